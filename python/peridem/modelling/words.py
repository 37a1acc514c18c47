"""Messages about the keys of a deck, said in terms of bodies, materials and loads."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ..materials import ARGUMENTS as OF_MATERIALS
from .arguments import in_words
from .bodies import Body
from .contact import ARGUMENTS as OF_CONTACT
from .loads import LoadPart

_PREFIX = re.compile(r"(?m)^model: (?=\S)")
_REST = {
    "Model.Time_Steps": "time steps",
    "Time_Steps": "time steps",
    "Final_Time": "the duration",
    "Force_BC.Gravity": "gravity",
    "--allow-overlap (allow_overlap=True)": "allow_overlap=True",
    "the deck's": "the model's",
    "the deck": "the model",
    "Kn": "stiffness",
    "Region": "region",
    "Output.Tags": "tags",
    "Model.Compatibility": "compatibility",
}


class Words:
    """Puts names of the model in place of the keys of its deck.

    Parameters
    ----------
    zones : sequence of sequence of Body
        Bodies of each zone.
    loads : sequence of LoadPart
        Loads, in the order of the model.
    """

    def __init__(self, zones: Sequence[Sequence[Body]], loads: Sequence[LoadPart]) -> None:
        self._zones = zones
        self._loads = {
            kind: [part.label for part in loads if part.kind == kind]
            for kind in ("displacement", "force")
        }

    def say(self, text: str) -> str:
        """Return a message in terms of the model."""
        text = re.sub(r"Material\.Zone_(\d+)((?:\.\w+)*)", self._material, text)
        text = re.sub(r"Contact\.Zone_(\d+(?:_\d+)?)((?:\.\w+)*)", self._contact, text)
        text = re.sub(r"(?:Mesh|Particle|Zone)\.Zone_(\d+)(?:\.\w+)*", self._body, text)
        text = re.sub(r"(Displacement|Force)_BC\.Set_(\d+)", self._load, text)
        text = re.sub(r"\bZone_(\d+)\b", self._body, text)
        return _PREFIX.sub("", in_words(text, _REST))

    def _names(self, number: int) -> str:
        if not 1 <= number <= len(self._zones):
            return f"zone {number}"
        zone = self._zones[number - 1]
        more = f" and {len(zone) - 1} more" if len(zone) > 1 else ""
        return f"{zone[0].name!r}{more}"

    def _body(self, match: re.Match[str]) -> str:
        return self._names(int(match[1]))

    def _material(self, match: re.Match[str]) -> str:
        number = int(match[1])
        if not 1 <= number <= len(self._zones):
            return match[0]
        label = self._zones[number - 1][0].material.label
        argument = OF_MATERIALS.get(match[2].lstrip("."), "")
        return f"material {label} of {self._names(number)}" + (f": {argument}" if argument else "")

    def _contact(self, match: re.Match[str]) -> str:
        digits, argument = match[1], OF_CONTACT.get(match[2].lstrip("."), "")
        what = f"contact: {argument}" if argument else "contact"
        numbers = digits.split("_") if "_" in digits else list(digits)
        if len(numbers) != 2:  # which zones is not clear from more digits
            return what
        one, other = (self._names(int(number)) for number in numbers)
        pair = f"among {one}" if one == other else f"of {one} with {other}"
        return f"contact {pair}" + (f": {argument}" if argument else "")

    def _load(self, match: re.Match[str]) -> str:
        labels = self._loads[match[1].lower()]
        number = int(match[2])
        return labels[number - 1] if 1 <= number <= len(labels) else match[0]
