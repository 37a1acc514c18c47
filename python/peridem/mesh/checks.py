"""Everything that is asked of a mesh before a body is made of it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .data import CELL_TYPES_OF, CellType, Mesh, RawMesh

_COINCIDENT = 1e-9  # of the mesh's diagonal
_FLAT = 1e-9  # of the mesh's diagonal
_FARTHEST = 1e100  # [m]; beyond, squares of distances overflow
_CHUNK = 1 << 14  # elements measured together: their corners stay in the cache
_DEGENERATE = 1e-10  # of the longest edge to the power of the dimension


def checked_mesh(raw: RawMesh, dimension: int, source: str) -> Mesh:
    """Pick the elements of the dimension and check nodes and elements.

    Raises
    ------
    InputError
        As `peridem.mesh.read_mesh` says.
    """
    points = raw.points
    if len(points) == 0:
        raise InputError(f"{source}: the mesh has no nodes; write the mesh again")
    check_points(points, source)
    _check_dimension(points, dimension, raw, source)
    check_volumes(raw.volumes, len(points), source)
    cell_type, cells = _pick(raw, dimension, source)
    if cell_type != "none":
        check_cells(points, cell_type, cells, source, orphans_allowed=raw.volumes is not None)
    return Mesh(points, cell_type, cells.astype(np.int32), raw.volumes, source)


def check_points(points: NDArray[np.float64], source: str) -> None:
    """Raise InputError unless all positions are finite and different from each other."""
    bad = np.flatnonzero(~(np.abs(points) < _FARTHEST).all(axis=1))
    if len(bad):
        raise InputError(
            f"{source}: position of node {bad[0]} (counted from 0) = {points[bad[0]]}: must be "
            f"finite and below {_FARTHEST:g} m ({len(bad)} such nodes); write the mesh again"
        )
    pair = _coincident_pair(points)
    if pair is not None:
        i, j = pair
        raise InputError(
            f"{source}: nodes {i} and {j} (counted from 0) coincide at {points[i]}: nodes must "
            "differ; merge duplicate nodes (in Gmsh: Coherence Mesh)"
        )


def _coincident_pair(points: NDArray[np.float64]) -> tuple[int, int] | None:
    """Find two nodes closer than the tolerance by sorting along a skew direction."""
    tolerance = _COINCIDENT * _diagonal(points)
    along = points @ np.array([0.741, 0.553, 0.381])
    order = np.argsort(along, kind="stable")
    s, p = along[order], points[order]
    for shift in range(1, len(points)):
        near = np.flatnonzero(s[shift:] - s[:-shift] <= tolerance)
        if len(near) == 0:
            return None
        distance = np.linalg.norm(p[near + shift] - p[near], axis=1)
        hits = near[distance <= tolerance]
        if len(hits):
            i, j = sorted((int(order[hits[0]]), int(order[hits[0] + shift])))
            return i, j
    return None


def _diagonal(points: NDArray[np.float64]) -> float:
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def _check_dimension(
    points: NDArray[np.float64], dimension: int, raw: RawMesh, source: str
) -> None:
    if dimension not in CELL_TYPES_OF:
        raise InputError(f"{source}: Dimension = {dimension}: must be 1, 2 or 3; correct the deck")
    extent = np.ptp(points, axis=0)
    thick = extent > _FLAT * _diagonal(points)
    for axis in range(dimension, 3):
        if thick[axis]:
            raise InputError(
                f"{source}: the mesh extends {extent[axis]:g} in {'xyz'[axis]}: must be flat in "
                f"a model of Dimension {dimension}; give a flat mesh or the right Dimension"
            )
    if dimension == 3 and not thick[2] and len(points) > 1:
        raise InputError(
            f"{source}: the mesh is flat in z: a model of Dimension 3 needs a solid mesh; give a "
            "mesh of tetrahedra or the right Dimension"
        )


def check_volumes(volumes: NDArray[np.float64] | None, n_nodes: int, source: str) -> None:
    """Raise InputError unless given nodal volumes fit the nodes and are positive."""
    if volumes is None:
        return
    if len(volumes) != n_nodes:
        raise InputError(
            f"{source}: {len(volumes)} nodal volumes for {n_nodes} nodes: must be one for each; "
            "write the mesh again"
        )
    bad = np.flatnonzero(~(np.isfinite(volumes) & (volumes > 0.0)))
    if len(bad):
        raise InputError(
            f"{source}: volume of node {bad[0]} (counted from 0) = {volumes[bad[0]]:g}: must be "
            f"positive ({len(bad)} such nodes); correct the volumes"
        )


def _pick(raw: RawMesh, dimension: int, source: str) -> tuple[CellType, NDArray[np.int64]]:
    wanted = CELL_TYPES_OF[dimension]
    present = [kind for kind in wanted if len(raw.cells.get(kind, ()))]
    if len(present) > 1:
        counts = " and ".join(f"{len(raw.cells[kind])} {kind}s" for kind in present)
        raise InputError(
            f"{source}: the mesh has {counts}: elements must be of one type; mesh it with one "
            "type (in Gmsh: recombine all surfaces or none)"
        )
    if present:
        return present[0], raw.cells[present[0]]
    if raw.volumes is not None:
        return "none", np.empty((0, 0), dtype=np.int64)
    found = ", ".join(f"{len(c)} {kind}" for kind, c in raw.cells.items()) or "no elements"
    raise InputError(
        f"{source}: the mesh has no {' or '.join(wanted)} elements of first order, which a model "
        f"of Dimension {dimension} needs (found: {found}); mesh it so, or correct Dimension"
    )


def check_cells(
    points: NDArray[np.float64],
    cell_type: CellType,
    cells: NDArray[np.int64],
    source: str,
    *,
    orphans_allowed: bool = False,
) -> None:
    """Raise InputError unless elements name existing nodes, use all, and have a volume."""
    n = len(points)
    outside = np.flatnonzero(((cells < 0) | (cells >= n)).any(axis=1))
    if len(outside):
        raise InputError(
            f"{source}: {cell_type} {outside[0]} (counted from 0) names a node that does not "
            f"exist: the mesh has {n} nodes; write the mesh again"
        )
    unused = np.flatnonzero(np.bincount(cells.ravel(), minlength=n) == 0)
    if len(unused) and not orphans_allowed:
        raise InputError(
            f"{source}: {len(unused)} of {n} nodes belong to no {cell_type}, the first is node "
            f"{unused[0]} (counted from 0): every node needs a volume; remove them from the mesh "
            "(in Gmsh: no points outside the geometry, one element type, Mesh.SaveAll = 0)"
        )
    size, edge = _measure(points, cell_type, cells)
    power = {"line": 1, "tetra": 3}.get(cell_type, 2)
    # a line is as long as its longest edge, so only one without length counts
    flat = np.flatnonzero(size <= _DEGENERATE * edge**power)
    if len(flat):
        raise InputError(
            f"{source}: {len(flat)} {cell_type} elements have no volume, the first is number "
            f"{flat[0]} (counted from 0) of nodes {cells[flat[0]].tolist()}: must be positive; "
            "mesh again with better shaped elements"
        )


def _measure(
    points: NDArray[np.float64], cell_type: CellType, cells: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Length, area or volume of each element and the longest distance from its node 0."""
    parts = [
        _measure_some(points, cell_type, cells[start : start + _CHUNK])
        for start in range(0, max(len(cells), 1), _CHUNK)
    ]
    return np.concatenate([size for size, _ in parts]), np.concatenate([edge for _, edge in parts])


def _measure_some(
    points: NDArray[np.float64], cell_type: CellType, cells: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    corner = points[cells]
    arms = corner[:, 1:] - corner[:, :1]
    edge = np.linalg.norm(arms, axis=2).max(axis=1)
    if cell_type == "line":
        size = edge
    elif cell_type == "triangle":
        size = 0.5 * np.linalg.norm(np.cross(arms[:, 0], arms[:, 1]), axis=1)
    elif cell_type == "quad":
        diagonal = corner[:, 3] - corner[:, 1]
        size = 0.5 * np.linalg.norm(np.cross(arms[:, 1], diagonal), axis=1)
    else:
        size = np.abs(np.einsum("ij,ij->i", np.cross(arms[:, 0], arms[:, 1]), arms[:, 2])) / 6.0
    return size, edge
