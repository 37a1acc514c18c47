"""Models made in Python: what the deck that says the same gives, there and back, and resumed."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import peridem as pd
import pytest
from helpers import DeckFolder, box_mesh
from modelling_parts import ARRAYS, SIZE, Block, Disc, glass, mesh_of, same, two_discs
from peridem.geometry import make_shape
from peridem.mesh import Mesh, read_mesh

DATA = Path(__file__).parents[1] / "decks" / "data" / "original"
STEPS = 300


class MeshedCircle:
    """The circle of the original's two_circles deck, with its mesh."""

    dimension = 2
    deck_keys = {"Type": "circle", "Parameters": [0.001, 0.0, 0.0, 0.0]}  # noqa: RUF012
    geometry = make_shape("circle", [0.001, 0.0, 0.0, 0.0])

    def mesh(self, mesh_size: float) -> Mesh:
        return read_mesh(DATA / "circle.msh", 2)


def two_circles(names: tuple[str, str] = ("glass", "glass"), **options: Any) -> pd.DEMModel:
    """two_circles.yaml in Python; materials of two names make two zones, as in the deck."""
    lower, upper = (glass(name=name) for name in names)
    model = pd.DEMModel(2, gravity=(0, -10), scheme="central_difference", threads=1, **options)
    circle = MeshedCircle()
    model.add_particle(circle, material=lower, mesh_size=2e-4, angle=0.3)
    model.add_particle(
        circle,
        material=upper,
        mesh_size=2e-4,
        at=(0.00015, 0.002134383),
        angle=1.1,
        velocity=(0.2, -1.0),
    )
    model.set_contact(
        friction=0.2, damping_ratio=0.95, damping_factor=10, stiffness=1.5915494309189538e24
    )
    return model


def run_deck_of_two_circles() -> pd.DEMModel:
    """Run two_circles.yaml to its end."""
    deck = pd.DEMModel.from_deck(DATA / "two_circles.yaml", threads=1)
    deck.run()
    assert deck.n == 2000
    assert np.abs(deck.state.v[:123]).max() > 0.1  # they have met: the first was at rest
    return deck


def test_two_circles_in_python_give_the_bits_of_their_deck() -> None:
    deck = run_deck_of_two_circles()
    # dt divides the duration of the deck, 9.999999999999999e-05 s, into its 2000 steps
    model = two_circles(("lower", "upper"), dt=5e-8)
    model.run(until=9.999999999999999e-05)
    assert model.n == 2000
    for name in (*ARRAYS, "volume", "density", "fixity", "particle_id", "zone_id"):
        a, b = getattr(model.state, name), getattr(deck.state, name)
        assert a.tobytes() == b.tobytes(), name
    same(model, deck)


def test_two_circles_of_one_material_agree_to_round_off() -> None:
    deck = run_deck_of_two_circles()
    model = two_circles(dt=5e-8)
    model.run(until=9.999999999999999e-05)
    # The deck has a zone for each circle, the model one for both. Bodies of one zone share the
    # lengths of their bonds, so round-off differs: by 5e-12 after 2000 steps, 20 times below this.
    for name in ARRAYS:
        a, b = getattr(model.state, name), getattr(deck.state, name)
        np.testing.assert_allclose(a, b, rtol=0, atol=1e-10 * np.abs(b).max(), err_msg=name)
    assert np.array_equal(model.bonds.intact, deck.bonds.intact)
    other = two_circles()
    other.run(until=9.999999999999999e-05, steps=2000)
    same(other, model)


def rich_model(**options: Any) -> pd.DEMModel:
    """One of nearly everything that a deck can say, in 2D."""
    model = pd.DEMModel(gravity=(1, -10), dt=1e-7, threads=1, **options)
    stone, soft = glass(name="stone"), glass(horizon_mesh_ratio=3.2, horizon=None, density=2000)
    elastic = pd.PDElasticBond(density=1000, young_modulus=1e7, horizon=6e-4, influence="constant")
    grains = model.add_particles(
        shape=Disc(),
        at=[(0, 0), (2.2e-3, 0.1e-3), (0.5e-3, 2.2e-3)],
        scale=[1, 1.1, 0.97],
        angle=[0.1, 0.2, 0.3],
        velocity=[(0, 0), (-3, 0), (0, -3)],
        spin=[0, 50, -20],
        material=stone,
        mesh_size=SIZE,
        name="grain",
    )
    odd = model.add_particle(
        Disc(known=False), at=(3e-3, 2.4e-3), velocity=(-2, -2), material=soft, mesh_size=SIZE
    )
    block = model.add_particle(
        mesh=mesh_of(box_mesh((2e-3, 1e-3), (10, 5), jiggle=0.1)), at=(-2.2e-3, 0), material=elastic
    )
    floor = model.add_wall(
        Block((9e-3, 0.6e-3)), at=(0, -1.4e-3), material=glass(), mesh_size=2e-4, name="floor"
    )
    lid = model.add_wall(
        Block((9e-3, 0.6e-3)), at=(0, 4.2e-3), material=stone, mesh_size=2e-4, velocity=(0, -4)
    )
    model.set_contact(friction=0.1)
    model.set_contact(stone, floor, friction=0.3, damping_ratio=0.8)
    model.set_contact(odd, [grains[0], lid], friction=0.2, friction_model="history")
    model.prescribe(
        block, displacement=("sin", 1e-5, 1e4), directions="x", region=((-4e-3, -1), (-2.5e-3, 1))
    )
    model.apply_force(grains[1], density=("linear", 1e9), directions="y", space=("hat_x", 2.0))
    model.apply_force(density=(1e4, 0), region={"Type": "circle", "Parameters": [1e-3]})
    return model


