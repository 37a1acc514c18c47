"""Reader of Gmsh's MSH 2 ASCII format, the one the original reads.

Written out here, rather than left to a library, so that an error names the line. The file is
looked at line by line only where something is wrong: a mesh of a million nodes takes seconds.
"""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .data import RawMesh
from .sections import KINDS, IntArray, kind_of, places

_CHUNK = 1 << 18  # bytes looked at together: they stay in the cache


def read_msh2(content: bytes, source: str) -> RawMesh:
    """Read the content of an MSH 2 ASCII file.

    Parameters
    ----------
    content : bytes
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
    tags, points = _nodes(_section(content, "Nodes", source), source)
    return RawMesh(points, _elements(_section(content, "Elements", source), tags, source))


@dataclass(frozen=True)
class _Section:
    """The `count` lines of a section, the first of which is line number `first` of the file."""

    data: bytes
    count: int
    first: int

    def line(self, k: int) -> str:
        return self.data.split(b"\n")[k].decode("utf-8", errors="replace").strip()


def _section(content: bytes, name: str, source: str) -> _Section:
    start = _find_line(content, b"$" + name.encode(), 0)
    if start is None:
        raise InputError(
            f"{source}: the section ${name} is missing: the file is not a mesh or is cut off; "
            "write it again as MSH 2.2 or 4.1"
        )
    number = content.count(b"\n", 0, start) + 2
    _, _, rest = content[start : start + 4096].partition(b"\n")
    announced = rest.partition(b"\n")[0].strip()
    if not (announced.isdigit() and len(announced) < 19):
        text = announced.decode("utf-8", errors="replace")
        raise InputError(
            f"{source}:{number}: number of {name.lower()} = {text!r}: must be an integer; "
            "write the mesh again"
        )
    count = int(announced)
    begin = content.find(b"\n", content.find(b"\n", start) + 1) + 1
    end = _find_line(content, b"$End" + name.encode(), begin) if begin else None
    if end is None or content.count(b"\n", begin, end) != count:
        raise InputError(
            f"{source}:{number}: {count} {name.lower()} are announced, but $End{name} does not "
            "follow the last of them: the file is cut off or damaged; write the mesh again"
        )
    return _Section(content[begin:end], count, number + 1)


def _find_line(content: bytes, text: bytes, start: int) -> int | None:
    """Return where the first line that holds nothing but a text begins."""
    at = content.find(text, start)
    while at >= 0:
        begin, end = content.rfind(b"\n", 0, at) + 1, content.find(b"\n", at)
        end = len(content) if end < 0 else end
        if content[begin:end].strip() == text:
            return begin
        at = content.find(text, end)
    return None


def _numbers(data: bytes, dtype: type) -> NDArray[np.generic] | None:
    """Return all numbers of a text; None if it holds anything else."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return np.fromstring(data, dtype=dtype, sep=" ")
        except (DeprecationWarning, ValueError):
            return None


def _words_per_line(data: bytes) -> IntArray:
    """Count the words of each line of a text that ends with a line end."""
    text = np.frombuffer(data, dtype=np.uint8)
    after: list[IntArray] = []  # words up to the end of each line
    total, in_space = 0, True
    for start in range(0, len(text), _CHUNK):
        part = text[start : start + _CHUNK]
        space = (part == ord(" ")) | (part - np.uint8(ord("\t")) <= ord("\r") - ord("\t"))
        begins = ~space
        begins[1:] &= space[:-1]
        begins[0] &= in_space
        words = np.cumsum(begins)
        after.append(words[part == ord("\n")] + total)
        total, in_space = total + int(words[-1]), bool(space[-1])
    lengths = np.concatenate(after)
    lengths[1:] -= lengths[:-1].copy()
    return lengths


def _first_bad(section: _Section, dtype: type, wanted: int | None = None) -> int:
    """Return the first line that does not hold numbers alone, `wanted` of them."""
    for k, line in enumerate(section.data.split(b"\n")[: section.count]):
        values, words = _numbers(line, dtype), len(line.split())
        if values is None or len(values) != words or words != (wanted or words):
            return k
    return 0


def _nodes(section: _Section, source: str) -> tuple[IntArray, NDArray[np.float64]]:
    if not section.count:
        return np.empty(0, dtype=np.int64), np.empty((0, 3))
    found = _numbers(section.data, float)
    if found is None or found.size != 4 * section.count:
        raise _bad_node(section, _first_bad(section, float, 4), source)
    wrong = np.flatnonzero(_words_per_line(section.data) != 4)
    if len(wrong):
        raise _bad_node(section, int(wrong[0]), source)
    rows = found.astype(float).reshape(-1, 4)
    number = rows[:, 0]
    wrong = np.flatnonzero(~((np.abs(number) < 2.0**53) & (np.floor(number) == number)))
    if len(wrong):
        raise _bad_node(section, int(wrong[0]), source)
    return number.astype(np.int64), rows[:, 1:].copy()


def _bad_node(section: _Section, at: int, source: str) -> InputError:
    return InputError(
        f"{source}:{section.first + at}: node line = {section.line(at)!r}: must be a number and "
        "the three coordinates x y z; write the mesh again"
    )


def _elements(section: _Section, tags: IntArray, source: str) -> dict[str, NDArray[np.int64]]:
    """Return the nodes of the elements by type, as positions in the file."""
    if not section.count:
        return {}
    length = _words_per_line(section.data)
    found = _numbers(section.data, np.int64)
    if found is None or found.size != length.sum():
        raise _bad_element(section, _first_bad(section, np.int64), source)
    flat: IntArray = found.astype(np.int64, copy=False)
    short = np.flatnonzero(length < 3)
    if len(short):
        raise _bad_element(section, int(short[0]), source)
    end = np.cumsum(length)
    start = end - length
    kinds, n_tags = flat[start + 1], flat[start + 2]
    cells: dict[str, NDArray[np.int64]] = {}
    _, first_seen = np.unique(kinds, return_index=True)
    for kind in kinds[np.sort(first_seen)].tolist():
        own = np.flatnonzero(kinds == kind)
        name, n_nodes = kind_of(kind)
        if kind not in KINDS:
            cells[name] = np.empty((len(own), 0), dtype=np.int64)
            continue
        wrong = (n_tags[own] < 0) | (length[own] != 3 + n_tags[own] + n_nodes)
        if wrong.any():
            raise _bad_element(section, int(own[wrong][0]), source)
        wanted = flat[end[own][:, None] - n_nodes + np.arange(n_nodes)]
        cells[name] = places(wanted, tags, source, own + section.first)
    return cells


def _bad_element(section: _Section, at: int, source: str) -> InputError:
    return InputError(
        f"{source}:{section.first + at}: element line = {section.line(at)!r}: must hold number, "
        "type, number of tags, tags and nodes, all integers; write the mesh again"
    )
