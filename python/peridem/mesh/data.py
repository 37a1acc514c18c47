"""The mesh of a body in its reference position."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

CellType = Literal["line", "triangle", "quad", "tetra", "none"]

CELL_TYPES_OF: dict[int, tuple[CellType, ...]] = {
    1: ("line",),
    2: ("triangle", "quad"),
    3: ("tetra",),
}
"""Element types kept in a model of dimension 1, 2, 3."""


@dataclass(frozen=True, eq=False)
class Mesh:
    """Nodes, elements and, where the file gives them, nodal volumes.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
        Node positions [m], in the order of the file.
    cell_type : {"line", "triangle", "quad", "tetra", "none"}
        Type of all elements; ``none`` for a cloud of nodes with volumes.
    cells : ndarray of int32, shape (m, k)
        Nodes of the elements, counted from 0.
    volumes : ndarray, shape (n,), or None
        Nodal volumes [m^d] when they are given rather than to be computed.
    source : str
        The file, or how the mesh was made.
    """

    points: NDArray[np.float64]
    cell_type: CellType
    cells: NDArray[np.int32]
    volumes: NDArray[np.float64] | None
    source: str


@dataclass(eq=False)
class RawMesh:
    """What a reader found, before any check: cells by meshio's type names."""

    points: NDArray[np.float64]
    cells: dict[str, NDArray[np.int64]]
    volumes: NDArray[np.float64] | None = None
