"""The command `peridem`: run a deck, go on with a run, check a deck, draw results, run the demo.

Exit codes: 0 success, 2 bad input or usage, 3 numerical failure, 130 stopped by Ctrl-C, 143 by
SIGTERM.
"""

from __future__ import annotations

import contextlib
import errno
import os
import sys
import time as clock
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
from rich.console import Console, RenderableType

from . import __version__
from .command import BAD_INPUT, fail, with_exit_codes
from .errors import InputError, NumericalError, PeridemWarning
from .interrupt import Terminated
from .memory import machine_memory, predict_memory, refuse_too_large
from .model import DEMModel
from .output import older_files, read_pvd, series_path
from .render_command import render
from .runlog import RunLog, show_progress
from .summary import (
    facts,
    output_plan,
    prediction_text,
    time_text,
    timing_rows,
    timing_table,
    zone_table,
)

__all__ = ["main"]

DEMO_DECK = Path(__file__).parent / "demo" / "input.yaml"
DEMO_PICTURE = "peridem_demo.png"
LOG_NAME = "peridem.log"
PIPE_WIDTH = 120
"""Characters in a line of a table that does not go to a terminal."""


class _Program(click.Group):
    """The group of commands; a standard output that is full ends it with one line.

    A closed pipe (``| head``) ends it quietly with exit code 1, which is click's own doing.
    """

    def main(self, *args: Any, **kwargs: Any) -> Any:
        """Run the command that the arguments name."""
        try:
            return super().main(*args, **kwargs)
        except OSError as error:
            _forget_output()
            where = error.filename or "the standard output"
            fail(
                f"error: {where}: {error.strerror or error}; free some space, or write elsewhere",
                BAD_INPUT,
            )


def _forget_output() -> None:
    """Drop what standard output still holds, which Python would try to write at its end."""
    with contextlib.suppress(OSError, ValueError):  # a stream without a file has no number
        descriptor = os.open(os.devnull, os.O_WRONLY)
        os.dup2(descriptor, sys.stdout.fileno())
        os.close(descriptor)


class _Console(Console):
    """A console that leaves a closed pipe to click."""

    def on_broken_pipe(self) -> None:
        """Raise the error again instead of ending the program here."""
        raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE))


DECK = click.argument("deck", type=click.Path(exists=True, dir_okay=False, path_type=Path))
THREADS = click.option(
    "--threads",
    type=click.IntRange(min=1),
    metavar="N",
    help="Threads to use; all cores if left out.",
)
COMPATIBILITY = click.option(
    "--compatibility",
    type=click.Choice(["original", "corrected"]),
    help="Reproduce the original program's known defects, or correct them (the default).",
)
STRICT = click.option(
    "--strict", is_flag=True, help="Refuse a time step above the estimated stable one."
)
STEPS = click.option("--steps", type=click.IntRange(min=0), metavar="N", help="Stop after N steps.")
CHECKPOINT_EVERY = click.option(
    "--checkpoint-every",
    type=click.IntRange(min=1),
    metavar="N",
    help="Write a checkpoint every N steps, to go on from with `peridem resume`.",
)
QUIET = click.option("--quiet", is_flag=True, help="Print warnings and errors only.")
ALLOW_OVERLAP = click.option(
    "--allow-overlap", is_flag=True, help="Accept bodies that overlap at the start."
)


@click.group(cls=_Program, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="peridem")
def main() -> None:
    """Granular media whose grains deform and break."""


@main.command()
@DECK
@THREADS
@click.option(
    "--output",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="DIR",
    help="Folder for the results, instead of the deck's Output.Path.",
)
@STEPS
@CHECKPOINT_EVERY
@COMPATIBILITY
@STRICT
@ALLOW_OVERLAP
@QUIET
@with_exit_codes
def run(
    *,
    deck: Path,
    threads: int | None,
    output: Path | None,
    steps: int | None,
    checkpoint_every: int | None,
    compatibility: str | None,
    strict: bool,
    allow_overlap: bool,
    quiet: bool,
) -> None:
    """Run DECK, an input file in YAML.

    Ctrl-C and SIGTERM stop the run after the current step, with a checkpoint.
    """
    model = DEMModel.from_deck(
        deck,
        threads=threads,
        compatibility=compatibility,
        strict=strict,
        allow_overlap=allow_overlap,
    )
    _run(model, _Job(output, steps, checkpoint_every, quiet))