@pytest.mark.filterwarnings("ignore:.*start in contact:peridem.PeridemWarning")  # on purpose
def test_a_deck_written_by_a_model_gives_its_bits(tmp_path: Path) -> None:
    model = rich_model()
    model.run(until=STEPS * 1e-7, record=["contacts"])
    assert model.summary()["broken_bonds"] > 0 or model.touching_nodes().size  # things happened
    deck = pd.DEMModel.from_deck(model.to_deck(tmp_path / "deck"), threads=1)
    deck.run()
    same(deck, model)
    assert [body.zone for body in deck.particles] == [body.zone for body in model.particles]


def test_a_solid_model_and_its_deck_are_the_same(tmp_path: Path) -> None:
    model = pd.DEMModel(3, threads=1, scheme="central_difference", dt=1e-7)
    cube = Block((1e-3, 1e-3, 1e-3))
    material = pd.PMBBond(density=1200, young_modulus=4e7, fracture_energy=50, horizon=6e-4)
    model.add_particle(cube, material=material, mesh_size=2.5e-4, fixed=True)
    model.add_particle(
        cube,
        material=material,
        mesh_size=2.5e-4,
        at=(0, 1e-4, 1.3e-3),
        axis=(1, 1, 0.5),
        angle=0.1,
        velocity=(0, 0, -20),
        spin=(10, 20, 30),
    )
    model.set_contact(damping_ratio=0.9)
    model.run(steps=200)
    deck = pd.DEMModel.from_deck(model.to_deck(tmp_path), threads=1)
    deck.run(steps=200)
    assert deck.dt == model.dt
    same(deck, model)


# Python functions against the built-in ones. Both multiply the same doubles in the same order.

RATE, PERIOD = 0.37, 9000.0

MOTIONS = {
    "constant": ({"displacement": 1e-6}, {"displacement": lambda t: 1e-6, "velocity": lambda t: 0}),
    "linear": (
        {"velocity": (RATE, None)},
        {"displacement": lambda t: RATE * t, "velocity": lambda t: RATE},
    ),
    "quadratic": (
        {"displacement": ("quadratic", RATE, 3.0)},
        {
            "displacement": lambda t: RATE * t + 3.0 * t * t,
            "velocity": lambda t: RATE + 2 * 3.0 * t,
        },
    ),
    "sin": (
        {"displacement": ("sin", 1e-6, PERIOD)},
        {
            "displacement": lambda t: 1e-6 * math.sin(math.pi * PERIOD * t),
            "velocity": lambda t: 1e-6 * math.pi * PERIOD * math.cos(math.pi * PERIOD * t),
        },
    ),
}


@pytest.mark.parametrize("kind", MOTIONS)
@pytest.mark.parametrize("scheme", ["velocity_verlet", "central_difference"])
def test_functions_of_python_move_nodes_as_the_built_in_ones(kind: str, scheme: str) -> None:
    models = []
    for motion in MOTIONS[kind]:
        model = two_discs(scheme=scheme)
        model.prescribe("lower", directions="x", **motion)
        model.step(STEPS)
        models.append(model)
    same(*models)


def spread(shape: str) -> Any:
    """Return 1e6 t in every form that a function may give it: 127 nodes, 2 directions."""
    sizes = {"number": (), "directions": (2,), "nodes": (127,), "both": (127, 2)}
    return lambda t: np.full(sizes[shape], 1e9 * t)


@pytest.mark.parametrize("shape", ["number", "directions", "nodes", "both"])
def test_functions_of_python_push_nodes_as_the_built_in_ones(shape: str) -> None:
    built_in, function = two_discs(), two_discs()
    built_in.apply_force("upper", density=("linear", 1e9))
    function.apply_force("upper", density=spread(shape))
    built_in.step(STEPS)
    function.step(STEPS)
    same(built_in, function)


def test_a_function_is_called_once_per_step() -> None:
    times: list[float] = []

    def push(t: float) -> float:
        times.append(t)
        return 0.0

    model = two_discs()
    model.apply_force("upper", density=push)
    model.prescribe("lower", displacement=0)
    model.step(50)
    assert len(times) == 51  # with the one at the start
    assert times[0] == 0
    assert times[-1] == model.time


def test_velocity_alone_adds_up_to_a_displacement() -> None:
    model = two_discs()
    model.prescribe("lower", velocity=lambda t: (2.0, 0.0))
    model.step(100)
    lower = model.nodes_of("lower")
    # a hundred additions of dt v
    np.testing.assert_allclose(model.state.u[lower, 0], 2.0 * model.time, rtol=1e-13)
    assert np.all(model.state.v[lower, 0] == 2.0)


