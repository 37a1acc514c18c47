"""`study`: run a function for many sets of parameters."""

from __future__ import annotations

import inspect
import os
import warnings
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .._core import __version__
from ..errors import InputError
from ..files import path_of
from ..modelling.arguments import choice, whole
from ..telling import without_progress
from .fingerprint import source_mark
from .parameters import Parameters, cell, check_signature, identity, sets_of
from .pool import Task, pickled, run_in_processes
from .table import StudyTable, StudyWarning, locked
from .worker import Outcome, call

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["study"]

_RERUN = ("failed", "none", "changed", "all")


def study(
    run: Callable[..., Any],
    rows: Any = None,
    *,
    folder: str | os.PathLike[str] | None = None,
    workers: int | None = None,
    threads: int | None = None,
    rerun: str = "failed",
    stop_on_error: bool = False,
    progress: bool = True,
    grid: Mapping[str, Any] | None = None,
    **axes: Any,
) -> pd.DataFrame:
    """Run a function for many sets of parameters, over processes, and tabulate what it returns.

    Every set is run once: a study that is started again, after an end of whatever kind or with
    more sets, runs what is not in its table yet. Sets are told apart by their values, not by
    their order.

    Parameters
    ----------
    run : callable
        Takes the parameters by name and returns a dict of numbers and text by name, or a
        `Result`, of which the last recorded values are taken. If it has an argument ``output``
        that is no parameter of the study it gets a folder of its own in `folder`. Models in it
        take `threads` threads unless they say otherwise.
    rows : DataFrame or list of dict, optional
        Sets of parameters, such as those of `sample`.
    folder : path-like, optional
        Where the table ``study.csv`` is kept; without it in memory only.
    workers : int, optional
        Number of processes; as many as processors when left out. 0 runs here, one set after the
        other, to look for errors.
    threads : int, optional
        Threads of each process; processors / workers when left out.
    rerun : {"failed", "none", "changed", "all"}
        Which sets of the table are run again: those that failed; none; those that failed or are
        of another source of `run` or version of peridem; all.
    stop_on_error : bool
        Stop at the first set that fails, instead of noting its message.
    progress : bool
        Show a bar, where there is a terminal.
    grid : mapping, optional
        Values by name like `axes`, for names that are those of other arguments.
    **axes
        For each parameter a value or a list of values; all combinations are run, with each of
        the `rows`.

    Returns
    -------
    DataFrame
        A row for each set, in the order given: ``id``, parameters, results, ``status``
        (done, failed), ``error``, ``seconds``, ``source`` and ``version``.

    Raises
    ------
    InputError
        If an argument breaks its rule, the folder cannot be used, or, with `stop_on_error`, a
        set has failed.
    KeyboardInterrupt
        After Ctrl-C; the table has all sets that were finished.

    Warns
    -----
    StudyWarning
        If sets have failed, or rows of the table are of another source of `run`, or version of
        peridem.

    Examples
    --------
    >>> import peridem as pd
    >>> table = pd.study(lambda a, b: {"sum": a + b}, a=[1, 2], b=[10, 20], workers=0)
    >>> table["sum"].tolist()
    [11, 21, 12, 22]
    """
    from .progress import Progress  # rich takes a quarter of a second to load

    if not callable(run):
        raise InputError(f"study: run = {run!r}: must be a function; give its name without ()")
    choice(rerun, _RERUN, "study: rerun")
    sets = sets_of(rows, {**(grid or {}), **axes})
    where = None if folder is None else path_of(folder, "study: folder")
    outputs = where if _takes_output(run, sets) else None
    check_signature(run, sets, set() if outputs is None else {"output"})
    with locked(where):
        job = _Job(run, sets, where, rerun, outputs)
        count, share = _shares(workers, threads, len(job.tasks))
        done = len(sets) - len(job.tasks)
        with (
            without_progress(),
            Progress(len(sets), done, shown=bool(progress)) as bar,
            closing(job.outcomes(count, share)) as outcomes,
        ):
            for id_, outcome in outcomes:
                job.keep(id_, outcome)
                bar.advance(failed=outcome["status"] == "failed")
                if stop_on_error and outcome["status"] == "failed":
                    raise InputError(job.failure(id_, outcome))
        _note_failed(table := job.table.frame(list(job.sets)))
        return table


