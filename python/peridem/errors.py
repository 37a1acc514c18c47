"""Errors of the package: each says where, which value, which rule and what to do."""

from __future__ import annotations


class InputError(ValueError):
    """The input (deck, mesh, placement, argument) breaks a rule.

    The text reads ``where: what = value: rule; remedy``, one line per problem.
    """


class NumericalError(RuntimeError):
    """The computation left the finite numbers or ran away during stepping."""
