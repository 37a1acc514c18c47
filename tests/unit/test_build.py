"""What the model builder passes from a deck to the core: rotations, self-contact, friction."""

import numpy as np
import pytest
from helpers import GRAIN_RADIUS, box_mesh, disc_mesh, pair_deck, single_deck
from peridem.errors import InputError


def test_bodies_are_turned_about_their_axis(deck_folder):
    # a turn by 90 degrees about x takes y to z and z to -y
    deck = deck_folder.cubes()
    header = "i,x,y,z,r,o,ax,ay,az\n"
    rows = "0,0,0,0,1e-3,1.5707963267948966,2,0,0\n1,0,0,3e-3,1e-3,0.2,0,0,1\n"
    (deck_folder.folder / "places.csv").write_text(header + rows)
    model = deck_folder.model(deck)
    mesh = box_mesh((GRAIN_RADIUS,) * 3, (4,) * 3, jiggle=0.15, seed=1).points
    body = model.particles[0]
    expected = np.column_stack([mesh[:, 0], -mesh[:, 2], mesh[:, 1]])
    # positions of 1e-3 rounded a few times
    np.testing.assert_allclose(model.state.x_ref[: body.stop], expected, rtol=0, atol=1e-18)


def test_prescribed_rotation_turns_about_its_axis(deck_folder):
    # angle T0 t about the axis through c: after a quarter turn about y, z goes to x, x to -z
    name = deck_folder.mesh("cube", box_mesh((1e-3,) * 3, (4,) * 3))
    deck = single_deck(name, {"Type": "cube", "Parameters": [1e-3]}, Dimension=3, steps=10)
    rate = 0.5 * np.pi / (10 * 1.0e-7)
    deck["Displacement_BC"] = {
        "Sets": 1,
        "Set_1": {
            "Particle_List": [0],
            "Time_Function": {"Type": "rotation", "Parameters": [rate, 0, 0, 5e-4, 0, 3, 0]},
        },
    }
    model = deck_folder.model(deck)
    model.step(10)
    x, v = model.state.x_ref, model.state.v
    expected = np.column_stack([x[:, 2] - 5e-4, x[:, 1], 5e-4 - x[:, 0]])
    # t is the sum of ten steps: the angle is off by a few roundings
    np.testing.assert_allclose(model.state.x, expected, rtol=0, atol=1e-17)
    arm = expected - [0, 0, 5e-4]
    np.testing.assert_allclose(v, rate * np.cross([0, 1, 0], arm), rtol=0, atol=1e-10 * rate * 1e-3)


def test_self_contact_needs_no_second_body(deck_folder):
    # halves of a disc without bonds across, moved 0.4 h into each other
    name = deck_folder.mesh("disc", disc_mesh(GRAIN_RADIUS, 6))
    deck = single_deck(name, {"Type": "circle", "Parameters": [GRAIN_RADIUS]})
    contact = {"Kn": 1.0e20, "Friction_On": False, "Damping_On": False, "Self_Contact": True}
    deck["Contact"] = {"Zone_11": contact}
    model = deck_folder.model(deck)
    far = np.linalg.norm(model.state.x_ref - model.state.x_ref[0], axis=1) > 6.5e-4  # not bonded
    node = int(np.flatnonzero(far)[0])
    model.state.x[node] = model.state.x[0] + [0.5 * model.particles[0].mesh_size, 0, 0]
    forces = model._core.contact_forces()
    assert forces[node, 0] > 0
    assert forces[0, 0] < 0
    # f_i V_i = -f_j V_j for the pair; other nodes near the two take part as well
    momentum = (forces * model.state.volume[:, None]).sum(axis=0)
    largest = np.abs(forces * model.state.volume[:, None]).max()
    assert np.abs(momentum).max() < 1e-12 * largest


