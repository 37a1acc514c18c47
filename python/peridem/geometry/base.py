"""What every shape can answer, and the fuzzy comparison shared by all of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

MARGIN = 1e-12
"""Absolute margin [m] by which a shape is grown before a point is tested."""

FUZZ = 1e-5
"""``a < b`` holds when ``b - a > FUZZ * max(|a|, |b|)``."""


def at_most(a: ArrayLike, b: ArrayLike, *, strict: bool = False) -> BoolArray:
    """Compare fuzzily: ``a <= b`` with margin, or ``a < b`` beyond it.

    Parameters
    ----------
    a, b : array_like, broadcastable
        Values [m].
    strict : bool
        Ask that `a` lies below `b` by more than margin and fuzz.

    Returns
    -------
    ndarray of bool
    """
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    limit = b - MARGIN if strict else b + MARGIN
    slack = FUZZ * np.maximum(np.abs(a), np.abs(limit))
    return np.asarray(limit - a > slack if strict else a - limit <= slack)


@dataclass(frozen=True, kw_only=True, eq=False)
class Shape(ABC):
    """A region of space: the outline of a body, a region of a load, a container.

    Two-dimensional shapes lie in the xy plane and ignore the z of a point.

    Attributes
    ----------
    type : str
        The name the shape has in a deck.
    scale_length : float or None
        Leading length [m]; a body with radius `r` in the placement file is the reference
        mesh scaled by ``r / scale_length``. None for shapes that cannot be scaled so.
    """

    type: str
    scale_length: float | None = None

    @property
    @abstractmethod
    def dimension(self) -> int:
        """Dimension of the shape: 1, 2 or 3."""

    @property
    @abstractmethod
    def center(self) -> FloatArray:
        """Centre of the shape, shape (3,) [m]."""

    @property
    @abstractmethod
    def bounding_radius(self) -> float:
        """Radius [m] about `center` that encloses the shape."""

    @property
    @abstractmethod
    def box(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper corner of the enclosing box, each of shape (3,) [m]."""

    @property
    @abstractmethod
    def volume(self) -> float:
        """Length [m], area [m^2] or volume [m^3] in dimension 1, 2, 3."""

    @abstractmethod
    def contains(self, points: FloatArray, *, strict: bool = False) -> BoolArray:
        """Tell which points, shape (n, 3), lie in the closed (strict: open) shape."""

    @abstractmethod
    def boundary(self) -> FloatArray:
        """Return the closed outline in the xy plane, shape (k, 3) [m], for pictures.

        Several loops are separated by a row of NaN; solids give the outline of their
        projection along z.
        """

    def inside(self, points: ArrayLike) -> BoolArray:
        """Tell which points lie in the shape, its boundary included.

        Parameters
        ----------
        points : array_like, shape (n, 3)
            Positions [m].

        Returns
        -------
        ndarray of bool, shape (n,)
        """
        with np.errstate(over="ignore"):  # an infinite distance is outside
            return self.contains(as_points(points))


def as_points(points: ArrayLike) -> FloatArray:
    """Return `points` as a float array of shape (n, 3).

    Raises
    ------
    ValueError
        If the array has another shape.
    """
    array = np.atleast_2d(np.asarray(points, dtype=float))
    if array.ndim != 2 or array.shape[1] != 3:
        raise ValueError(f"points must have shape (n, 3), got {array.shape}")
    return array


def circle_outline(center: FloatArray, a: float, b: float, angle: float) -> FloatArray:
    """Return a closed polyline, shape (129, 3), of an ellipse with half axes `a`, `b` [m]."""
    t = np.linspace(0.0, 2.0 * np.pi, 129)
    u, v = a * np.cos(t), b * np.sin(t)
    c, s = np.cos(angle), np.sin(angle)
    outline = np.column_stack([c * u - s * v, s * u + c * v, np.zeros_like(t)])
    return np.asarray(center + outline)


def box_outline(lower: FloatArray, upper: FloatArray) -> FloatArray:
    """Return a closed polyline, shape (5, 3), of the box's projection along z."""
    (x0, y0, z), (x1, y1) = lower, upper[:2]
    return np.array([[x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z], [x0, y0, z]])


def join_loops(loops: list[FloatArray]) -> FloatArray:
    """Stack closed polylines, a row of NaN between them."""
    gap = np.full((1, 3), np.nan)
    rows = [row for loop in loops for row in (loop, gap)]
    return np.vstack(rows[:-1])
