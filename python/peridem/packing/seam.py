"""Shapes made here: the one place that names the public classes of `peridem.shapes`."""

from __future__ import annotations

from typing import Any

from ..geometry.base import FloatArray


def polygon_shape(points: FloatArray) -> Any:
    """Return a polygon with corners `points`, shape (k, 2) [m], counter-clockwise."""
    from ..shapes import Polygon

    return Polygon(points=points.tolist())


def polyhedron_shape(points: FloatArray) -> Any:
    """Return the convex polyhedron with corners `points`, shape (k, 3) [m]."""
    from ..shapes import Polyhedron

    return Polyhedron.convex_hull(points)
