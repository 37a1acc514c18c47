"""A process of a study: takes sets of parameters, runs the function, hands back rows."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Mapping
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from ..errors import InputError, NumericalError
from ..modelling.arguments import show_value
from ..result import Result
from ..telling import be_quiet
from .parameters import OWN_COLUMNS, Parameters, cell, line

__all__ = ["Outcome", "call", "main"]

Outcome = dict[str, str]
"""Cells of a row: results, ``status``, ``error``, ``seconds``; ``trace`` is no column."""


def call(
    run: Callable[..., Any], parameters: Parameters, extra: Mapping[str, Any] | None = None
) -> Outcome:
    """Run the function for one set of parameters; what it raises becomes part of the row.

    Parameters
    ----------
    run : callable
        The function of the study.
    parameters : dict
        Its parameters.
    extra : mapping, optional
        More arguments, which are not parameters of the study.

    Returns
    -------
    dict of str to str
        Cells of the row.
    """
    start = time.perf_counter()
    given = dict(extra or {})
    try:
        if isinstance(given.get("output"), Path):
            given["output"].mkdir(parents=True, exist_ok=True)
        row = _cells(run(**parameters, **given), parameters)
        row |= {"status": "done"}
    except Exception as error:
        known = isinstance(error, InputError | NumericalError)
        text = str(error) if known else f"{type(error).__name__}: {error}"
        row = {"status": "failed", "error": line(text), "trace": traceback.format_exc()}
    return {**row, "seconds": f"{time.perf_counter() - start:.3f}"}


def _cells(result: Any, parameters: Parameters) -> Outcome:
    """Cells for what the function returns.

    Raises
    ------
    InputError
        If it is no dict of numbers and text, or a name is taken.
    """
    values = _last_values(result) if isinstance(result, Result) else result
    if not isinstance(values, Mapping):
        raise InputError(
            f"study: the function returns {show_value(values)}: must be a dict of results by name "
            "or a Result; write return {'peak': peak}"
        )
    for name, value in values.items():
        if name in parameters or name in OWN_COLUMNS:
            raise InputError(f"study: result {name!r}: the table has such a column; rename it")
        shape = getattr(value, "shape", ())
        if shape != () or isinstance(value, Mapping | list | tuple | set):
            raise InputError(
                f"study: result {name!r} = {show_value(value)}: must be a number or text; take "
                "one value of it, and write the rest to a file (argument output)"
            )
    return {str(name): cell(value) for name, value in values.items()}


def _last_values(result: Result) -> dict[str, Any]:
    """Numbers of a run: how it ended, and the last of all that was recorded."""
    names = ("steps", "time", "broken_bonds")
    values = {name: result.summary[name] for name in names}
    series = result.series
    if len(series):
        last = series.ffill().iloc[-1]
        values |= {name: float(last[name]) for name in series.columns if name != "step"}
    return values


def main(descriptor: int) -> None:
    """Serve as a process of a study until the pipe is closed.

    Parameters
    ----------
    descriptor : int
        File descriptor of a pipe to the study. First come the search path of modules, the
        arguments of the command line, the folder to work in and the pickled function, then
        parameters, each answered by its row.
    """
    import pickle

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the study itself answers Ctrl-C
    threading.Thread(target=_end_with_parent, daemon=True).start()
    pipe = Connection(descriptor)
    sys.path[:], sys.argv[:], folder, pickled = pipe.recv()
    os.chdir(folder)
    be_quiet()
    try:
        run = pickle.loads(pickled)
    except Exception as error:
        pipe.send(f"{type(error).__name__}: {error}")
        return
    pipe.send(None)
    while True:
        try:
            parameters, extra = pipe.recv()
        except EOFError:
            return
        pipe.send(call(run, parameters, extra))


def _end_with_parent() -> None:
    """Wait for the end of standard input, which the study holds open, and end."""
    while os.read(0, 4096):
        pass
    os._exit(1)