class _Job:
    """Sets of parameters, those of them that are to be run, and the table they go to."""

    def __init__(
        self,
        run: Callable[..., Any],
        sets: Sequence[Parameters],
        folder: Path | None,
        rerun: str,
        outputs: Path | None,
    ) -> None:
        self.sets = {identity(one): one for one in sets}
        self.table = StudyTable(folder, [name for one in sets for name in one])
        self._run = run
        self._marks = {"source": source_mark(run), "version": __version__}
        old = [key for key, row in self.table.rows.items() if key in self.sets]
        changed = {key for key in old if self._has_changed(key)}
        failed = {key for key in old if self.table.rows[key].get("status") != "done"}
        again: dict[str, set[str]] = {
            "none": set(),
            "failed": failed,
            "changed": failed | changed,
            "all": set(old),
        }
        skipped = set(old) - again[rerun]
        _note_changed(skipped & changed, self._marks)
        self.tasks: list[Task] = [
            (key, one, {} if outputs is None else {"output": outputs.resolve() / key})
            for key, one in self.sets.items()
            if key not in skipped
        ]

    def _has_changed(self, key: str) -> bool:
        row = self.table.rows[key]
        return any(row.get(name) != mark for name, mark in self._marks.items())

    def outcomes(self, workers: int, threads: int) -> Generator[tuple[str, Outcome]]:
        """Run all tasks, here or in processes."""
        if not self.tasks:
            return
        if workers == 0:
            for key, parameters, extra in self.tasks:
                yield key, call(self._run, parameters, extra)
            return
        yield from run_in_processes(pickled(self._run), self.tasks, workers, threads)

    def keep(self, key: str, outcome: Outcome) -> None:
        """Put a row into the table."""
        cells = {name: cell(value) for name, value in self.sets[key].items()}
        result = {name: value for name, value in outcome.items() if name != "trace"}
        row = {"id": key, **cells, **result, **self._marks}
        self.table.add({name: value for name, value in row.items() if value != ""})

    def failure(self, key: str, outcome: Outcome) -> str:
        """Say which set has failed, and how."""
        trace = outcome.get("trace", "")
        return f"study: {self.sets[key]}: failed: {outcome['error']}\n{trace}".rstrip()


def _takes_output(run: Callable[..., Any], sets: Sequence[Parameters]) -> bool:
    try:
        known = inspect.signature(run).parameters
    except (TypeError, ValueError):
        return False
    return "output" in known and not any("output" in one for one in sets)


def _shares(workers: Any, threads: Any, n: int) -> tuple[int, int]:
    """Numbers of processes and of threads in each, so that processors are not oversubscribed."""
    processors = len(os.sched_getaffinity(0))
    share = None if threads is None else whole(threads, "study: threads", 1)
    if workers is None:
        count = max(1, min(n, processors // (share or 1)))
    else:
        count = whole(workers, "study: workers", 0)
    return count, share or max(1, processors // max(count, 1))


def _note_failed(table: pd.DataFrame) -> None:
    failed = table[table["status"] == "failed"]
    if len(failed):
        warnings.warn(
            f"study: {len(failed)} of {len(table)} sets failed, the first with: "
            f"{failed['error'].iloc[0]}; see the column error",
            StudyWarning,
            stacklevel=3,
        )


def _note_changed(keys: set[str], marks: Mapping[str, str]) -> None:
    if keys:
        warnings.warn(
            f"study: {len(keys)} rows of the table are of another source of the function or "
            f"version of peridem (now {marks['source']}, {marks['version']}): they are kept; "
            "give rerun='changed' to run them again",
            StudyWarning,
            stacklevel=4,
        )
