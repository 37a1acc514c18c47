"""Samples of parameters: at random, or spread evenly by Latin hypercubes or Sobol points."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..modelling.arguments import choice, number, plain, show_value, whole

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["sample"]

_METHODS = ("latin_hypercube", "sobol", "random")
_RANGE = "give (low, high), ('log', low, high), ('whole', low, high) or a list of values"


def sample(
    n: int, /, *, method: str = "latin_hypercube", seed: int = 0, **ranges: Any
) -> pd.DataFrame:
    """Draw sets of parameters for a study.

    Parameters
    ----------
    n : int
        Number of sets; for Sobol points a power of two keeps their balance.
    method : {"latin_hypercube", "sobol", "random"}
        How they are spread: each parameter evenly, all of them together evenly, or not at all.
    seed : int
        The same seed gives the same sets.
    **ranges
        For each parameter its range: ``(low, high)``; ``("log", low, high)``, even in the
        logarithm; ``("whole", low, high)``, whole numbers, both ends included; or a list of
        values.

    Returns
    -------
    DataFrame
        One row for each set, one column for each parameter.

    Raises
    ------
    InputError
        If an argument breaks its rule.

    Examples
    --------
    >>> import peridem as pd
    >>> rows = pd.sample(8, method="sobol", seed=1, friction=(0, 0.5), speed=("log", 0.1, 10))
    >>> len(rows), list(rows)
    (8, ['friction', 'speed'])
    """
    import pandas as pd

    count = whole(n, "sample: n", 1)
    kind = choice(method, _METHODS, "sample: method")
    start = whole(seed, "sample: seed", 0)
    if not ranges:
        raise InputError(f"sample: ranges: missing; name a parameter and {_RANGE}")
    scales = {name: _scale(name, given) for name, given in ranges.items()}
    unit = _unit_points(kind, count, len(ranges), start)
    return pd.DataFrame({name: scales[name](unit[:, k]) for k, name in enumerate(ranges)})


def _unit_points(method: str, n: int, d: int, seed: int) -> NDArray[np.float64]:
    """Points in the unit cube, shape (n, d)."""
    from scipy.stats import qmc

    if method == "random":
        return np.random.default_rng(seed).random((n, d))
    if method == "latin_hypercube":
        return np.asarray(qmc.LatinHypercube(d, rng=np.random.default_rng(seed)).random(n))
    sobol = qmc.Sobol(d, rng=np.random.default_rng(seed))
    return np.asarray(sobol.random_base2(math.ceil(math.log2(n)))[:n])


def _scale(name: str, given: Any) -> Callable[[NDArray[np.float64]], Any]:
    """Make the function that takes numbers in [0, 1) to a range."""
    where = f"sample: {name}"
    values = plain(given)
    if not isinstance(values, list) or not values:
        raise InputError(f"{where} = {show_value(given)}: must be a range; {_RANGE}")
    if isinstance(given, list):
        return lambda u: [values[int(one * len(values))] for one in u]
    kind = values.pop(0) if values[0] in ("log", "whole") else "even"
    if len(values) != 2 or any(isinstance(one, str) for one in values):
        raise InputError(f"{where} = {show_value(given)}: must be a range; {_RANGE}")
    low, high = (number(one, where, above=0 if kind == "log" else None) for one in values)
    if not low < high:
        raise InputError(f"{where} = {show_value(given)}: low must be below high; exchange them")
    if kind == "log":
        return lambda u: low * (high / low) ** u
    if kind == "whole":
        first, last = math.ceil(low), math.floor(high)
        return lambda u: np.asarray(first + np.floor(u * (last - first + 1)), dtype=int)
    return lambda u: low + (high - low) * u
