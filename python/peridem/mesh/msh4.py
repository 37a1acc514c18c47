"""Readers of Gmsh's MSH 4.1 (text and binary) and of the binary MSH 2."""

from __future__ import annotations

import numpy as np

from ..errors import InputError
from .data import RawMesh
from .sections import Cursor, IntArray, SectionError, TextCursor, gather, kind_of, section_bytes


def read_msh41(content: bytes, source: str, *, binary: bool) -> RawMesh:
    """Read the content of an MSH 4.1 file.

    Raises
    ------
    InputError
        If a section is missing, cut off or damaged.
    """
    cursor = Cursor if binary else TextCursor
    name = "Nodes"
    try:
        tags, points = _nodes41(cursor(section_bytes(content, name)))
        name = "Elements"
        blocks = _elements41(cursor(section_bytes(content, name)))
    except SectionError as error:
        raise _damaged(source, name, error) from None
    return RawMesh(points, gather(tags, blocks, source))


def _damaged(source: str, name: str, error: SectionError) -> InputError:
    return InputError(
        f"{source}: section ${name}: {error}; write the mesh again, as MSH 2.2 if in doubt"
    )


def _nodes41(cursor: Cursor) -> tuple[IntArray, np.ndarray]:
    n_blocks, n_nodes = cursor.sizes(4)[:2].tolist()
    tags: list[IntArray] = []
    points: list[np.ndarray] = []
    for _ in range(n_blocks):
        dimension, _, parametric = cursor.ints(3).tolist()
        (count,) = cursor.sizes(1).tolist()
        width = 3 + (dimension if parametric else 0)
        if not 3 <= width <= 6:
            raise SectionError(f"an entity has dimension {dimension}: the file is damaged")
        tags.append(cursor.sizes(count))
        points.append(cursor.reals(count * width).reshape(count, width)[:, :3])
    if sum(map(len, tags)) != n_nodes:
        raise SectionError(f"{n_nodes} nodes are announced and {sum(map(len, tags))} given")
    if not tags:
        return np.empty(0, dtype=np.int64), np.empty((0, 3))
    return np.concatenate(tags), np.vstack(points)


def _elements41(cursor: Cursor) -> list[tuple[str, IntArray]]:
    n_blocks, n_elements = cursor.sizes(4)[:2].tolist()
    blocks, total = [], 0
    for _ in range(n_blocks):
        kind = int(cursor.ints(3)[2])
        (count,) = cursor.sizes(1).tolist()
        name, n_nodes = kind_of(kind)
        if not n_nodes:
            raise SectionError(f"element type {kind} is unknown")
        rows = cursor.sizes(count * (1 + n_nodes)).reshape(count, 1 + n_nodes)
        blocks.append((name, rows[:, 1:]))
        total += count
    if total != n_elements:
        raise SectionError(f"{n_elements} elements are announced and {total} given")
    return blocks


def read_msh2_binary(content: bytes, source: str) -> RawMesh:
    """Read the content of a binary MSH 2 file.

    Raises
    ------
    InputError
        If a section is missing, cut off or damaged.
    """
    name = "Nodes"
    try:
        count, cursor = _counted(section_bytes(content, name))
        rows = cursor.take(count, "<i4,<3f8")
        tags, points = rows["f0"].astype(np.int64), rows["f1"].astype(float)  # type: ignore[call-overload]
        name = "Elements"
        count, cursor = _counted(section_bytes(content, name))
        blocks = _elements2(cursor, count)
    except SectionError as error:
        raise _damaged(source, name, error) from None
    return RawMesh(points, gather(tags, blocks, source))


def _counted(section: bytes) -> tuple[int, Cursor]:
    """Return the number on the first line of a section and a cursor behind it."""
    first, found, _ = section.partition(b"\n")
    if not found or not first.strip().isdigit() or len(first) > 20:
        raise SectionError("does not begin with the number of its entries")
    return int(first), Cursor(section, len(first) + 1)


def _elements2(cursor: Cursor, total: int) -> list[tuple[str, IntArray]]:
    blocks, done = [], 0
    while done < total:
        kind, count, n_tags = cursor.ints(3).tolist()
        name, n_nodes = kind_of(kind)
        if not n_nodes or count < 1 or n_tags < 0:
            raise SectionError(f"type {kind}, count {count}, tags {n_tags} head no elements")
        width = 1 + n_tags + n_nodes
        blocks.append((name, cursor.ints(count * width).reshape(count, width)[:, -n_nodes:]))
        done += count
    return blocks
