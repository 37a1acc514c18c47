"""Shapes made of others: box minus box, annulus, plus/minus combinations."""
# ruff: noqa: D102 - the members are documented once, in Shape

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .base import BoolArray, FloatArray, Shape, at_most, join_loops
from .primitives import Ball, Box


@dataclass(frozen=True, kw_only=True, eq=False)
class Difference(Shape):
    """Outer shape without the inside of the inner one; the inner edge belongs to it.

    Where a box-shaped hole touches the outer box it is an opening: the points of the
    outer edge between the walls are not part of the shape.
    """

    outer: Box | Ball
    inner: Box | Ball

    @property
    def dimension(self) -> int:
        return self.outer.dimension

    @property
    def center(self) -> FloatArray:
        return self.outer.center

    @property
    def bounding_radius(self) -> float:
        return self.outer.bounding_radius

    @property
    def box(self) -> tuple[FloatArray, FloatArray]:
        return self.outer.box

    @property
    def volume(self) -> float:
        return self.outer.volume - self.inner.volume

    def contains(self, points: FloatArray, *, strict: bool = False) -> BoolArray:
        hole = self.inner
        if isinstance(hole, Box) and isinstance(self.outer, Box):
            hole = _open_towards(self.outer, hole)
        return self.outer.contains(points, strict=strict) & ~hole.contains(
            points, strict=not strict
        )

    def boundary(self) -> FloatArray:
        return join_loops([self.outer.boundary(), self.inner.boundary()])


def _open_towards(outer: Box, inner: Box) -> Box:
    """Extend the inner box through those sides of the outer one that it touches."""
    reach = 2.0 * outer.bounding_radius
    touches_lower = ~at_most(outer.lower, inner.lower, strict=True)
    touches_upper = ~at_most(inner.upper, outer.upper, strict=True)
    return Box(
        type=inner.type,
        lower=np.where(touches_lower, outer.lower - reach, inner.lower),
        upper=np.where(touches_upper, outer.upper + reach, inner.upper),
        axes=inner.axes,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Complex(Shape):
    """Members added or taken away one after the other.

    Attributes
    ----------
    members : tuple of Shape
    signs : tuple of bool
        True adds the member to what the ones before it made, False takes it away (its
        edge stays).
    """

    members: tuple[Shape, ...]
    signs: tuple[bool, ...]

    @property
    def dimension(self) -> int:
        return max(member.dimension for member in self.members)

    @property
    def center(self) -> FloatArray:
        lower, upper = self.box
        return 0.5 * (lower + upper)

    @property
    def bounding_radius(self) -> float:
        lower, upper = self.box
        by_box = 0.5 * float(np.linalg.norm((upper - lower)[: self.dimension]))
        by_member = max(
            float(np.linalg.norm(member.center - self.center)) + member.bounding_radius
            for member in self._added()
        )
        return min(by_box, by_member)

    @property
    def box(self) -> tuple[FloatArray, FloatArray]:
        corners = [member.box for member in self._added()]
        lower = np.min([c[0] for c in corners], axis=0)
        upper = np.max([c[1] for c in corners], axis=0)
        return lower, upper

    @property
    def volume(self) -> float:
        """Sum of the members' volumes with their signs.

        Exact when what is added does not overlap and what is taken away was there.
        """
        return sum(
            m.volume if sign else -m.volume
            for m, sign in zip(self.members, self.signs, strict=True)
        )

    def contains(self, points: FloatArray, *, strict: bool = False) -> BoolArray:
        found = np.zeros(len(points), dtype=bool)
        for member, sign in zip(self.members, self.signs, strict=True):
            if sign:
                found |= member.contains(points, strict=strict)
            else:
                found &= ~member.contains(points, strict=not strict)
        return found

    def boundary(self) -> FloatArray:
        return join_loops([member.boundary() for member in self.members])

    def _added(self) -> list[Shape]:
        return [m for m, sign in zip(self.members, self.signs, strict=True) if sign]
