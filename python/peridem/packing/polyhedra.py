"""Voronoi cells in a box: convex polyhedra between half-spaces."""

from __future__ import annotations

import numpy as np
from scipy.spatial import Delaunay, HalfspaceIntersection, QhullError

from ..errors import InputError
from ..geometry.base import FloatArray

_SAME = 1e-9


def convex_cells(
    seeds: FloatArray, lower: FloatArray, upper: FloatArray, gap: float
) -> list[FloatArray]:
    """Return the corners of the Voronoi cells of points in a box, made smaller by half a gap.

    Parameters
    ----------
    seeds : ndarray, shape (n, 3)
    lower, upper : ndarray, shape (3,)
        Corners of the box [m].
    gap : float
        Distance of the cells [m].

    Returns
    -------
    list of ndarray, each of shape (k, 3)

    Raises
    ------
    InputError
        If a cell vanishes.
    """
    size = float((upper - lower).max())
    unit = (seeds - lower) / size  # for Qhull's tolerances
    sides = [np.array([[-1.0, 0, 0, 0], [0, -1.0, 0, 0], [0, 0, -1.0, 0]])]
    sides += [np.column_stack([np.eye(3), -(upper - lower) / size])]
    walls = np.vstack(sides)
    neighbours = _neighbours(unit)
    cells = []
    for k, seed in enumerate(unit):
        others = unit[neighbours[k]]
        away = others - seed
        distance = np.linalg.norm(away, axis=1)
        normals = away / distance[:, None]
        offsets = -(normals * 0.5 * (others + seed)).sum(axis=1)
        planes = np.vstack([walls, np.column_stack([normals, offsets])])
        planes[:, 3] += 0.5 * gap / size  # normals are of unit length
        room = -(planes[:, :3] @ seed + planes[:, 3]).max()
        inner = seed if room > 1e-6 else _middle(planes)
        if inner is None:
            raise InputError(
                f"voronoi: gap = {gap:g}: a grain vanishes; give a smaller gap, fewer grains or "
                "lloyd = 10"
            )
        corners = HalfspaceIntersection(planes, inner).intersections
        cells.append(lower + size * _distinct(corners))
    return cells


def _neighbours(points: FloatArray) -> list[list[int]]:
    """Return the seeds whose cells touch, in a box and perhaps some more."""
    n = len(points)
    if n < 6:
        return [[j for j in range(n) if j != k] for k in range(n)]
    try:
        mesh = Delaunay(points)
    except QhullError:  # all in one plane
        return [[j for j in range(n) if j != k] for k in range(n)]
    starts, neighbours = mesh.vertex_neighbor_vertices
    return [sorted(neighbours[starts[k] : starts[k + 1]].tolist()) for k in range(n)]


def _middle(planes: FloatArray) -> FloatArray | None:
    """Centre of the largest ball between the planes, None if there is none."""
    from scipy.optimize import linprog

    best = linprog(
        [0.0, 0.0, 0.0, -1.0],
        A_ub=np.column_stack([planes[:, :3], np.ones(len(planes))]),
        b_ub=-planes[:, 3],
        bounds=[(None, None)] * 3 + [(0.0, None)],
    )
    if best.status != 0 or best.x is None or best.x[3] <= 1e-9:
        return None
    return np.asarray(best.x[:3])


def _distinct(points: FloatArray) -> FloatArray:
    """Drop corners met by more than three planes that were found more than once."""
    keep: list[int] = []
    for k in range(len(points)):
        if all(np.abs(points[k] - points[m]).max() > _SAME for m in keep):
            keep.append(k)
    return points[keep]