@pytest.mark.parametrize(("ratio", "factor"), [(None, 2 / 7), (0.5, 0.5)])
def test_friction_with_history_pulls_back_with_its_ratio(deck_folder, ratio, factor):
    # Two nodes r = 2/3 Rc apart; one slips by d. The spring pulls with factor Kn V d, below
    # Coulomb's cap, and the normal force Kn V (Rc - r) is tilted by d/r, where Rc - r = r/2.
    square = [(x, y, 0.0) for x in (0, 1e-3) for y in (0, 1e-3)]
    names = [deck_folder.nodes(f"body_{k}", square, [1e-6] * 4) for k in (1, 2)]
    shape = {"Type": "square", "Parameters": [1e-3]}
    deck = pair_deck(names, shape)
    contact = {"Kn": 1.0e12, "Contact_Radius": 3e-4, "Damping_On": False, "Friction_Coeff": 10.0}
    contact["Friction_Model"] = "history"
    if ratio is not None:
        contact["Tangential_Stiffness_Ratio"] = ratio
    deck["Contact"]["Zone_12"] = contact
    for zone in ("Zone_1", "Zone_2"):
        deck["Material"][zone] = {**deck["Material"][zone], "Horizon": 1.2e-3}
    deck_folder.places((0, 0, 0, 0, 1e-3, 0), (1, 1.2e-3, 0, 0, 1e-3, 0))
    model = deck_folder.model(deck)
    model.start()
    speed = 1e-3
    model.state.v[4:] = [0, speed, 0]
    model.step(1)
    node = 2  # at (1e-3, 0) of body 0, touched by node 4 at (1.2e-3, 0)
    expected = (factor - 0.5) * 1.0e12 * 1e-6 * speed * model.dt
    # the tilt d/r is 5e-7: terms of second order are below that
    assert model._core.contact_forces()[node, 1] == pytest.approx(expected, rel=1e-5)


@pytest.mark.parametrize(
    ("row", "what"),
    [
        (
            (0, 1e6, 0, 0, GRAIN_RADIUS, 0),
            "place = (1000000.0, 0.0, 0.0): must be within 1e+08 times",
        ),
        (
            (0, 0, 0, 0, 1e-24, 0),
            "size = 2e-24 m after scaling by 1e-21: must be between 1e-20 and",
        ),
        ((0, 0, 0, 0, 1e300, 0), "size = 2e+300 m after scaling by 1e+303: must be between"),
    ],
)
def test_bodies_whose_nodes_cannot_be_told_apart_are_refused(deck_folder, row, what):
    deck = deck_folder.grains()
    deck_folder.places(row, (1, 0, 1, 0, GRAIN_RADIUS, 0))
    with pytest.raises(InputError) as caught:
        deck_folder.model(deck)
    assert str(caught.value).startswith(f"{deck_folder.folder / 'places.csv'}:2: body 0")
    assert what in str(caught.value)


def test_created_mesh_that_does_not_fit_names_its_zone(deck_folder):
    deck = single_deck("", {"Type": "rectangle", "Parameters": [0, 0, 0, 1e-3, 1e-3, 0]})
    deck["Mesh"] = {"Zone_1": {"CreateMesh": {"Flag": True, "Info": "uniform"}, "Mesh_Size": 2e-3}}
    with pytest.raises(InputError, match=r"deck_1.yaml:\d+: Mesh.Zone_1: Mesh_Size = 0.002 is lon"):
        deck_folder.model(deck)


def test_broken_meshes_and_places_are_reported_together(deck_folder):
    deck = deck_folder.grains()
    for name in deck["Mesh"].values():
        (deck_folder.folder / name["File"]).write_text("$MeshFormat\n")
    deck_folder.places((0, 0, 0, 0, -1.0, 0), (5, 0, 1, 0, GRAIN_RADIUS, 0))
    with pytest.raises(InputError) as caught:
        deck_folder.model(deck)
    lines = str(caught.value).splitlines()
    assert len(lines) == 4
    assert "disc_6_1.msh" in lines[0]
    assert "disc_6_2.msh" in lines[1]
    assert "places.csv:2: r = -1.0: must be positive" in lines[2]
    assert "places.csv:3: i = 5: must be a zone" in lines[3]


