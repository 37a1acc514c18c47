"""The plane shapes of a deck."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from ..errors import InputError
from .base import number, point
from .deck import DeckShape


@dataclass(frozen=True, kw_only=True, repr=False)
class Circle(DeckShape):
    """A disc.

    Parameters
    ----------
    radius : float
        Radius [m].
    center : sequence of 2 or 3 float
        Centre [m].
    """

    radius: float
    _type: ClassVar[str] = "circle"
    _center_node: ClassVar[bool] = True
    _scalable: ClassVar[tuple[str, ...]] = ("radius",)

    def _parameters(self) -> tuple[list[float], list[float]]:
        return [self.radius, *self.center], [self.radius]


@dataclass(frozen=True, kw_only=True, repr=False)
class Ellipse(DeckShape):
    """An ellipse.

    Parameters
    ----------
    a, b : float
        Half axes [m]; the first lies along x.
    angle : float
        Angle [rad] by which it is turned, counter-clockwise.
    center : sequence of 2 or 3 float
        Centre [m].
    """

    a: float
    b: float
    angle: float = 0.0
    _type: ClassVar[str] = "ellipse"
    _scalable: ClassVar[tuple[str, ...]] = ("a", "b")

    def _check(self) -> None:
        self._set(angle=number("Ellipse", "angle", self.angle, " in rad"))

    def _parameters(self) -> tuple[list[float], list[float]]:
        full = [self.a, self.b, *self.center, self.angle]
        return full, [] if self.angle else [self.a, self.b]


@dataclass(frozen=True, kw_only=True, repr=False)
class Square(DeckShape):
    """A square with sides along x and y.

    Parameters
    ----------
    side : float
        Length of its sides [m].
    center : sequence of 2 or 3 float
        Centre [m].
    """

    side: float
    _type: ClassVar[str] = "square"
    _scalable: ClassVar[tuple[str, ...]] = ("side",)

    def _parameters(self) -> tuple[list[float], list[float]]:
        return [self.side, *self.center], [self.side]


@dataclass(frozen=True, kw_only=True, repr=False)
class Rectangle(DeckShape):
    """A rectangle with sides along x and y.

    Parameters
    ----------
    width, height : float
        Sides [m] along x and y.
    center : sequence of 2 or 3 float
        Centre [m].
    """

    width: float
    height: float
    _type: ClassVar[str] = "rectangle"
    _scalable: ClassVar[tuple[str, ...]] = ("width", "height")

    @classmethod
    def between(cls, lower: Sequence[float], upper: Sequence[float]) -> Rectangle:
        """Make the rectangle between two corners.

        Parameters
        ----------
        lower, upper : sequence of 2 float
            Lower left and upper right corner [m].
        """
        (x0, y0, z0), (x1, y1, _) = corners("Rectangle", lower, upper)
        center = (0.5 * (x0 + x1), 0.5 * (y0 + y1), z0)
        return cls(width=x1 - x0, height=y1 - y0, center=center)

    def _parameters(self) -> tuple[list[float], list[float]]:
        x, y, z = self.center
        dx, dy = 0.5 * self.width, 0.5 * self.height
        return [x - dx, y - dy, z, x + dx, y + dy, z], [self.width, self.height]


@dataclass(frozen=True, kw_only=True, repr=False)
class Triangle(DeckShape):
    """An equilateral triangle.

    Parameters
    ----------
    radius : float
        Distance [m] of its corners from the centre.
    angle : float
        Direction [rad] of its first corner, from the x axis; it points up unless said otherwise.
    center : sequence of 2 or 3 float
        Centre [m].
    """

    radius: float
    angle: float = 0.5 * math.pi
    _type: ClassVar[str] = "triangle"
    _scalable: ClassVar[tuple[str, ...]] = ("radius",)

    def _check(self) -> None:
        self._set(angle=number("Triangle", "angle", self.angle, " in rad"))

    def _parameters(self) -> tuple[list[float], list[float]]:
        full = [self.radius, *self.center]
        if self.angle != 0.5 * math.pi:
            return full + axis_at(self.angle), []
        return full, [self.radius]


@dataclass(frozen=True, kw_only=True, repr=False)
class Hexagon(DeckShape):
    """A regular hexagon.

    Parameters
    ----------
    radius : float
        Distance [m] of its corners from the centre.
    angle : float
        Direction [rad] of its first corner, from the x axis.
    center : sequence of 2 or 3 float
        Centre [m].
    """

    radius: float
    angle: float = 0.0
    _type: ClassVar[str] = "hexagon"
    _center_node: ClassVar[bool] = True
    _scalable: ClassVar[tuple[str, ...]] = ("radius",)

    def _check(self) -> None:
        self._set(angle=number("Hexagon", "angle", self.angle, " in rad"))

    def _parameters(self) -> tuple[list[float], list[float]]:
        full = [self.radius, *self.center, *axis_at(self.angle)]
        return full, [] if self.angle else [self.radius]


@dataclass(frozen=True, kw_only=True, repr=False)
class ConcaveHexagon(DeckShape):
    """A hexagon drawn in at a neck; ``drum2d`` in decks.

    Four corners lie at 60 degrees from the axis, two on it, where the neck is.

    Parameters
    ----------
    radius : float
        Distance [m] of the four outer corners from the centre.
    neck : float
        Width [m] of the neck, below twice the radius. Decks have half of it.
    angle : float
        Direction [rad] across the neck, from the x axis.
    center : sequence of 2 or 3 float
        Centre [m].
    """

    radius: float
    neck: float
    angle: float = 0.0
    _type: ClassVar[str] = "drum2d"
    _center_node: ClassVar[bool] = True
    _scalable: ClassVar[tuple[str, ...]] = ("radius", "neck")

    def _check(self) -> None:
        self._set(angle=number("ConcaveHexagon", "angle", self.angle, " in rad"))
        if not self.neck < 2.0 * self.radius:
            raise InputError(
                f"ConcaveHexagon: neck = {self.neck:g}: must be below twice the radius = "
                f"{2.0 * self.radius:g}; give a smaller one"
            )

    def _parameters(self) -> tuple[list[float], list[float]]:
        half = 0.5 * self.neck
        full = [self.radius, half, *self.center]
        if self.angle:
            return full + axis_at(self.angle), []
        return full, [self.radius, half]


@dataclass(frozen=True, kw_only=True, repr=False)
class Annulus(DeckShape):
    """A ring between two circles; ``annulus_circle`` in decks.

    Parameters
    ----------
    inner_radius, outer_radius : float
        Radii [m].
    center : sequence of 2 or 3 float
        Centre [m].
    """

    inner_radius: float
    outer_radius: float
    _type: ClassVar[str] = "annulus_circle"
    _scalable: ClassVar[tuple[str, ...]] = ("inner_radius", "outer_radius")

    def _check(self) -> None:
        self._inner_below_outer("inner_radius", "outer_radius")

    def _parameters(self) -> tuple[list[float], list[float]]:
        radii = [self.inner_radius, self.outer_radius]
        return [*radii, *self.center], radii


@dataclass(frozen=True, kw_only=True, repr=False)
class AnnulusRectangle(DeckShape):
    """A rectangular frame around a rectangle of the same centre.

    Parameters
    ----------
    inner_width, inner_height : float
        Sides [m] of the opening.
    outer_width, outer_height : float
        Sides [m] of the frame.
    center : sequence of 2 or 3 float
        Centre [m].
    """

    inner_width: float
    inner_height: float
    outer_width: float
    outer_height: float
    _type: ClassVar[str] = "annulus_rectangle"
    _scalable: ClassVar[tuple[str, ...]] = (
        "inner_width",
        "inner_height",
        "outer_width",
        "outer_height",
    )

    def _check(self) -> None:
        self._inner_below_outer("inner_width", "outer_width")
        self._inner_below_outer("inner_height", "outer_height")

    def _parameters(self) -> tuple[list[float], list[float]]:
        sides = [self.inner_width, self.inner_height, self.outer_width, self.outer_height]
        return [*sides, *self.center], sides


def axis_at(angle: float) -> list[float]:
    """Return the unit vector of a direction in the xy plane, as decks have it."""
    return [math.cos(angle), math.sin(angle), 0.0]


def corners(
    where: str, lower: Sequence[float], upper: Sequence[float]
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Return two corners of two or three coordinates [m] as three floats each."""
    return point(where, "lower", lower), point(where, "upper", upper)
