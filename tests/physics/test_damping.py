"""Normal damping: closed forms, and the restitution of a collision."""

import numpy as np
import pytest
from helpers import GRAIN_RADIUS, disc_mesh, pair_deck

R, RHO = GRAIN_RADIUS, 1200.0
STIFF = {"K": 2.0e9, "G": 1.2e9, "Gc": 1e6, "Density": RHO}  # glass of the paper, unbreakable


def facing_discs(deck_folder, gap, velocity, changes):
    """Two equal discs whose outermost nodes face each other across a gap along x."""
    name = deck_folder.mesh("disc", disc_mesh(R))
    shape = {"Type": "circle", "Parameters": [R]}
    deck = pair_deck([name, name], shape, dt=2e-8, scheme="velocity_verlet")
    deck_folder.places((0, 0, 0, 0, R, 0.0), (1, 2 * R + gap, 0, 0, R, 0.0))
    deck["IC"] = {"Constant_Velocity": {"Velocity_Vector": [-velocity, 0, 0], "Particle_List": [1]}}
    for zone in ("Zone_1", "Zone_2"):
        deck["Material"][zone].update(STIFF)
    for law in deck["Contact"].values():
        del law["Contact_Radius_Factor"]
    return deck_folder.model(deck, {f"Contact.Zone_12.{k}": v for k, v in changes.items()})


def approach_speed(model):
    """Relative velocity of the two bodies' centres of mass along x."""
    s, middle = model.state, model.particles[1].start
    mass = s.density * s.volume
    v = [np.average(s.v[n, 0], weights=mass[n]) for n in (slice(middle), slice(middle, None))]
    return v[0] - v[1]


def test_dashpot_alone_slows_the_approach_geometrically(deck_folder):
    # Before nodes touch (gap > Rc) both discs are pulled as a whole, c' = -rate c with rate =
    # 2 beta / m, m the mass. Nothing is deformed, so that the sums of the integrator are exact:
    # half a kick by the force at hand, and half a kick by that of the new velocity.
    rc, v0 = 1e-4, 1e-4
    damping = {"Contact_Radius": rc, "Damping_On": True, "Epsilon": 0.9, "Beta_n_Factor": 400.0}
    model = facing_discs(deck_folder, 1.009 * rc, v0, damping)
    betan = 400 * 2 * 0.1053605157 / np.sqrt(np.pi**2 + 0.1053605157**2)  # ln 0.9
    mass = RHO * model.particles[0].volume
    rate = 2 * betan * np.sqrt(2.0e9 * rc * mass) / mass
    half = rate * model.dt / 2
    c, c_of_force = v0, v0
    for _ in range(100):
        c -= half * c_of_force
        c_of_force = c
        c -= half * c_of_force
        model.step()
        assert approach_speed(model) == pytest.approx(c, rel=1e-9)
    assert c < 0.5 * v0
    assert np.abs(model.state.theta).max() < 1e-12


@pytest.mark.parametrize("epsilon", [1.0, 0.95, 0.9, 0.8])
def test_restitution_of_hard_discs_follows_the_damped_oscillator(deck_folder, epsilon):
    # One pair of nodes touches, a spring k = Kn V^2 soft against the discs: k << K. The overlap
    # obeys d'' + 2 zeta omega d' + omega^2 d = 0 while it grows and d'' + omega^2 d = 0 while it
    # shrinks, as the dashpot only resists approach. With omega^2 = 2k/m and 2 zeta omega =
    # 2 beta / m the largest overlap is v0/omega exp(-zeta acos(zeta)/sqrt(1-zeta^2)),
    # and omega times it comes back.
    rc, v0, kn, factor = 1.5e-4, 0.3, 1.4e22, 20.0
    damping = {"Contact_Radius": rc, "Epsilon": epsilon, "Beta_n_Factor": factor}
    settings = {**damping, "Damping_On": True, "Kn": kn}
    model = facing_discs(deck_folder, rc * (1 - 1e-6), v0, settings)
    disc = model.particles[0]
    volume = model.state.volume[np.argmax(model.state.x[: disc.stop, 0])]
    k = kn * volume**2
    assert k < 1e-2 * STIFF["K"]
    mass = RHO * disc.volume
    omega = np.sqrt(2 * k / mass)
    ln = np.log(epsilon)
    beta = factor * -2 * ln / np.sqrt(np.pi**2 + ln**2) * np.sqrt(STIFF["K"] * rc * mass)
    zeta = beta / (mass * omega)
    expected = np.exp(-zeta * np.arccos(zeta) / np.sqrt(1 - zeta**2))
    model.step(int(1.3 * np.pi / omega / model.dt))
    # the discs give a little, and keep some of the energy as vibration
    assert -approach_speed(model) / v0 == pytest.approx(expected, abs=0.01)
    assert epsilon == 1 or expected < 0.9


def test_restitution_falls_with_node_damping(deck_folder):
    # The same collision with the dashpot between the two nodes: beta from their masses.
    rc, v0 = 1.5e-4, 0.3
    speeds = []
    for factor in (0.0, 3.0, 10.0):
        node = {"Damping_On": True, "Epsilon": 0.8, "Node_Damping": True, "Beta_n_Factor": factor}
        nodes_only = {"Contact_Radius": rc, "Kn": 1e23, "Center_Damping_Criterion": "nodes"}
        model = facing_discs(deck_folder, rc * (1 - 1e-6), v0, {**node, **nodes_only})
        model.step(5000)
        speeds.append(-approach_speed(model) / v0)
    assert speeds[0] == pytest.approx(1, abs=0.02)
    assert speeds[0] > speeds[1] > speeds[2] > 0
