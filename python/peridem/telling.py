"""What a run from Python tells its user: how long it will be, how far it is, how it was stopped."""

from __future__ import annotations

import os
import sys
import warnings
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .errors import InputError, PeridemWarning
from .leftovers import left_files, set_aside
from .plausibility import long_run_warnings

if TYPE_CHECKING:
    from .driving import Observer
    from .model import DEMModel
    from .series import SeriesRecorder

__all__ = [
    "RunTeller",
    "be_quiet",
    "checked_progress",
    "interval_warnings",
    "opening",
    "warn_of",
    "without_progress",
]

_quiet = False


def be_quiet() -> None:
    """Show no progress and raise no warnings in this process: a study tells of its runs itself."""
    global _quiet  # noqa: PLW0603
    _quiet = True
    warnings.simplefilter("ignore", PeridemWarning)


@contextmanager
def without_progress() -> Iterator[None]:
    """Show no progress of runs within the ``with``, where something else is shown."""
    global _quiet  # noqa: PLW0603
    before, _quiet = _quiet, True
    try:
        yield
    finally:
        _quiet = before


def _watched() -> bool:
    """Whether someone looks at standard error, and no test is running."""
    return not _quiet and "PYTEST_CURRENT_TEST" not in os.environ and sys.stderr.isatty()


def opening(model: DEMModel, last: int) -> str:
    """Say in a line what is about to run: steps, time step and its limit, nodes, bonds.

    Parameters
    ----------
    model : DEMModel
        An initialised model.
    last : int
        Step to stop after.
    """
    from .summary import time_text

    limit, limited = _stable_time_step(model)
    stable = f", {model.dt / limit:.2g} of the stable one, which {limited}" if limit > 0 else ""
    steps = max(last - model.n, 0)
    return (
        f"peridem: {steps} steps of {model.dt:.3g} s{stable}; to t = {time_text(last * model.dt)}; "
        f"{len(model.bodies)} bodies, {model.n_nodes} nodes, {len(model.bonds.intact) // 2} bonds"
    )


def _stable_time_step(model: DEMModel) -> tuple[float, str]:
    """Return the stable time step [s] and what limits it, as text.

    Springs of broken bonds count in models made in Python, as for their default time step; for
    decks they are a matter of `time_step_notes`.
    """
    limits = model.stable_time_step()
    limit, limited = min((limits.bonds, "the bonds limit"), (limits.contact, "contact limits"))
    if model.scripted and limits.self_contact < 0.99 * limit:  # often they are contact's
        return limits.self_contact, "springs between the ends of broken bonds limit"
    return limit, limited


def checked_progress(progress: Any) -> Any:
    """Return the argument `progress` of a run, checked."""
    if progress is None or isinstance(progress, bool) or callable(progress):
        return progress
    raise InputError(
        f"run: progress = {progress!r}: must be True, False or a function of the model; leave it "
        "out for a bar on a terminal"
    )


def warn_of(texts: Iterable[str], *, stacklevel: int) -> None:
    """Raise each text as a `PeridemWarning` where the user called.

    Parameters
    ----------
    texts : iterable of str
        The warnings.
    stacklevel : int
        Calls between the caller of this function and the user, as in `warnings.warn`.
    """
    for text in texts:
        warnings.warn(text, PeridemWarning, stacklevel=stacklevel + 1)


def interval_warnings(steps: int, intervals: dict[str, tuple[Any, int]]) -> list[str]:
    """Say which intervals a run does not reach once.

    Parameters
    ----------
    steps : int
        Number of the last step.
    intervals : dict of str to (given, steps)
        The interval of each argument as it was given, or None, and in steps.
    """
    return [
        f"{name} = {given!r}: is longer than the run ({steps} steps), so that there is nothing "
        "between its start and its end; give a shorter one (a whole number is in steps, any other "
        "in s)"
        for name, (given, every) in intervals.items()
        if given is not None and every > steps > 0
    ]


class RunTeller:
    """What is told of one run besides its results.

    Parameters
    ----------
    model : DEMModel
        An initialised model.
    last : int
        Step to stop after.
    folder : Path or None
        Its output folder.
    progress : bool, callable or None
        As in `DEMModel.run`; who gives a function does the talking at the end, too.
    """

    def __init__(self, model: DEMModel, last: int, folder: Path | None, progress: Any) -> None:
        self._model, self._last, self._folder, self._progress = model, last, folder, progress
        self._fresh = folder is not None and not model.goes_on

    def at_start(self, series: SeriesRecorder) -> list[str]:
        """Set aside what an earlier run has left, and collect the warnings before the first step.

        Parameters
        ----------
        series : SeriesRecorder
            What the run records.
        """
        model, texts = self._model, long_run_warnings(self._model, self._last)
        if model.recorded and not series.tables:
            texts.append(
                f"record: missing: the run so far has recorded {model.recorded}; give the same to "
                "go on with its series"
            )
        if self._fresh and self._folder is not None:
            own = series.path if series.tables else None
            texts += set_aside(self._folder, model.deck.output.tag_pp, own)
        return texts

    def at_end(self) -> list[str]:
        """Warnings after the last step."""
        if not self._fresh or self._folder is None or callable(self._progress):
            return []
        return left_files(self._model, self._folder)

    @contextmanager
    def shown(self) -> Iterator[Observer | None]:
        """Show a line at the start of the run and then how far it is.

        Yields
        ------
        callable or None
            To be called with the model about ten times a second.
        """
        progress = self._progress
        if callable(progress):
            yield progress
        elif progress or (progress is None and _watched()):
            from rich.console import Console  # rich takes a quarter of a second to load

            from .runlog import show_progress

            console = Console(stderr=True, highlight=False)
            console.print(opening(self._model, self._last), markup=False, soft_wrap=True)
            with show_progress(console, self._model.n, self._last) as update:
                yield update
        else:
            yield None

    def stopped(self, error: BaseException) -> BaseException:
        """Make the error that tells how the run was stopped by a signal and how to go on.

        Parameters
        ----------
        error : KeyboardInterrupt or Terminated
            What has stopped it.
        """
        if isinstance(error, KeyboardInterrupt) and error.args:
            return error  # the user's own
        from .summary import time_text

        model = self._model
        where = f"stopped after step {model.n} of {self._last}, t = {time_text(model.time)}"
        saved = model.last_checkpoint
        if self._folder is None or saved is None:
            rest = "nothing is saved: run(output=...) writes a checkpoint when it is stopped"
        elif model.scripted:
            rest = f"{saved} is written: run the script again with run(..., resume=True)"
        else:
            rest = f"{saved} is written: go on with `peridem resume {self._folder}`"
        if isinstance(error, KeyboardInterrupt):
            return KeyboardInterrupt(f"{where}; {rest}")
        if not callable(self._progress):  # SystemExit itself says nothing
            print(f"peridem: SIGTERM: {where}; {rest}", file=sys.stderr)
        return error