def test_broken_mesh_of_two_zones_is_reported_once(deck_folder):
    deck = deck_folder.grains()
    deck["Mesh"]["Zone_2"] = deck["Mesh"]["Zone_1"]
    (deck_folder.folder / deck["Mesh"]["Zone_1"]["File"]).write_text("$MeshFormat\n")
    with pytest.raises(InputError) as caught:
        deck_folder.model(deck)
    assert len(str(caught.value).splitlines()) == 1


def test_horizon_loads_and_ids_are_reported_together(deck_folder):
    deck = deck_folder.grains()
    deck["Material"]["Zone_1"] = {**deck["Material"]["Zone_1"], "Horizon": 1e-5}
    held = {"Particle_List": [7], "Direction": [1], "Zero_Displacement": True}
    push = {"Type": "constant", "Parameters": [1.0]}
    deck["Displacement_BC"] = {"Sets": 1, "Set_1": held}
    pushed = {"Particle_List": [8], "Direction": [1], "Time_Function": push}
    deck["Force_BC"] = {"Sets": 1, "Set_1": pushed}
    deck["IC"] = {"Constant_Velocity": {"Velocity_Vector": [1, 0, 0], "Particle_List": [9]}}
    deck["Particle"]["Test_Name"] = "compressive_test"
    test = {"Particle_Id": 6, "Particle_Force_Direction": 2}
    deck["Particle"]["Compressive_Test"] = test
    with pytest.raises(InputError) as caught:
        deck_folder.model(deck)
    lines = str(caught.value).splitlines()
    wanted = ("Zone_1.Horizon = 1e-05: must exceed", "Particle_Id = 6", "no body 7", "no body 8")
    for line, part in zip(lines, (*wanted, "no body 9"), strict=True):
        assert part in line


@pytest.mark.parametrize(
    ("shape", "inside"),
    [
        ({"Type": "annulus_circle", "Parameters": [5.5e-4, 9e-4, 0, 0, 0]}, "r"),
        ({"Type": "annulus_rectangle", "Parameters": [1.1e-3, 1.1e-3, 2.2e-3, 2.2e-3]}, "box"),
    ],
)
def test_annulus_selects_the_nodes_of_a_set(deck_folder, shape, inside):
    name = deck_folder.mesh("disc", disc_mesh(GRAIN_RADIUS, 6))
    deck = single_deck(name, {"Type": "circle", "Parameters": [GRAIN_RADIUS]})
    held = {"Region": {"Geometry": shape}, "Direction": [1], "Zero_Displacement": True}
    deck["Displacement_BC"] = {"Sets": 1, "Set_1": held}
    deck["Container"] = {"Geometry": shape}
    model = deck_folder.model(deck)
    assert model.warnings == []  # the centre lies in the hole: a hollow container is its box
    x = model.state.x_ref
    r, half = np.linalg.norm(x, axis=1), np.abs(x).max(axis=1)
    expected = (r > 5.5e-4) & (r < 9e-4) if inside == "r" else half > 5.5e-4
    assert 0 < expected.sum() < len(x)
    np.testing.assert_array_equal(model.state.fixity != 0, expected)


@pytest.mark.parametrize("body", [-1, 2, 0.5])
def test_body_that_does_not_exist_is_named(deck_folder, body):
    model = deck_folder.model(deck_folder.grains())
    for ask in (model.particle, model.start_center, lambda k: model.contact_radius(0, k)):
        with pytest.raises(InputError, match=f"body = {body}: there is none; .* 0 to 1"):
            ask(body)
    assert model.particle(np.int64(1)).id == 1


@pytest.mark.parametrize("steps", [-1, 1.5, "2"])
def test_number_of_steps_must_be_whole(deck_folder, steps):
    model = deck_folder.model(deck_folder.grains())
    with pytest.raises(InputError, match=f"n = {steps!r}: must be a whole number, at least 0"):
        model.step(steps)
    with pytest.raises(InputError, match=f"steps = {steps!r}: must be a whole number"):
        model.run(steps=steps)
