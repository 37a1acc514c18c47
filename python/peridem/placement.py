"""Where the bodies stand: ``particle_locations.csv``."""

from __future__ import annotations

import difflib
import math
import os
from dataclasses import dataclass
from pathlib import Path

from .errors import InputError

_COLUMNS = ("i", "x", "y", "z", "r")
_ORIENTATION = "o"
_AXIS = ("ax", "ay", "az")
_IGNORED = ("id",)  # the number of the body, in files written by a run
_DATA_TYPES = ("loc_rad", "loc_rad_orient")
_MOST_REPORTED = 20


@dataclass(frozen=True)
class Placement:
    """One body of the placement file.

    Attributes
    ----------
    zone : int
        Zone, counted from 0.
    site : tuple of float
        Position [m] of the reference mesh's origin.
    radius : float
        Size [m] of the body: its mesh is scaled by ``radius / leading length``.
    orientation : float or None
        Angle [rad] about `axis`; None when it is to be drawn at random (``loc_rad``).
    line : int
        Line of the file, counted from 1.
    axis : tuple of float
        Axis of the rotation by `orientation`, of any length; the z axis unless given.
    where : str
        What messages call the body; file and line when empty.
    """

    zone: int
    site: tuple[float, float, float]
    radius: float
    orientation: float | None
    line: int
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    where: str = ""


def read_particle_locations(
    path: str | os.PathLike[str], data_type: str, n_zones: int, *, dimension: int = 3
) -> list[Placement]:
    """Read the placement file; columns are found by their names.

    Parameters
    ----------
    path : path-like
        Comma-separated text whose first line names the columns i, x, y, z, r and, for
        ``loc_rad_orient``, o. Optional: ax, ay, az, the axis of the rotation by o in 3D.
    data_type : {"loc_rad", "loc_rad_orient"}
        The deck's ``File_Data_Type``.
    n_zones : int
        Number of zones of the deck.
    dimension : int
        Dimension of the model; in 2D bodies turn about z only.

    Returns
    -------
    list of Placement
        In the order of the file.

    Raises
    ------
    InputError
        With one line for each problem found.
    """
    if data_type not in _DATA_TYPES:
        raise InputError(
            f"{path}: File_Data_Type = {data_type}: must be loc_rad or loc_rad_orient"
            f"{_suggestion(data_type, _DATA_TYPES) or '; use one of them'}"
        )
    lines = _lines(Path(path))
    with_orientation = data_type == "loc_rad_orient"
    header_line = next(k for k, line in enumerate(lines) if line.strip())
    columns = _header(lines[header_line], f"{path}:{header_line + 1}", with_orientation)
    placements: list[Placement] = []
    problems: list[str] = []
    for k, line in enumerate(lines[header_line + 1 :], header_line + 2):
        if not line.strip():
            continue
        found = _row(line, columns, f"{path}:{k}", n_zones, dimension)
        if isinstance(found, list):
            problems += found
        else:
            zone, site, radius, angle, axis = found
            orientation = angle if with_orientation else None
            placements.append(Placement(zone, site, radius, orientation, k, axis))
    if problems:
        more = len(problems) - _MOST_REPORTED
        tail = [f"{path}: and {more} more problems"] if more > 0 else []
        raise InputError("\n".join(problems[:_MOST_REPORTED] + tail))
    if not placements:
        raise InputError(f"{path}: only a header: it must place bodies; add a line for each")
    return placements


def _lines(file: Path) -> list[str]:
    try:
        content = file.read_bytes()
    except FileNotFoundError:
        raise InputError(
            f"{file}: placement file does not exist; correct Particle_Generation.From_File "
            "(relative paths start at the deck's folder)"
        ) from None
    except OSError as error:
        raise InputError(
            f"{file}: placement file cannot be read ({error.strerror}); give a readable file"
        ) from None
    try:
        lines = content.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        raise InputError(f"{file}: placement file is not text; give comma-separated text") from None
    if not any(line.strip() for line in lines):
        raise InputError(
            f"{file}: placement file is empty; give a header i,x,y,z,r,o and a line for each body"
        )
    return lines


