"""Units of the coordinates in files that do not say."""

from __future__ import annotations

from ..errors import InputError
from .base import length

_UNITS = {"m": 1.0, "dm": 0.1, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}


def unit_length(where: str, unit: str | float) -> float:
    """Return the length [m] of a unit.

    Parameters
    ----------
    where : str
        Start of an error message.
    unit : str or float
        ``"m"``, ``"dm"``, ``"cm"``, ``"mm"``, ``"um"``, ``"in"``, or a length [m].

    Raises
    ------
    InputError
        If there is no such unit.
    """
    if not isinstance(unit, str):
        return length(where, "unit", unit)
    if unit in _UNITS:
        return _UNITS[unit]
    raise InputError(f"{where}: unit = {unit!r}: no such unit; use " + ", ".join(_UNITS))
