"""Models in Python: zones formed, contact between whom, handles, many bodies, loads on whom."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas
import peridem as pd
import pytest
from modelling_parts import SIZE, Block, Disc, glass, same, two_discs
from numpy.typing import NDArray

SOFT = glass(bulk_modulus=2e6, shear_modulus=1e6)


@dataclass
class CountingDisc:
    """A disc that counts how often it is meshed."""

    meshed: list[float] = field(default_factory=list)

    dimension = 2
    geometry = Disc().geometry
    deck_keys = Disc().deck_keys

    def __hash__(self) -> int:
        return 1

    def mesh(self, mesh_size: float) -> Any:
        self.meshed.append(mesh_size)
        return Disc().mesh(mesh_size)


def test_bodies_alike_are_one_zone_and_meshes_are_made_once() -> None:
    disc = CountingDisc()
    model = pd.DEMModel(threads=1)
    at = iter(range(20))

    def add(**changes: Any) -> pd.Body:
        arguments = {"material": glass(), "mesh_size": SIZE, "at": (3e-3 * next(at), 0), **changes}
        return model.add_particle(disc, **arguments)

    one, soft, two, fine, held = (
        add(),
        add(material=SOFT),
        add(),
        add(mesh_size=1e-3 / 8),
        add(fixed=True),
    )
    wall = model.add_wall(disc, material=glass(), mesh_size=SIZE, at=(3e-3 * next(at), 0))
    model.init()
    # zones in the order of their first bodies, bodies zone by zone
    assert [body.id for body in (one, two, soft, fine, held, wall)] == [0, 1, 2, 3, 4, 5]
    assert [body.zone for body in model.particles] == [0, 0, 1, 2, 3, 4]
    assert sorted(disc.meshed) == sorted([SIZE, 1e-3 / 8])
    assert [body.constrained for body in model.particles] == [False] * 4 + [True, True]
    assert [body.type for body in model.particles] == ["particle"] * 5 + ["wall"]
    for body in (one, soft, two, fine, held, wall):
        x = model.state.x_ref[body.nodes]
        assert np.allclose(x[0], body.at)  # node 0 of the mesh is its centre
        assert set(model.state.particle_id[body.nodes]) == {body.id}


def contact_of(model: pd.DEMModel, a: pd.Body, b: pd.Body) -> dict[str, float]:
    return dict(model._core.contact_law(a.id, b.id))


def test_contact_defaults_are_those_of_the_paper() -> None:
    model = two_discs()
    plain = pd.DEMModel(threads=1)
    for k in range(2):
        plain.add_particle(Disc(), material=glass(), mesh_size=SIZE, at=(3e-3 * k, 0))
    plain.init()
    law = dict(plain._core.contact_law(0, 1))
    h = plain.particles[0].mesh_size
    assert law["radius"] == pytest.approx(0.95 * h, rel=1e-14)
    assert law["kn"] == pytest.approx(18 * 2.16e7 / (np.pi * 6e-4**5), rel=1e-14)  # eq. 36
    assert law["friction"] == 0
    assert law["damping_factor"] == 0
    model.init()
    law = dict(model._core.contact_law(0, 1))
    log = np.log(0.9)
    assert law["friction"] == -0.2  # the sign opposes the slip
    assert law["damping_factor"] == pytest.approx(-2 * log / np.hypot(np.pi, log), rel=1e-12)


def test_contact_of_pairs_overrides_that_of_one_side_and_of_all() -> None:
    model = pd.DEMModel(threads=1)
    hard, soft = glass(), SOFT
    a, b, c = (
        model.add_particle(Disc(), material=hard, mesh_size=SIZE, at=(3e-3 * k, 0))
        for k in range(3)
    )
    d = model.add_particle(Disc(), material=soft, mesh_size=SIZE, at=(0, 3e-3), name="soft")
    model.set_contact(a, [b, "soft"], friction=0.5, stiffness=1e20)  # before: still more specific
    model.set_contact(friction=0.1, radius_factor=0.9)
    model.set_contact(soft, friction=0.2, radius=1e-4)
    model.set_contact(soft, hard, friction=0.3)
    model.set_contact(b, c, friction=0.4)
    model.init()
    h = min(body.mesh_size for body in model.particles)

    def law(one: pd.Body, other: pd.Body) -> tuple[float, float]:
        found = contact_of(model, one, other)
        assert contact_of(model, other, one) == found
        return -found["friction"], found["radius"]

    assert law(a, c) == (0.1, pytest.approx(0.9 * h))
    assert law(a, b) == (0.5, pytest.approx(0.9 * h))
    assert law(b, c) == (0.4, pytest.approx(0.9 * h))
    # of two rules that name both sides the later holds; what it leaves open the others give
    assert law(a, d) == (0.3, pytest.approx(1e-4))
    assert law(c, d) == (0.3, pytest.approx(1e-4))
    assert contact_of(model, a, d)["kn"] == 1e20
    assert contact_of(model, a, b)["kn"] == 1e20
    assert contact_of(model, c, d)["kn"] > 1e20


def test_self_contact_is_of_a_body_with_itself() -> None:
    model = two_discs()
    model.set_contact(self_contact=True)
    model.init()
    assert [contact.self_contact for contact in model.deck.contacts.values()] == [True]
    model = two_discs()
    model.set_contact("lower", "upper", friction=0.3)  # two zones then
    model.set_contact(self_contact=True)
    model.init()
    flags = {pair: contact.self_contact for pair, contact in model.deck.contacts.items()}
    assert flags == {(0, 0): True, (0, 1): False, (1, 1): True}


@dataclass(frozen=True)
class SmallPacking:
    """What a packing has of interest to a model."""

    shapes: tuple[Any, ...]
    shape_index: NDArray[np.intp]
    positions: NDArray[np.float64]
    scales: NDArray[np.float64]
    angles: NDArray[np.float64]
    axes: NDArray[np.float64]


AT = np.array([[0, 0, 0], [3e-3, 0, 0], [0, 3e-3, 0], [3e-3, 3e-3, 0]])
SCALES, ANGLES = np.array([1.0, 1.2, 0.9, 1.1]), np.array([0.0, 0.1, 0.2, 0.3])


def one_by_one() -> pd.DEMModel:
    model = pd.DEMModel(threads=1, dt=1e-7)
    shapes = Disc(), Block((1.5e-3, 1.5e-3)), Disc(), Disc()
    for k, shape in enumerate(shapes):
        model.add_particle(
            shape,
            material=glass(),
            mesh_size=SIZE,
            at=AT[k, :2],
            scale=SCALES[k],
            angle=ANGLES[k],
            velocity=(k, -k),
            spin=10.0 * k,
        )
    return model


def test_packings_tables_and_arrays_add_the_same_bodies() -> None:
    shapes = [Disc(), Block((1.5e-3, 1.5e-3))]
    which = np.array([0, 1, 0, 0])
    rest: dict[str, Any] = {"material": glass(), "mesh_size": SIZE}
    moving: dict[str, Any] = {"velocity": [(k, -k) for k in range(4)], "spin": [0, 10, 20, 30]}
    z = np.broadcast_to([0.0, 0.0, 1.0], (4, 3))
    packing = SmallPacking(tuple(shapes), which, AT, SCALES, ANGLES, z)
    table = pandas.DataFrame(
        {
            "shape": which, "x": AT[:, 0], "y": AT[:, 1], "scale": SCALES, "angle": ANGLES,
            "vx": [0, 1, 2, 3], "vy": [0, -1, -2, -3], "spin": [0, 10, 20, 30],
        }
    )  # fmt: skip
    expected = one_by_one()
    expected.step(20)
    calls: list[tuple[Any, dict[str, Any]]] = [
        (packing, moving),
        (table, {"shape": shapes}),
        (
            None,
            {
                "shape": [shapes[k] for k in which],
                "at": AT,
                "scale": SCALES,
                "angle": ANGLES,
                **moving,
            },
        ),
    ]
    for source, arguments in calls:
        model = pd.DEMModel(threads=1, dt=1e-7)
        grains = model.add_particles(source, **rest, **arguments)
        assert [body.name for body in grains] == [f"{grains.name}-{k}" for k in range(1, 5)]
        model.step(20)
        assert grains.ids == [0, 3, 1, 2]  # the block is a zone of its own, after the discs
        same(model, expected)


def test_a_table_gives_radii_and_axes() -> None:
    table = pandas.DataFrame({"x": [0, 4e-3], "y": [0, 0], "radius": [1e-3, 1.5e-3]})
    model = pd.DEMModel()
    bodies = model.add_particles(table, shape=Disc(), material=glass(), mesh_size=SIZE)
    assert [body.scale for body in bodies] == pytest.approx([1, 1.5], rel=1e-15)
    turned = pandas.DataFrame(
        {"x": [0.0], "y": [0.0], "z": [1.0], "angle": [0.5], "ax": [1.0], "ay": [2.0], "az": [0.0]}
    )
    solid = pd.DEMModel(3)
    (body,) = solid.add_particles(
        turned, shape=Block((1e-3,) * 3), material=glass(), mesh_size=2.5e-4
    )
    assert (body.at, body.angle, body.axis) == ((0, 0, 1), 0.5, (1, 2, 0))


def test_groups_can_be_sliced_selected_and_named() -> None:
    model = pd.DEMModel(threads=1)
    grains = model.add_particles(shape=Disc(), at=AT, material=glass(), mesh_size=SIZE, name="g")
    assert len(grains) == 4
    assert [body.name for body in grains[1:3]] == ["g-2", "g-3"]
    right = grains.select(AT[:, 0] > 1e-3)
    assert [body.name for body in right] == ["g-2", "g-4"]
    assert model.body("g") is grains
    assert model.body("g-4") is grains[3]
    with pytest.raises(pd.InputError, match=r"mask of shape \(3,\): must have one flag for each"):
        grains.select([True, False, True])
    model.set_contact(right, friction=0.3)
    model.init()
    assert model.ids_of("g") == [0, 2, 1, 3]  # those on the right are a zone of their own
    assert model.ids_of([right, 0]) == [2, 3, 0]
    assert repr(grains) == "<4 bodies 'g'>"
    assert repr(grains[1]) == "<particle 'g-2': disc of PDState at (0.003, 0, 0)>"


def test_loads_act_on_the_nodes_that_are_named() -> None:
    def fixity(**arguments: Any) -> NDArray[np.bool_]:
        model = two_discs()
        model.prescribe(**arguments)
        model.init()
        return np.asarray(model.state.fixity > 0)

    model = two_discs()
    model.init()
    x, lower = model.state.x_ref, np.arange(254) < 127
    assert np.array_equal(fixity(displacement=0), np.ones(254, bool))
    assert np.array_equal(fixity(bodies="lower", displacement=0), lower)
    assert np.array_equal(fixity(bodies=glass(), displacement=0), np.ones(254, bool))
    left = x[:, 0] < -2e-4
    corners = ((-1, -1), (-2e-4, 1))
    assert np.array_equal(fixity(region=corners, displacement=0), left)
    assert np.array_equal(fixity(bodies="upper", region=corners, displacement=0), left & ~lower)
    by_function = fixity(bodies="upper", region=lambda x: x[:, 0] < -2e-4, displacement=0)
    assert np.array_equal(by_function, left & ~lower)
    disc = x[:, 0] ** 2 + x[:, 1] ** 2 <= 1e-6 * (1 + 1e-9)
    assert np.array_equal(fixity(region=Disc(), displacement=0), disc)
    assert np.array_equal(fixity(region=Disc(known=False), displacement=0), disc)
    chosen = fixity(bodies="upper", nodes=[0, 5], displacement=0)
    assert np.flatnonzero(chosen).tolist() == [127, 132]


def test_components_prescribe_their_directions_only() -> None:
    model = two_discs()
    model.prescribe("lower", velocity=(0.5, None))
    model.prescribe("upper", displacement=(1e-6, 2e-6))
    model.step(10)
    s = model.state
    lower, upper = s.fixity[:127], s.fixity[127:]
    assert set(lower) == {1}
    assert set(upper) == {3}
    np.testing.assert_array_equal(s.u[:127, 0], 0.5 * model.time)
    np.testing.assert_array_equal(s.u[127:, :2], np.broadcast_to([1e-6, 2e-6], (127, 2)))


def test_a_rotation_turns_a_body_about_a_point() -> None:
    model = pd.DEMModel(threads=1, dt=1e-6)
    model.add_particle(Disc(), material=glass(), mesh_size=SIZE)
    model.prescribe(rotation=np.pi / 2 / 1e-4, about=(1e-3, 0))
    model.step(100)  # a quarter turn
    x = model.state.x_ref - (1e-3, 0, 0)
    turned = np.column_stack([1e-3 - x[:, 1], x[:, 0], x[:, 2]])
    np.testing.assert_allclose(model.state.x, turned, rtol=0, atol=1e-15)


def test_driven_walls_move_and_fixed_ones_do_not() -> None:
    model = two_discs()
    block = Block((4e-3, 4e-4))
    fixed = model.add_wall(block, material=glass(), mesh_size=2e-4, at=(0, -1.3e-3))
    driven = model.add_wall(block, material=glass(), mesh_size=2e-4, at=(0, 4e-3), velocity=(0, -2))
    model.step(50)
    assert np.all(model.state.u[fixed.nodes] == 0)
    np.testing.assert_allclose(model.state.u[driven.nodes, 1], -2 * model.time, rtol=1e-13)
    assert np.all(model.state.u[driven.nodes, 0] == 0)


def test_a_velocity_and_a_spin_keep_the_momentum_of_the_velocity() -> None:
    model = pd.DEMModel(threads=1, dt=1e-7)
    model.add_particle(Disc(), material=glass(), mesh_size=SIZE, velocity=(3, 1), spin=200.0)
    model.start()
    s = model.state
    mass = s.density * s.volume
    assert mass @ s.v == pytest.approx(mass.sum() * np.array([3, 1, 0]), abs=1e-15)
    center = mass @ s.x / mass.sum()
    spin = (mass @ np.cross(s.x - center, s.v))[2]
    inertia = mass @ ((s.x - center) ** 2).sum(axis=1)
    assert spin == pytest.approx(200 * inertia, rel=1e-12)


def test_the_time_step_is_the_one_given_or_part_of_the_stable_one() -> None:
    model = two_discs(dt=3e-7)
    model.run(until=9e-6)
    assert (model.n, model.dt) == (30, 3e-7)
    assert model.summary()["dt_from"] == "given"
    model = two_discs(dt=3e-7)
    model.run(until=1e-6)  # four steps: the largest that fit
    assert (model.n, model.dt) == (4, 1e-6 / 4)
    model = two_discs(dt=None, safety=0.25)
    model.run(until=2e-5)
    limits = model.stable_time_step()
    stable = min(limits.bonds, limits.contact, limits.self_contact)
    assert model.n == np.ceil(2e-5 / (0.25 * stable))
    assert model.dt == 2e-5 / model.n
    assert model.summary()["dt_from"].startswith("0.25 of the estimated stable one")
    even = two_discs(dt=None)
    even.run(until=2e-5, every=5e-6)  # whole steps between outputs
    assert even.n % 4 == 0
    assert even.dt == 2e-5 / even.n <= 0.5 * stable
    assert even.output_interval == even.n // 4
    model.run(until=2.1e-5)
    assert model.time == pytest.approx(2.1e-5, abs=model.dt)
    before = model.n
    model.run(steps=3)
    assert model.n == before + 3
