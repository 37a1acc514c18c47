"""Plane elements: their triangles, and the edges of the bodies that they make up."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["boundary_edges", "split"]

IntArray = NDArray[np.int64]


def split(cells: NDArray[Any]) -> NDArray[Any]:
    """Triangles, shape (m, 3), of triangles or quads; those of a quad follow each other."""
    if cells.shape[1] == 3:
        return cells
    return np.asarray(cells[:, [[0, 1, 2], [0, 2, 3]]].reshape(-1, 3))


def boundary_edges(cells: list[NDArray[Any]], n_nodes: int) -> IntArray:
    """Edges, shape (m, 2), that belong to one element only, of plane elements."""
    pairs = [np.stack([c, np.roll(c, -1, axis=1)], axis=2).reshape(-1, 2) for c in cells if len(c)]
    if not pairs:
        return np.empty((0, 2), dtype=np.int64)
    edges = np.sort(np.concatenate(pairs).astype(np.int64), axis=1)
    keys, count = np.unique(edges[:, 0] * n_nodes + edges[:, 1], return_counts=True)
    once = keys[count == 1]
    return np.stack([once // n_nodes, once % n_nodes], axis=1)
