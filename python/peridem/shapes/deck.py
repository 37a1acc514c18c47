"""Base of the shapes that a deck knows by name."""

from __future__ import annotations

import dataclasses
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

from ..errors import InputError
from ..geometry import Shape as Geometry
from ..geometry import make_shape
from .base import BodyShape, Self, factor_of, point


@dataclass(frozen=True, kw_only=True, repr=False)
class DeckShape(BodyShape):
    """A shape that a deck describes by ``Type`` and ``Parameters``.

    Parameters
    ----------
    center : sequence of 2 or 3 float
        Centre [m] in the reference position; the origin unless said otherwise.
    """

    center: Sequence[float] = (0.0, 0.0, 0.0)

    _type: ClassVar[str]
    _scalable: ClassVar[tuple[str, ...]]

    def __post_init__(self) -> None:
        self._set(center=point(type(self).__name__, "center", self.center))
        self._lengths(*self._scalable)
        self._check()

    def _check(self) -> None:
        """Raise InputError if the lengths do not go together."""

    @abstractmethod
    def _parameters(self) -> tuple[list[float], list[float]]:
        """``Parameters`` in the form with a centre, and in the short one without."""

    @property
    def full_keys(self) -> dict[str, Any]:
        """`deck_keys` in the form that members of a complex shape have, with the centre."""
        return {"Type": self._type, "Parameters": self._parameters()[0]}

    @property
    def deck_keys(self) -> dict[str, Any]:
        """Keys ``Type`` and ``Parameters`` of a deck."""
        full, short = self._parameters()
        plain = short and self.center == (0.0, 0.0, 0.0)
        return {"Type": self._type, "Parameters": short if plain else full}

    @cached_property
    def geometry(self) -> Geometry:
        """The region of space it fills: centre, bounding radius, box, area, points inside."""
        keys = self.deck_keys
        return make_shape(keys["Type"], keys["Parameters"], where=type(self).__name__)

    def scaled(self: Self, factor: float) -> Self:
        """Return the shape with all lengths times `factor` (positive)."""
        assert isinstance(self, DeckShape)
        s = factor_of(type(self).__name__, factor)
        changed: dict[str, Any] = {name: s * getattr(self, name) for name in self._scalable}
        changed["center"] = tuple(s * x for x in self.center)
        return dataclasses.replace(self, **changed)

    def moved(self: Self, by: Sequence[float]) -> Self:
        """Return the shape moved by 2 or 3 components [m]."""
        assert isinstance(self, DeckShape)
        shift = point(type(self).__name__, "by", by)
        center: Any = tuple(a + b for a, b in zip(self.center, shift, strict=True))
        return dataclasses.replace(self, center=center)

    def _inner_below_outer(self, inner: str, outer: str) -> None:
        a, b = getattr(self, inner), getattr(self, outer)
        if not a < b:
            raise InputError(
                f"{type(self).__name__}: {inner} = {a:g}: must be below {outer} = {b:g}; "
                "give a smaller one"
            )
