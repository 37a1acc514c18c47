"""Line, box (rectangle to cuboid), ball (circle, sphere), ellipse, polygon, cylinder."""
# ruff: noqa: D102 - the members are documented once, in Shape

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .base import (
    FUZZ,
    MARGIN,
    BoolArray,
    FloatArray,
    Shape,
    at_most,
    box_outline,
    circle_outline,
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Line(Shape):
    """Segment between two points, each of shape (3,) [m]."""

    start: FloatArray
    end: FloatArray

    @property
    def dimension(self) -> int:
        return 1

    @property
    def center(self) -> FloatArray:
        return 0.5 * (self.start + self.end)

    @property
    def bounding_radius(self) -> float:
        return 0.5 * self.volume

    @property
    def box(self) -> tuple[FloatArray, FloatArray]:
        return np.minimum(self.start, self.end), np.maximum(self.start, self.end)

    @property
    def volume(self) -> float:
        return float(np.linalg.norm(self.end - self.start))

    def contains(self, points: FloatArray, *, strict: bool = False) -> BoolArray:
        tolerance = MARGIN + FUZZ * self.volume
        axis = (self.end - self.start) / self.volume
        along = (points - self.start) @ axis
        across = np.linalg.norm(points - self.start - np.outer(along, axis), axis=1)
        grow = -tolerance if strict else tolerance
        in_range = (along >= -grow) & (along <= self.volume + grow)
        return np.asarray(in_range & (across <= tolerance))

    def boundary(self) -> FloatArray:
        return np.array([self.start, self.end, self.start])


@dataclass(frozen=True, kw_only=True, eq=False)
class Box(Shape):
    """Axis-parallel rectangle (``axes=2``) or cuboid (``axes=3``) between two corners."""

    lower: FloatArray
    upper: FloatArray
    axes: int

    @property
    def dimension(self) -> int:
        return self.axes

    @property
    def center(self) -> FloatArray:
        return 0.5 * (self.lower + self.upper)

    @property
    def sides(self) -> FloatArray:
        """Side lengths, shape (axes,) [m]."""
        return (self.upper - self.lower)[: self.axes]

    @property
    def bounding_radius(self) -> float:
        return 0.5 * float(np.linalg.norm(self.sides))

    @property
    def box(self) -> tuple[FloatArray, FloatArray]:
        return self.lower.copy(), self.upper.copy()

    @property
    def volume(self) -> float:
        return float(np.prod(self.sides))

    def contains(self, points: FloatArray, *, strict: bool = False) -> BoolArray:
        p, lower, upper = points[:, : self.axes], self.lower[: self.axes], self.upper[: self.axes]
        above = at_most(-p, -lower, strict=strict)
        below = at_most(p, upper, strict=strict)
        return np.asarray((above & below).all(axis=1))

    def boundary(self) -> FloatArray:
        return box_outline(self.lower, self.upper)


@dataclass(frozen=True, kw_only=True, eq=False)
class Ball(Shape):
    """Circle (``axes=2``) or sphere (``axes=3``)."""

    radius: float
    middle: FloatArray
    axes: int

    @property
    def dimension(self) -> int:
        return self.axes

    @property
    def center(self) -> FloatArray:
        return np.array(self.middle)

    @property
    def bounding_radius(self) -> float:
        return self.radius

    @property
    def box(self) -> tuple[FloatArray, FloatArray]:
        reach = np.zeros(3)
        reach[: self.axes] = self.radius
        return self.middle - reach, self.middle + reach

    @property
    def volume(self) -> float:
        r = self.radius
        return float(np.pi * r**2 if self.axes == 2 else 4.0 / 3.0 * np.pi * r**3)

    def contains(self, points: FloatArray, *, strict: bool = False) -> BoolArray:
        distance = np.linalg.norm((points - self.middle)[:, : self.axes], axis=1)
        return at_most(distance, self.radius, strict=strict)

    def boundary(self) -> FloatArray:
        return circle_outline(self.middle, self.radius, self.radius, 0.0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Ellipse(Shape):
    """Ellipse with half axes `a`, `b` [m], the first turned by `angle` [rad] from x."""

    a: float
    b: float
    middle: FloatArray
    angle: float

    @property
    def dimension(self) -> int:
        return 2

    @property
    def center(self) -> FloatArray:
        return np.array(self.middle)

    @property
    def bounding_radius(self) -> float:
        return max(self.a, self.b)

    @property
    def box(self) -> tuple[FloatArray, FloatArray]:
        c, s = np.cos(self.angle), np.sin(self.angle)
        reach = np.array([np.hypot(self.a * c, self.b * s), np.hypot(self.a * s, self.b * c), 0.0])
        return self.middle - reach, self.middle + reach

    @property
    def volume(self) -> float:
        return float(np.pi * self.a * self.b)

    def contains(self, points: FloatArray, *, strict: bool = False) -> BoolArray:
        d = points - self.middle
        c, s = np.cos(self.angle), np.sin(self.angle)
        u, v = c * d[:, 0] + s * d[:, 1], c * d[:, 1] - s * d[:, 0]
        # a length, so that the absolute margin means the same as for a circle
        small = min(self.a, self.b)
        return at_most(small * np.hypot(u / self.a, v / self.b), small, strict=strict)

    def boundary(self) -> FloatArray:
        return circle_outline(self.middle, self.a, self.b, self.angle)


@dataclass(frozen=True, kw_only=True, eq=False)
class Polygon(Shape):
    """Simple polygon: triangle, hexagon, the concave drum2d.

    Attributes
    ----------
    radius : float
        Distance [m] of the farthest vertices from the centre.
    middle : ndarray, shape (3,)
        Centre [m].
    vertices : ndarray, shape (k, 3)
        Counter-clockwise; the first lies on the axis (drum2d: the neck does).
    """

    radius: float
    middle: FloatArray
    vertices: FloatArray

    @property
    def dimension(self) -> int:
        return 2

    @property
    def center(self) -> FloatArray:
        return np.array(self.middle)

    @property
    def bounding_radius(self) -> float:
        return self.radius

    @property
    def box(self) -> tuple[FloatArray, FloatArray]:
        return self.vertices.min(axis=0), self.vertices.max(axis=0)

    @property
    def volume(self) -> float:
        x, y = (self.vertices - self.middle)[:, :2].T
        return 0.5 * abs(float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)))

    def contains(self, points: FloatArray, *, strict: bool = False) -> BoolArray:
        x, y = points[:, 0], points[:, 1]
        odd = np.zeros(len(points), dtype=bool)
        distance2 = np.full(len(points), np.inf)
        for (ax, ay, _), (bx, by, _) in zip(
            self.vertices, np.roll(self.vertices, -1, axis=0), strict=True
        ):
            ex, ey = bx - ax, by - ay
            # ray to +x: count edges that straddle the point's y and lie to its right
            straddles = (ay > y) != (by > y)
            right_of = ((x - ax) * ey - (y - ay) * ex) * (1.0 if ey > 0 else -1.0) < 0.0
            odd ^= straddles & right_of
            t = np.clip(((x - ax) * ex + (y - ay) * ey) / (ex * ex + ey * ey), 0.0, 1.0)
            np.minimum(distance2, (x - ax - t * ex) ** 2 + (y - ay - t * ey) ** 2, out=distance2)
        on_edge = distance2 <= (MARGIN + FUZZ * self.radius) ** 2
        return np.asarray(odd & ~on_edge if strict else odd | on_edge)

    def boundary(self) -> FloatArray:
        return np.vstack([self.vertices, self.vertices[:1]])