@main.command()
@click.argument("output_dir", type=click.Path(exists=True, file_okay=False, path_type=Path))
@THREADS
@STEPS
@CHECKPOINT_EVERY
@click.option("--tag", metavar="TAG", help="Tag_PP of the run, if OUTPUT_DIR has several.")
@click.option(
    "--without-series", is_flag=True, help="Go on although nothing more will be recorded."
)
@QUIET
@with_exit_codes
def resume(
    *,
    output_dir: Path,
    threads: int | None,
    steps: int | None,
    checkpoint_every: int | None,
    tag: str | None,
    without_series: bool,
    quiet: bool,
) -> None:
    """Go on with the run whose results are in OUTPUT_DIR, from its newest checkpoint."""
    model = DEMModel.resume(output_dir, threads=threads, tag=tag)
    if model.recorded and not without_series:
        raise InputError(
            f"{model.last_checkpoint}: is of a Python script that records {model.recorded}: the "
            "command line cannot go on with that; run the script again with model.run(..., "
            "resume=True), or give --without-series"
        )
    _run(model, _Job(output_dir, steps, checkpoint_every, quiet, resumed=True))


@main.command()
@DECK
@COMPATIBILITY
@STRICT
@ALLOW_OVERLAP
@with_exit_codes
def check(*, deck: Path, compatibility: str | None, strict: bool, allow_overlap: bool) -> None:
    """Say what DECK describes, or what is wrong with it, without running it."""
    model = DEMModel.from_deck(
        deck, compatibility=compatibility, strict=strict, allow_overlap=allow_overlap
    )
    out = _console()
    prediction = predict_memory(model)
    refuse_too_large(prediction, machine_memory(), deck.name)
    model.init()
    _print(out, f"deck: {deck} (sha256 {model.deck.sha256})")
    for name, text in facts(model):
        _print(out, f"{name}: {text}")
    _print(out, f"memory predicted before the bonds: {prediction_text(prediction)}")
    _print(out, f"output: {output_plan(model)}, in {_folder(model, None)}")
    out.print(zone_table(model))
    for text in _remarks(model):
        _print(out, text)
    _print(out, "The deck can be run.")


@main.command()
@click.option(
    "--threads",
    type=click.IntRange(min=1),
    default=1,
    metavar="N",
    help="Threads to use; one if left out, since two grains are little work.",
)
@click.option(
    "--output",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path(),
    metavar="DIR",
    help="Folder for the results; the current one if left out.",
)
@with_exit_codes
def demo(*, threads: int, output: Path) -> None:
    """Run a small impact in which a grain breaks, and draw it."""
    model = _run(DEMModel.from_deck(DEMO_DECK, threads=threads), _Job(output))
    picture = output / DEMO_PICTURE
    model.render("Damage", picture)
    series = series_path(output, model.deck.output.tag_pp)
    out = _console()
    _print(out, f"Look at {picture}: a disc has struck a grain in its waist and broken it in two.")
    _print(out, f"In ParaView open {series}, press Apply and colour by Damage_Z.")
    _print(out, f"The deck is {DEMO_DECK}: copy its folder, change it, and `peridem run` it.")


main.add_command(render)


@dataclass(frozen=True)
class _Job:
    """What a run is asked to do; None is the deck's choice."""

    output: Path | None = None
    steps: int | None = None
    checkpoint_every: int | None = None
    quiet: bool = False
    resumed: bool = False


def _run(model: DEMModel, job: _Job) -> DEMModel:
    """Run a model with log and progress, and say what came of it."""
    out, err = _console(), _console(stderr=True)
    folder = _folder(model, job.output)
    began = clock.perf_counter()
    model.init()  # first, so that a deck it refuses does not cost the log of an earlier run
    with RunLog(folder / LOG_NAME, append=job.resumed) as log:
        _open_log(log, job, model)
        for text in _remarks(model):
            log.write(text)
            if not job.quiet or text.startswith("warning"):
                _print(err, text)
        first = model.n
        last = model.n_steps if job.steps is None else first + job.steps
        written = _Written(folder, model)
        ending = "stopped by an error"
        known = list(model.warnings)
        try:
            with _printed_here(), show_progress(err, first, last, quiet=job.quiet) as progress:
                model.run(
                    output=folder,
                    steps=job.steps,
                    progress=progress,
                    checkpoint_every=job.checkpoint_every,
                )
            ending = "stopped by Output_Criteria" if model.stop_reason else "finished"
        except KeyboardInterrupt:
            ending = "stopped by Ctrl-C"
            raise
        except Terminated:
            ending = "stopped by SIGTERM"
            raise
        except NumericalError as error:
            ending = "stopped by a numerical failure"
            log.write(f"error: {error}")
            raise
        except InputError as error:
            log.write(f"error: {error}")
            raise
        finally:
            seconds = clock.perf_counter() - began
            for text in (one for one in model.warnings if one not in known):
                log.write(f"warning: {text}")
                with contextlib.suppress(OSError):
                    _print(err, f"warning: {text}")
            report = _Report(model, ending, seconds, model.n - first, written)
            at_end = ending in ("finished", "stopped by Output_Criteria")
            # Output that cannot be printed must not hide the error that ends the run.
            with contextlib.nullcontext() if at_end else contextlib.suppress(OSError):
                report.show(log, None if job.quiet else out, out if at_end else err)
    return model


