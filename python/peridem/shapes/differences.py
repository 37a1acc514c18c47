"""Boxes without a box: containers, walls with an opening."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

from ..errors import InputError
from ..geometry import Shape as Geometry
from ..geometry import make_shape
from .base import BodyShape
from .deck import DeckShape
from .plane import Rectangle
from .solid import Cuboid


@dataclass(frozen=True, kw_only=True, repr=False)
class _BoxDifference(BodyShape):
    """An outer box without an inner one; where they touch there is an opening."""

    inner: DeckShape
    outer: DeckShape

    _type: ClassVar[str]
    _member: ClassVar[type[DeckShape]]

    def __post_init__(self) -> None:
        for name in ("inner", "outer"):
            if not isinstance(getattr(self, name), self._member):
                kind = self._member.__name__
                raise InputError(
                    f"{type(self).__name__}: {name} = {getattr(self, name)!r:.60}: must be a "
                    f"{kind}; give {kind}.between(lower, upper)"
                )
        _ = self.geometry  # checks that one lies within the other

    @property
    def full_keys(self) -> dict[str, Any]:
        """`deck_keys`, as members of a complex shape have them."""
        return self.deck_keys

    @property
    def deck_keys(self) -> dict[str, Any]:
        """Keys ``Type`` and ``Parameters`` of a deck."""
        boxes = [self.inner.full_keys["Parameters"], self.outer.full_keys["Parameters"]]
        return {"Type": self._type, "Parameters": [*boxes[0], *boxes[1]]}

    @cached_property
    def geometry(self) -> Geometry:
        """The region of space it fills: centre, bounding radius, box, area, points inside."""
        return make_shape(self._type, self.deck_keys["Parameters"], where=type(self).__name__)

    def scaled(self, factor: float) -> Any:
        """Return the shape scaled about the origin by `factor` (positive)."""
        return type(self)(inner=self.inner.scaled(factor), outer=self.outer.scaled(factor))

    def moved(self, by: Sequence[float]) -> Any:
        """Return the shape moved by 2 or 3 components [m]."""
        return type(self)(inner=self.inner.moved(by), outer=self.outer.moved(by))


@dataclass(frozen=True, kw_only=True, repr=False)
class RectangleMinusRectangle(_BoxDifference):
    """A rectangle without another that lies in it.

    Where both share a part of an edge there is an opening: a container without lid has an
    inner rectangle that reaches the upper edge of the outer one.

    Parameters
    ----------
    inner, outer : Rectangle
        Both rectangles, such as ``Rectangle.between((0, 0), (3, 2))`` [m].
    """

    inner: Rectangle
    outer: Rectangle
    _type: ClassVar[str] = "rectangle_minus_rectangle"
    _member: ClassVar[type[DeckShape]] = Rectangle


@dataclass(frozen=True, kw_only=True, repr=False)
class CuboidMinusCuboid(_BoxDifference):
    """A cuboid without another that lies in it.

    Where both share a part of a side there is an opening: a container without lid has an
    inner cuboid that reaches the upper side of the outer one.

    Parameters
    ----------
    inner, outer : Cuboid
        Both cuboids, such as ``Cuboid.between((0, 0, 0), (3, 2, 1))`` [m].
    """

    inner: Cuboid
    outer: Cuboid
    _type: ClassVar[str] = "cuboid_minus_cuboid"
    _member: ClassVar[type[DeckShape]] = Cuboid
