"""Any region of the plane with straight edges."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..geometry import Region
from ..geometry.base import FloatArray
from .base import BodyShape, Point, factor_of, length, number, point, points_of

_COINCIDENT = 1e-9  # of the polygon's size


@dataclass(frozen=True, kw_only=True, repr=False)
class Polygon(BodyShape):
    """A simple polygon, with holes where given.

    It stays where its points are; `centered` moves its centroid to the origin, where bodies
    that are placed and turned should have it.

    Parameters
    ----------
    points : sequence of points, shape (n, 2)
        Corners [m], one after the other, in either sense; edges must not cross.
    holes : sequence of sequences of points
        Corners [m] of each hole; holes lie inside and apart from each other.
    """

    points: ArrayLike
    holes: Sequence[ArrayLike] = ()

    def __post_init__(self) -> None:
        outer = _loop("points", self.points, turns=1)
        if isinstance(self.holes, str) or not hasattr(self.holes, "__len__"):
            raise InputError(
                f"Polygon: holes = {self.holes!r:.60}: must be a list of lists of points; "
                "give [[(x, y), ...], ...]"
            )
        holes = [_loop(f"holes[{k}]", hole, turns=-1) for k, hole in enumerate(self.holes)]
        _check_valid(outer, holes)
        self._set(points=_tuples(outer), holes=tuple(_tuples(hole) for hole in holes))

    @classmethod
    def regular(cls, *, corners: int, radius: float, angle: float = 0.0) -> Polygon:
        """Make a regular polygon about the origin.

        Parameters
        ----------
        corners : int
            Number of corners, at least 3.
        radius : float
            Distance [m] of the corners from the centre.
        angle : float
            Direction [rad] of the first corner, from the x axis.
        """
        if isinstance(corners, bool) or not isinstance(corners, (int, np.integer)) or corners < 3:
            raise InputError(f"Polygon: corners = {corners!r}: must be an integer of at least 3")
        r = length("Polygon", "radius", radius)
        turn = number("Polygon", "angle", angle, " in rad")
        angles = turn + 2.0 * np.pi * np.arange(corners) / corners
        return cls(
            points=_tuples(r * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles]))
        )

    @cached_property
    def geometry(self) -> Region:
        """The region of space it fills: centre (centroid), bounding radius, area, and so on."""
        outline = np.array(self.points)
        region = Region(
            type="polygon", outline=outline, holes=tuple(np.array(hole) for hole in self.holes)
        )
        return Region(
            type="polygon",
            outline=region.outline,
            holes=region.holes,
            scale_length=region.bounding_radius,
        )

    def scaled(self, factor: float) -> Polygon:
        """Return the shape with all coordinates times `factor` (positive)."""
        s = factor_of("Polygon", factor)
        return self._changed(lambda loop: s * np.array(loop))

    def moved(self, by: Sequence[float]) -> Polygon:
        """Return the shape moved by 2 or 3 components [m]."""
        shift = np.array(point("Polygon", "by", by))
        return self._changed(lambda loop: np.array(loop) + shift)

    def _changed(self, change: Any) -> Polygon:
        return Polygon(
            points=_tuples(change(self.points)),
            holes=tuple(_tuples(change(hole)) for hole in self.holes),
        )


def _tuples(points: FloatArray) -> tuple[Point, ...]:
    return tuple((x, y, z) for x, y, z in points.tolist())


def _loop(name: str, values: ArrayLike, *, turns: int) -> FloatArray:
    """Check the corners of a loop and order them counter-clockwise (or clockwise for -1)."""
    points = points_of("Polygon", name, values)
    size = float(np.ptp(points, axis=0).max())
    if len(points) > 3 and np.linalg.norm(points[0] - points[-1]) <= _COINCIDENT * size:
        points = points[:-1]  # closed explicitly
    if len(points) < 3:
        raise InputError(f"Polygon: {name}: {len(points)} corners: must be at least 3; add some")
    if np.ptp(points[:, 2]) > 0.0:
        raise InputError(
            f"Polygon: {name}: z must be the same for all corners; give (x, y), or use Polyhedron"
        )
    length("Polygon", f"size of {name}", size)
    steps = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    k = int(np.argmin(steps))
    if steps[k] <= _COINCIDENT * size:
        raise InputError(
            f"Polygon: {name}[{k}] and the next coincide at {tuple(points[k].tolist())}: corners "
            "must differ; leave one out"
        )
    x, y = (points - points.mean(axis=0))[:, :2].T
    area = 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
    return points if area * turns >= 0.0 else points[::-1].copy()


def _check_valid(outer: FloatArray, holes: list[FloatArray]) -> None:
    import shapely
    from shapely.validation import explain_validity

    polygon = shapely.Polygon(outer[:, :2], [hole[:, :2] for hole in holes])
    size = float(np.ptp(outer, axis=0).max())
    if not polygon.convex_hull.area > _COINCIDENT * size**2:
        raise InputError("Polygon: points: the corners lie on a line: there is no area; move one")
    if not polygon.is_valid:
        what, _, place = explain_validity(polygon).rstrip("]").partition("[")
        raise InputError(
            f"Polygon: points: {what.lower()} at ({', '.join(place.split())}): edges must not "
            "cross or touch, and holes must lie inside and apart; list the corners in order "
            "around the shape"
        )
