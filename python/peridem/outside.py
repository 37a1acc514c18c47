"""What a deck cannot say of a load: Python functions of time, nodes chosen one by one."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .errors import InputError

FloatArray = NDArray[np.float64]
TimeCallable = Callable[[float], Any]
NodeChoice = Callable[[FloatArray, NDArray[np.int64]], NDArray[np.bool_]]


@dataclass(frozen=True)
class Outside:
    """Parts of a load set that no deck can say.

    Attributes
    ----------
    label : str
        What messages call the load.
    choose : callable, optional
        Tells which of some nodes carry the load, from their reference positions (n, 3) [m] and
        their numbers, counted in each body from 0.
    displacement, velocity, density : callable, optional
        Functions of the time [s] that return a number, one for each direction or each node, or an
        array of shape (n_nodes, n_directions).
    """

    label: str
    choose: NodeChoice | None = None
    displacement: TimeCallable | None = None
    velocity: TimeCallable | None = None
    density: TimeCallable | None = None

    @property
    def unsayable(self) -> str:
        """What of it a deck cannot say."""
        what = []
        for name in ("displacement", "velocity", "density"):
            if getattr(self, name) is not None:
                what.append(f"a Python function as {name}")
        if self.choose is not None:
            what.append("chosen nodes")
        return " and ".join(what)


class NodeValues:
    """A function of time on the nodes of a load set, its results checked and spread out.

    Parameters
    ----------
    function : callable
        The user's function.
    n_nodes : int
        Number of nodes.
    directions : sequence of int
        Directions of the load, 1 to 3.
    label : str
        What messages call it, e.g. ``prescribe 'lid': displacement``.
    """

    def __init__(
        self, function: TimeCallable, n_nodes: int, directions: Sequence[int], label: str
    ) -> None:
        self.function = function
        self.n_nodes = n_nodes
        self.axes = [direction - 1 for direction in directions]
        self.label = label

    def __call__(self, t: float) -> FloatArray:
        """Return the values at time `t` [s], shape (n_nodes, 3), zero in other directions."""
        values = np.zeros((self.n_nodes, 3))
        values[:, self.axes] = self._spread(self.function(t), t)
        if not np.all(np.isfinite(values)):
            raise InputError(
                f"{self.label}: the function gives a number that is not finite at t = {t:g} s; "
                "correct it"
            )
        return values

    def _spread(self, value: Any, t: float) -> FloatArray:
        """Shape the result so that it can be set on (n_nodes, n_directions)."""
        try:
            array = np.asarray(value, dtype=float)
        except (TypeError, ValueError):
            array = np.empty((0, 0, 0))
        n, d = self.n_nodes, len(self.axes)
        if array.ndim == 0 or array.shape == (n, d):
            return array
        if array.ndim == 1 and not (n == d > 1):
            if len(array) == d:
                return array
            if len(array) == n:
                return array[:, None]
        shown = f"an array of shape {array.shape}" if array.ndim < 3 else f"{value!r:.60}"
        raise InputError(
            f"{self.label}: the function gives {shown} at t = {t:g} s: must be a number, {d} (one "
            f"for each direction), {n} (one for each node) or an array of shape ({n}, {d}); "
            "correct it"
        )

    def weak(self) -> Callable[[float], FloatArray]:
        """Return a function that does not keep this one alive.

        The core keeps what it is given, unseen by Python's collector of cycles: a function that
        refers to its model would keep both for good.
        """
        reference = weakref.ref(self)

        def evaluate(t: float) -> FloatArray:
            values = reference()
            assert values is not None  # the model keeps it, and only the model steps
            return values(t)

        return evaluate
