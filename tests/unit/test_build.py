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
