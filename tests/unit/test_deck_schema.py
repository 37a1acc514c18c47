"""The schema itself: what validation, messages and the reference page of the keys rest on."""

from __future__ import annotations

import pytest
from peridem.deck import DeckFile
from peridem.deck.messages import closest, remedy, schema_keys, show

KEYS = list(schema_keys(DeckFile))


@pytest.mark.parametrize(("path", "field"), [(p, f) for p, f in KEYS if f is not None])
def test_schema_key_has_a_description_that_makes_a_remedy(path, field):
    assert field.alias == path.split(".")[-1]
    assert field.description
    assert field.description[0].isalnum() or field.description[0] == "["
    assert remedy(field)


def test_schema_names_every_block_of_the_original():
    blocks = {path for path, _ in KEYS if "." not in path}
    assert blocks == {
        "Model",
        "Container",
        "Zone",
        "Particle",
        "Particle_Generation",
        "Mesh",
        "Material",
        "Contact",
        "Neighbor",
        "Force_BC",
        "Displacement_BC",
        "IC",
        "Output",
        "Restart",
        "Policy",
        "HPX",
    }


def test_schema_reaches_numbered_and_nested_blocks():
    paths = {path for path, _ in KEYS}
    assert "Material.Zone_k.Influence_Function.Type" in paths
    assert "Material.Zone_k.Copy_Material_Data" in paths
    assert "Contact.Zone_ij.Center_Damping_Criterion" in paths
    assert "Displacement_BC.Set_k.Region.Geometry.Vec_Flag" in paths


def test_lengths_and_moduli_carry_units():
    units = {path: (field.json_schema_extra or {}).get("unit") for path, field in KEYS if field}
    assert units["Material.Zone_k.Horizon"] == "m"
    assert units["Material.Zone_k.K"] == "Pa"
    assert units["Model.Final_Time"] == "s"
    assert units["Force_BC.Gravity"] == "m/s^2"


@pytest.mark.parametrize(
    ("word", "expected"),
    [("Horizn", "Horizon"), ("horizon", "Horizon"), ("DENSITY", "Density"), ("xyz", None)],
)
def test_closest_finds_misspelt_words_in_any_case(word, expected):
    assert closest(word, ["Density", "Horizon", "Type"]) == expected


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (True, "true"),
        (1e-4, "0.0001"),
        ([1, "a"], "[1, a]"),
        ("a\nb", repr("a\nb")),
        ("x" * 100, "x" * 57 + "..."),
        (10**21, "a very large integer"),
    ],
)
def test_show_writes_values_as_the_deck_would(value, text):
    assert show(value) == text
