"""Distributions of the size of grains.

A distribution is known by its quantiles, so that sizes are drawn by strata: of n grains exactly
one falls into each n-th part of the distribution. Even a few grains then follow the curve.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..geometry.base import FloatArray
from .arguments import checked_init, number

_REACH = 3.0
"""Where a normal or log-normal distribution is cut by default, in standard deviations."""


class Sizes(ABC):
    """A distribution of sizes [m], by number of grains."""

    @abstractmethod
    def quantile(self, fraction: ArrayLike, dimension: int = 2) -> FloatArray:
        """Return the size below which a fraction of the grains lies.

        Parameters
        ----------
        fraction : array_like
            Fractions of the number of grains, 0 to 1.
        dimension : int
            2 or 3; a grading is given by mass, and mass goes as the size to this power.

        Returns
        -------
        ndarray
            Sizes [m].
        """

    def draw(self, count: int, rng: np.random.Generator, dimension: int = 2) -> FloatArray:
        """Return `count` sizes [m] in random order, one from each of as many equal strata."""
        fraction = (np.arange(count) + rng.random(count)) / count
        return rng.permutation(self.quantile(fraction, dimension))


@checked_init
@dataclass(frozen=True)
class Constant(Sizes):
    """All grains of one size.

    Parameters
    ----------
    size : float
        The size [m].

    Raises
    ------
    InputError
        If it is not positive.
    """

    size: float

    def __post_init__(self) -> None:
        number("Constant", "size", self.size, above=0, remedy="give a length in m")

    def quantile(self, fraction: ArrayLike, dimension: int = 2) -> FloatArray:
        """See `Sizes.quantile`."""
        return np.full(np.shape(fraction), float(self.size))


@checked_init
@dataclass(frozen=True)
class Uniform(Sizes):
    """Sizes between two bounds, all as likely.

    Parameters
    ----------
    low, high : float
        Bounds [m].

    Raises
    ------
    InputError
        If a bound is not positive or they are not in order.
    """

    low: float
    high: float

    def __post_init__(self) -> None:
        _bounds("Uniform", self.low, self.high)

    def quantile(self, fraction: ArrayLike, dimension: int = 2) -> FloatArray:
        """See `Sizes.quantile`."""
        return self.low + (self.high - self.low) * np.asarray(fraction, dtype=float)


@checked_init
@dataclass(frozen=True)
class Normal(Sizes):
    """Normal distribution, cut at two bounds (what lies beyond is left out, not moved).

    Parameters
    ----------
    mean, std : float
        Mean and standard deviation [m] before the cut.
    low, high : float, optional
        Bounds [m]; three standard deviations from the mean by default.

    Raises
    ------
    InputError
        If a length is not positive or `low` is not below `high`.
    """

    mean: float
    std: float
    low: float | None = None
    high: float | None = None

    def __post_init__(self) -> None:
        number("Normal", "mean", self.mean, above=0, remedy="give a length in m")
        number("Normal", "std", self.std, above=0, remedy="give a length in m, or use Constant")
        _bounds("Normal", *self.bounds)

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest size [m]."""
        low = self.mean - _REACH * self.std if self.low is None else self.low
        return low, self.mean + _REACH * self.std if self.high is None else self.high

    def quantile(self, fraction: ArrayLike, dimension: int = 2) -> FloatArray:
        """See `Sizes.quantile`."""
        low, high = self.bounds
        return _cut_normal(fraction, self.mean, self.std, low, high)


@checked_init
@dataclass(frozen=True)
class LogNormal(Sizes):
    """Log-normal distribution, cut at two bounds (what lies beyond is left out, not moved).

    Parameters
    ----------
    median : float
        Median [m] before the cut.
    sigma : float
        Standard deviation of the natural logarithm of the size.
    low, high : float, optional
        Bounds [m]; three standard deviations of the logarithm from the median by default.

    Raises
    ------
    InputError
        If a number is not positive or `low` is not below `high`.
    """

    median: float
    sigma: float
    low: float | None = None
    high: float | None = None

    def __post_init__(self) -> None:
        number("LogNormal", "median", self.median, above=0, remedy="give a length in m")
        number("LogNormal", "sigma", self.sigma, above=0, most=5, remedy="0.2 is a common value")
        _bounds("LogNormal", *self.bounds)

    @property
    def bounds(self) -> tuple[float, float]:
        """Smallest and largest size [m]."""
        reach = float(np.exp(_REACH * self.sigma))
        low = self.median / reach if self.low is None else self.low
        return low, self.median * reach if self.high is None else self.high

    def quantile(self, fraction: ArrayLike, dimension: int = 2) -> FloatArray:
        """See `Sizes.quantile`."""
        low, high = np.log(self.bounds)
        return np.exp(_cut_normal(fraction, np.log(self.median), self.sigma, low, high))


