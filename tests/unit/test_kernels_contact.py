"""Contact forces: the core against the reference, its search against brute force."""

# ruff: noqa: N806 - symbols of the paper

import itertools

import numpy as np
import pytest
from helpers import displace, random_displacement, relative_error
from reference import ReferenceModel

BOTH_MODES = pytest.mark.parametrize("mode", ["corrected", "original"])
BOTH_DIMENSIONS = pytest.mark.parametrize("dimension", [2, 3], ids=["2D", "3D"])
PAIRS = ("Zone_11", "Zone_12", "Zone_22")
FRICTION = {"Friction_On": True, "Friction_Coeff": 0.3}
DAMPING = {"Damping_On": True, "Epsilon": 0.8, "Beta_n_Factor": 10.0}
LAWS = {
    "normal": {},
    "friction": FRICTION,
    "damping": DAMPING,
    "damping-by-nodes": {**DAMPING, "Center_Damping_Criterion": "nodes"},
    "node-damping": {**DAMPING, "Node_Damping": True},
    "all": {**FRICTION, **DAMPING, "Node_Damping": True, "Center_Damping_Criterion": "nodes"},
}


def overlapping(deck_folder, dimension, contact, *, walls=(), **options):
    """Two bodies that overlap by about a contact radius, moving at random."""
    if dimension == 2:
        deck = deck_folder.grains(offset=(1e-4, 1.88e-3), walls=walls)
    else:
        deck = deck_folder.cubes(offset=(1e-4, 0.5e-4, 1.03e-3))
    deck["Contact"]["Zone_12"].update(contact)
    deck["Material"]["Zone_2"]["Density"] = 2000.0
    deck["Material"]["Zone_2"]["K"] = 3.0e7
    model = deck_folder.model(deck, allow_overlap=True, **options)
    rng = np.random.default_rng(3)
    displace(model, random_displacement(model, rng, 0.05, turn=0.1))
    model.state.v[:, :dimension] = rng.uniform(-1, 1, (model.n_nodes, dimension))
    # the centres approach each other, as dashpots act then only
    model.state.v[model.particles[0].start : model.particles[0].stop, dimension - 1] += 2
    return model


def contact_forces(model):
    model.state.f[:] = 0
    model._core.compute_contact_forces()
    return model.state.f


def reference_forces(model, reference):
    reference.copy_state(model)
    reference.state.f[:] = 0
    reference.add_contact_forces()
    return reference.state.f


@BOTH_MODES
@BOTH_DIMENSIONS
@pytest.mark.parametrize("law", LAWS)
def test_contact_forces_match_the_reference(deck_folder, law, dimension, mode):
    model = overlapping(deck_folder, dimension, LAWS[law], compatibility=mode)
    reference = ReferenceModel(model)
    expected = reference_forces(model, reference)
    touched = [len(found.i) for _, _, found in reference.pairs()]
    assert min(touched) >= 10
    # d - Rc loses a digit or two of 16
    assert relative_error(contact_forces(model), expected) < 1e-12


@BOTH_MODES
@pytest.mark.parametrize("law", LAWS)
def test_contact_with_a_wall_matches_the_reference(deck_folder, law, mode):
    model = overlapping(deck_folder, 2, LAWS[law], walls=(2,), compatibility=mode)
    expected = reference_forces(model, ReferenceModel(model))
    assert relative_error(contact_forces(model), expected) < 1e-12
    wall = model.particles[1]
    assert wall.constrained
    assert (expected[wall.start :] != 0).any()


@BOTH_MODES
@pytest.mark.parametrize("free", ["all", "y"])
def test_contact_on_walls_that_may_move_matches_the_reference(deck_folder, free, mode):
    # In original mode such walls get no contact force, as in the program.
    deck = deck_folder.grains(offset=(1e-4, 1.95e-3))
    deck["Zone"]["Zone_2"]["Is_Wall"] = True
    for pair in PAIRS:
        deck["Contact"][pair].update({**FRICTION, **DAMPING})
    if free == "y":
        fixed = {"Particle_List": [1], "Direction": [1], "Zero_Displacement": True}
        deck["Displacement_BC"] = {"Sets": 1, "Set_1": fixed}
    model = deck_folder.model(deck, compatibility=mode, allow_overlap=True)
    model.state.v[:] = [0.1, 1.0, 0.0]
    model.state.v[model.particles[1].start :] = 0
    expected = reference_forces(model, ReferenceModel(model))
    assert relative_error(contact_forces(model), expected) < 1e-12
    assert (expected[model.particles[1].start :] != 0).any() == (mode == "corrected")


