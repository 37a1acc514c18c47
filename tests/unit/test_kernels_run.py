"""Whole runs: the core, step by step, against the reference."""

import numpy as np
import pytest
from helpers import relative_error
from reference import ReferenceModel

FULL_CONTACT = {
    "Friction_On": True,
    "Friction_Coeff": 0.3,
    "Damping_On": True,
    "Epsilon": 0.8,
    "Beta_n_Factor": 10.0,
}
SCHEMES = pytest.mark.parametrize("scheme", ["central_difference", "velocity_verlet"])
MODES = pytest.mark.parametrize("mode", ["corrected", "original"])


def impact(deck, velocity, **contact):
    """Loads for a deck of two bodies: the second flies at the first, all kinds of contact act."""
    for law in deck["Contact"].values():
        law.update({**FULL_CONTACT, **contact})
    deck["IC"] = {"Constant_Velocity": {"Velocity_Vector": velocity, "Particle_List": [1]}}
    deck["Force_BC"] = {"Gravity": [0.0, -10.0, 0.0]}
    return deck


def run_both(model, steps):
    reference = ReferenceModel(model)
    model.start()
    reference.start()
    model.step(steps)
    for _ in range(steps):
        reference.step()
    return reference


def assert_same_run(model, reference, tolerance):
    for name in ("x", "u", "v", "f", "theta"):
        error = relative_error(getattr(model.state, name), getattr(reference.state, name))
        assert error < tolerance, name
    assert relative_error(model.state.damage_z, reference.state.Z) < tolerance
    assert np.array_equal(model.bonds.intact, reference.intact)
    assert model.time == reference.t


# Both do the same sums in different order: differences of single roundings (1e-16) grow a
# hundredfold in forces (extensions are a hundredth of lengths) and some more over the steps.
# Measured: up to 6e-13. A difference in the method would be at least of the order of dt.
TOLERANCE = 1e-11


@MODES
@SCHEMES
def test_breaking_impact_of_two_grains_runs_as_the_reference(deck_folder, scheme, mode):
    deck = impact(deck_folder.grains(offset=(1.5e-4, 2.11e-3), scheme=scheme), [5.0, -25.0, 0.0])
    model = deck_folder.model(deck, compatibility=mode)
    reference = run_both(model, 60)
    assert model.bonds.intact.mean() < 0.99
    assert any(len(found.i) for _, _, found in reference.pairs())
    assert_same_run(model, reference, TOLERANCE)


@MODES
def test_breaking_impact_of_two_cubes_runs_as_the_reference(deck_folder, mode):
    # Kn as stiff against the cubes' nodes as eq. 36 is against those of the discs
    deck = deck_folder.cubes(offset=(1e-4, 0.5e-4, 1.2e-3))
    deck = impact(deck, [2.0, 1.0, -30.0], Kn=1e27)
    model = deck_folder.model(deck, compatibility=mode)
    reference = run_both(model, 50)
    assert model.bonds.intact.mean() < 0.99
    assert_same_run(model, reference, TOLERANCE)


@MODES
def test_impact_on_a_wall_with_node_damping_runs_as_the_reference(deck_folder, mode):
    options = {"Node_Damping": True, "Center_Damping_Criterion": "nodes"}
    deck = deck_folder.grains(offset=(1.5e-4, -2.11e-3), walls=(1,))
    model = deck_folder.model(impact(deck, [3.0, 20.0, 0.0], **options), compatibility=mode)
    reference = run_both(model, 50)
    assert (model.state.f[: model.particles[0].stop, 0] != 0).any()
    assert_same_run(model, reference, TOLERANCE)


def test_friction_with_history_and_self_contact_run_as_the_reference(deck_folder):
    options = {"Friction_Model": "history", "Tangential_Stiffness_Ratio": 0.4}
    deck = impact(deck_folder.grains(offset=(1.5e-4, 2.11e-3)), [15.0, -25.0, 0.0], **options)
    deck["Contact"]["Zone_11"]["Self_Contact"] = True
    model = deck_folder.model(deck)
    reference = run_both(model, 60)
    assert_same_run(model, reference, TOLERANCE)
    pairs, elongations = model.friction_springs()
    expected = {ij: xi for kept in reference.springs.values() for ij, xi in kept.items()}
    assert len(expected) >= 2
    assert set(map(tuple, pairs.tolist())) == set(expected)
    wanted = np.array([expected[tuple(ij)] for ij in pairs.tolist()])
    assert relative_error(elongations, wanted) < TOLERANCE


LAWS = {
    "PMBBond": {},
    "RNPBond": {"Bond_Potential": {"Check_Sc_Factor": 1.5}},
    "PDElasticBond": {},
}


@pytest.mark.parametrize("law", LAWS)
def test_impact_of_two_laws_runs_as_the_reference(deck_folder, law):
    deck = impact(deck_folder.grains(offset=(1.5e-4, 2.11e-3)), [5.0, -25.0, 0.0])
    material = {"Type": law, "E": 3e7, "Gc": 50.0, "Horizon": 6e-4, "Density": 1200.0}
    deck["Material"]["Zone_2"] = {**material, **LAWS[law]}
    model = deck_folder.model(deck)
    assert_same_run(model, run_both(model, 50), TOLERANCE)


@MODES
@SCHEMES
def test_led_and_loaded_body_runs_as_the_reference(deck_folder, scheme, mode):
    deck = deck_folder.grains(offset=(0, 2.2e-3), scheme=scheme)
    low = {"Type": "rectangle", "Parameters": [-2e-3, -2e-3, 0, 2e-3, -0.6e-3, 0]}
    deck["Displacement_BC"] = {
        "Sets": 3,
        "Set_1": {
            "Region": {"Geometry": low},
            "Direction": [2],
            "Time_Function": {"Type": "quadratic", "Parameters": [1.5, -3e4]},
        },
        "Set_2": {
            "Region": {"Geometry": low},
            "Direction": [1],
            "Time_Function": {"Type": "sin", "Parameters": [2e-5, 3e4]},
            "Spatial_Function": {"Type": "hat_x", "Parameters": [2e-5]},
        },
        "Set_3": {
            "Region": {"Geometry": {"Type": "circle", "Parameters": [5e-4, 0, 2.2e-3, 0]}},
            "Particle_Exclude_List": [0],
            "Direction": [1, 2],
            "Time_Function": {"Type": "rotation", "Parameters": [2e3, 1e-4, 2.2e-3, 0.0]},
        },
    }
    kinds = {
        "Set_1": ("linear_step", [1e12, 1e-6, 0.5e-6], {"Type": "constant"}),
        "Set_2": ("sin", [1e6, 2e5], {"Type": "linear_y", "Parameters": [3e2]}),
        "Set_3": (
            "linear_slow_fast",
            [1.0, 2.5e-6, 1e11, 4e11],
            {"Type": "hat_y", "Parameters": [1.0]},
        ),
    }
    deck["Force_BC"] = {"Sets": 3, "Gravity": [1.0, -10.0, 0.0]}
    for name, (kind, parameters, space) in kinds.items():
        deck["Force_BC"][name] = {
            "Particle_List": [0, 1],
            "Direction": [1, 2],
            "Time_Function": {"Type": kind, "Parameters": parameters},
            "Spatial_Function": space,
        }
    model = deck_folder.model(deck, compatibility=mode)
    reference = run_both(model, 50)
    assert np.abs(model.state.u).max() > 1e-6
    assert_same_run(model, reference, TOLERANCE)
