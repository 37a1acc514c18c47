"""The loop of a run: steps between outputs, checkpoints, records and callbacks."""

from __future__ import annotations

import contextlib
import time as clock
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from .background import Job as FileJob
from .checkpoint import CheckpointWriter
from .diagnostics import check_finite
from .errors import InputError, NumericalError
from .interrupt import StopSignals
from .recorder import Recorder
from .series import SeriesRecorder

if TYPE_CHECKING:
    from .model import DEMModel

Observer = Callable[["DEMModel"], object]

PROGRESS_SECONDS = 0.1
"""Longest time [s] between two looks at signals and progress, unless one step takes longer."""


@dataclass(frozen=True)
class Job:
    """What a run is asked to do.

    Attributes
    ----------
    last : int
        Step to stop after.
    output : Path or None
        Folder for results.
    callback : callable or None
        Called with the model at the start and after every `callback_every` steps.
    callback_every : int
        Steps between calls.
    progress : callable or None
        Called with the model about ten times a second.
    checkpoint_every : int or None
        Steps between checkpoints.
    series : SeriesRecorder
        Records time series.
    """

    last: int
    output: Path | None
    callback: Observer | None
    callback_every: int
    progress: Observer | None
    checkpoint_every: int | None
    series: SeriesRecorder


def drive(model: DEMModel, job: Job) -> None:
    """Take the steps of a run and write what it is to leave.

    Raises
    ------
    InputError, NumericalError, KeyboardInterrupt, Terminated
        As `DEMModel.run` says.
    """
    with contextlib.ExitStack() as stack:
        signals = stack.enter_context(StopSignals(active=job.output is not None))
        checkpoints = _open_checkpoints(model, job)
        recorder = stack.enter_context(_open_recorder(model, job.output))
        stack.enter_context(model.background)
        job.series.begin(model)
        model.start()
        stack.enter_context(job.series)
        _observe(model, recorder, job)
        while model.n < job.last and signals.noted is None and model.stop_reason is None:
            ends = [*recorder.intervals, *job.series.intervals]
            ends += [job.callback_every] if job.callback is not None else []
            ends += [checkpoints.every] if checkpoints and checkpoints.every else []
            stop = min(job.last, *((model.n // end + 1) * end for end in ends))
            with _last_state(recorder):
                model.advance(stop - model.n, PROGRESS_SECONDS)
            model.background.check()
            _observe(model, recorder, job)
            if checkpoints is not None and checkpoints.is_due(model.n):
                _save(model, checkpoints, job)
            if job.progress is not None:
                job.progress(model)
        if signals.noted is None:
            _observe_end(model, recorder, job)
        # A run that stops short can be gone on with.
        short = model.stop_reason is None and model.n < model.n_steps
        if checkpoints is not None and (checkpoints.every or signals.noted is not None or short):
            _save(model, checkpoints, job)


@contextlib.contextmanager
def _last_state(recorder: Recorder) -> Iterator[None]:
    """Write the state that a numerical failure leaves, and say where it is."""
    try:
        yield
    except NumericalError as error:
        path = recorder.write_last()
        if path is None:
            raise
        raise NumericalError(f"{error}; the last state is in {path}") from error


def _observe(model: DEMModel, recorder: Recorder, job: Job) -> None:
    with _timed_output(model):
        with _last_state(recorder):
            check_finite(model)
        recorder.record()
        model.stop_reason = recorder.stop_reason
        job.series.sample(model)
    if job.callback is not None and model.n % job.callback_every == 0:
        job.callback(model)


def _observe_end(model: DEMModel, recorder: Recorder, job: Job) -> None:
    """Write and record the last state, whatever the intervals."""
    with _timed_output(model):
        recorder.record_end()
        job.series.sample(model, at_end=True)


def _open_recorder(model: DEMModel, folder: Path | None) -> Recorder:
    goes_on = model.note_goes_on(folder is not None)
    return Recorder(model, folder, goes_on=goes_on, background=model.background)


def _open_checkpoints(model: DEMModel, job: Job) -> CheckpointWriter | None:
    every = job.checkpoint_every
    if job.output is None:
        if every is not None:
            raise InputError(f"checkpoint_every = {every}: checkpoints need a folder; give output")
        return None
    model.checkpoint_every = model.checkpoint_every if every is None else every
    recorded = ", ".join(table.name for table in job.series.tables) or model.recorded
    return CheckpointWriter(
        job.output, model, model.checkpoint_every, model.last_checkpoint, recorded
    )


def _save(model: DEMModel, checkpoints: CheckpointWriter, job: Job) -> None:
    if checkpoints.last_step == model.n:
        return

    def take() -> FileJob:
        write = checkpoints.take(model)

        def save() -> None:
            model.last_checkpoint = write()

        return save

    with _timed_output(model):
        job.series.save()  # at once, so that a checkpoint never knows more than the series
        model.background.submit(take)


@contextlib.contextmanager
def _timed_output(model: DEMModel) -> Iterator[None]:
    """Count the time of the ``with`` as output, but for waiting."""
    begin, waited = clock.perf_counter(), model.background.seconds_waited
    yield
    waited = model.background.seconds_waited - waited
    model.note_output_time(clock.perf_counter() - begin - waited)
