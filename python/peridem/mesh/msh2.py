"""Reader of Gmsh's MSH 2 ASCII format, the one the original reads.

Written out here, rather than left to a library, so that an error names the line.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .data import RawMesh
from .sections import KINDS, IntArray, kind_of, places

_LINE_END = -(2**60)  # stands for a line's end in the numbers of a section; exact in double


def read_msh2(text: str, source: str) -> RawMesh:
    """Read the text of an MSH 2 ASCII file.

    Parameters
    ----------
    text : str
        The whole file.
    source : str
        Its name, for messages.

    Returns
    -------
    RawMesh

    Raises
    ------
    InputError
        With file, line, what is wrong with it and what to do.
    """
    lines = text.split("\n")
    first, n_nodes = _section(lines, "Nodes", source)
    tags, points = _nodes(lines[first : first + n_nodes], first, source)
    first, n_elements = _section(lines, "Elements", source)
    return RawMesh(points, _elements(lines[first : first + n_elements], first, tags, source))


def _section(lines: list[str], name: str, source: str) -> tuple[int, int]:
    """Return index of the first data line and number of entries of a section."""
    at = next((i for i, line in enumerate(lines) if line.strip() == f"${name}"), None)
    if at is None:
        raise InputError(
            f"{source}: the section ${name} is missing: the file is not a mesh or is cut off; "
            "write it again as MSH 2.2 or 4.1"
        )
    announced = lines[at + 1].strip() if at + 1 < len(lines) else ""
    if not (announced.isascii() and announced.isdecimal() and len(announced) < 19):
        raise InputError(
            f"{source}:{at + 2}: number of {name.lower()} = {announced!r}: must be an integer; "
            "write the mesh again"
        )
    count = int(announced)
    end = at + 2 + count
    if end >= len(lines) or lines[end].strip() != f"$End{name}":
        raise InputError(
            f"{source}:{at + 2}: {count} {name.lower()} are announced, but $End{name} does not "
            "follow the last of them: the file is cut off or damaged; write the mesh again"
        )
    return at + 2, count


def _numbers(lines: Sequence[str], dtype: type) -> NDArray[np.generic] | None:
    """Return all numbers of the lines, each line closed by `_LINE_END`; None if not numbers."""
    text = f" {_LINE_END} ".join(lines) + f" {_LINE_END}"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return np.fromstring(text, dtype=dtype, sep=" ")
        except (DeprecationWarning, ValueError):
            return None


def _first_bad(lines: Sequence[str], dtype: type) -> int:
    return next((k for k, line in enumerate(lines) if _numbers([line], dtype) is None), 0)


def _nodes(lines: list[str], first: int, source: str) -> tuple[IntArray, NDArray[np.float64]]:
    if not lines:
        return np.empty(0, dtype=np.int64), np.empty((0, 3))
    found = _numbers(lines, float)
    if found is None or found.size != 5 * len(lines) or not _are_nodes(found):
        bad = next(
            (k for k, line in enumerate(lines) if not _are_nodes(_numbers([line], float))), 0
        )
        raise InputError(
            f"{source}:{first + bad + 1}: node line = {lines[bad].strip()!r}: must be a number and "
            "the three coordinates x y z; write the mesh again"
        )
    rows = found.astype(float).reshape(-1, 5)
    return rows[:, 0].astype(np.int64), rows[:, 1:4].copy()


def _are_nodes(values: NDArray[np.generic] | None) -> bool:
    """Tell whether the numbers are lines of an integer and three coordinates."""
    if values is None or values.size % 5:
        return False
    number, _, _, _, end = values.astype(float).reshape(-1, 5).T
    whole = (np.abs(number) < 2.0**53) & (np.floor(number) == number)
    return bool(whole.all() and np.all(end == _LINE_END))


def _elements(
    lines: list[str], first: int, tags: IntArray, source: str
) -> dict[str, NDArray[np.int64]]:
    """Return the nodes of the elements by type, as positions in the file."""
    if not lines:
        return {}
    found = _numbers(lines, np.int64)
    if found is None:
        raise _bad_element(lines, _first_bad(lines, np.int64), first, source)
    flat: IntArray = found.astype(np.int64)
    end = np.flatnonzero(flat == _LINE_END)
    start = np.concatenate([[0], end[:-1] + 1])
    short = np.flatnonzero(end - start < 3)
    if len(short) or len(end) != len(lines):
        raise _bad_element(lines, int(short[0]) if len(short) else 0, first, source)
    kinds, n_tags = flat[start + 1], flat[start + 2]
    cells: dict[str, NDArray[np.int64]] = {}
    _, first_seen = np.unique(kinds, return_index=True)
    for kind in kinds[np.sort(first_seen)].tolist():
        own = np.flatnonzero(kinds == kind)
        name, n_nodes = kind_of(kind)
        if kind not in KINDS:
            cells[name] = np.empty((len(own), 0), dtype=np.int64)
            continue
        wrong = (n_tags[own] < 0) | (end[own] - start[own] != 3 + n_tags[own] + n_nodes)
        if wrong.any():
            raise _bad_element(lines, int(own[wrong][0]), first, source)
        wanted = flat[end[own][:, None] - n_nodes + np.arange(n_nodes)]
        cells[name] = places(wanted, tags, source, own + first + 1)
    return cells


def _bad_element(lines: list[str], at: int, first: int, source: str) -> InputError:
    return InputError(
        f"{source}:{first + at + 1}: element line = {lines[at].strip()!r}: must hold number, type, "
        "number of tags, tags and nodes, all integers; write the mesh again"
    )
