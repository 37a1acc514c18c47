"""Arguments of the modelling functions that break a rule: what is said about them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas
import peridem as pd
import pytest
from modelling_parts import SIZE, Block, Disc, glass

DISC = Disc()
GLASS: dict[str, Any] = {"material": glass(), "mesh_size": SIZE}
TWO = [(0.0, 0.0), (3e-3, 0.0)]


def model() -> pd.DEMModel:
    """A model with the particle "one"."""
    made = pd.DEMModel(threads=1)
    made.add_particle(DISC, **GLASS, name="one")
    return made


def table(**columns: Any) -> pandas.DataFrame:
    return pandas.DataFrame({name: [value] for name, value in columns.items()})


def refusal(call: Callable[[], object]) -> str:
    with pytest.raises(pd.InputError) as caught:
        call()
    return str(caught.value)


def without(name: str) -> dict[str, Any]:
    return {key: value for key, value in GLASS.items() if key != name}


MODEL = [
    ({"dimension": 4}, "dimension = 4: must be 2 or 3"),
    ({"gravity": (1, 2, 3, 4)}, "gravity = [1, 2, 3, 4]: must be (x, y) or (x, y, z)"),
    ({"gravity": (0, 0, -10)}, "gravity: z must be 0 in 2D"),
    ({"gravty": 1}, "gravty: unknown argument; did you mean gravity?"),
    ({"dt": 0}, "dt = 0: must be positive; give a number in s"),
    ({"dt": "x"}, "dt = 'x': must be a finite number"),
    ({"safety": 2}, "safety = 2: must be at most 1"),
    ({"scheme": "verlet"}, "did you mean velocity_verlet?"),
    ({"compatibility": "orig"}, "did you mean original?"),
    ({"threads": 0}, "threads = 0: must be at least 1"),
    ({"threads": True}, "threads = True: must be at least 1"),
]


@pytest.mark.parametrize(("arguments", "text"), MODEL)
def test_model_refuses(arguments: dict[str, Any], text: str) -> None:
    assert text in refusal(lambda: pd.DEMModel(**arguments))


PARTICLE: list[tuple[Any, dict[str, Any], str]] = [
    (None, GLASS, "shape: missing; give a shape such as Circle"),
    (
        DISC,
        without("material"),
        "add_particle: material: missing; give material=..., the law that the body is made of",
    ),
    (DISC, without("mesh_size"), "mesh_size: missing; give the edge length of the mesh in m"),
    (DISC, {**GLASS, "material": "g"}, "material = g: must be a material; give PDState(...)"),
    (DISC, {**GLASS, "mesh_size": -1}, "mesh_size = -1: must be positive; give a number in m"),
    (DISC, {**GLASS, "at": (1,)}, "at = [1]: must be (x, y) or (x, y, z); give numbers in m"),
    (DISC, {**GLASS, "at": (1, np.nan)}, "at: must be finite numbers in m"),
    (DISC, {**GLASS, "at": (1, 0, 2)}, "at: z must be 0 in 2D"),
    (Disc, GLASS, "must be a shape; give for instance Circle(radius=1e-3)"),
    (1, GLASS, "shape = 1: must be a shape"),
    (Block((1, 1, 1)), GLASS, "has dimension 3, the model 2; use a shape of the model's dimension"),
    (None, {"material": glass(), "mesh": 3}, "mesh = 3: must be a peridem.mesh.Mesh"),
    (DISC, {**GLASS, "mesh": DISC.mesh(SIZE)}, "is given besides mesh; keep one of them"),
    (DISC, {**GLASS, "fixed": 1}, "fixed = 1: must be True or False"),
    (DISC, {**GLASS, "fixed": True, "velocity": (1, 1)}, "given to a body that is fixed"),
    (DISC, {**GLASS, "velocity": ("a", 2)}, "velocity = ['a', 2]: must be (x, y) or (x, y, z)"),
    (DISC, {**GLASS, "scale": 0}, "scale = 0: must be positive"),
    (DISC, {**GLASS, "angle": "a"}, "angle = 'a': must be a finite number; give a number in rad"),
    (DISC, {**GLASS, "spin": (1, 0, 0)}, "spin = [1, 0, 0]: must be about z in 2D"),
    (DISC, {**GLASS, "axis": (1, 0, 0)}, "axis = [1, 0, 0]: must be z in 2D"),
    (DISC, {**GLASS, "name": ""}, "name = '': must be text"),
    (DISC, {**GLASS, "name": "one"}, "name = 'one': is taken already"),
    (DISC, {**GLASS, "mesh_sise": 1}, "mesh_sise: unknown argument; did you mean mesh_size?"),
]


@pytest.mark.parametrize(("shape", "arguments", "text"), PARTICLE)
def test_add_particle_refuses(shape: Any, arguments: dict[str, Any], text: str) -> None:
    made = model()
    assert text in refusal(lambda: made.add_particle(shape, **arguments))
    made.add_particle(DISC, **GLASS, at=(3e-3, 0))  # what was refused has left nothing behind
    made.init()
    assert len(made.particles) == 2


def test_add_particle_refuses_an_axis_without_direction() -> None:
    made = pd.DEMModel(3)
    text = refusal(lambda: made.add_particle(Block((1, 1, 1)), **GLASS, axis=(0, 0, 0)))
    assert "axis = [0, 0, 0]: has no direction" in text


PARTICLES: list[tuple[Any, dict[str, Any], str]] = [
    (None, {}, "shape: missing; give a shape"),
    (None, {"shape": DISC}, "at: missing; give the places as an array of shape (n, 2)"),
    (None, {"shape": DISC, "at": TWO, "scale": [1]}, "scale = [1]: must be a number, or 2 of them"),
    (None, {"shape": DISC, "at": TWO, "angle": "a"}, "angle = a: must be a number, or 2 of them"),
    (None, {"shape": [DISC] * 3, "at": TWO}, "3 shapes for 2 places: must be one, or one for each"),
    (None, {"shape": DISC, "at": []}, "at: has no places; give at least one"),
    (None, {"shape": DISC, "at": TWO, "velocity": TWO + TWO}, "4 vectors for 2 places"),
    (3, {}, "source = 3: must be a packing or a DataFrame"),
    (table(x=1, yy=1), {"shape": DISC}, "column 'yy': is unknown; did you mean y?"),
    (table(x=1), {"shape": DISC}, "column 'y': missing; the table needs x and y in m"),
    (table(x=1, y="a"), {"shape": DISC}, "column 'y': must hold numbers only"),
    (table(x=1, y=1), {"shape": DISC, "at": TWO}, "at: is given besides the table"),
    (table(x=1, y=1, shape=3), {"shape": [DISC]}, "column 'shape': 3: must be from 0 to 0"),
    (table(x=1, y=1, shape=0), {"shape": DISC}, "must be a sequence of shapes"),
    (table(x=1, y=1, radius=3), {"shape": DISC, "scale": 1}, "is given besides the column"),
    (table(x=1, y=1, radius=3), {"shape": 3}, "shape = 3: must be a shape"),
    (table(x=1, y=1, angle=3), {"shape": DISC, "angle": 1}, "is given besides the column"),
    (table(x=1, y=1, radius=3, scale=1), {"shape": DISC}, "'radius': is given besides 'scale'"),
    (table(x=1, y=1, wz=3, spin=1), {"shape": DISC}, "'wz': is given besides 'spin'"),
    (table(x=1, y=1, wx=3), {"shape": DISC}, "spin = [3.0, 0.0, 0.0]: must be about z in 2D"),
    (table(x=1, y=1, ax=1), {"shape": DISC}, "axis = [1.0, 0.0, 0.0]: must be z in 2D"),
    (
        None,
        {"shape": DISC, "at": TWO, "axis": TWO},
        "axis = [[0.0, 0.0], [0.003, 0.0]]: must be (x, y, z); give numbers",
    ),
    (None, {"shape": DISC, "at": TWO, "spin": [1, 2, 3]}, "must be a number, or 2 of them"),
]


@pytest.mark.parametrize(("source", "arguments", "text"), PARTICLES)
def test_add_particles_refuses(source: Any, arguments: dict[str, Any], text: str) -> None:
    assert text in refusal(lambda: model().add_particles(source, **GLASS, **arguments))


def test_add_wall_refuses_a_velocity_when_fixed() -> None:
    text = refusal(lambda: model().add_wall(DISC, **GLASS, velocity=(0, 1), fixed=True))
    assert "velocity = [0, 1]: is given to a wall with fixed = True" in text


CONTACT: list[tuple[tuple[Any, ...], dict[str, Any], str]] = [
    ((), {}, "nothing is given; give at least one of friction, damping_ratio"),
    ((), {"friction": -1}, "friction = -1: must be at least 0; give the friction coefficient"),
    ((), {"frction": 0.1}, "frction: unknown argument; did you mean friction?"),
    ((), {"mu": 0.1}, "mu: unknown argument; did you mean friction?"),
    ((), {"restitution": 0.1}, "unknown argument; did you mean damping_ratio?"),
    ((), {"damping_ratio": 1.2}, "damping_ratio = 1.2: must be at most 1"),
    ((), {"damping_ratio": 0}, "damping_ratio = 0: must be positive"),
    ((), {"radius": 1, "radius_factor": 1}, "radius = 1: is given besides radius_factor"),
    ((), {"stiffness": -1}, "stiffness = -1: must be at least 0"),
    ((), {"friction": 0.1, "friction_model": "histry"}, "did you mean history?"),
    ((), {"damping_criterion": "node"}, "did you mean nodes?"),
    ((), {"self_contact": "yes"}, "self_contact = yes: must be true or false"),
    (("two",), {"friction": 0.1}, "a = 'two': there is no body of this name; known are one"),
    (("one", 3), {"friction": 0.1}, "b = 3: must be bodies, by handle, name or material"),
    (([],), {"friction": 0.1}, "a = []: must be bodies"),
    ((model().body("one"),), {"friction": 0.1}, "is a body of another model; use its own"),
]


@pytest.mark.parametrize(("sides", "arguments", "text"), CONTACT)
def test_set_contact_refuses(sides: tuple[Any, ...], arguments: dict[str, Any], text: str) -> None:
    assert text in refusal(lambda: model().set_contact(*sides, **arguments))


def rest(t: float) -> float:
    return 0.0


MOTION: list[tuple[dict[str, Any], str]] = [
    ({}, "nothing is given; give displacement, velocity or rotation"),
    ({"displacement": 1, "velocity": 1}, "velocity = 1: is given besides displacement"),
    ({"displacement": "lin"}, "displacement = 'lin': must be one of constant, linear"),
    ({"displacement": "lin"}, "did you mean linear?"),
    ({"displacement": ("linear",)}, "linear needs 1 parameter, has 0"),
    ({"displacement": ("linear", "a")}, "displacement: parameter 1 = 'a': must be a finite number"),
    (
        {"displacement": ("linear", 1, 2)},
        "linear has 1 parameter, 2 are given; leave the",
    ),
    ({"displacement": 0, "space": ("hat_x", 1, 2)}, "space = ['hat_x', 1, 2]: hat_x has 1 parame"),
    ({"velocity": (1, 0, 2)}, "velocity = [1, 0, 2]: z must be 0 in 2D; leave it out"),
    ({"displacement": ("rotation", 1)}, "must be one of constant, linear, quadratic, sin"),
    ({"displacement": (1,)}, "displacement = [1]: must have 2 components; None leaves"),
    ({"displacement": (None, None)}, "names no direction"),
    ({"displacement": np.nan}, "displacement = nan: must be a finite number"),
    ({"displacement": rest, "velocity": 3}, "velocity = 3: must be a function of time"),
    ({"rotation": 1, "displacement": 0}, "rotation = 1: is given besides displacement"),
    ({"rotation": "x"}, "rotation = 'x': must be a finite number; give a number in rad/s"),
    ({"displacement": 0, "about": (0, 0)}, "about = [0, 0]: belongs to a rotation"),
    ({"displacement": 0, "directions": "xw"}, "directions = xw: must name each direction once"),
    ({"displacement": 0, "directions": "z"}, "directions = z: must name each direction once"),
    ({"displacement": 0, "directions": [1, 1]}, "must name each direction once"),
    ({"displacement": 0, "space": "hat"}, "space = 'hat': must be one of constant, hat_x"),
    ({"displacement": 0, "space": "hat_x"}, "hat_x needs 1 parameter, has 0"),
    ({"displacement": 0, "region": 3}, "region = 3: must be two corners, a shape"),
    ({"displacement": 0, "region": ((1, 1), (0, 0))}, "first corner has x = 1 above the second's"),
    ({"displacement": 0, "region": {"Type": "circel"}}, "did you mean circle?"),
    ({"displacement": 0, "region": {"Type": "circle"}}, "Parameters: missing; give the lengths"),
    ({"displacement": 0, "nodes": [-1]}, "nodes = [-1]: must be numbers of nodes in the body"),
    ({"displacement": 0, "nodes": [1], "region": np.isnan}, "nodes: are given besides a region"),
    ({"displacment": 0}, "displacment: unknown argument; did you mean displacement?"),
    ({"displacement": 0, "bodies": "tow"}, "bodies = 'tow': there is no body of this name"),
]


@pytest.mark.parametrize(("arguments", "text"), MOTION)
def test_prescribe_refuses(arguments: dict[str, Any], text: str) -> None:
    assert text in refusal(lambda: model().prescribe(**{"bodies": "one", **arguments}))


FORCE: list[tuple[dict[str, Any], str]] = [
    ({}, "apply_force: density: missing"),
    ({"density": ("quadratic", 1, 1)}, "density = 'quadratic': must be one of constant, linear"),
    ({"density": ("sin", 1)}, "sin needs 2 parameters, has 1"),
    ({"density": ("linear_step", 1, -1, 0)}, "needs times T1, T2 >= 0 with T1 + T2 > 0"),
    ({"density": (1, 2, 3, 4)}, "must have 2 components"),
    ({"density": 1, "name": "push", "space": ("sin_x",)}, "apply_force 'push': space"),
]


@pytest.mark.parametrize(("arguments", "text"), FORCE)
def test_apply_force_refuses(arguments: dict[str, Any], text: str) -> None:
    assert text in refusal(lambda: model().apply_force("one", **arguments))


FUNCTIONS: list[tuple[dict[str, Any], str]] = [
    (
        {"density": lambda t: np.ones(5)},
        "gives an array of shape (5,) at t = 0 s: must be a number",
    ),
    ({"density": lambda t: np.nan}, "gives a number that is not finite at t = 0 s"),
    ({"density": lambda t: "a"}, "density: the function gives 'a'"),
    ({"density": lambda t: [1, 2], "nodes": [3, 4]}, "shape (2,)"),  # of nodes, or directions?
    ({"density": 1, "nodes": [200]}, "nodes: 200: no such node; the body has nodes 0 to 126"),
    (
        {"density": 1, "region": lambda x: x},
        "region: the function gives an array of shape (127, 3)",
    ),
]


@pytest.mark.parametrize(("arguments", "text"), FUNCTIONS)
def test_functions_that_give_nonsense_are_refused(arguments: dict[str, Any], text: str) -> None:
    made = model()
    made.apply_force("one", **arguments)
    assert text in refusal(lambda: made.run(steps=1))


RUN: list[tuple[dict[str, Any], str]] = [
    ({}, "run: until: missing; give the time to stop at in s, or steps"),
    ({"until": -1}, "until = -1: must be positive; give a number in s"),
    ({"steps": -1}, "steps = -1: must be a whole number, at least 0"),
    ({"steps": 1.5}, "steps = 1.5: must be a whole number"),
    ({"steps": 3, "every": 0}, "every = 0: must be at least 1 step"),
    ({"steps": 3, "every": 1e-30}, "every = 1e-30: is shorter than the time step"),
    ({"steps": 3, "every": "a"}, "every = 'a': must be a finite number"),
    ({"steps": 3, "callback_every": 0}, "callback_every = 0: must be at least 1 step"),
    ({"steps": 3, "record_every": 0}, "record_every = 0: must be at least 1 step"),
    ({"steps": 3, "tags": ["Displacment"]}, "did you mean Displacement?"),
    ({"steps": 3, "checkpoint_every": 2}, "checkpoint_every = 2: checkpoints need a folder"),
    ({"steps": 3, "resume": True}, "resume = True: needs the folder of the checkpoints"),
    ({"steps": 3, "output": 3}, "output = 3: must be a path; give its name in quotes"),
    ({"steps": 3, "record_to": 3}, "record_to = 3: must be a path"),
    ({"steps": 3, "callback": 3}, "callback = 3: must be a function of the model"),
    ({"steps": 3, "progress": "bar"}, "progress = 'bar': must be True, False or a"),
    ({"stpes": 3}, "run: stpes: unknown argument; did you mean steps?"),
    ({"steps": 3, "record": ["momentm"]}, "no such recorder; did you mean momentum?"),
    ({"steps": 3, "record": 3}, "record = 3: must be a list of recorders"),
    ({"steps": 3, "record": [3]}, "record = 3: must be the name of a recorder or a function"),
    ({"steps": 3, "record": ["damage"] * 2}, "record = 'damage': is given twice"),
    ({"steps": 3, "record": ["damage"], "record_to": "a.xls"}, "must end in .csv or .parquet"),
    ({"steps": 3, "record": [lambda m: "a"]}, "recorder_1: gives a: must be a number"),
    ({"steps": 3, "record": [lambda m: np.zeros((2, 2))]}, "must be a number, a sequence"),
    ({"steps": 3, "record": [pd.recorders.reaction("on")]}, "did you mean one?"),
    ({"steps": 3, "record": [pd.recorders.reaction(7)]}, "body = 7: there is none"),
]


@pytest.mark.parametrize(("arguments", "text"), RUN)
def test_run_refuses(arguments: dict[str, Any], text: str) -> None:
    assert text in refusal(lambda: model().run(**arguments))


def test_models_that_are_built_or_of_a_deck_take_nothing_more() -> None:
    made = model()
    made.init()
    for call in (
        lambda: made.add_particle(DISC, **GLASS),
        lambda: made.add_particles(shape=DISC, at=TWO, **GLASS),
        lambda: made.add_wall(DISC, **GLASS),
        lambda: made.set_contact(friction=0.1),
        lambda: made.prescribe("one", displacement=0),
        lambda: made.apply_force("one", density=0),
    ):
        assert "the model is built already (by init, step or run)" in refusal(call)


def test_what_is_known_only_after_building_says_so() -> None:
    made = model()
    body = made.body("one")
    assert isinstance(body, pd.Body)
    assert "id: is known once the model is built; call model.init()" in refusal(lambda: body.id)
    assert "to_deck: until: missing" in refusal(lambda: made.to_deck("deck"))
    assert "has no bodies; add one" in refusal(lambda: pd.DEMModel().init())
    assert "did you mean one?" in refusal(lambda: made.body("onee"))


def test_messages_of_the_build_are_in_terms_of_the_model() -> None:
    small = pd.DEMModel()
    small.add_particle(DISC, material=glass(horizon=1e-5, name="g"), mesh_size=SIZE, name="one")
    text = refusal(small.init)
    assert text.startswith("material 'g' of 'one': horizon = 1e-05: must exceed the mesh size")
    near = pd.DEMModel()
    near.add_particles(shape=DISC, at=[(0, 0), (1e-3, 0)], **GLASS, name="near")
    text = refusal(near.init)
    assert text.startswith("body 'near-1' at (0, 0) and body 'near-2' at (0.001, 0) overlap at the")
    assert "allow_overlap=True" in text
    assert "--" not in text
    fast = pd.DEMModel(dt=1e-5, strict=True)
    fast.add_particle(DISC, **GLASS)
    assert "dt = 1e-05 s: is above the estimated stable one" in refusal(fast.init)
    idle = model()
    idle.prescribe("one", displacement=0, region=((9, 9), (10, 10)), name="far")
    idle.init()
    assert any(text.startswith("prescribe 'far': no node lies in") for text in idle.warnings)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: pd.Surface.from_stl(3), "Surface.from_stl: path = 3"),
        (lambda: pd.MeshFile(path=3), "MeshFile: path = 3"),
        (lambda: pd.packing.grid(DISC, cells=(2, 2)).to_csv(3), "to_csv: path = 3"),
        (lambda: pd.study(rest, folder=3, t=[1]), "study: folder = 3"),
        (lambda: pd.DEMModel.from_deck(None), "from_deck: path = None"),
        (lambda: pd.DEMModel.resume(3), "resume: folder = 3"),
        (lambda: model().to_deck(3, steps=1), "to_deck: folder = 3"),
    ],
)
def test_what_is_no_path_is_refused(call: Any, text: str) -> None:
    assert f"{text}: must be a path; give its name in quotes" in refusal(call)


def test_what_is_found_late_is_said_once_and_in_the_words_of_the_model(tmp_path: Path) -> None:
    near = pd.DEMModel()
    near.add_particles(shape=DISC, at=[(0, 0), (1e-3, 0)], **GLASS)
    with pytest.raises(pd.InputError) as caught:
        near.init()
    assert caught.value.__suppress_context__ and caught.value.__cause__ is None
    held = pd.DEMModel()
    held.add_particle(DISC, **GLASS, fixed=True)
    assert "because no body can move: all are walls or fixed" in refusal(lambda: held.run(until=1))
    assert "material: missing (of 'top'); give" in refusal(
        lambda: pd.DEMModel().add_particle(DISC, mesh_size=SIZE, name="top")  # type: ignore[call-arg]
    )
    text = refusal(lambda: pd.MeshFile(path="none.msh"))
    assert text.startswith("MeshFile: path = 'none.msh': does not exist (it would be /")
    model().run(steps=10, output=tmp_path, checkpoint_every=5)
    other = pd.DEMModel(threads=1)
    other.add_particle(DISC, material=glass(density=1000), mesh_size=SIZE)
    text = refusal(lambda: other.run(steps=20, output=tmp_path, resume=True))
    assert (
        "is of a model with other mesh sizes, materials, contact or dt; make the model as" in text
    )
    same_step = pd.DEMModel(threads=1)
    same_step.add_particle(DISC, **GLASS, velocity=(1, 0))
    text = refusal(lambda: same_step.run(steps=20, output=tmp_path, resume=True))
    assert "contact or loads than this one; make the model as it was, or give another" in text
