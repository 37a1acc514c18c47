"""How long a run is: intervals in seconds or steps, and time steps exact to the last bit."""

from __future__ import annotations

import math
from typing import Any

from .errors import InputError
from .modelling.arguments import number, plain

ROUND_OFF = 1e-9
"""Part of a step by which the end of a run may lie beyond whole steps."""

_MOST_TRIED = 200


def steps_until(until: float, dt: float) -> int:
    """Count the steps of `dt` that reach the time `until` [s]."""
    return max(math.ceil(until / dt - ROUND_OFF * max(1.0, until / dt)), 0)


def interval_in_steps(name: str, value: Any, dt: float) -> int:
    """Return an interval, given in steps (int) or in seconds (float), in steps.

    Raises
    ------
    InputError
        If it is not positive, or shorter than a step.
    """
    given = plain(value)
    if isinstance(given, int) and not isinstance(given, bool):
        if given < 1:
            raise InputError(
                f"{name} = {value!r}: must be at least 1 step, a whole number, or a time in s; "
                "correct it"
            )
        return given
    seconds = number(value, name, above=0, unit="s, or a whole number of steps")
    steps = round(seconds / dt)
    if steps < 1:
        raise InputError(
            f"{name} = {value!r}: is shorter than the time step {dt:.4g} s; give a longer time, or "
            "a whole number of steps"
        )
    return steps


def duration_until(until: float, dt: float, every: float | None = None) -> tuple[float, int]:
    """Return duration and number of steps for a time to reach with steps of at most `dt` [s].

    Whole steps fill the interval `every` [s], too, if there is one and it fills the time. Else
    the time step is `dt` to the last bit where whole steps of it reach the time and their number
    allows, or the time by the number of steps.
    """
    intervals = round(until / every) if every is not None and every > 0 else 0
    if every is not None and intervals and abs(until / every - intervals) <= 1e-6:
        return until, intervals * max(steps_until(every, dt), 1)
    steps = max(steps_until(until, dt), 1)
    exact = _product(dt, steps) if abs(until / steps - dt) <= ROUND_OFF * dt else None
    return (until if exact is None else exact), steps


def _product(dt: float, steps: int) -> float | None:
    """Return a duration that gives `dt` again when divided by the steps; None if there is none."""
    product = dt * steps
    for final_time in (product, math.nextafter(product, 0), math.nextafter(product, math.inf)):
        if final_time / steps == dt:
            return final_time
    return None


def exact_duration(dt: float, steps: int) -> tuple[float, int]:
    """Duration and number of steps whose ratio is `dt` to the last bit.

    Parameters
    ----------
    dt : float
        Time step [s].
    steps : int
        Number of steps wanted.

    Returns
    -------
    final_time : float
        Duration [s].
    steps : int
        The number wanted, or a few more: not every product rounds so that dividing it by the
        number of steps gives the time step again.
    """
    for n in range(max(steps, 1), max(steps, 1) + _MOST_TRIED):
        final_time = _product(dt, n)
        if final_time is not None:
            return final_time, n
    power = 1 << max(steps, 1).bit_length()
    return dt * power, power
