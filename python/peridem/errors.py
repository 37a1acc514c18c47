"""Errors of the package: each says where, which value, which rule and what to do."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager


class InputError(ValueError):
    """The input (deck, mesh, placement, argument) breaks a rule.

    The text reads ``where: what = value: rule; remedy``, one line per problem.
    """


class InputErrors:
    """Errors of checks that do not need each other, collected to be raised as one."""

    def __init__(self) -> None:
        self._texts: dict[str, None] = {}

    @contextmanager
    def collect(self) -> Iterator[None]:
        """Keep an `InputError` of the body instead of raising it."""
        try:
            yield
        except InputError as error:
            self._texts[str(error)] = None

    def raise_if_any(self) -> None:
        """Raise what was collected, each text once, in the order of collection."""
        if self._texts:
            raise InputError("\n".join(self._texts))


class PeridemWarning(UserWarning):
    """Something about a model or a run is probably not what was wanted; it runs all the same."""


class NumericalError(RuntimeError):
    """The computation left the finite numbers or ran away during stepping."""
