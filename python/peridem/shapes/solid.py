"""The solids of a deck."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from ..errors import InputError
from .base import point
from .deck import DeckShape
from .plane import corners


@dataclass(frozen=True, kw_only=True, repr=False)
class Sphere(DeckShape):
    """A ball.

    Parameters
    ----------
    radius : float
        Radius [m].
    center : sequence of 3 float
        Centre [m].
    """

    radius: float
    _type: ClassVar[str] = "sphere"
    _scalable: ClassVar[tuple[str, ...]] = ("radius",)

    def _parameters(self) -> tuple[list[float], list[float]]:
        return [self.radius, *self.center], [self.radius]


@dataclass(frozen=True, kw_only=True, repr=False)
class Cube(DeckShape):
    """A cube with edges along the axes.

    Parameters
    ----------
    side : float
        Length of its edges [m].
    center : sequence of 3 float
        Centre [m].
    """

    side: float
    _type: ClassVar[str] = "cube"
    _scalable: ClassVar[tuple[str, ...]] = ("side",)

    def _parameters(self) -> tuple[list[float], list[float]]:
        return [self.side, *self.center], [self.side]


@dataclass(frozen=True, kw_only=True, repr=False)
class Cuboid(DeckShape):
    """A box with edges along the axes.

    Parameters
    ----------
    width, depth, height : float
        Lengths of its edges [m] along x, y and z.
    center : sequence of 3 float
        Centre [m].
    """

    width: float
    depth: float
    height: float
    _type: ClassVar[str] = "cuboid"
    _scalable: ClassVar[tuple[str, ...]] = ("width", "depth", "height")

    @classmethod
    def between(cls, lower: Sequence[float], upper: Sequence[float]) -> Cuboid:
        """Make the box between two corners.

        Parameters
        ----------
        lower, upper : sequence of 3 float
            Corners [m].
        """
        (x0, y0, z0), (x1, y1, z1) = corners("Cuboid", lower, upper)
        center = (0.5 * (x0 + x1), 0.5 * (y0 + y1), 0.5 * (z0 + z1))
        return cls(width=x1 - x0, depth=y1 - y0, height=z1 - z0, center=center)

    def _parameters(self) -> tuple[list[float], list[float]]:
        sides = [self.width, self.depth, self.height]
        lower = [x - 0.5 * side for x, side in zip(self.center, sides, strict=True)]
        upper = [x + 0.5 * side for x, side in zip(self.center, sides, strict=True)]
        return [*lower, *upper], sides


@dataclass(frozen=True, kw_only=True, repr=False)
class Cylinder(DeckShape):
    """A circular cylinder.

    Parameters
    ----------
    radius, height : float
        Radius and length along the axis [m].
    axis : sequence of 3 float
        Direction of the axis, of any length; z unless said otherwise.
    center : sequence of 3 float
        Centre [m], in the middle between both ends.
    """

    radius: float
    height: float
    axis: Sequence[float] = (0.0, 0.0, 1.0)
    _type: ClassVar[str] = "cylinder"
    _scalable: ClassVar[tuple[str, ...]] = ("radius", "height")

    def _check(self) -> None:
        axis = point("Cylinder", "axis", self.axis)
        if not math.hypot(*axis) > 0.0:
            raise InputError(
                f"Cylinder: axis = {axis}: must have a length; give for instance (0, 0, 1)"
            )
        self._set(axis=axis)

    def _parameters(self) -> tuple[list[float], list[float]]:
        norm = math.hypot(*self.axis)
        axis = [self.height * a / norm for a in self.axis]
        base = [x - 0.5 * a for x, a in zip(self.center, axis, strict=True)]
        return [self.radius, *base, *axis], []
