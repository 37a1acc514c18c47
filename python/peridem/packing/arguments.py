"""Checks of arguments: each error names argument, value, rule and remedy."""

from __future__ import annotations

import difflib
import functools
import inspect
import math
from collections.abc import Callable, Iterable
from typing import Any, ParamSpec, TypeVar

import numpy as np

from ..errors import InputError

P = ParamSpec("P")
R = TypeVar("R")


def did_you_mean(word: str, known: Iterable[str]) -> str:
    """Return a remedy for an unknown name: the nearest known one, or all of them."""
    known = list(known)
    near = difflib.get_close_matches(str(word).lower(), known, n=1, cutoff=0.6)
    return f"did you mean {near[0]}?" if near else "use one of " + ", ".join(known)


def checked_names(function: Callable[P, R]) -> Callable[P, R]:
    """Turn the TypeError for a misnamed, missing or superfluous argument into an InputError."""
    signature = inspect.signature(function)
    known = [name for name in signature.parameters if name != "self"]
    title = function.__qualname__.removesuffix(".__init__")

    @functools.wraps(function)
    def wrapper(*args: P.args, **kwargs: P.kwargs) -> R:
        for name in kwargs:
            if name not in known:
                raise InputError(f"{title}: {name}: no such argument; {did_you_mean(name, known)}")
        try:
            signature.bind(*args, **kwargs)
        except TypeError as error:
            usage = ", ".join(known)
            raise InputError(f"{title}: {error}; its arguments are {usage}") from None
        return function(*args, **kwargs)

    return wrapper


def checked_init(cls: type[R]) -> type[R]:
    """Check the names of the arguments of a class as `checked_names` does."""
    setattr(cls, "__init__", checked_names(cls.__init__))  # noqa: B010
    return cls


def number(
    where: str,
    name: str,
    value: Any,
    *,
    above: float | None = None,
    least: float | None = None,
    below: float | None = None,
    most: float | None = None,
    remedy: str = "correct it",
) -> float:
    """Return `value` as a finite float within bounds.

    Raises
    ------
    InputError
        If it is not a number or breaks a bound.
    """
    try:
        x = math.nan if isinstance(value, (bool, str)) else float(value)
    except (TypeError, ValueError):
        x = math.nan
    rules = [
        (math.isfinite(x), "must be a finite number"),
        (above is None or x > above, f"must be above {above}"),
        (least is None or x >= least, f"must be at least {least}"),
        (below is None or x < below, f"must be below {below}"),
        (most is None or x <= most, f"must be at most {most}"),
    ]
    for holds, rule in rules:
        if not holds:
            raise InputError(f"{where}: {name} = {value!r}: {rule}; {remedy}")
    return x


def integer(where: str, name: str, value: Any, *, least: int = 1, remedy: str = "") -> int:
    """Return `value` as an int of at least `least`, or raise an `InputError`."""
    whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not whole or value < least:
        remedy = remedy or f"give {least} or more"
        raise InputError(f"{where}: {name} = {value!r}: must be an integer >= {least}; {remedy}")
    return int(value)


def choice(where: str, name: str, value: Any, known: Iterable[str]) -> str:
    """Return `value` if it is one of the `known` names, or raise an `InputError`."""
    known = list(known)
    if value not in known:
        remedy = did_you_mean(value, known)
        raise InputError(f"{where}: {name} = {value!r}: no such choice; {remedy}")
    return str(value)


def vector(where: str, name: str, value: Any, dimension: int) -> np.ndarray[Any, Any]:
    """Return `value`, a number or one for each axis, as an array of shape (dimension,)."""
    try:
        array = np.asarray(value, dtype=float)
        array = np.broadcast_to(array, (dimension,)).copy()
    except (TypeError, ValueError):
        array = np.full(dimension, math.nan)
    if not np.isfinite(array).all():
        raise InputError(
            f"{where}: {name} = {value!r}: must be a number or {dimension} of them, "
            "one for each axis; correct it"
        )
    return array


def generator(where: str, seed: Any) -> np.random.Generator:
    """Return the source of random numbers that belongs to `seed`, on every machine the same."""
    return np.random.Generator(np.random.PCG64(integer(where, "seed", seed, least=0)))