def test_displacement_alone_gives_the_velocity_of_the_last_step() -> None:
    model = two_discs()
    model.prescribe("lower", displacement=lambda t: (3.0 * t, 0.0))
    model.step(100)
    # Round-off of a difference of displacements of 3e-5 m over a step of 3e-7 m: 1e-16 * 100.
    np.testing.assert_allclose(model.state.v[model.nodes_of("lower"), 0], 3.0, rtol=1e-12)


def test_an_error_in_a_function_stops_the_run_as_it_is(tmp_path: Path) -> None:
    class OwnError(Exception):
        pass

    error = OwnError("enough")

    def push(t: float) -> float:
        if t > 25.5e-7:
            raise error
        return 0.0

    model = two_discs()
    model.apply_force("upper", density=push)
    with pytest.raises(OwnError) as caught:
        model.run(output=tmp_path, until=1e-5, every=5)
    assert caught.value is error
    plain = two_discs()
    plain.apply_force("upper", density=0.0, directions="x")
    plain.step(25)
    assert model.n == 25  # the whole steps before
    np.testing.assert_array_equal(model.state.x, plain.state.x)
    np.testing.assert_array_equal(model.state.v, plain.state.v)


# Checkpoints.


def pushed() -> pd.DEMModel:
    """A model that no deck can say."""
    model = two_discs()
    model.apply_force("upper", density=lambda t: (1e7 * math.sin(1e5 * t), 0.0))
    return model


@pytest.mark.parametrize("make", [two_discs, pushed])
def test_a_script_run_again_goes_on_bit_for_bit(make: Any, tmp_path: Path) -> None:
    whole = make()
    whole.run(until=3e-5, record=["momentum"], record_every=10)
    expected = whole.run(until=3e-5, record=["momentum"], record_every=10)
    first = make()
    arguments = {
        "until": 3e-5,
        "output": tmp_path,
        "every": 50,
        "checkpoint_every": 40,
        "record": ["momentum"],
        "record_every": 10,
        "resume": True,
    }

    def stop(model: pd.DEMModel) -> None:
        if model.n == 130:
            raise RuntimeError("a power cut")

    with pytest.raises(RuntimeError, match="a power cut"):
        first.run(callback=stop, callback_every=10, **arguments)
    again = make()
    result = again.run(**arguments)
    same(again, whole)
    assert len(result.momentum) == 31  # 0, 10, ..., 300: none lost, none twice
    assert len(expected.momentum) == 1  # a run that is at its end records where it is
    assert sorted(path.name for path in tmp_path.glob("output_*.vtu")) == sorted(
        f"output_{k}.vtu" for k in range(7)
    )


def test_the_command_line_goes_on_with_a_model_made_in_python(tmp_path: Path) -> None:
    whole = two_discs()
    whole.run(until=3e-5)
    model = two_discs()
    model.to_deck(tmp_path / "aside", until=3e-5)
    model.run(output=tmp_path, steps=110)
    resumed = pd.DEMModel.resume(tmp_path, threads=1)
    resumed.run(output=tmp_path)
    same(resumed, whole)
    # and back: the script goes on with what the command line has left
    further = two_discs()
    further.run(output=tmp_path, until=3.5e-5, resume=True)
    longer = two_discs()
    longer.run(until=3.5e-5)
    same(further, longer)


def test_a_model_that_no_deck_can_say_goes_on_by_its_script_only(tmp_path: Path) -> None:
    model = pushed()
    model.run(output=tmp_path, until=3e-6, checkpoint_every=10)
    with pytest.raises(
        pd.InputError, match=r"run the script again with model\.run\(\.\.\., resume"
    ):
        pd.DEMModel.resume(tmp_path)
    with pytest.raises(pd.InputError, match="apply_force: a Python function as density"):
        model.to_deck(tmp_path / "deck")
    other = two_discs(velocity=(0, -4))
    with pytest.raises(pd.InputError, match="other bodies, materials, contact or loads"):
        other.run(output=tmp_path, until=3e-6, resume=True)


def test_bodies_placed_by_deck_and_model_have_the_same_spin(deck_folder: DeckFolder) -> None:
    deck = deck_folder.grains()
    deck["IC"] = {
        "Sets": 1,
        "Constant_Velocity": {"Velocity_Vector": [1, 2], "Particle_List": [0]},
        "Set_1": {"Velocity_Vector": [0, -3], "Particle_List": [1], "Spin": [0, 0, 40]},
    }
    model = deck_folder.model(deck)
    model.start()
    s, nodes = model.state, model.nodes_of(1)
    assert np.all(s.v[model.nodes_of(0)] == (1, 2, 0))
    m = s.volume[nodes]
    center = m @ s.x_ref[nodes] / m.sum()
    expected = np.array([0, -3, 0]) + np.cross([0, 0, 40], s.x_ref[nodes] - center)
    np.testing.assert_allclose(s.v[nodes], expected, rtol=0, atol=1e-13)
