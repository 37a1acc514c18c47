"""Cells of a plane tessellation with common corners, so that short sides can be contracted."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely
from scipy.spatial import cKDTree

from ..errors import InputError
from ..geometry.base import FloatArray

_SAME = 1e-9
"""Corners nearer than this part of the domain's size are the same."""


class Cells:
    """Polygons that share corners.

    Parameters
    ----------
    polygons : list of shapely Polygon
        Cells without holes that fill the domain.
    domain : shapely geometry
        Its corners stay where they are, and corners of cells on its edge stay on it.
    """

    def __init__(self, polygons: list[Any], domain: Any) -> None:
        rings = [shapely.get_coordinates(shapely.orient_polygons(p).exterior)[:-1]
                 for p in polygons]  # fmt: skip
        points = np.vstack(rings)
        size = float(np.ptp(points, axis=0).max())
        first = _merged(points, _SAME * size)
        self.points = points
        ends = np.cumsum([len(ring) for ring in rings])[:-1]
        self.loops = [_without_repeats(loop.tolist()) for loop in np.split(first, ends)]
        corners = cKDTree(shapely.get_coordinates(domain))
        distance, _ = corners.query(points)
        edge = shapely.distance(shapely.points(points), domain.boundary) <= _SAME * size
        # 2: a corner of the domain, 1: on its edge, 0: inside
        self.rank = np.where(distance <= _SAME * size, 2, np.where(edge, 1, 0))
        self.domain = domain

    def polygons(self) -> list[Any]:
        """Return the cells; those that share a side have the same two corners, to the bit."""
        return [
            shapely.Polygon(self.points[loop]) if len(loop) > 2 else shapely.Polygon()
            for loop in self.loops
        ]

    def contracted(self, shortest: float) -> list[Any]:
        """Contract sides below `shortest` [m], the shortest first; return the polygons.

        Raises
        ------
        InputError
            If a cell would vanish or fold.
        """
        for _ in range(len(self.points)):
            side = self._shortest(shortest)
            if side is None:
                break
            if not self._contract(*side):
                x, y = self.points[side[0]]
                raise InputError(
                    f"voronoi: min_edge = {shortest:g}: a grain at ({x:.3g}, {y:.3g}) would vanish "
                    "or fold; give a smaller min_edge, fewer grains or lloyd = 10"
                )
        return self.polygons()

    def _shortest(self, limit: float) -> tuple[int, int] | None:
        """Return the shortest side below the limit that may be contracted."""
        a = np.concatenate([np.array(loop, dtype=np.intp) for loop in self.loops])
        b = np.concatenate([np.array(loop[1:] + loop[:1], dtype=np.intp) for loop in self.loops])
        length = np.hypot(*(self.points[a] - self.points[b]).T)
        length[~self._may_contract(a, b)] = np.inf
        k = int(length.argmin())
        return (int(a[k]), int(b[k])) if length[k] < limit else None

    def _may_contract(self, a: Any, b: Any) -> Any:
        """Two corners of the domain stay apart; two points on its edge may meet along it."""
        low = np.minimum(self.rank[a], self.rank[b])
        allowed = low < 2
        both = np.flatnonzero(low == 1)
        middle = shapely.points(0.5 * (self.points[a[both]] + self.points[b[both]]))
        size = float(np.ptp(self.points, axis=0).max())
        on = shapely.distance(middle, self.domain.boundary) <= _SAME * size
        allowed[both[~on]] = False
        return allowed

    def _contract(self, a: int, b: int) -> bool:
        """Make one corner of two; tell whether all cells stay simple polygons."""
        if self.rank[a] < self.rank[b]:
            a, b = b, a
        touched = [k for k, loop in enumerate(self.loops) if a in loop or b in loop]
        before = [self.loops[k] for k in touched]
        for k in touched:
            self.loops[k] = _without_repeats([a if v == b else v for v in self.loops[k]])
        one, two = self.points[a].copy(), self.points[b].copy()
        places = [one] if self.rank[a] > self.rank[b] else [0.5 * (one + two), one, two]
        for place in places:
            self.points[a] = place
            if all(self._is_simple(k) for k in touched):
                return True
        self.points[a] = one
        for k, loop in zip(touched, before, strict=True):
            self.loops[k] = loop
        return False

    def _is_simple(self, k: int) -> bool:
        if len(self.loops[k]) < 3:
            return False
        polygon = shapely.Polygon(self.points[self.loops[k]])
        return bool(polygon.is_valid and polygon.area > 0.0 and polygon.exterior.is_ccw)


def _without_repeats(loop: list[int]) -> list[int]:
    return [v for v, w in zip(loop, loop[1:] + loop[:1], strict=True) if v != w]


def _merged(points: FloatArray, tolerance: float) -> Any:
    """Return, for each point, the first of those that coincide with it."""
    first = np.arange(len(points))
    for i, j in sorted(cKDTree(points).query_pairs(tolerance)):
        first[j] = min(first[j], first[i])
    return first