@dataclass(frozen=True, kw_only=True, eq=False)
class Cylinder(Shape):
    """Right circular cylinder from the centre of its base along `axis` (its length) [m]."""

    radius: float
    base: FloatArray
    axis: FloatArray

    @property
    def dimension(self) -> int:
        return 3

    @property
    def length(self) -> float:
        """Height of the cylinder [m]."""
        return float(np.linalg.norm(self.axis))

    @property
    def center(self) -> FloatArray:
        return self.base + 0.5 * self.axis

    @property
    def bounding_radius(self) -> float:
        return float(np.hypot(self.radius, 0.5 * self.length))

    @property
    def box(self) -> tuple[FloatArray, FloatArray]:
        n = self.axis / self.length
        reach = self.radius * np.sqrt(np.maximum(0.0, 1.0 - n * n))
        ends = np.array([self.base, self.base + self.axis])
        return ends.min(axis=0) - reach, ends.max(axis=0) + reach

    @property
    def volume(self) -> float:
        return float(np.pi * self.radius**2 * self.length)

    def contains(self, points: FloatArray, *, strict: bool = False) -> BoolArray:
        n = self.axis / self.length
        d = points - self.center
        along = d @ n
        across = np.linalg.norm(d - np.outer(along, n), axis=1)
        in_height = at_most(np.abs(along), 0.5 * self.length, strict=strict)
        return np.asarray(in_height & at_most(across, self.radius, strict=strict))

    def boundary(self) -> FloatArray:
        return box_outline(*self.box)