@BOTH_DIMENSIONS
def test_center_damping_is_felt_before_contact(deck_folder, dimension):
    # Between Rc and 1.01 Rc nothing touches, yet centres closer than R + R + 1.01 Rc are damped.
    make = deck_folder.grains if dimension == 2 else deck_folder.cubes
    deck = make()
    deck["Contact"]["Zone_12"].update(DAMPING)
    model = deck_folder.model(deck)
    reference = ReferenceModel(model)
    p, q = reference.bodies
    law = reference.contact_laws[0, 1]
    axis = np.array([1.0, 0, 0]) if dimension == 2 else np.array([0.6, 0, 0.8])
    state = model.state
    for reach, acts in ((1.005, True), (1.02, False)):
        distance = p.radius + q.radius + reach * law.Rc
        state.x[q.nodes] += state.x[p.center] + distance * axis - state.x[q.center]
        state.v[p.nodes] = axis
        expected = reference_forces(model, reference)
        assert not any(len(found.i) for _, _, found in reference.pairs())
        assert (expected != 0).any() == acts
        assert relative_error(contact_forces(model), expected) < 1e-12


@BOTH_DIMENSIONS
@BOTH_MODES
def test_damped_volume_is_the_body_s_own_and_in_the_original_a_disc(deck_folder, dimension, mode):
    # f on p is beta c n / vol with meq = rho vol for equal bodies, vol the area of the mesh (a disc
    # of six rings: the polygon of 36 corners) or the volume of the cube; pi R^2 in the original.
    make = deck_folder.grains if dimension == 2 else deck_folder.cubes
    deck = make()
    deck["Contact"]["Zone_12"].update(DAMPING)
    model = deck_folder.model(deck, compatibility=mode)
    p, q = model.particles
    radius = p.bounding_radius
    assert radius == pytest.approx(1e-3 if dimension == 2 else np.sqrt(3) / 2 * 1e-3, rel=1e-14)
    polygon = 18 * np.sin(np.pi / 18) * radius**2
    own = polygon if dimension == 2 else 1e-9
    volume = np.pi * radius**2 if mode == "original" else own
    law = model._core.contact_law(0, 1)
    gap = (2 * radius + 1.005 * law["radius"]) * np.array([1.0, 0, 0])
    model.state.x[q.start :] += p.center + gap - q.center
    model.state.v[: p.stop] = [0.3, 0, 0]
    # epsilon = 0.8, C = 10: -20 ln 0.8 / sqrt(pi^2 + ln^2 0.8) = 1.41701
    beta = 1.4170060 * np.sqrt(2.16e7 * law["radius"] * 1200 * volume)
    f = contact_forces(model)
    np.testing.assert_allclose(f[: p.stop, 0], -beta * 0.3 / volume, rtol=1e-7)
    np.testing.assert_allclose(f[q.start :, 0], beta * 0.3 / volume, rtol=1e-7)


@BOTH_MODES
def test_contact_constants(deck_folder, mode):
    deck = deck_folder.grains()
    deck["Contact"]["Zone_12"] = {**FRICTION, **DAMPING, "Kn_Factor": 0.5}
    deck["Contact"]["Zone_22"].update({"Contact_Radius": 1.1e-4, "Kn": 3e23, "Kn_Factor": 2.0})
    del deck["Contact"]["Zone_22"]["Contact_Radius_Factor"]
    deck["Material"]["Zone_2"].update({"K": 4.32e7, "Horizon": 7e-4})
    deck_folder.places((0, 0, 0, 0, 1e-3, 0), (1, 3e-3, 0, 0, 1e-3, 0), (1, 6e-3, 0, 0, 0.9e-3, 0))
    model = deck_folder.model(deck, compatibility=mode)
    h = [body.mesh_size for body in model.particles]
    mixed, same = model._core.contact_law(1, 0), model._core.contact_law(1, 2)
    # Left out: Rc = 0.95 h (35), Kn = 18 kappa / (pi eps^5) (36), with the larger horizon of two
    # and kappa = 2 K K' / (K + K') (25) = 2.88e7
    assert mixed["radius"] == pytest.approx(0.95 * min(h), rel=1e-4)
    assert mixed["kappa"] == pytest.approx(2.88e7, rel=1e-14)
    assert mixed["kn"] == pytest.approx(0.5 * 18 * 2.88e7 / (np.pi * 7e-4**5), rel=1e-13)
    assert mixed["friction"] == (0.3 if mode == "original" else -0.3)
    # -2 C ln(eps) / sqrt(pi^2 + ln^2 eps) with C = 10, eps = 0.8: 20 * 0.2231436 / 3.1495075
    assert mixed["damping_factor"] == pytest.approx(1.4170060, rel=1e-7)
    assert same["radius"] == 1.1e-4
    assert same["kn"] == 6e23
    assert same["kappa"] == 4.32e7
    assert same["friction"] == same["damping_factor"] == 0


