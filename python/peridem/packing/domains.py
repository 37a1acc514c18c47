"""What is packed into: hoppers, and what a domain may be given as."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import InputError
from ..geometry import Shape
from ..geometry.base import BoolArray, FloatArray, at_most, circle_outline, join_loops
from ..geometry.primitives import Box, Polygon
from .arguments import checked_init, integer, number, vector
from .outlines import geometry_of


@checked_init
@dataclass(frozen=True)
class Hopper:
    """A bin on a funnel, standing on its outlet: plane, or round about the vertical in 3D.

    Parameters
    ----------
    width : float
        Width (diameter in 3D) of the bin [m].
    outlet : float
        Width (diameter) of the outlet [m].
    funnel_height : float
        Height of the funnel [m], from the outlet to the bin.
    height : float
        Height of all of it [m].
    dimension : int
        2 (up is y) or 3 (up is z).
    at : tuple of float
        Middle of the outlet [m].

    Raises
    ------
    InputError
        If a length is not positive, the outlet is wider than the bin or the funnel too high.

    Examples
    --------
    >>> Hopper(width=0.1, outlet=0.02, funnel_height=0.05, height=0.15).geometry.volume
    0.013
    """

    width: float
    outlet: float
    funnel_height: float
    height: float
    dimension: int = 2
    at: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        number("Hopper", "width", self.width, above=0, remedy="give a length in m")
        remedy = f"give a length in m up to the width {self.width:g}"
        number("Hopper", "outlet", self.outlet, above=0, most=self.width, remedy=remedy)
        number("Hopper", "height", self.height, above=0, remedy="give a length in m")
        remedy = f"give a length in m up to the height {self.height:g}"
        number("Hopper", "funnel_height", self.funnel_height, above=0, most=self.height,
               remedy=remedy)  # fmt: skip
        d = integer("Hopper", "dimension", self.dimension, least=2, remedy="give 2 or 3")
        if d > 3:
            raise InputError(f"Hopper: dimension = {d}: must be 2 or 3; correct it")
        at = vector("Hopper", "at", self.at if len(self.at) else (0.0,) * d, d)
        object.__setattr__(self, "at", tuple(at.tolist()))

    @cached_property
    def geometry(self) -> Shape:
        """The inside as a shape."""
        heights = np.array([0.0, self.funnel_height, self.height])
        widths = 0.5 * np.array([self.outlet, self.width, self.width])
        if self.funnel_height == self.height:
            heights, widths = heights[:2], widths[:2]
        if self.dimension == 3:
            base = np.array(self.at)
            return Funnel(type="hopper", base=base, heights=heights, radii=widths)
        right = np.column_stack([widths, heights, np.zeros_like(heights)])
        left = right[::-1] * (-1.0, 1.0, 1.0)
        middle = np.array([self.at[0], self.at[1] + 0.5 * self.height, 0.0])
        vertices = np.vstack([right, left]) + np.array([*self.at, 0.0])
        reach = float(np.linalg.norm(vertices - middle, axis=1).max())
        return Polygon(type="hopper", radius=reach, middle=middle, vertices=vertices)


@dataclass(frozen=True, kw_only=True, eq=False)
class Funnel(Shape):
    """Body of revolution about the vertical z: frusta of cones, one on the other.

    Attributes
    ----------
    base : ndarray, shape (3,)
        Middle of the lower end [m].
    heights, radii : ndarray, shape (k,)
        Radius [m] at each height [m] above the base, linear in between.
    """

    base: FloatArray
    heights: FloatArray
    radii: FloatArray

    @property
    def dimension(self) -> int:
        """Always 3."""
        return 3

    @property
    def center(self) -> FloatArray:
        """Middle of the axis [m]."""
        return np.asarray(self.base + np.array([0.0, 0.0, 0.5 * self.heights[-1]]))

    @property
    def bounding_radius(self) -> float:
        """Radius [m] about the centre."""
        return float(np.hypot(self.radii, self.heights - 0.5 * self.heights[-1]).max())

    @property
    def box(self) -> tuple[FloatArray, FloatArray]:
        """Lower and upper corner [m]."""
        r = self.radii.max()
        top = float(self.heights[-1])
        return self.base - np.array([r, r, 0.0]), self.base + np.array([r, r, top])

    @property
    def volume(self) -> float:
        """Volume of the frusta [m^3]."""
        r, s = self.radii[:-1], self.radii[1:]
        return float(np.sum(math.pi / 3.0 * np.diff(self.heights) * (r * r + r * s + s * s)))

    def contains(self, points: FloatArray, *, strict: bool = False) -> BoolArray:
        """Tell which points lie inside."""
        d = points - self.base
        limit = np.interp(d[:, 2], self.heights, self.radii)
        inside = at_most(np.hypot(d[:, 0], d[:, 1]), limit, strict=strict)
        above = at_most(-d[:, 2], 0.0, strict=strict)
        return np.asarray(inside & above & at_most(d[:, 2], self.heights[-1], strict=strict))

    def boundary(self) -> FloatArray:
        """Circles of the bin and the outlet, seen from above."""
        ends = {float(self.radii[0]), float(self.radii.max())}
        return join_loops([circle_outline(self.base, r, r, 0.0) for r in sorted(ends)])


def domain_of(where: str, domain: Any) -> Shape:
    """Return the geometry of a domain.

    Parameters
    ----------
    where : str
        Function that asks, for the error message.
    domain : shape, or pair of points
        A shape with a geometry, a geometry, or two corners of a rectangle or box [m].

    Raises
    ------
    InputError
        If it is neither, or has no inside.
    """
    if isinstance(domain, (tuple, list, np.ndarray)):
        return _between_corners(where, domain)
    try:
        shape = geometry_of(where, domain)
    except InputError:
        raise InputError(
            f"{where}: domain = {domain!r}: must be a shape, or two corners such as "
            "((0, 0), (0.1, 0.05)); give one"
        ) from None
    if shape.dimension < 2 or not shape.volume > 0.0:
        raise InputError(f"{where}: domain = {domain!r}: has no inside; give an area or a volume")
    return shape


def _between_corners(where: str, corners: Any) -> Shape:
    try:
        array = np.asarray(corners, dtype=float)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape not in ((2, 2), (2, 3)) or not np.isfinite(array).all():
        raise InputError(
            f"{where}: domain = {corners!r}: must be two points of two or three numbers; "
            "give for instance ((0, 0), (0.1, 0.05)), in m"
        )
    if not (array[0] < array[1]).all():
        raise InputError(
            f"{where}: domain = {corners!r}: the first corner must be below the second on "
            "every axis; swap them"
        )
    d = array.shape[1]
    lower, upper = np.zeros(3), np.zeros(3)
    lower[:d], upper[:d] = array
    return Box(type="rectangle" if d == 2 else "cuboid", lower=lower, upper=upper, axes=d)