def _header(line: str, where: str, with_orientation: bool) -> list[str]:
    """Return the names of the columns, checked."""
    names = [name.strip() for name in line.split(",")]
    known = (*_COLUMNS, _ORIENTATION, *_AXIS, *_IGNORED)
    problems = []
    meant = set()
    for name in names:
        if name not in known:
            remedy = _suggestion(name, known)
            meant.add(remedy.removeprefix("; did you mean ").removesuffix("?"))
            remedy = remedy or "; use i, x, y, z, r and o"
            problems.append(f"{where}: column {name!r}: unknown{remedy}")
        elif names.count(name) > 1 and f"{where}: column {name!r}" not in "".join(problems):
            problems.append(f"{where}: column {name!r}: given more than once; keep one of them")
    needed = (*_COLUMNS, _ORIENTATION) if with_orientation else _COLUMNS
    if any(name in names for name in _AXIS):
        needed = (*needed, *_AXIS)
    missing = [name for name in needed if name not in names and name not in meant]
    if missing:
        remedy = "add it to header and lines"
        if missing == [_ORIENTATION]:
            remedy += ", or use File_Data_Type: loc_rad for random orientations"
        problems.append(
            f"{where}: header = {line.strip()!r}: column {', '.join(missing)} is missing; {remedy}"
        )
    if problems:
        raise InputError("\n".join(problems))
    return names


_Vector = tuple[float, float, float]
_Row = tuple[int, _Vector, float, float, _Vector]


def _row(
    line: str, columns: list[str], where: str, n_zones: int, dimension: int
) -> _Row | list[str]:
    """Return zone, site, radius, angle and axis of a line, or what is wrong with it."""
    texts = [text.strip() for text in line.split(",")]
    if len(texts) != len(columns):
        return [
            f"{where}: {len(texts)} values where the header names {len(columns)}; "
            f"give {','.join(columns)}"
        ]
    values: dict[str, float] = {}
    problems = []
    for name, text in zip(columns, texts, strict=True):
        try:
            values[name] = float(text)
        except ValueError:
            values[name] = math.nan
        if not math.isfinite(values[name]):
            problems.append(f"{where}: {name} = {text}: must be a finite number; correct it")
    if problems:
        return problems
    if not values["i"].is_integer() or not 0 <= values["i"] < n_zones:
        problems.append(
            f"{where}: i = {texts[columns.index('i')]}: must be a zone, an integer from 0 to "
            f"{n_zones - 1}; zones are counted from 0 here (Zone_1 of the deck is 0)"
        )
    if not values["r"] > 0.0:
        problems.append(
            f"{where}: r = {texts[columns.index('r')]}: must be positive; give the radius in m"
        )
    axis = (values.get("ax", 0.0), values.get("ay", 0.0), values.get("az", 1.0))
    if not any(axis):
        problems.append(f"{where}: ax, ay, az = 0, 0, 0: an axis needs a direction; correct it")
    elif dimension == 2 and any(axis[:2]):
        problems.append(
            f"{where}: ax, ay, az = {axis[0]:g}, {axis[1]:g}, {axis[2]:g}: must be 0, 0, 1 in 2D; "
            "remove the columns"
        )
    if problems:
        return problems
    site = (values["x"], values["y"], values["z"])
    return int(values["i"]), site, values["r"], values.get(_ORIENTATION, 0.0), axis


def _suggestion(word: str, known: tuple[str, ...]) -> str:
    """Return "; did you mean ...?" or nothing."""
    aliases = {"zone": "i", "id": "i", "radius": "r", "rad": "r", "orientation": "o"}
    aliases |= {"orient": "o", "theta": "o", "angle": "o"}
    lowered = word.lower()
    near = difflib.get_close_matches(lowered, known, n=1, cutoff=0.6)
    guess = near[0] if near else aliases.get(lowered, "")
    return f"; did you mean {guess}?" if guess in known else ""
