"""Checks of a packing by the outlines of its grains, apart from the search used in packing."""

from __future__ import annotations

import itertools
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from ..geometry import Shape
from ..geometry.base import FloatArray
from ..geometry.primitives import Ball, Box
from .outlines import placed_polygons
from .pairs import IndexArray, near_pairs
from .regions import region_of

if TYPE_CHECKING:
    from .result import Packing

_ROUND_OFF = 1e-9
"""Part of a grain's radius that is taken for round-off."""
_GRID = 1e-9
"""Distance of points, in radii of the smallest grain, that are the same for polygons."""
_PROBES = 4096


def rotations(axes: FloatArray, angles: FloatArray) -> FloatArray:
    """Return the matrices of turns by `angles` [rad] about `axes`, shape (n, 3, 3)."""
    length = np.linalg.norm(axes, axis=1)[:, None]
    n = axes / np.where(length > 0, length, 1.0)
    zero = np.zeros(len(n))
    x, y, z = n.T
    cross = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)
    c, s = np.cos(angles)[:, None, None], np.sin(angles)[:, None, None]
    return np.asarray(c * np.eye(3) + s * cross + (1 - c) * n[:, :, None] * n[:, None, :])


def centers_of(packing: Packing) -> FloatArray:
    """Return the centres of the grains (not the origins of their shapes), shape (n, 3) [m]."""
    inner = np.array([g.center for g in packing.geometries])[packing.shape_index]
    turned = np.einsum("nij,nj->ni", rotations(packing.axes, packing.angles), inner)
    return np.asarray(packing.positions + packing.scales[:, None] * turned)


def overlapping(packing: Packing) -> tuple[IndexArray, IndexArray, FloatArray]:
    """Return pairs of overlapping grains and how deep [m]."""
    if len(packing) < 2:
        none = np.empty(0, dtype=np.intp)
        return none, none, np.empty(0)
    d = packing.dimension
    centers = centers_of(packing)[:, :d]
    i, j = near_pairs(centers, packing.radii, 0.0)
    distance = np.linalg.norm(centers[i] - centers[j], axis=1)
    depth = packing.radii[i] + packing.radii[j] - distance
    balls = np.array([isinstance(g, Ball) for g in packing.geometries])[packing.shape_index]
    rest = np.flatnonzero(~(balls[i] & balls[j]))
    if d == 2:
        depth[rest] = _shared(packing, i[rest], j[rest])
    else:
        bodies = [_Body.of(packing, k) for k in range(len(packing))]
        for k in rest:
            a, b = bodies[i[k]], bodies[j[k]]
            if a is not None and b is not None:
                depth[k] = a.depth_in(b)
    small = np.minimum(packing.radii[i], packing.radii[j])
    deep = depth > _ROUND_OFF * small
    return i[deep], j[deep], depth[deep]


def _shared(packing: Packing, i: IndexArray, j: IndexArray) -> FloatArray:
    """Side [m] of a square of the area that two plane grains share."""
    polygons = packing.polygons()
    # on a fine grid: without it GEOS may take touching polygons for the same
    grid = _GRID * float(packing.radii.min())
    area = shapely.area(shapely.intersection(polygons[i], polygons[j], grid_size=grid))
    areas = shapely.area(polygons)
    area[area <= 10.0 * _GRID * np.minimum(areas[i], areas[j])] = 0.0
    return np.asarray(np.sqrt(area))


def part_inside(packing: Packing) -> FloatArray:
    """Return the part of each grain that lies in the container, shape (n,)."""
    part = np.ones(len(packing))
    if packing.container is None or not len(packing):
        return part
    region, d = region_of(packing.container), packing.dimension
    out, _ = region.push(centers_of(packing)[:, :d], packing.radii)
    near = np.flatnonzero(out > 0.0)
    if d == 2:
        polygons = placed_polygons(
            packing.geometries, packing.shape_index[near], packing.positions[near, :2],
            packing.scales[near], packing.angles[near],
        )  # fmt: skip
        part[near] = 1.0 - part_outside(polygons, region.polygon)
        return part
    turns = rotations(packing.axes, packing.angles)
    probes = [_probes(g) for g in packing.geometries] if len(near) else []
    for k in near:
        points = packing.scales[k] * probes[packing.shape_index[k]] @ turns[k].T
        part[k] = packing.container.inside(points + packing.positions[k]).mean()
    return part


