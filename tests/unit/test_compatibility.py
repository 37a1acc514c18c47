"""What a run says about the defects of the original that its deck meets."""

from __future__ import annotations

import pytest
from helpers import changed
from modelling_parts import two_discs
from peridem import DEMModel

FRICTION = {"Friction_On": True, "Friction_Coeff": 0.3}
PMB = {"Type": "PMBBond", "Horizon": 6e-4, "Density": 1200.0, "K": 2.16e7, "Gc": 50.0}


def quadratic(t1):
    time = {"Type": "quadratic", "Parameters": [0.1, t1]}
    held = {"Particle_List": [0], "Direction": [1], "Time_Function": time}
    return {"Displacement_BC": {"Sets": 1, "Set_1": held}}


def friction(*pairs, **more):
    return {
        f"Contact.Zone_{pair}.{key}": value
        for pair in pairs
        for key, value in {**FRICTION, **more}.items()
    }


def damping(epsilon):
    return {"Contact.Zone_12.Damping_On": True, "Contact.Zone_12.Epsilon": epsilon}


def notes(deck_folder, changes, mode="corrected", *, cubes=False, **options):
    deck = deck_folder.cubes(**options) if cubes else deck_folder.grains(**options)
    return deck_folder.model(deck, changes, compatibility=mode).notes


# Changes, the key that meets the defect, what the original does, what is done here.
DEFECTS = [
    (
        friction("12"),
        "Contact.Zone_12.Friction_Coeff",
        "friction pushes along the slip",
        "friction opposes the slip",
    ),
    (
        quadratic(2.0),
        "Displacement_BC.Set_1.Time_Function",
        "is a + T1 t",
        "is a + 2 T1 t",
    ),
    (
        {"Material.Zone_2.Influence_Function": {"Type": 0}},
        "Material.Zone_2.Influence_Function",
        "the influence function of Zone_1 serves all zones",
        "each zone has its own influence function",
    ),
    (
        {"Material.Zone_2": PMB | {"Influence_Function": {"Type": 1}}},
        "Material.Zone_2.Type",
        "body 0, which is state-based, decides for all bodies",
        "each body has the dilatation and break test of its own material",
    ),
    (
        {"Zone.Zone_2.Is_Wall": True},
        "Particle.Zone_2",
        "a wall that is free to move takes no contact force",
        "a wall that is free to move takes contact forces",
    ),
]


@pytest.mark.parametrize(("changes", "key", "original", "corrected"), DEFECTS)
def test_each_defect_is_noted_once_in_each_mode(deck_folder, changes, key, original, corrected):
    (note,) = notes(deck_folder, changes)
    assert f": {key}: " in note
    assert note.startswith("deck_1.yaml:")
    assert f"{corrected}" in note.split(", corrected here; in the original ")[0]
    assert original in note.split(", corrected here; in the original ")[1]
    assert note.endswith("; Model.Compatibility: original reproduces it")
    (note,) = notes(deck_folder, changes, "original")
    assert original in note.split(": a defect of the original, reproduced as asked; ")[0]
    assert corrected in note.split("with Model.Compatibility: corrected ")[1]


@pytest.mark.parametrize("cubes", [False, True])
def test_damping_between_centres_is_noted(deck_folder, cubes):
    (note,) = notes(deck_folder, damping(0.9), cubes=cubes)
    assert "Contact.Zone_12.Epsilon: damping between centres uses the volume" in note
    (note,) = notes(deck_folder, damping(0.9), "original", cubes=cubes)
    assert "for a body's volume: a defect of the original" in note
    assert "takes the disc of the bounding radius" in note


def test_friction_of_several_pairs_is_noted_once(deck_folder):
    (note,) = notes(deck_folder, friction("12", "22") | {"Contact.Zone_22.Self_Contact": True})
    assert "Contact.Zone_12" in note


@pytest.mark.parametrize(
    "changes",
    [
        friction("11", "22"),  # a zone of one body: it touches no other of its zone
        friction("12", Friction_Coeff=0.0),
        friction("12", Friction_Model="history"),
        quadratic(0.0),
        {f"Material.Zone_{k}.Influence_Function": {"Type": 2} for k in (1, 2)},
        {"Zone.Zone_2.Is_Wall": True, "Particle.Zone_2.All_Dofs_Constrained": True},
    ],
)
def test_what_meets_no_defect_is_silent(deck_folder, changes):
    for mode in ("corrected", "original"):
        assert notes(deck_folder, changes, mode) == []


@pytest.mark.parametrize("cubes", [False, True])
def test_damping_without_loss_is_silent(deck_folder, cubes):
    assert notes(deck_folder, damping(1.0), cubes=cubes) == []


def test_friction_between_pieces_of_one_body_is_noted(deck_folder):
    changes = changed(friction("11"), {})
    (note,) = notes(deck_folder, changes | {"Contact.Zone_11.Self_Contact": True})
    assert "Contact.Zone_11.Friction_Coeff" in note


def test_wall_moved_in_every_direction_is_silent(deck_folder):
    held = {"Particle_List": [1], "Direction": [1, 2], "Zero_Displacement": True}
    changes = {"Displacement_BC": {"Sets": 1, "Set_1": held}, "Zone.Zone_2.Is_Wall": True}
    assert notes(deck_folder, changes) == []


def test_deck_that_asks_for_the_correction_is_not_told_of_it(deck_folder):
    changes = {**friction("12"), "Model.Compatibility": "corrected"}
    model = deck_folder.model(deck_folder.grains(), changes)
    assert not any("defect" in note or "corrected here" in note for note in model.notes)
    asked = deck_folder.model(deck_folder.grains(), changes, compatibility="original")
    assert "friction pushes along the slip" in asked.notes[0]


def test_deck_that_a_model_writes_has_no_notes(tmp_path):
    two_discs().to_deck(tmp_path, until=1e-6)  # with friction
    assert DEMModel.from_deck(tmp_path / "input.yaml", threads=1).notes == []
