"""What the commands share: exit codes, and how errors become messages.

Exit codes: 0 success, 2 bad input or usage, 3 numerical failure, 130 stopped by Ctrl-C, 143 by
SIGTERM.
"""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable
from typing import NoReturn, ParamSpec, TypeVar

import click

from .errors import InputError, NumericalError

__all__ = ["BAD_INPUT", "NUMERICAL_FAILURE", "STOPPED", "fail", "with_exit_codes"]

BAD_INPUT = 2
NUMERICAL_FAILURE = 3
STOPPED = 130

P = ParamSpec("P")
R = TypeVar("R")


def fail(text: str, code: int) -> NoReturn:
    """End the program with a message on standard error and an exit code."""
    with contextlib.suppress(OSError):  # stderr may be full or closed: the code still tells
        click.echo(f"peridem: {text}", err=True)
    raise SystemExit(code)


def with_exit_codes(command: Callable[P, R]) -> Callable[P, R]:
    """Turn the package's errors into a message on stderr and an exit code."""

    @functools.wraps(command)
    def guarded(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            return command(*args, **kwargs)
        except InputError as error:
            fail(f"error: {error}", BAD_INPUT)
        except NumericalError as error:
            fail(f"numerical failure: {error}", NUMERICAL_FAILURE)
        except MemoryError:
            fail("error: not enough memory; use fewer or coarser bodies", BAD_INPUT)
        except KeyboardInterrupt:
            fail("stopped by Ctrl-C", STOPPED)

    return guarded
