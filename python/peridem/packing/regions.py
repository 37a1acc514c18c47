"""Walls of a domain as the packing sees them: how far a ball sticks out, and the way back in."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
import shapely

from ..geometry import Shape
from ..geometry.base import FloatArray
from ..geometry.primitives import Ball, Box, Cylinder
from .domains import Funnel
from .outlines import polygon_of
from .pairs import IndexArray

_DIRECTIONS, _WIDER = 400, 1.01
"""Points asked on a ball, and how much wider it is taken: a flat wall between them is felt."""


class Region(ABC):
    """The inside of a domain.

    Attributes
    ----------
    shape : Shape
        The domain.
    polygon : shapely geometry or None
        In the plane, the domain as its boundary is drawn.
    corners : ndarray, shape (k, d)
        Corners [m] that stick into the domain.
    """

    def __init__(self, shape: Shape) -> None:
        self.shape = shape
        self.dimension = shape.dimension
        self.polygon: Any = polygon_of(shape) if self.dimension == 2 else None
        self.corners: FloatArray = np.empty((0, self.dimension))

    @property
    def measure(self) -> float:
        """Area [m^2] or volume [m^3]."""
        return float(self.shape.volume)

    @property
    def box(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper corner, each of shape (d,) [m]."""
        lower, upper = self.shape.box
        return lower[: self.dimension], upper[: self.dimension]

    @abstractmethod
    def push(self, centers: FloatArray, radii: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return how far balls stick out [m], negative inside, and the way back in.

        Parameters
        ----------
        centers : ndarray, shape (m, d)
        radii : ndarray, shape (m,)

        Returns
        -------
        depth : ndarray, shape (m,)
        normal : ndarray, shape (m, d)
        """

    def walls(
        self, centers: FloatArray, radii: FloatArray
    ) -> tuple[IndexArray, FloatArray, FloatArray]:
        """Return every wall that a ball sticks out of: which ball, how far [m], the way back in.

        Unlike `push`, which names the worst, this changes smoothly as a ball moves in a corner.
        """
        depth, normal = self.push(centers, radii)
        out = np.flatnonzero(depth > 0.0)
        return out, depth[out], normal[out]

    def sample(self, rng: np.random.Generator, count: int) -> FloatArray:
        """Return `count` points, uniform over the region, shape (count, d) [m]."""
        lower, upper = self.box
        found: list[FloatArray] = []
        total = 0
        for _ in range(1000):
            points = lower + (upper - lower) * rng.random((2 * count + 16, self.dimension))
            depth, _normal = self.push(points, np.zeros(len(points)))
            found.append(points[depth <= 0.0])
            total += len(found[-1])
            if total >= count:
                break
        return np.vstack(found)[:count]


class _Planes(Region):
    """Convex: between planes ``normal . x <= offset``, normals outward."""

    def __init__(self, shape: Shape, normals: FloatArray, offsets: FloatArray) -> None:
        super().__init__(shape)
        self.normals, self.offsets = normals, offsets

    def push(self, centers: FloatArray, radii: FloatArray) -> tuple[FloatArray, FloatArray]:
        height = centers @ self.normals.T - self.offsets
        worst = height.argmax(axis=1)
        return height[np.arange(len(worst)), worst] + radii, -self.normals[worst]

    def walls(
        self, centers: FloatArray, radii: FloatArray
    ) -> tuple[IndexArray, FloatArray, FloatArray]:
        depth = centers @ self.normals.T - self.offsets + radii[:, None]
        out, wall = np.nonzero(depth > 0.0)
        return out, depth[out, wall], -self.normals[wall]


class _Round(Region):
    """Disc or sphere."""

    def __init__(self, shape: Ball) -> None:
        super().__init__(shape)
        self.middle, self.radius = shape.center[: shape.dimension], shape.radius

    def push(self, centers: FloatArray, radii: FloatArray) -> tuple[FloatArray, FloatArray]:
        d = centers - self.middle
        distance = np.sqrt((d * d).sum(axis=1))
        return distance + radii - self.radius, -d / np.where(distance > 0, distance, 1.0)[:, None]


class _Revolved(Region):
    """Convex body of revolution: planes in the half-plane of distance from and along the axis."""

    def __init__(
        self, shape: Shape, base: FloatArray, axis: FloatArray, profile: FloatArray
    ) -> None:
        super().__init__(shape)
        self.base, self.axis = base, axis
        # from the foot of the axis along the wall to its top; the axis itself is no wall
        edge = np.diff(profile, axis=0)
        edge = edge / np.linalg.norm(edge, axis=1)[:, None]
        self.normals = np.column_stack([edge[:, 1], -edge[:, 0]])
        self.offsets = (self.normals * profile[:-1]).sum(axis=1)

    def _heights(self, centers: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Height over each wall, and the direction away from the axis."""
        d = centers - self.base
        along = d @ self.axis
        outward = d - np.outer(along, self.axis)
        rho = np.sqrt((outward * outward).sum(axis=1))
        outward = outward / np.where(rho > 0, rho, 1.0)[:, None]
        return np.column_stack([rho, along]) @ self.normals.T - self.offsets, outward

    def _inward(self, wall: IndexArray, outward: FloatArray) -> FloatArray:
        n = self.normals[wall]
        return -(n[:, :1] * outward + np.outer(n[:, 1], self.axis))

    def push(self, centers: FloatArray, radii: FloatArray) -> tuple[FloatArray, FloatArray]:
        height, outward = self._heights(centers)
        worst = height.argmax(axis=1)
        return height[np.arange(len(worst)), worst] + radii, self._inward(worst, outward)

    def walls(
        self, centers: FloatArray, radii: FloatArray
    ) -> tuple[IndexArray, FloatArray, FloatArray]:
        height, outward = self._heights(centers)
        depth = height + radii[:, None]
        out, wall = np.nonzero(depth > 0.0)
        return out, depth[out, wall], self._inward(wall, outward[out])


class _Outlined(Region):
    """Any plane region: distance to the nearest side."""

    def __init__(self, shape: Shape) -> None:
        super().__init__(shape)
        polygon = shapely.orient_polygons(self.polygon)
        starts, ends, corners = [], [], []
        for part in shapely.get_parts(polygon):
            for ring in (part.exterior, *part.interiors):
                p = shapely.get_coordinates(ring)[:-1]
                before, after = p - np.roll(p, 1, axis=0), np.roll(p, -1, axis=0) - p
                starts.append(p)
                ends.append(p + after)
                corners.append(p[before[:, 0] * after[:, 1] < before[:, 1] * after[:, 0]])
        self.start, self.corners = np.vstack(starts), np.vstack(corners)
        edge = np.vstack(ends) - self.start
        self.length = np.hypot(*edge.T)
        self.edge = edge / self.length[:, None]
        shapely.prepare(self.polygon)

    def push(self, centers: FloatArray, radii: FloatArray) -> tuple[FloatArray, FloatArray]:
        d = centers[:, None] - self.start
        along = (d * self.edge).sum(axis=2).clip(0.0, self.length)
        away = d - along[..., None] * self.edge
        squared = (away**2).sum(axis=2)
        nearest = squared.argmin(axis=1)
        rows = np.arange(len(centers))
        distance, away = np.sqrt(squared[rows, nearest]), away[rows, nearest]
        inside = shapely.contains_xy(self.polygon, centers)
        # on a side the direction is that of its inner normal (sides run counter-clockwise)
        t = self.edge[nearest]
        normal = np.column_stack([-t[:, 1], t[:, 0]])
        apart = distance > 1e-12 * self.length[nearest]
        sign = np.where(inside, 1.0, -1.0)
        normal[apart] = (sign[:, None] * away)[apart] / distance[apart, None]
        return radii - sign * distance, normal


class _Probed(Region):
    """Any other solid, known by the points it contains: asks points on each ball.

    A ball that sticks out by a cap of the height h has the part h / (2 r) of its surface outside.
    Sharp edges that point inwards may slip in between the points, by up to a tenth of the radius.
    """

    def __init__(self, shape: Shape) -> None:
        super().__init__(shape)
        k = np.arange(_DIRECTIONS) + 0.5
        z = 1.0 - 2.0 * k / _DIRECTIONS
        turn = np.pi * (1.0 + 5.0**0.5) * k
        rho = np.sqrt(1.0 - z * z)
        self.directions = np.column_stack([rho * np.cos(turn), rho * np.sin(turn), z])

    def push(self, centers: FloatArray, radii: FloatArray) -> tuple[FloatArray, FloatArray]:
        radii = _WIDER * radii
        points = centers[:, None] + radii[:, None, None] * self.directions
        inside = self.shape.inside(points.reshape(-1, 3)).reshape(len(centers), -1)
        home = np.asarray(self.shape.center) - centers
        normal = (inside[..., None] * self.directions).sum(axis=1)
        lost = ~inside.any(axis=1)
        normal[lost] = home[lost]
        length = np.linalg.norm(normal, axis=1)
        part = 1.0 - inside.mean(axis=1)
        depth = np.where(part > 0.0, 2.0 * part * np.maximum(radii, 1e-300), -1e-300)
        depth[lost] = np.maximum(radii, np.linalg.norm(home, axis=1))[lost]
        return depth, normal / np.where(length > 0, length, 1.0)[:, None]


def region_of(shape: Shape) -> Region:
    """Return the walls of a domain."""
    d = shape.dimension
    if isinstance(shape, Box):
        normals = np.vstack([np.eye(d), -np.eye(d)])
        lower, upper = shape.box
        return _Planes(shape, normals, np.concatenate([upper[:d], -lower[:d]]))
    if isinstance(shape, Ball):
        return _Round(shape)
    return _plane_region(shape) if d == 2 else _solid_region(shape)


def _solid_region(shape: Shape) -> Region:
    if isinstance(shape, Cylinder):
        r, h = shape.radius, shape.length
        profile = np.array([(0.0, 0.0), (r, 0.0), (r, h), (0.0, h)])
        return _Revolved(shape, shape.base, shape.axis / h, profile)
    if isinstance(shape, Funnel):
        wall = np.column_stack([shape.radii, shape.heights])
        profile = np.vstack([(0.0, 0.0), wall, (0.0, shape.heights[-1])])
        return _Revolved(shape, shape.base, np.array([0.0, 0.0, 1.0]), profile)
    return _Probed(shape)


def _plane_region(shape: Shape) -> Region:
    polygon = polygon_of(shape)
    if polygon.geom_type == "Polygon" and polygon.convex_hull.area <= (1 + 1e-12) * polygon.area:
        p = shapely.get_coordinates(shapely.orient_polygons(polygon.convex_hull))
        edge = np.diff(p, axis=0)
        edge = edge / np.hypot(*edge.T)[:, None]
        normals = np.column_stack([edge[:, 1], -edge[:, 0]])
        return _Planes(shape, normals, (normals * p[:-1]).sum(axis=1))
    return _Outlined(shape)
