"""What the readers of Gmsh's formats share: element types, sections, node numbers."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError

IntArray = NDArray[np.int64]

KINDS = {1: ("line", 2), 2: ("triangle", 3), 3: ("quad", 4), 4: ("tetra", 4)}
"""Gmsh's number of an element type -> meshio's name and number of nodes, of those kept."""

_OTHERS = {5: ("hexahedron", 8), 6: ("wedge", 6), 7: ("pyramid", 5), 8: ("line3", 3)}
_OTHERS |= {9: ("triangle6", 6), 10: ("quad9", 9), 11: ("tetra10", 10), 12: ("hexahedron27", 27)}
_OTHERS |= {13: ("wedge18", 18), 14: ("pyramid14", 14), 15: ("vertex", 1), 16: ("quad8", 8)}
_OTHERS |= {17: ("hexahedron20", 20), 18: ("wedge15", 15), 19: ("pyramid13", 13)}
_OTHERS |= {21: ("triangle10", 10), 26: ("line4", 4)}


def kind_of(number: int) -> tuple[str, int]:
    """Return name and number of nodes (0 if unknown) of a Gmsh element type."""
    return KINDS.get(number) or _OTHERS.get(number, (f"Gmsh type {number}", 0))


class SectionError(ValueError):
    """A section ends too early or holds what it must not; the text says what."""


def section_bytes(content: bytes, name: str) -> bytes:
    """Return what stands between ``$name`` and ``$Endname``.

    Raises
    ------
    SectionError
        If one of them is missing.
    """
    for line_end in (b"\n", b"\r\n"):
        mark = b"$" + name.encode() + line_end
        start = content.find(mark)
        if start >= 0:
            end = content.find(b"$End" + name.encode(), start)
            if end < 0:
                raise SectionError(f"$End{name} is missing: the file is cut off")
            return content[start + len(mark) : end]
    raise SectionError(f"the section ${name} is missing")


@dataclass
class Cursor:
    """Reads numbers one after the other from a binary section.

    Attributes
    ----------
    data : bytes
        The section.
    at : int
        Position of the next number.
    """

    data: bytes
    at: int = 0

    def take(self, count: int, dtype: str) -> NDArray[np.generic]:
        """Return the next `count` numbers.

        Raises
        ------
        SectionError
            If there are fewer.
        """
        size = np.dtype(dtype).itemsize
        if not 0 <= count <= (len(self.data) - self.at) // size:
            raise SectionError(f"{count} values are announced, more than there are")
        found = np.frombuffer(self.data, dtype=dtype, count=count, offset=self.at)
        self.at += count * size
        return found

    def ints(self, count: int, dtype: str = "<i4") -> IntArray:
        """Return the next `count` integers."""
        return self.take(count, dtype).astype(np.int64)

    def sizes(self, count: int) -> IntArray:
        """Return the next `count` unsigned integers of 8 bytes."""
        return self.ints(count, "<i8")

    def reals(self, count: int) -> NDArray[np.float64]:
        """Return the next `count` reals."""
        return self.take(count, "<f8").astype(float)


class TextCursor(Cursor):
    """The same for a section of text, whatever its lines."""

    def __init__(self, data: bytes) -> None:
        super().__init__(data)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            try:
                self._values = np.fromstring(data.decode("ascii"), dtype=float, sep=" ")
            except (DeprecationWarning, ValueError):
                raise SectionError("holds something that is not a number") from None

    def take(self, count: int, dtype: str) -> NDArray[np.generic]:
        """Return the next `count` numbers."""
        if not 0 <= count <= len(self._values) - self.at:
            raise SectionError(f"{count} values are announced, more than there are")
        found = self._values[self.at : self.at + count]
        self.at += count
        whole = np.abs(found) < 2.0**53
        if dtype != "<f8" and not np.all(whole & (np.floor(found) == found)):
            raise SectionError("holds a number where an integer belongs")
        return found


def places(
    wanted: IntArray, tags: IntArray, source: str, line_numbers: IntArray | None = None
) -> IntArray:
    """Turn node numbers of the file into positions in it.

    Parameters
    ----------
    wanted : ndarray, shape (m, k)
        Node numbers of the elements.
    tags : ndarray, shape (n,)
        Node numbers in the order of the file.
    source : str
        The file, for messages.
    line_numbers : ndarray, shape (m,), optional
        Lines on which the elements stand.

    Raises
    ------
    InputError
        If two nodes have the same number or an element names one that does not exist.
    """
    if not len(tags):
        return wanted  # a mesh without nodes is refused later
    ordered, order = _in_order(tags)
    twice = np.flatnonzero(ordered[1:] == ordered[:-1])
    if len(twice):
        raise InputError(
            f"{source}: node number {ordered[twice[0]]} is given twice: numbers must differ; "
            "write the mesh again"
        )
    lowest = int(ordered[0])
    if int(ordered[-1]) - lowest == len(tags) - 1:  # without gaps: a number says its place
        missing = (wanted < lowest) | (wanted > ordered[-1])
        at = np.where(missing, 0, wanted - lowest) if missing.any() else wanted - lowest
    else:
        at = np.minimum(np.searchsorted(ordered, wanted), len(ordered) - 1)
        missing = ordered[at] != wanted
    if missing.any():
        k = int(np.flatnonzero(missing.any(axis=1))[0])
        line = "" if line_numbers is None else f":{line_numbers[k]}"
        raise InputError(
            f"{source}{line}: node {wanted[k][missing[k]][0]} of the element does not exist: the "
            f"file has {len(tags)} nodes; write the mesh again"
        )
    return at if order is None else np.asarray(order[at], dtype=np.int64)


def _in_order(tags: IntArray) -> tuple[IntArray, IntArray | None]:
    """Return sorted node numbers and their places; None for the places when sorted already."""
    if np.all(tags[1:] >= tags[:-1]):
        return tags, None
    order = np.argsort(tags, kind="stable")
    return tags[order], order


def gather(tags: IntArray, blocks: list[tuple[str, IntArray]], source: str) -> dict[str, IntArray]:
    """Stack the blocks of each type and turn node numbers into positions."""
    by_name: dict[str, list[IntArray]] = {}
    for name, numbers in blocks:
        if len(numbers):
            by_name.setdefault(name, []).append(numbers)
    return {name: places(np.vstack(parts), tags, source) for name, parts in by_name.items()}