@pytest.mark.parametrize(("mode", "sign"), [("corrected", 1), ("original", -1)])
def test_pair_of_nodes_in_contact_follows_the_closed_form(deck_folder, mode, sign):
    # Two bodies of two nodes, Rc = 1.2e-4; node 1 of p and node 0 of q are d = 1e-4 apart along x.
    h, V, Kn, d = 1e-3, 1e-6, 1e20, 1e-4
    name = deck_folder.nodes("two", [(0.0, 0.0, 0.0), (h, 0.0, 0.0)], [V, V])
    deck = deck_folder.grains()
    deck["Mesh"] = {"Zone_1": {"File": name}, "Zone_2": {"File": name}}
    deck_folder.places((0, 0, 0, 0, h, 0), (1, h + d, 0, 0, h, 0))
    law = {"Contact_Radius": 1.2e-4, "Kn": Kn, **FRICTION, "Damping_On": False}
    deck["Contact"] = dict.fromkeys(PAIRS, law)
    for zone in ("Zone_1", "Zone_2"):
        deck["Material"][zone]["Horizon"] = 2 * h
    model = deck_folder.model(deck, compatibility=mode)
    model.state.v[2] = [-0.7, 0.4, 0]  # q comes nearer and slides along +y
    F = Kn * 0.2e-4 * V
    # (17): pushed apart by F. Friction 0.3 F drags node 1 along +y with q, and q back; reversed
    # in the original.
    expected = np.zeros((4, 3))
    expected[1] = [-F, sign * 0.3 * F, 0]
    expected[2] = [F, -sign * 0.3 * F, 0]
    np.testing.assert_allclose(contact_forces(model), expected, rtol=1e-10, atol=1e-10 * F)
    # Without slip there is no friction.
    model.state.v[:] = [0.2, 0.5, 0]
    expected[:, 1] = 0
    np.testing.assert_allclose(contact_forces(model), expected, rtol=1e-10, atol=1e-10 * F)


def three_grains(deck_folder, dimension, contact):
    """Three bodies of two zones."""
    make = deck_folder.grains if dimension == 2 else deck_folder.cubes
    deck = make(rings=4) if dimension == 2 else make()
    for pair in PAIRS:
        deck["Contact"][pair].update(contact)
    r = 1e-3
    deck_folder.places((0, 0, 0, 0, r, 0.3), (1, 6e-3, 0, 0, 1.2 * r, 0.2), (1, 0, 9e-3, 0, r, 0.0))
    return deck_folder.model(deck)


def move_bodies(model, shifts):
    for body, shift in zip(model.particles, shifts, strict=True):
        model.state.x[body.start : body.stop] += shift


@BOTH_DIMENSIONS
def test_search_misses_no_pair_when_bodies_jump(deck_folder, dimension):
    model = three_grains(deck_folder, dimension, {**FRICTION, **DAMPING})
    reference = ReferenceModel(model)
    rng = np.random.default_rng(5)
    start, n_touching = model.state.x_ref.copy(), 0
    for _ in range(40):
        # bodies thrown anywhere into a box of about two diameters: apart, touching, overlapping
        model.state.x[:] = start
        shifts = np.zeros((3, 3))
        shifts[:, :dimension] = rng.uniform(-1.8e-3, 1.8e-3, (3, dimension))
        centres = np.array([body.center for body in model.particles])
        move_bodies(model, shifts - centres)
        model.state.v[:, :dimension] = rng.uniform(-1, 1, (model.n_nodes, dimension))
        expected = reference_forces(model, reference)
        n_touching += sum(len(found.i) > 0 for _, _, found in reference.pairs())
        assert relative_error(contact_forces(model), expected) < 1e-12
    assert n_touching > 20