@checked_init
@dataclass(frozen=True)
class Grading(Sizes):
    """A grading curve: which part of the mass passes each sieve.

    Between two sieves the mass is spread evenly over the sizes. The size of a grain is half of
    the sieve it just passes, as a radius is half of a diameter.

    Parameters
    ----------
    sieves : sequence of float
        Openings of the sieves [m], increasing.
    passing : sequence of float
        Part of the mass that passes each, from 0 at the first to 1 at the last (or to 100,
        read as percent).

    Raises
    ------
    InputError
        If the lists differ in length, are not increasing or do not go from 0 to 1.
    """

    sieves: Sequence[float]
    passing: Sequence[float]

    def __post_init__(self) -> None:
        for name in ("sieves", "passing"):
            values = getattr(self, name)
            if np.ndim(values) != 1:
                raise InputError(f"Grading: {name} = {values!r}: must be a list of numbers; use []")
            numbers = tuple(number("Grading", name, v, least=0) for v in values)
            object.__setattr__(self, name, numbers)
        sieves, passing = np.array(self.sieves), np.array(self.passing)
        if len(sieves) != len(passing) or len(sieves) < 2:
            raise InputError(
                f"Grading: {len(sieves)} sieves and {len(passing)} values of passing: must be as "
                "many, two at least; give one for each sieve"
            )
        if sieves[0] <= 0 or (np.diff(sieves) <= 0).any():
            raise InputError(
                f"Grading: sieves = {self.sieves}: must be positive and increase; sort them"
            )
        if passing[-1] == 100.0:
            passing = passing / 100.0
            object.__setattr__(self, "passing", tuple(passing.tolist()))
        if passing[0] != 0.0 or passing[-1] != 1.0 or (np.diff(passing) < 0).any():
            raise InputError(
                f"Grading: passing = {self.passing}: must grow from 0 to 1 (or 100); add the sieve "
                "that nothing passes and the one that all passes"
            )

    def quantile(self, fraction: ArrayLike, dimension: int = 2) -> FloatArray:
        """See `Sizes.quantile`."""
        # mass even over d in [a, b] means a number density ~ d^-D, D the dimension;
        # its integral from a is (a^(1-D) - d^(1-D)) / (D-1), to be solved for d
        power = 1.0 - dimension
        a = np.array(self.sieves[:-1]) ** power
        b = np.array(self.sieves[1:]) ** power
        per_size = np.diff(self.passing) / np.diff(self.sieves)
        total = np.concatenate([[0.0], np.cumsum(per_size * (a - b))])
        fraction = np.asarray(fraction, dtype=float)
        share = np.clip(fraction, 0.0, 1.0) * total[-1]
        k = np.clip(np.searchsorted(total, share, side="right") - 1, 0, len(a) - 1)
        # a bin without mass is never met, but at a fraction of exactly 1
        height = np.where(per_size[k] > 0, per_size[k], np.inf)
        diameter = (a[k] - (share - total[k]) / height) ** (1.0 / power)
        return np.asarray(0.5 * diameter)


def as_sizes(where: str, sizes: Any) -> Sizes:
    """Return a distribution; a number means that all grains have this size."""
    if isinstance(sizes, Sizes):
        return sizes
    if isinstance(sizes, (int, float, np.floating)) and not isinstance(sizes, bool):
        return Constant(number(where, "sizes", sizes, above=0, remedy="give a length in m"))
    raise InputError(
        f"{where}: sizes = {sizes!r}: must be a length in m or a distribution; "
        "use Constant, Uniform, Normal, LogNormal or Grading"
    )


def _bounds(where: str, low: float, high: float) -> None:
    remedy = "give lengths in m, low below high"
    number(where, "low", low, above=0, remedy=remedy)
    number(where, "high", high, above=low, remedy=remedy)


def _cut_normal(
    fraction: ArrayLike, mean: float, std: float, low: float, high: float
) -> FloatArray:
    from scipy.special import ndtr, ndtri

    start, end = ndtr((low - mean) / std), ndtr((high - mean) / std)
    x = ndtri(start + (end - start) * np.asarray(fraction, dtype=float))
    # far in a tail the two probabilities are the same number
    return np.asarray(np.clip(mean + std * x, low, high), dtype=float)
