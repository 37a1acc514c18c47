"""Energy of grains that move without loss."""

import numpy as np
import pytest
from helpers import GRAIN_RADIUS, disc_mesh, displace, single_deck
from reference import ReferenceModel

UNBREAKABLE = {"Gc": 1e6}
PMB = {"Type": "PMBBond", "E": 3e7, "Gc": 1e6, "Horizon": 6e-4, "Density": 1200.0}


def energies(model, reference):
    reference.copy_state(model)
    return reference.energy()


# dt is about an eighth of the stable step of each
@pytest.mark.parametrize(("law", "dt"), [({}, 1e-7), (PMB, 5e-8)], ids=["state", "pmb"])
def test_energy_of_an_oscillating_grain_stays_over_1e4_verlet_steps(deck_folder, law, dt):
    circle = {"Type": "circle", "Parameters": [GRAIN_RADIUS]}
    name = deck_folder.mesh("disc", disc_mesh(GRAIN_RADIUS, jiggle=0.15))
    deck = single_deck(name, circle, scheme="velocity_verlet", dt=dt, steps=10000)
    deck["Material"]["Zone_1"] = law or {**deck["Material"]["Zone_1"], **UNBREAKABLE}
    model = deck_folder.model(deck)
    reference = ReferenceModel(model)
    u = np.zeros((model.n_nodes, 3))  # released from an ellipse
    u[:, :2] = 0.01 * model.state.x_ref[:, :2] * [1, -1]
    displace(model, u)
    start = sum(energies(model, reference))
    total, kinetic = [], []
    for _ in range(100):
        model.step(100)
        parts = energies(model, reference)
        total.append(sum(parts) / start)
        kinetic.append(parts[0] / start)
    assert model.bonds.intact.all()
    # Verlet's energy oscillates by about (omega dt)^2 / 8 (5e-4 here) and does not drift.
    np.testing.assert_allclose(total, 1, atol=1e-3)
    assert np.mean(total[50:]) == pytest.approx(np.mean(total[:50]), abs=1e-4)
    assert min(kinetic) < 0.2  # it oscillates: energy goes to and fro
    assert max(kinetic) > 0.8


@pytest.mark.parametrize("scheme", ["central_difference", "velocity_verlet"])
def test_energy_of_an_elastic_collision_is_kept(deck_folder, scheme):
    deck = deck_folder.grains(offset=(3e-4, 2.15e-3), scheme=scheme, dt=5e-8)
    deck["IC"] = {"Constant_Velocity": {"Velocity_Vector": [0, -4.0, 0], "Particle_List": [1]}}
    for zone in ("Zone_1", "Zone_2"):
        deck["Material"][zone].update(UNBREAKABLE)
    model = deck_folder.model(deck)
    reference = ReferenceModel(model)
    model.start()
    total = sum(energies(model, reference))
    strain = contact = 0.0
    for _ in range(60):
        model.step(25)
        parts = energies(model, reference)
        # v is known half a step late or early in the central difference: first order in dt
        assert sum(parts) == pytest.approx(total, rel=1e-2 if scheme[0] == "c" else 2e-3)
        strain, contact = max(strain, parts[1]), max(contact, parts[2])
    assert strain > 0.1 * total
    assert contact > 1e-3 * total
    assert parts[2] == 0  # they have parted


def test_broken_bonds_lose_their_energy_and_friction_less_contact_gains_none(deck_folder):
    deck = deck_folder.grains(offset=(3e-4, 2.1e-3), dt=5e-8)
    deck["IC"] = {"Constant_Velocity": {"Velocity_Vector": [0, -30.0, 0], "Particle_List": [1]}}
    model = deck_folder.model(deck)
    reference = ReferenceModel(model)
    model.start()
    total = sum(energies(model, reference))
    model.step(400)
    assert model.bonds.intact.mean() < 0.98
    assert sum(energies(model, reference)) < 0.99 * total
