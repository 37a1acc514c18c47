"""Energy of a block that hits a bar obliquely and slides along it."""

import numpy as np
import pytest
from helpers import box_mesh, pair_deck
from reference import ReferenceModel

SPEED = np.array([1.0, -0.3, 0.0])


def sliding_block(deck_folder, contact, mode):
    """A square of 1 mm that flies at a held bar at an angle; no gravity, no damping."""
    block = deck_folder.mesh("block", box_mesh((1e-3, 1e-3), (6, 6), jiggle=0.1))
    bar = deck_folder.mesh("bar", box_mesh((4e-3, 0.5e-3), (24, 3)))
    deck = pair_deck([block, bar], {}, walls=(2,), dt=1e-7, scheme="velocity_verlet")
    deck["Particle"] = {
        "Zone_1": {"Type": "square", "Parameters": [1e-3]},
        "Zone_2": {
            "Type": "rectangle",
            "Parameters": [-2e-3, -0.25e-3, 0, 2e-3, 0.25e-3, 0],
            "All_Dofs_Constrained": True,
            "Create_Particle_Using_ParticleZone_GeomObject": True,
        },
    }
    deck_folder.places((0, -1.03e-3, 0.92e-3, 0, 1e-3, 0.0))
    deck["Contact"]["Zone_12"].update(contact)
    deck["Contact"]["Zone_12"]["Kn"] = 1.6e23
    velocity = {"Velocity_Vector": SPEED.tolist(), "Particle_List": [0]}
    deck["IC"] = {"Constant_Velocity": velocity}
    return deck_folder.model(deck, {"Material.Zone_1.Gc": 1e6}, compatibility=mode)


def slide(model):
    """Energy relative to its start every 50 steps, and the ratio of impulses along and across."""
    reference = ReferenceModel(model)
    model.start()
    block = slice(0, model.particles[0].stop)
    mass = (model.state.density * model.state.volume)[block, None]
    start = (mass * model.state.v[block]).sum(axis=0)
    energy = []
    for _ in range(60):
        reference.copy_state(model)
        energy.append(sum(reference.energy()))
        model.step(50)
    impulse = (mass * model.state.v[block]).sum(axis=0) - start
    assert impulse[1] > 0.3 * mass.sum()  # it was turned back
    return np.array(energy) / energy[0], impulse[0] / impulse[1]


def test_energy_is_kept_without_friction(deck_folder):
    energy, _ = slide(sliding_block(deck_folder, {}, "corrected"))
    assert np.abs(energy - 1).max() < 2e-3


FRICTION = {"Friction_On": True, "Friction_Coeff": 0.3}
HISTORY = {**FRICTION, "Friction_Model": "history"}


@pytest.fixture
def smooth_ratio(deck_folder):
    """Ratio of impulses without friction: not 0, as the rows of nodes of the two are rough."""
    return slide(sliding_block(deck_folder, {}, "corrected"))[1]


# The block slides all along, so friction adds -mu to the ratio (here to 0.05, as the contacts
# themselves change) and takes out about mu v_t J_n, J_n = 1.1 m: 0.33 of (1 + 0.09) / 2.
def test_friction_takes_energy_out(deck_folder, smooth_ratio):
    energy, ratio = slide(sliding_block(deck_folder, FRICTION, "corrected"))
    assert energy[-1] < 0.9
    assert np.diff(energy).max() < 1e-3
    assert ratio - smooth_ratio == pytest.approx(-0.3, abs=0.05)


def test_friction_with_history_takes_energy_out(deck_folder, smooth_ratio):
    # A spring gives back some of the energy it stored.
    energy, ratio = slide(sliding_block(deck_folder, HISTORY, "corrected"))
    assert energy[-1] < 0.9
    assert energy.max() <= 1 + 1e-3
    assert ratio - smooth_ratio < -0.2


def test_friction_of_the_original_feeds_energy(deck_folder, smooth_ratio):
    energy, ratio = slide(sliding_block(deck_folder, FRICTION, "original"))
    assert energy[-1] > 1.2
    assert np.diff(energy).min() > -1e-3
    assert ratio - smooth_ratio == pytest.approx(0.3, abs=0.05)
