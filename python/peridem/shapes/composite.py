"""Shapes put together from others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from ..errors import InputError
from ..geometry import Shape as Geometry
from ..geometry import make_shape
from ..geometry.composite import Complex
from .base import BodyShape


@dataclass(frozen=True, kw_only=True, repr=False)
class Composite(BodyShape):
    """Shapes added or taken away one after the other; ``complex`` in decks.

    ``pd.Circle(radius=4) - pd.Circle(radius=3) + pd.Rectangle(width=2, height=1, center=(-2, 0))``
    is a ring with a bar in it.

    Parameters
    ----------
    members : sequence of BodyShape
        Shapes of one dimension, each where its ``center`` says.
    signs : sequence of bool
        True adds the member to what the ones before it made, False takes it away.
    """

    members: Sequence[BodyShape]
    signs: Sequence[bool]

    def __post_init__(self) -> None:
        members, signs = tuple(self.members), tuple(bool(sign) for sign in self.signs)
        if not members or len(members) != len(signs):
            raise InputError(
                f"Composite: {len(members)} members and {len(signs)} signs: give one sign, True or "
                "False, for each member"
            )
        for member in members:
            if not isinstance(member, BodyShape):
                raise InputError(f"Composite: {member!r:.60}: must be a shape, such as Circle")
        if not signs[0]:
            raise InputError("Composite: signs[0] = False: there is nothing yet; begin with True")
        if len({member.dimension for member in members}) > 1:
            raise InputError("Composite: members: plane shapes and solids cannot be put together")
        self._set(members=members, signs=signs)

    @cached_property
    def geometry(self) -> Geometry:
        """The region of space it fills; its volume is that of the members with their signs.

        That is exact when what is added does not overlap and what is taken away was there.
        """
        members = tuple(member.geometry for member in self.members)
        return Complex(type="complex", members=members, signs=tuple(self.signs))

    @property
    def deck_keys(self) -> dict[str, Any] | None:
        """Keys of a ``complex`` shape; None when a member is no shape of decks."""
        known = [member for member in self.members if hasattr(member, "full_keys")]
        if len(known) < len(self.members):
            return None
        parts: list[dict[str, Any]] = [member.full_keys for member in known]
        keys = {
            "Type": "complex",
            "Parameters": [value for part in parts for value in part["Parameters"]],
            "Vec_Type": [part["Type"] for part in parts],
            "Vec_Flag": ["plus" if sign else "minus" for sign in self.signs],
        }
        try:
            make_shape("complex", keys["Parameters"], keys["Vec_Type"], keys["Vec_Flag"])
        except InputError:
            return None  # members turned in ways whose parameters could not be told apart
        return keys

    def scaled(self, factor: float) -> Composite:
        """Return the shape scaled about the origin by `factor` (positive)."""
        members = tuple(member.scaled(factor) for member in self.members)
        return Composite(members=members, signs=self.signs)

    def moved(self, by: Sequence[float]) -> Composite:
        """Return the shape moved by 2 or 3 components [m]."""
        return Composite(members=tuple(m.moved(by) for m in self.members), signs=self.signs)


def combined(first: BodyShape, second: BodyShape, *, plus: bool) -> Composite:
    """Append a shape to a composite, or make one of two shapes."""
    if isinstance(first, Composite):
        return Composite(members=(*first.members, second), signs=(*first.signs, plus))
    return Composite(members=(first, second), signs=(True, plus))
