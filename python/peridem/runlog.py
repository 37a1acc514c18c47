"""A run's log file, and its progress on the terminal or in a pipe."""

from __future__ import annotations

import contextlib
import time as clock
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, Any

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)

from .errors import InputError
from .summary import time_text

__all__ = ["LINE_SECONDS", "RunLog", "show_progress"]

LINE_SECONDS = 10.0
"""Without a terminal a line of progress appears this often [s]."""


class RunLog:
    """The log file of a run: plain lines, each on disk once written.

    Parameters
    ----------
    path : Path
        The file; replaced unless `append`. Its folder is created when missing.
    append : bool
        Go on with an existing log (a resumed run).

    Raises
    ------
    InputError
        If the file cannot be opened.
    """

    def __init__(self, path: Path, *, append: bool = False) -> None:
        self.path = path
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file: IO[str] = path.open("a" if append else "w", encoding="utf-8")
        except OSError as error:
            raise InputError(
                f"{path}: the log file cannot be written: {error.strerror}; "
                "choose another folder (Output.Path, --output or output=)"
            ) from error

    def write(self, text: str) -> None:
        """Add a line (or several). A full disk costs log lines, never the run."""
        with contextlib.suppress(OSError):
            self._file.write(text.rstrip() + "\n")
            self._file.flush()

    def __enter__(self) -> RunLog:
        return self

    def __exit__(self, *_: object) -> None:
        with contextlib.suppress(OSError):
            self._file.close()


@contextlib.contextmanager
def show_progress(
    console: Console, first: int, last: int, *, quiet: bool = False
) -> Iterator[Callable[[Any], None]]:
    """Show how far a run is: a bar on a terminal, else a line now and then.

    Parameters
    ----------
    console : Console
        Where to show it.
    first, last : int
        Number of steps done before and after the run.
    quiet : bool
        Show nothing.

    Yields
    ------
    callable
        To be called with the model, as often as one likes.
    """
    if quiet:
        yield lambda model: None
    elif console.is_terminal:
        with _bar(console) as bar:
            task = bar.add_task("", total=last - first, time="0 s", rate="")
            yield _BarUpdate(bar, task, first)
    else:
        yield _Lines(console, first, last)


def _bar(console: Console) -> Progress:
    return Progress(
        MofNCompleteColumn(),
        TextColumn("steps"),
        BarColumn(bar_width=None),
        TextColumn("t = {task.fields[time]}"),
        TextColumn("{task.fields[rate]}"),
        TimeRemainingColumn(),
        TextColumn("left"),
        console=console,
        transient=True,
    )


class _BarUpdate:
    """Moves the bar, with the mean rate since the start."""

    def __init__(self, bar: Progress, task: TaskID, first: int) -> None:
        self._bar, self._task, self._first = bar, task, first
        self._began = clock.perf_counter()

    def __call__(self, model: Any) -> None:
        done = model.n - self._first
        rate = done / max(clock.perf_counter() - self._began, 1e-9)
        self._bar.update(
            self._task, completed=done, time=time_text(model.time), rate=f"{rate:.0f} steps/s"
        )


class _Lines:
    """Prints a line at most every `LINE_SECONDS`."""

    def __init__(self, console: Console, first: int, last: int) -> None:
        self._console, self._first, self._last = console, first, last
        self._began = self._shown = clock.perf_counter()

    def __call__(self, model: Any) -> None:
        now = clock.perf_counter()
        if now - self._shown < LINE_SECONDS:
            return
        self._shown = now
        rate = (model.n - self._first) / (now - self._began)
        left = f"{(self._last - model.n) / rate:.0f} s left" if rate > 0 else "no step done yet"
        self._console.print(
            f"step {model.n} of {self._last}, t = {time_text(model.time)}, "
            f"{rate:.0f} steps/s, {left}",
            highlight=False,
            soft_wrap=True,
        )