@contextlib.contextmanager
def _printed_here() -> Iterator[None]:
    """Leave warnings to the printing of this module."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PeridemWarning)
        yield


class _Written:
    """The result files of this run, told from those of an earlier one by their time."""

    def __init__(self, folder: Path, model: DEMModel) -> None:
        self.series = series_path(folder, model.deck.output.tag_pp or None)
        self._before = self._stamp()

    def _stamp(self) -> int | None:
        return self.series.stat().st_mtime_ns if self.series.exists() else None

    def text(self) -> list[str]:
        """Lines that say what was written and what was there before."""
        if self._stamp() in (None, self._before):
            return ["no vtu files were written"]
        names = [path.name for _, path in read_pvd(self.series)]
        lines = [
            f"{len(names)} vtu files in {self.series.parent}; open {self.series.name} in ParaView"
        ]
        older = older_files(self.series, names)
        if older:
            lines.append(
                f"note: {len(older)} vtu files of an earlier run are left in the folder "
                f"({older[0].name}, ...); {self.series.name} does not list them"
            )
        return lines


@dataclass(frozen=True)
class _Report:
    """The end of a run: what was reached, what was written, where the time went."""

    model: DEMModel
    ending: str
    seconds: float
    steps: int
    written: _Written

    def lines(self) -> list[str]:
        known: dict[str, Any] = self.model.summary()
        return [
            f"{self.ending} after step {self.model.n}, t = {time_text(self.model.time)}; "
            f"{known['broken_bonds']} of {known['bonds']} bonds are broken",
            *([known["stop_reason"]] if known["stop_reason"] else []),
            *self.written.text(),
            *self._going_on(),
        ]

    def _going_on(self) -> list[str]:
        """Say how to go on, when the run has more steps to take and a checkpoint for that."""
        checkpoint = self.model.last_checkpoint
        ended = self.model.n >= self.model.n_steps or self.model.stop_reason is not None
        if checkpoint is None or ended:
            return []
        return [f"go on from {checkpoint.name} with `peridem resume {checkpoint.parent}`"]

    def show(self, log: RunLog, table_on: Console | None, lines_on: Console) -> None:
        """Write everything to the log, and to consoles unless the run is to be quiet."""
        rows = timing_rows(self.model.timings, self.seconds, self.steps)
        lines = self.lines()
        for line in lines:
            log.write(line)
        for name, seconds, share, per_step in rows:
            log.write(
                f"time: {name:<16} {seconds:10.3f} s {100 * share:6.1f} % {per_step:10.1f} us/step"
            )
        for line in lines if table_on is not None or lines_on.stderr else []:
            _print(lines_on, line[:1].upper() + line[1:])
        if table_on is not None and self.steps:
            table_on.print(timing_table(rows))


def _open_log(log: RunLog, job: _Job, model: DEMModel) -> None:
    log.write(f"peridem {__version__}")
    log.write(f"deck: {model.deck.path} (sha256 {model.deck.sha256})")
    if job.resumed:
        log.write(f"resumed from {model.last_checkpoint} after step {model.n}")
    for name, text in facts(model):
        log.write(f"{name}: {text}")
    log.write(f"threads: {model.threads}")
    log.write(f"output: {output_plan(model)}")
    if job.steps is not None:
        log.write(f"steps asked for: {job.steps}")


def _remarks(model: DEMModel) -> list[str]:
    """List the notes of the deck and the warnings of the model, each one line."""
    return [f"note: {text}" for text in model.notes] + [
        f"warning: {text}" for text in model.warnings
    ]


def _folder(model: DEMModel, output: Path | None) -> Path:
    return output if output is not None else model.deck.path.parent / model.deck.output.path


def _console(*, stderr: bool = False) -> Console:
    console = _Console(stderr=stderr, highlight=False)
    if not console.is_terminal:
        console.width = PIPE_WIDTH
    return console


def _print(console: Console, text: RenderableType) -> None:
    console.print(text, markup=False, highlight=False, soft_wrap=True)
