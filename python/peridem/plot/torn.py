"""Elements that a crack has torn open."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .snapshot import Snapshot

__all__ = ["TORN", "torn"]

TORN = 1.3
"""An element with an edge longer than this times its reference length is left out."""


def torn(snapshot: Snapshot, cells: NDArray[Any]) -> NDArray[np.bool_]:
    """Tell which elements, shape (m, k), have an edge much longer than at the start.

    Without the displacement none is known to be. A position that is not finite tears its elements.
    """
    moved = snapshot.fields.get("Displacement")
    if moved is None or not len(cells):
        return np.zeros(len(cells), dtype=bool)
    now, moves = snapshot.points[cells], moved[cells]
    found = np.zeros(len(cells), dtype=bool)
    for i, j in combinations(range(cells.shape[1]), 2):
        edge = now[:, i] - now[:, j]
        before = edge - (moves[:, i] - moves[:, j])
        with np.errstate(invalid="ignore"):
            found |= ~(_square(edge) <= TORN**2 * _square(before))
    return found


def _square(vectors: NDArray[Any]) -> NDArray[Any]:
    return np.asarray(np.einsum("ij,ij->i", vectors, vectors))
