"""Which grains are to be placed: shapes by their weights, sizes by their distribution."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import InputError
from ..geometry import Shape
from ..geometry.base import FloatArray
from .arguments import choice, number
from .outlines import Outline, equivalent_radius, geometry_of, outline_of
from .pairs import IndexArray
from .sizes import Sizes, as_sizes

MEASURES = ("bounding", "equivalent", "leading", "scale")
_FINE = 4096


@dataclass(frozen=True)
class Grains:
    """Grains without a place: shape, factor on the shape, angle [rad], axis of the turn."""

    index: IndexArray
    scales: FloatArray
    angles: FloatArray
    axes: FloatArray


class Recipe:
    """What the functions of this package have in common: shapes, sizes, weights, angles.

    Parameters
    ----------
    where : str
        Function that asks, for error messages.
    shapes, sizes, weights, measure, angles
        As given by the user, see `peridem.packing.random`.
    """

    def __init__(
        self, where: str, shapes: Any, *, sizes: Any, weights: Any, measure: Any, angles: Any
    ) -> None:
        self.where = where
        self.shapes = _as_shapes(where, shapes)
        self.geometries: tuple[Shape, ...] = tuple(geometry_of(where, s) for s in self.shapes)
        dimensions = sorted({g.dimension for g in self.geometries})
        if len(dimensions) > 1 or dimensions[0] < 2:
            raise InputError(
                f"{where}: shapes: have the dimensions {dimensions}: must be all plane or all "
                "solid; leave some out"
            )
        self.dimension = dimensions[0]
        self.outlines: tuple[Outline, ...] = tuple(outline_of(g) for g in self.geometries)
        self.sizes: Sizes | None = None if sizes is None else as_sizes(where, sizes)
        self.weights = _as_weights(where, weights, len(self.shapes))
        self.measure = choice(where, "measure", measure, MEASURES)
        self.angle: float | None = None
        if isinstance(angles, str):
            choice(where, "angles", angles, ("random",))
        else:
            self.angle = number(where, "angles", angles, remedy='give an angle in rad, or "random"')
        self.lengths = np.array([self._length(g) for g in self.geometries])
        self.volumes = np.array([g.volume for g in self.geometries])

    def _length(self, geometry: Shape) -> float:
        """Length [m] that a size of a shape is compared with."""
        if self.measure == "bounding":
            return float(geometry.bounding_radius)
        if self.measure == "equivalent":
            return equivalent_radius(geometry)
        if self.measure == "scale":
            return 1.0
        if geometry.scale_length is None:
            raise InputError(
                f"{self.where}: measure = 'leading': a {geometry.type} has no leading length; use "
                "'bounding'"
            )
        return float(geometry.scale_length)

    def mean_volume(self) -> float:
        """Mean area [m^2] or volume [m^3] of a grain."""
        if self.sizes is None:
            return float(self.weights @ self.volumes)
        sizes = self.sizes.quantile((np.arange(_FINE) + 0.5) / _FINE, self.dimension)
        moment = float((sizes**self.dimension).mean())
        return moment * float(self.weights @ (self.volumes / self.lengths**self.dimension))

    def draw(self, count: int, rng: np.random.Generator) -> Grains:
        """Return `count` grains in random order; the weights are met to within one grain."""
        index = rng.permutation(_quotas(self.weights, count))
        scales = np.ones(count)
        if self.sizes is not None:
            scales = self.sizes.draw(count, rng, self.dimension) / self.lengths[index]
        return self._turned(index, scales, rng)

    def draw_volume(self, volume: float, rng: np.random.Generator) -> Grains:
        """Return grains that together come as near to `volume` as whole grains can, or nearly."""
        mean = self.mean_volume()
        count = max(1, round(volume / mean))
        best, nearest = self.draw(count, rng), np.inf
        for _ in range(10):
            grains = self.draw(count, rng)
            total = float((self.volumes[grains.index] * grains.scales**self.dimension).sum())
            if abs(total - volume) < nearest:
                best, nearest = grains, abs(total - volume)
            change = round((volume - total) / mean)
            if change == 0:
                break
            count = max(1, count + change)
        return best

    def _turned(self, index: IndexArray, scales: FloatArray, rng: np.random.Generator) -> Grains:
        n = len(index)
        axes = np.tile((0.0, 0.0, 1.0), (n, 1))
        if self.angle is not None:
            return Grains(index, scales, np.full(n, self.angle), axes)
        if self.dimension == 2:
            return Grains(index, scales, 2.0 * np.pi * rng.random(n), axes)
        # a unit quaternion of any direction is a rotation of any kind, all as likely
        q = rng.normal(size=(n, 4))
        sine = np.linalg.norm(q[:, 1:], axis=1)
        return Grains(index, scales, 2.0 * np.arctan2(sine, q[:, 0]), q[:, 1:] / sine[:, None])

    def check_domain(self, domain: Shape) -> None:
        """Ask that the domain has the dimension of the shapes."""
        if domain.dimension != self.dimension:
            raise InputError(
                f"{self.where}: domain: has dimension {domain.dimension}, the shapes "
                f"{self.dimension}: must be the same; give an area for plane shapes, a volume for "
                "solids"
            )


def _as_shapes(where: str, shapes: Any) -> tuple[Any, ...]:
    if isinstance(shapes, Sequence) and not isinstance(shapes, str):
        if not shapes:
            raise InputError(f"{where}: shapes = []: must name a shape at least; give one")
        return tuple(shapes)
    return (shapes,)


def _as_weights(where: str, weights: Any, count: int) -> FloatArray:
    if weights is None:
        return np.full(count, 1.0 / count)
    try:
        array = np.asarray(weights, dtype=float)
    except (TypeError, ValueError):
        array = np.array([np.nan])
    good = array.shape == (count,) and np.isfinite(array).all() and (array >= 0).all()
    if not good or not array.sum() > 0:
        raise InputError(
            f"{where}: weights = {weights!r}: must be {count} numbers, one for each shape, not "
            "negative and not all zero; correct them"
        )
    return np.asarray(array / array.sum())


def _quotas(weights: FloatArray, count: int) -> IndexArray:
    """Share out `count` by the weights: whole parts first, then the largest remainders."""
    exact = weights * count
    whole = np.floor(exact + 1e-9).astype(int)
    rest = np.argsort(-(exact - whole), kind="stable")[: count - whole.sum()]
    whole[rest] += 1
    return np.repeat(np.arange(len(weights)), whole)
