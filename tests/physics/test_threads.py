"""The same run on 1, 2 and 4 threads, bit for bit."""

import numpy as np
import pytest

FIELDS = ("x", "u", "v", "f", "theta", "damage_z")
CONTACT = {
    "Friction_On": True,
    "Friction_Coeff": 0.3,
    "Damping_On": True,
    "Epsilon": 0.8,
    "Beta_n_Factor": 5.0,
}
LAWS = {
    "state": {"K": 2.16e7, "G": 1.296e7},
    "pmb": {"Type": "PMBBond", "E": 3.0e7},
}


def state_after(model, steps):
    model.step(steps)
    arrays = {name: getattr(model.state, name).copy() for name in FIELDS}
    return {**arrays, "intact": model.bonds.intact.copy()}


def assert_same_on_all_threads(build, steps):
    """Runs a model on 1, 2 and 4 threads and returns its last state."""
    expected = state_after(build(1), steps)
    for threads in (2, 4):
        found = state_after(build(threads), steps)
        for name, array in expected.items():
            assert np.array_equal(found[name], array), (threads, name)
    return expected


@pytest.mark.parametrize("history", [False, True])
def test_breaking_impact_is_the_same_on_any_number_of_threads(deck_folder, history):
    deck = deck_folder.grains(offset=(1.5e-4, 2.11e-3))
    for law in deck["Contact"].values():
        law.update({**CONTACT, **({"Friction_Model": "history"} if history else {})})
    velocity = {"Velocity_Vector": [5.0, -25.0, 0], "Particle_List": [1]}
    deck["IC"] = {"Constant_Velocity": velocity}
    end = assert_same_on_all_threads(lambda n: deck_folder.model(deck, threads=n), 300)
    assert end["intact"].mean() < 0.98


def bars(law, length, height):
    """Two long bars, one flying at the other: bodies and contact large enough for all threads.

    Spacing 1 mm; a body of more than 4096 nodes is cut into blocks, loops over nodes are shared
    from 20000 nodes and contact from 2000 nodes on.
    """
    gap, h = 0.9e-3, 1e-3
    boxes = [
        [0.0, 0.0, 0.0, length, height, 0.0],
        [0.2e-3, height + gap, 0.0, length + 0.2e-3, 2 * height + gap, 0.0],
    ]
    shapes = [{"Type": "rectangle", "Parameters": box} for box in boxes]
    created = "Create_Particle_Using_ParticleZone_GeomObject"
    # s0 = sqrt(1 / (3 G eps)) = 2.9e-3: an impact at 20 m/s, a tenth of the wave speed, breaks it
    material = {"Horizon": 3.05e-3, "Density": 1200.0, "Gc": 1.0, **law}
    material.setdefault("Type", "PDState")
    contact = {"Contact_Radius_Factor": 0.95, "Kn": 18 * 2.16e7 / (np.pi * 3.05e-3**5), **CONTACT}
    velocity = {"Velocity_Vector": [3.0, -20.0, 0], "Particle_List": [1]}
    mesh = {"Mesh_Size": h * (1 - 1e-6), "CreateMesh": {"Flag": True}}
    return {
        "Model": {
            "Dimension": 2,
            "Discretization_Type": {"Time": "velocity_verlet"},
            "Final_Time": 1e-3,
            "Time_Steps": 1000,
        },
        "Zone": {"Zones": 2, "Zone_1": {"Is_Wall": False}, "Zone_2": {"Is_Wall": False}},
        "Particle": {f"Zone_{k + 1}": {**shapes[k], created: True} for k in range(2)},
        "Mesh": {"Zone_1": mesh, "Zone_2": mesh},
        "Contact": {f"Zone_{pair}": contact for pair in ("11", "12", "22")},
        "Material": {"Zone_1": material, "Zone_2": material},
        "IC": {"Constant_Velocity": velocity},
        "Force_BC": {"Gravity": [0.0, -10.0, 0.0]},
        "Output": {"Output_Interval": 100},
    }


@pytest.mark.parametrize("law", LAWS)
def test_large_breaking_bodies_are_the_same_on_any_number_of_threads(deck_folder, law):
    # the state-based one in full size, the other with blocks only
    nodes = (1101, 10) if law == "state" else (601, 8)
    deck = bars(LAWS[law], *(1e-3 * (n - 1) for n in nodes))
    end = assert_same_on_all_threads(lambda n: deck_folder.model(deck, threads=n), 15)
    assert len(end["f"]) == 2 * np.prod(nodes)
    assert 0.3 < end["intact"].mean() < 0.999
