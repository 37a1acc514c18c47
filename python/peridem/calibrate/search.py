"""The search for the value of a parameter that gives a wanted outcome."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from ..errors import InputError

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["Calibration", "Search"]

MOST_RUNS = 40
"""Runs after which a search gives up."""


@dataclass(frozen=True)
class Calibration:
    """The value of a parameter that gives a wanted outcome, and how it was found.

    Attributes
    ----------
    name : str
        The parameter.
    value : float
        Its value.
    outcome : str
        What was wanted.
    wanted, achieved : float
        The outcome wanted, and that of the last run.
    residual : float
        achieved - wanted.
    tolerance : float
        Largest residual that was asked for.
    runs : int
        Number of runs.
    table : DataFrame
        All values tried and their outcomes, in order.
    measured : object
        All that was measured in the last run.
    """

    name: str
    value: float
    outcome: str
    wanted: float
    achieved: float
    residual: float
    tolerance: float
    runs: int
    table: pd.DataFrame = field(repr=False)
    measured: Any = field(repr=False)

    def __str__(self) -> str:
        return (
            f"{self.name} = {self.value:.6g} gives {self.outcome} = {self.achieved:.6g}, "
            f"{self.residual:+.2g} from {self.wanted:g} (tolerance {self.tolerance:g}), "
            f"after {self.runs} runs"
        )


class Search:
    """Runs with values of a parameter until one gives what is wanted.

    Parameters
    ----------
    measure : callable
        Makes a run with a value; returns what it measured.
    outcome_of : callable
        Takes the outcome from what was measured.
    who, name, outcome : str
        The function, parameter and outcome, for messages and the report.
    wanted, tolerance : float
        The outcome wanted, and its largest residual.
    logarithmic : bool
        Whether the search goes by the logarithm of the parameter, which is positive then.

    Attributes
    ----------
    tried : list of (float, float)
        Values and outcomes so far.
    measured : object
        What the last run measured.
    """

    def __init__(
        self,
        measure: Callable[[float], Any],
        outcome_of: Callable[[Any], float],
        *,
        who: str,
        name: str,
        outcome: str,
        wanted: float,
        tolerance: float,
        logarithmic: bool = False,
    ) -> None:
        self._measure, self._outcome_of = measure, outcome_of
        self._who, self._name, self._outcome = who, name, outcome
        self._wanted, self._tolerance = wanted, tolerance
        self._logarithmic = logarithmic
        self.tried: list[tuple[float, float]] = []
        self.measured: Any = None

    def residual(self, value: float) -> float:
        """Run with a value; return achieved - wanted, or 0 when it is within the tolerance."""
        if len(self.tried) >= MOST_RUNS:
            near = min(self.tried, key=lambda one: abs(one[1] - self._wanted))
            raise InputError(
                f"{self._who}: tolerance = {self._tolerance:g}: not reached in {MOST_RUNS} runs "
                f"({self._name} = {near[0]:.6g} gives {near[1]:.6g}): the outcome does not change "
                "smoothly enough; give a larger one"
            )
        self.measured = self._measure(value)
        achieved = self._outcome_of(self.measured)
        self.tried.append((value, achieved))
        difference = achieved - self._wanted
        return 0.0 if abs(difference) <= self._tolerance else difference

    def find(self, values: Iterable[float]) -> Calibration:
        """Go along values until the outcome has passed what is wanted, then close in.

        Parameters
        ----------
        values : iterable of float
            Values to try, from one end of the range to the other; it may look at `tried`.

        Raises
        ------
        InputError
            If what is wanted is not within the outcomes of these values, with their range.
        """
        before: tuple[float, float] | None = None
        for value in values:
            residual = self.residual(value)
            if residual == 0.0:
                return self._report()
            if before is not None and (before[1] > 0) != (residual > 0):
                self._close_in(before, (value, residual))
                return self._report()
            before = value, residual
        raise self._out_of_reach()

    def _close_in(self, one: tuple[float, float], other: tuple[float, float]) -> None:
        """Find the root between two values with residuals of different sign."""
        from scipy.optimize import brentq

        to = math.log if self._logarithmic else float
        a, b = to(one[0]), to(other[0])
        known = {a: one[1], b: other[1]}

        def residual(x: float) -> float:
            if x in known:
                return known[x]
            return self.residual(math.exp(x) if self._logarithmic else x)

        brentq(residual, a, b, xtol=1e-9 * abs(a - b), maxiter=MOST_RUNS)

    def _out_of_reach(self) -> InputError:
        outcomes = [one[1] for one in self.tried]
        first, last = self.tried[0][0], self.tried[-1][0]
        return InputError(
            f"{self._who}: {self._outcome} = {self._wanted:g}: cannot be reached: {self._name} "
            f"from {first:g} to {last:g} gives {min(outcomes):.4g} to {max(outcomes):.4g}; want a "
            "value within, or change the other arguments"
        )

    def _report(self) -> Calibration:
        import pandas as pd

        value, achieved = self.tried[-1]
        if abs(achieved - self._wanted) > self._tolerance:
            raise InputError(
                f"{self._who}: tolerance = {self._tolerance:g}: not reached: at {self._name} = "
                f"{value:.9g} {self._outcome} jumps past {self._wanted:g} to {achieved:.6g}; give "
                "a larger one"
            )
        return Calibration(
            name=self._name,
            value=value,
            outcome=self._outcome,
            wanted=self._wanted,
            achieved=achieved,
            residual=achieved - self._wanted,
            tolerance=self._tolerance,
            runs=len(self.tried),
            table=pd.DataFrame(self.tried, columns=[self._name, self._outcome]),
            measured=self.measured,
        )
