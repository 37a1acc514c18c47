"""Outlines of shapes: discs, convex pieces for the search of contacts, polygons to measure with.

A disc is a point with a rounding; everything else is cut into convex polygons. All are given
about the centre of the shape (`geometry.Shape.center`), at scale 1 and not turned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from ..errors import InputError
from ..geometry import Shape
from ..geometry.base import FloatArray
from ..geometry.composite import Complex, Difference
from ..geometry.primitives import Ball, Ellipse

_ELLIPSE_SIDES = 24
_Point = tuple[float, ...]
_Loop = list[_Point]


@dataclass(frozen=True)
class Outline:
    """What a packing needs to know of a shape, at scale 1.

    Attributes
    ----------
    geometry : Shape
    center : ndarray, shape (d,)
        Centre of the shape [m] in its own coordinates, about which it is enclosed.
    radius : float
        Radius [m] about the centre that encloses the shape.
    pieces : tuple of ndarray, each of shape (k, 2)
        Convex polygons [m], counter-clockwise, that cover the shape; empty for discs, spheres
        and all shapes in 3D, which stand as their enclosing ball.
    """

    geometry: Shape
    center: FloatArray
    radius: float
    pieces: tuple[FloatArray, ...]


def geometry_of(where: str, shape: Any) -> Shape:
    """Return the geometry of a public shape, or the geometry itself."""
    geometry = getattr(shape, "geometry", shape)
    if not isinstance(geometry, Shape):
        raise InputError(
            f"{where}: {shape!r}: must be a shape; use for instance Circle(radius=1e-3)"
        )
    return geometry


def outline_of(shape: Shape) -> Outline:
    """Return the outline of a shape; a plane one is cut into convex pieces."""
    d = shape.dimension
    center = np.asarray(shape.center, dtype=float)[:d]
    filled = shape.outer if isinstance(shape, Difference) else shape
    if d == 3 or isinstance(filled, Ball):
        return Outline(shape, center, float(shape.bounding_radius), ())
    pieces = tuple(piece - center for piece in _convex_pieces(enclosing_polygon(shape)))
    reach = max(float(np.hypot(*piece.T).max()) for piece in pieces)
    return Outline(shape, center, reach, pieces)


def polygon_of(shape: Shape) -> Any:
    """Return the shapely polygon of a plane shape as its boundary is drawn."""
    if isinstance(shape, Difference):
        return shapely.difference(polygon_of(shape.outer), polygon_of(shape.inner))
    if isinstance(shape, Complex):
        whole = shapely.Polygon()
        for member, sign in zip(shape.members, shape.signs, strict=True):
            change = shapely.union if sign else shapely.difference
            whole = change(whole, polygon_of(member))
        return whole
    points = np.asarray(shape.boundary(), dtype=float)[:, :2]
    breaks = np.flatnonzero(np.isnan(points[:, 0]))
    loops = [loop[~np.isnan(loop[:, 0])] for loop in np.split(points, breaks)]
    whole = shapely.Polygon()
    for loop in loops:  # a loop inside another is a hole
        whole = shapely.symmetric_difference(whole, shapely.Polygon(loop))
    return whole


def enclosing_polygon(shape: Shape) -> Any:
    """Return a shapely polygon that encloses the shape: holes filled, around an ellipse."""
    if not isinstance(shape, Ellipse):
        parts = shapely.get_parts(polygon_of(shape))
        return shapely.union_all([shapely.Polygon(part.exterior) for part in parts])
    t = 2.0 * np.pi * np.arange(_ELLIPSE_SIDES) / _ELLIPSE_SIDES
    grow = 1.0 / np.cos(np.pi / _ELLIPSE_SIDES)
    u, v = grow * shape.a * np.cos(t), grow * shape.b * np.sin(t)
    c, s = np.cos(shape.angle), np.sin(shape.angle)
    return shapely.Polygon(shape.center[:2] + np.column_stack([c * u - s * v, s * u + c * v]))


def placed_polygons(
    shapes: Sequence[Shape],
    index: np.ndarray[Any, Any],
    positions: FloatArray,
    scales: FloatArray,
    angles: FloatArray,
) -> np.ndarray[Any, Any]:
    """Return the shapely polygons of plane grains: ``position + scale R(angle) shape``."""
    polygons = np.empty(len(index), dtype=object)
    c, s = scales * np.cos(angles), scales * np.sin(angles)
    for k, shape in enumerate(shapes):
        chosen = np.flatnonzero(index == k)
        if len(chosen) == 0:
            continue
        copies = np.repeat(np.array([polygon_of(shape)], dtype=object), len(chosen))
        points = shapely.get_coordinates(copies)
        n = len(points) // len(chosen)
        of = np.repeat(chosen, n)
        x, y = points.T
        placed = np.column_stack(
            [c[of] * x - s[of] * y + positions[of, 0], s[of] * x + c[of] * y + positions[of, 1]]
        )
        polygons[chosen] = shapely.set_coordinates(copies, placed)
    return polygons


def equivalent_radius(shape: Shape) -> float:
    """Radius [m] of the circle or sphere with the area or volume of the shape."""
    if shape.dimension == 2:
        return float(np.sqrt(shape.volume / np.pi))
    return float(np.cbrt(0.75 * shape.volume / np.pi))


def _convex_pieces(polygon: Any) -> list[FloatArray]:
    """Cut a polygon into convex ones: triangles, merged as long as they stay convex."""
    if _is_convex(polygon):
        return [_corners(polygon)]
    loops = []
    for part in shapely.get_parts(shapely.constrained_delaunay_triangles(polygon)):
        if part.area > 0.0:
            points = shapely.get_coordinates(shapely.orient_polygons(part))[:-1]
            loops.append([tuple(point) for point in points.tolist()])
    return [np.array(loop) for loop in _merged(loops)]


def _merged(loops: list[_Loop]) -> list[_Loop]:
    """Merge convex polygons over common sides while they stay convex (Hertel and Mehlhorn)."""
    of: dict[tuple[_Point, _Point], int] = {}  # side, in the sense of its polygon
    for k, loop in enumerate(loops):
        of |= dict.fromkeys(_sides(loop), k)
    for a, b in list(of):
        if (a, b) not in of or (b, a) not in of or of[a, b] == of[b, a]:
            continue
        k, m = of[a, b], of[b, a]
        i, j = loops[k].index(b), loops[m].index(a)
        # once around the first from b to a, then around the second from a to b
        joined = loops[k][i:] + loops[k][:i] + (loops[m][j:] + loops[m][:j])[1:-1]
        if _turns_left(joined):
            for side in ((a, b), (b, a)):
                del of[side]
            loops[k], loops[m] = joined, []
            of |= dict.fromkeys(_sides(joined), k)
    return [loop for loop in loops if loop]


def _sides(loop: _Loop) -> list[tuple[_Point, _Point]]:
    return list(zip(loop, loop[1:] + loop[:1], strict=True))


def _turns_left(loop: _Loop) -> bool:
    points = np.array(loop)
    before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    return bool((turn >= -1e-12 * np.hypot(*before.T) * np.hypot(*after.T)).all())


def _is_convex(polygon: Any) -> bool:
    return bool(polygon.convex_hull.area - polygon.area <= 1e-9 * polygon.area)


def _corners(polygon: Any) -> FloatArray:
    """Vertices of the convex hull, counter-clockwise, without those on a straight side."""
    hull = shapely.orient_polygons(polygon.convex_hull)
    points = shapely.get_coordinates(hull)[:-1]
    before, after = points - np.roll(points, 1, axis=0), np.roll(points, -1, axis=0) - points
    turn = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    return np.asarray(points[turn > 1e-9 * np.hypot(*before.T) * np.hypot(*after.T)])