@BOTH_DIMENSIONS
def test_search_misses_no_pair_in_slow_motion_and_keeps_its_lists(deck_folder, dimension):
    # Approach, pass through and leave at a hundredth of a contact radius a step.
    model = three_grains(deck_folder, dimension, {**FRICTION, **DAMPING})
    reference = ReferenceModel(model)
    rc = model._core.contact_law(0, 1)["radius"]
    p, q, _ = model.particles
    shift = np.zeros((3, 3))
    shift[1] = p.center - q.center
    shift[1, 0] += 2.6e-3
    move_bodies(model, shift)
    model.state.v[q.start : q.stop, 0] = -1
    shift[1] = [-0.01 * rc, 0, 0]
    before, hits = model._core.contact_rebuilds(), 0
    steps = 150
    for step, _ in enumerate(itertools.repeat(None, steps)):
        move_bodies(model, shift * (5 if step > steps // 2 else 1))
        expected = reference_forces(model, reference)
        hits += bool((expected != 0).any())
        assert relative_error(contact_forces(model), expected) < 1e-12
    assert hits > 30
    # The lists hold for half a skin, some 25 steps at first and 5 later.
    assert 2 <= model._core.contact_rebuilds() - before <= steps // 4


def test_search_sees_a_single_node_that_moves(deck_folder):
    # All of a body at rest but one node, drawn out towards the other body.
    deck = deck_folder.grains(offset=(0.0, 2.6e-3))
    model = deck_folder.model(deck)
    reference = ReferenceModel(model)
    top = int(np.argmax(model.state.x[: model.particles[0].stop, 1]))
    hits = 0
    for _ in range(60):
        model.state.x[top, 1] += 1e-5
        expected = reference_forces(model, reference)
        hits += bool((expected != 0).any())
        assert relative_error(contact_forces(model), expected) < 1e-12
    assert 5 < hits < 55


def test_spring_of_friction_stretches_with_the_slip_up_to_coulomb_s_limit(deck_folder):
    # Two bodies of two nodes, led: node 0 of q passes node 1 of p at v along y, d away along x.
    # Spring: kt V xi with kt = 2.5 Kn, at most mu F, which it reaches at xi = 2.4e-6.
    h, V, Kn, Rc, d, v, dt = 1e-3, 1e-6, 1e20, 1.2e-4, 1e-4, 0.4, 1e-6
    name = deck_folder.nodes("two", [(0.0, 0.0, 0.0), (h, 0.0, 0.0)], [V, V])
    deck = deck_folder.grains(dt=dt)
    deck["Mesh"] = {"Zone_1": {"File": name}, "Zone_2": {"File": name}}
    deck_folder.places((0, 0, 0, 0, h, 0), (1, h + d, 0, 0, h, 0))
    spring = {"Friction_Model": "history", "Tangential_Stiffness_Ratio": 2.5}
    law = {"Contact_Radius": Rc, "Kn": Kn, **FRICTION, "Damping_On": False, **spring}
    deck["Contact"] = dict.fromkeys(PAIRS, law)
    motion = {"Type": "linear", "Parameters": [v]}
    deck["Displacement_BC"] = {
        "Sets": 3,
        "Set_1": {"Particle_List": [0], "Direction": [1, 2], "Zero_Displacement": True},
        "Set_2": {"Particle_List": [1], "Direction": [1], "Zero_Displacement": True},
        "Set_3": {"Particle_List": [1], "Direction": [2], "Time_Function": motion},
    }
    for zone in ("Zone_1", "Zone_2"):
        deck["Material"][zone]["Horizon"] = 2 * h
    model = deck_folder.model(deck)

    def forces(n):
        """Normal force, limit of friction and friction on node 1 after n steps."""
        model.step(n - model.n)
        f, distance = model.state.f, np.hypot(d, n * v * dt)
        e_n = np.array([d, n * v * dt]) / distance
        e_t = np.array([-e_n[1], e_n[0]])
        np.testing.assert_allclose(f[1], -f[2], rtol=1e-12)
        normal = Kn * V * (Rc - distance)
        assert -f[1, :2] @ e_n == pytest.approx(normal, rel=1e-12)
        return f[1, :2] @ e_t, 0.3 * normal

    for n in (1, 4):  # e_n turns by up to 0.016, whose square is taken off the slip
        friction, limit = forces(n)
        assert friction == pytest.approx(2.5 * Kn * V * n * v * dt, rel=3e-4)
        assert friction < limit
    friction, limit = forces(9)
    assert friction == pytest.approx(limit, rel=1e-12)


@BOTH_DIMENSIONS
def test_self_contact_acts_between_nodes_never_bonded(deck_folder, dimension):
    # A body folded onto itself: nodes farther apart than the horizon are pushed together.
    make = deck_folder.grains if dimension == 2 else deck_folder.cubes
    deck = make(offset=(0, 9e-3) if dimension == 2 else (0, 0, 9e-3))
    for pair in PAIRS:
        deck["Contact"][pair].update({**FRICTION, **DAMPING})
    deck["Contact"]["Zone_11"]["Self_Contact"] = True
    model = deck_folder.model(deck)
    reference, rng = ReferenceModel(model), np.random.default_rng(4)
    x = model.state.x_ref.copy()
    x[:, 0] = np.abs(x[:, 0] + 1e-4 * rng.uniform(-1, 1, len(x)))
    model.state.x[:] = x
    model.state.v[:, :dimension] = rng.uniform(-1, 1, (len(x), dimension))
    expected = reference_forces(model, reference)
    first = model.particles[0].stop
    assert (expected[:first] != 0).any(axis=1).sum() > 20
    assert (expected[first:] == 0).all()
    assert relative_error(contact_forces(model), expected) < 1e-12
    balance = (expected * model.state.volume[:, None]).sum(axis=0)
    assert np.abs(balance).max() < 1e-12 * np.abs(expected * model.state.volume[:, None]).sum()
