"""Momentum of an isolated pair of grains that collide and break."""

import numpy as np
import pytest
from helpers import GRAIN_RADIUS, box_mesh
from reference import ReferenceModel

FRICTION = {"Friction_On": True, "Friction_Coeff": 0.4}
HISTORY = {**FRICTION, "Friction_Model": "history"}
NODE_DAMPING = {
    "Damping_On": True,
    "Epsilon": 0.8,
    "Node_Damping": True,
    # so weak that the dashpots between centres do nothing
    "Beta_n_Factor": 1e-300,
}
MODES = pytest.mark.parametrize("mode", ["corrected", "original"])
DIMENSIONS = pytest.mark.parametrize("dimension", [2, 3], ids=["2D", "3D"])


def colliding(deck_folder, dimension, contact, changes=None, *, places=None, **options):
    """Two grains that meet off centre, turning, in 2D or 3D; no gravity."""
    if dimension == 2:
        deck = deck_folder.grains(offset=(6e-4, 2.08e-3))
        velocity = [3.0, -25.0, 0.0]
    else:
        deck = deck_folder.cubes(offset=(4e-4, 3e-4, 1.2e-3))
        velocity = [2.0, 1.0, -30.0]
    if places:
        deck_folder.places(*places)
    deck["IC"] = {"Constant_Velocity": {"Velocity_Vector": velocity, "Particle_List": [1]}}
    # Kn as stiff against the cubes' nodes as eq. 36 is against those of the discs
    stiffness = {"Kn": 1e27} if dimension == 3 else {}
    for law in deck["Contact"].values():
        law.update({**stiffness, **contact})
    return deck_folder.model(deck, changes, **options)


def momenta(model):
    """Linear and angular momentum, and the sizes |m v| and |x| |m v| they are measured by."""
    s = model.state
    p = (s.density * s.volume)[:, None] * s.v
    return p.sum(axis=0), np.cross(s.x, p).sum(axis=0), np.abs(p).sum()


def run_and_compare(model, steps):
    """Change of both momenta over a run, relative to their size; the run must be eventful."""
    model.start()
    p0, l0, size = momenta(model)
    before = model.state.v.copy()
    model.step(steps)
    p1, l1, _ = momenta(model)
    first = slice(0, model.particles[0].stop)
    assert np.abs(model.state.v[first] - before[first]).max() > 1
    assert not model.bonds.intact.all()
    return np.abs(p1 - p0).max() / size, np.abs(l1 - l0).max() / (size * 1e-3)


# Every force has its exact opposite but for the rounding of sums: a few 1e-16 a step.
LIMIT = 1e-12


@MODES
@DIMENSIONS
@pytest.mark.parametrize("scheme", ["central_difference", "velocity_verlet"])
def test_linear_and_angular_momentum_without_friction(deck_folder, dimension, mode, scheme):
    # Bonds, self-contact and normal contact are central, and both integrators add dt x (f V) of
    # one instant: nothing is lost even with large steps.
    change = {"Model.Discretization_Type.Time": scheme}
    model = colliding(deck_folder, dimension, {}, change, compatibility=mode)
    linear, angular = run_and_compare(model, 150)
    assert linear < LIMIT
    assert angular < LIMIT


@MODES
def test_node_damping_keeps_both_momenta(deck_folder, mode):
    model = colliding(deck_folder, 2, NODE_DAMPING, compatibility=mode)
    linear, angular = run_and_compare(model, 150)
    assert linear < LIMIT
    assert angular < LIMIT


@MODES
@DIMENSIONS
@pytest.mark.parametrize("friction", [FRICTION, HISTORY], ids=["slip", "history"])
def test_friction_keeps_linear_momentum(deck_folder, dimension, friction, mode):
    model = colliding(deck_folder, dimension, friction, compatibility=mode)
    linear, angular = run_and_compare(model, 150)
    assert linear < LIMIT
    # Friction between nodes a distance d apart is a couple F d: see the next test.
    assert angular > 1e-6


def take_springs(model, reference):
    """Give the reference the tangential springs of the model."""
    for pair, xi in zip(*model.friction_springs(), strict=True):
        ids = tuple(model.state.particle_id[pair].tolist())
        reference.springs[ids][tuple(pair.tolist())] = xi


@MODES
@pytest.mark.parametrize("friction", [FRICTION, HISTORY], ids=["slip", "history"])
def test_friction_changes_angular_momentum_by_its_couples_alone(deck_folder, friction, mode):
    # Nodes that touch are up to Rc apart, and friction on them is opposite but not in one line:
    # by design it turns the pair, dL/dt = sum over nodes of x_i x F_t.
    model = colliding(deck_folder, 2, friction, compatibility=mode)
    reference = ReferenceModel(model)
    model.start()
    model.step(20)
    size, turned = momenta(model)[2] * 1e-3, 0.0
    for _ in range(40):
        reference.copy_state(model)
        take_springs(model, reference)
        couple = 0.0
        for _, _, found in reference.pairs():
            force = found.friction * model.state.volume[found.i, None]
            couple += np.cross(model.state.x[found.i], force).sum(axis=0)[2]
        before = momenta(model)[1][2]
        model.step()
        change = momenta(model)[1][2] - before
        assert change == pytest.approx(couple * model.dt, abs=1e-13 * size)
        turned += abs(couple) * model.dt
    assert turned > 1e-6 * size


DAMPING = {"Damping_On": True, "Epsilon": 0.8, "Beta_n_Factor": 10.0}


@MODES
def test_center_damping_keeps_linear_momentum_of_like_bodies_in_2d(deck_folder, mode):
    # F = beta c n spread over |Omega_p|: in the original the disc of the bounding radius, so that a
    # body of area A feels A / (pi R^2) of it: the same part where outlines are the same, as here.
    model = colliding(deck_folder, 2, DAMPING, compatibility=mode)
    linear, _ = run_and_compare(model, 150)
    assert linear < LIMIT


@pytest.mark.parametrize(("mode", "kept"), [("corrected", True), ("original", False)])
def test_center_damping_keeps_linear_momentum_of_unlike_bodies_in_2d(deck_folder, mode, kept):
    # A square that strikes a disc: 2/pi of its bounding disc against 0.995 of the other's.
    side = 1.6e-3
    square = deck_folder.mesh("square", box_mesh([side, side], [10, 10]))
    shape = {"Type": "square", "Parameters": [side]}
    changes = {"Particle.Zone_2": shape, "Mesh.Zone_2.File": square}
    model = colliding(
        deck_folder,
        2,
        DAMPING,
        changes,
        places=[(0, 0, 0, 0, GRAIN_RADIUS, 0.3), (1, 3e-4, 1.93e-3, 0, side, 0.0)],
        compatibility=mode,
    )
    linear, _ = run_and_compare(model, 150)
    assert (linear < LIMIT) == kept


@pytest.mark.parametrize(("mode", "kept"), [("corrected", True), ("original", False)])
def test_center_damping_keeps_linear_momentum_of_all_bodies_in_3d(deck_folder, mode, kept):
    # The body's own volume in the corrected mode: the forces are beta c n and its opposite. The
    # original spreads them over pi R^2, so that cubes of different size differ.
    side = 1e-3
    places = [(0, 0, 0, 0, side, 0.3), (1, 4e-4, 3e-4, 1.25e-3, 1.1 * side, 0.2)]
    model = colliding(deck_folder, 3, DAMPING, places=places, compatibility=mode)
    linear, _ = run_and_compare(model, 150)
    assert (linear < LIMIT) == kept
