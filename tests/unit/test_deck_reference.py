"""The reference page of the keys: in step with the schema, and complete."""

from __future__ import annotations

from pathlib import Path

from peridem.deck import DeckFile
from peridem.deck.messages import schema_keys
from peridem.deck.reference import reference_page
from peridem.geometry import SHAPE_TYPES

DOCUMENT = Path(__file__).parents[2] / "docs" / "deck_keys.md"


def row(key: str) -> list[str]:
    """Cells of a key's row: value, unit, default, bounds, what it is."""
    (line,) = [text for text in reference_page().splitlines() if text.startswith(f"| `{key}` |")]
    return [cell.strip() for cell in line.strip("|").split("|")[1:]]


def test_page_of_keys_is_in_step():
    assert DOCUMENT.read_text(encoding="utf-8") == reference_page()


def test_page_has_every_key_but_those_of_shapes():
    page = reference_page()
    for path, _ in schema_keys(DeckFile):
        block, _, name = path.rpartition(".")
        if block.endswith(("Geometry", "Reference_Particle")):
            assert name in ("Type", "Parameters", "Vec_Type", "Vec_Flag")
        else:
            assert f"| `{path}` |" in page or f"\n## {path}\n" in page, path


def test_rows_give_value_unit_default_and_bounds():
    assert row("Material.Zone_k.Horizon") == ["number", "m", "", "> 0", "the horizon"]
    text = "the number of steps up to Final_Time"
    assert row("Model.Time_Steps") == ["whole number", "", "required", f">= 1, <= {10**15}", text]
    assert row("Material.Zone_k.Poisson_Ratio")[3] == "> -1, < 0.5"
    assert row("Output.Perform_Out")[:3] == ["true or false", "", "true"]
    assert row("Output.Compress_Type")[0] == "`zlib`, `ascii`, `none`"
    assert row("Particle.Zone_k.Type")[0] == "[shape](#shapes)"
    assert row("Contact.Zone_ij.Copy_Contact_Data")[3] == ">= 1, 2 entries"
    assert row("HPX.Partitions")[4] == "no effect: threads are chosen on the command line"


def test_page_lists_the_parameters_of_every_shape():
    page = reference_page()
    assert all(f"\n| {name} | " in page for name in SHAPE_TYPES)
    assert "| circle | `[r]` or `[r, x, y, z]` |" in page
