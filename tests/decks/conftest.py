"""A small deck to start from, and a way to read it with something changed."""

from __future__ import annotations

import copy
import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from peridem.deck import Deck, read_deck
from peridem.errors import InputError
from ruamel.yaml import YAML

_CONTACT = {
    "Contact_Radius_Factor": 0.95,
    "Kn": 1.6e24,
    "Epsilon": 0.9,
    "Friction_Coeff": 0.2,
}
_MATERIAL = {
    "Type": "PDState",
    "Density": 1200.0,
    "Horizon": 6.0e-4,
    "K": 2.16e7,
    "G": 1.296e7,
    "Gc": 50.0,
    "Influence_Function": {"Type": 1},
}
_TWO_GRAINS: dict[str, Any] = {
    "Model": {
        "Dimension": 2,
        "Discretization_Type": {"Spatial": "finite_difference", "Time": "central_difference"},
        "Final_Time": 1.0e-4,
        "Time_Steps": 1000,
    },
    "Zone": {"Zones": 2, "Zone_1": {"Is_Wall": False}, "Zone_2": {"Is_Wall": False}},
    "Particle": {
        "Test_Name": "two_particle",
        "Zone_1": {"Type": "circle", "Parameters": [1.0e-3, 0.0, 0.0, 0.0]},
        "Zone_2": {"Type": "circle", "Parameters": [1.0e-3, 0.0, 0.0, 0.0]},
    },
    "Particle_Generation": {"From_File": "places.csv", "File_Data_Type": "loc_rad_orient"},
    "Mesh": {"Zone_1": {"File": "one.msh"}, "Zone_2": {"File": "two.msh"}},
    "Contact": {
        "Zone_11": _CONTACT,
        "Zone_12": {"Copy_Contact_Data": [1, 1]},
        "Zone_22": {"Copy_Contact_Data": [1, 2]},
    },
    "Neighbor": {"Update_Criteria": "simple_all", "Search_Factor": 10.0, "Search_Interval": 40},
    "Material": {"Zone_1": _MATERIAL, "Zone_2": {"Copy_Material_Data": 1}},
    "Force_BC": {"Gravity": [0.0, -10.0, 0.0]},
    "IC": {"Constant_Velocity": {"Velocity_Vector": [0.0, -1.0, 0.0], "Particle_List": [1]}},
    "Displacement_BC": {
        "Sets": 1,
        "Set_1": {
            "Particle_List": [0],
            "Direction": [1, 2],
            "Time_Function": {"Type": "constant", "Parameters": [0.0]},
            "Spatial_Function": {"Type": "constant"},
            "Zero_Displacement": True,
        },
    },
    "Output": {"Path": "out", "Tags": ["Displacement", "Velocity"], "Output_Interval": 100},
}
_ONE_GRAIN: dict[str, Any] = {
    "Model": {**_TWO_GRAINS["Model"], "Particle_Sim_Type": "Single_Particle"},
    "Mesh": {"Zone_1": {"File": "one.msh"}},
    "Material": {"Zone_1": _MATERIAL},
    "Output": {"Output_Interval": 100},
}


class DeckMaker:
    """Write a deck with keys changed into a folder, and read it.

    A change is named by its key path; `REMOVE` takes the key away. The files that the deck names
    exist beside it, empty.
    """

    REMOVE = object()

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for name in ("one.msh", "two.msh", "places.csv"):
            (folder / name).touch()

    def write(self, changes: dict[str, Any], *, single: bool = False) -> Path:
        """Write the two-grain deck, or that of a single body, with changes."""
        deck = copy.deepcopy(_ONE_GRAIN if single else _TWO_GRAINS)
        for path, value in changes.items():
            *blocks, key = path.split(".")
            block = deck
            for name in blocks:
                block = block.setdefault(name, {})
            if value is self.REMOVE:
                del block[key]
            else:
                block[key] = value
        text = io.StringIO()
        yaml = YAML(typ="safe", pure=True)
        yaml.default_flow_style = False
        yaml.dump(deck, text)
        return self.write_text(text.getvalue())

    def write_text(self, text: str) -> Path:
        path = self.folder / "input.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    def two_grains(self, changes: dict[str, Any] | None = None) -> Deck:
        return read_deck(self.write(changes or {}))

    def one_grain(self, changes: dict[str, Any] | None = None) -> Deck:
        return read_deck(self.write(changes or {}, single=True))

    def refusal(self, changes: dict[str, Any], *, single: bool = False) -> list[str]:
        """Lines of the error about a changed deck."""
        path = self.write(changes, single=single)
        with pytest.raises(InputError) as caught:
            read_deck(path)
        return str(caught.value).splitlines()

    def line_of(self, *keys: str) -> int:
        """Line, from 1, of nested keys in the deck written last."""
        lines = (self.folder / "input.yaml").read_text(encoding="utf-8").splitlines()
        number = -1
        for depth, key in enumerate(keys):
            start = f"{'  ' * depth}{key}:"
            number = next(n for n in range(number + 1, len(lines)) if lines[n].startswith(start))
        return number + 1


@pytest.fixture
def decks(tmp_path: Path) -> DeckMaker:
    """Decks in a temporary folder."""
    return DeckMaker(tmp_path)


@pytest.fixture
def remove() -> object:
    """The value that takes a key away."""
    return DeckMaker.REMOVE


@pytest.fixture
def refusal(decks: DeckMaker) -> Callable[[dict[str, Any]], str]:
    """The only line of the error about a changed two-grain deck."""

    def only_line(changes: dict[str, Any]) -> str:
        lines = decks.refusal(changes)
        assert len(lines) == 1, lines
        return lines[0]

    return only_line