def part_outside(polygons: NDArray[Any], domain: Any) -> FloatArray:
    """Return the part of each polygon that lies outside of a domain, round-off left out."""
    if not len(polygons):
        return np.empty(0)
    areas = shapely.area(polygons)
    grid = _GRID * float(np.sqrt(areas.min()))
    part = shapely.area(shapely.difference(polygons, domain, grid_size=grid)) / areas
    return np.where(part <= 100.0 * _GRID, 0.0, part)


def _probes(shape: Shape) -> FloatArray:
    """Points spread evenly over a solid, the same in every run."""
    from scipy.stats import qmc

    lower, upper = shape.box
    share = shape.volume / float(np.prod(upper - lower))
    count = 2 ** int(np.ceil(np.log2(_PROBES / max(share, 1e-3))))
    points = lower + (upper - lower) * qmc.Sobol(3, scramble=False).random(count)
    inside = points[shape.contains(points)]
    return inside if len(inside) else np.asarray(shape.center)[None]


class _Body:
    """Convex polyhedron: vertices, normals of the faces, directions of the edges."""

    def __init__(self, points: FloatArray, normals: FloatArray, edges: FloatArray) -> None:
        self.points, self.normals, self.edges = points, normals, edges

    @staticmethod
    def of(packing: Packing, k: int) -> _Body | None:
        """Return grain k as a body, None if it is no convex polyhedron."""
        shape = _convex(packing.geometries[packing.shape_index[k]])
        if shape is None:
            return None
        turn = rotations(packing.axes[k : k + 1], packing.angles[k : k + 1])[0]
        points = packing.scales[k] * shape.points @ turn.T + packing.positions[k]
        return _Body(points, shape.normals @ turn.T, shape.edges @ turn.T)

    def depth_in(self, other: _Body) -> float:
        """Least overlap [m] over all axes that can separate the two; negative when apart."""
        depth = self._along(other, np.vstack([self.normals, other.normals]))
        if depth <= 0.0:
            return depth
        cross = np.cross(self.edges[:, None], other.edges[None]).reshape(-1, 3)
        length = np.linalg.norm(cross, axis=1)
        cross = cross[length > 1e-9] / length[length > 1e-9, None]
        return min(depth, self._along(other, cross)) if len(cross) else depth

    def _along(self, other: _Body, axes: FloatArray) -> float:
        a, b = self.points @ axes.T, other.points @ axes.T
        over = np.minimum(a.max(axis=0) - b.min(axis=0), b.max(axis=0) - a.min(axis=0))
        return float(over.min())


@lru_cache(maxsize=4096)
def _convex(shape: Shape) -> _Body | None:
    if isinstance(shape, Box):
        points = np.array(list(itertools.product(*zip(*shape.box, strict=True))))
    else:
        points = np.asarray(getattr(shape, "points", np.empty((0, 3))), dtype=float)
    if len(points) < 4:
        return None
    try:
        hull = ConvexHull(points)
    except QhullError:
        return None
    if abs(hull.volume - shape.volume) > 1e-6 * shape.volume:
        return None
    normals = _distinct(hull.equations[:, :3])
    sides = np.vstack([hull.simplices[:, [0, 1]], hull.simplices[:, [1, 2]],
                       hull.simplices[:, [2, 0]]])  # fmt: skip
    edges = points[sides[:, 0]] - points[sides[:, 1]]
    edges = edges / np.linalg.norm(edges, axis=1)[:, None]
    edges *= np.where(edges[:, :1] < 0, -1.0, 1.0)
    return _Body(points[hull.vertices], normals, _distinct(edges))


def _distinct(directions: FloatArray) -> FloatArray:
    """Drop directions that differ by round-off only."""
    _, first = np.unique(np.round(directions, 9), axis=0, return_index=True)
    return directions[np.sort(first)]
