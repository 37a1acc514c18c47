"""`DEMModel`: a model of grains, from its bodies to its last step."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .background import BackgroundWriter
from .build import build_model
from .checkpoint import EnergyAccounts, newest_checkpoint
from .deck import read_deck
from .diagnostics import check_finite
from .driving import PROGRESS_SECONDS, Job, Observer, drive
from .duration import interval_in_steps
from .errors import InputError, NumericalError
from .files import path_of
from .interrupt import Terminated
from .modelling.arguments import check_callable, checked, choice, number, vector, whole
from .modelling.plan import ModelPlan
from .particle import Particle
from .restart import find_deck
from .result import Result
from .series import SeriesRecorder, make_tables, series_file
from .staged import StagedModel
from .telling import RunTeller, checked_progress, interval_warnings, warn_of
from .view import FloatArray

SAFETY = 0.5
"""Part of the estimated stable time step that is taken when none is given."""

_SCHEMES = ("velocity_verlet", "central_difference")


class DEMModel(StagedModel):
    """Deformable, breakable grains in contact: a model and its state.

    Made here and filled with `add_particle`, `set_contact`, `prescribe` and their like, or read
    from a deck by `from_deck`. `run` drives it; `init` builds bonds and contact before, `step`
    takes single steps. The arrays of `state` are views of the core's memory: they show every
    step, stay valid as long as anything refers to them, and those that are writable (x, u, v, f,
    theta, damage_z) take what a driver writes between steps.

    Parameters
    ----------
    dimension : {2, 3}
        Dimension; in 2D quantities are per unit thickness.
    gravity : sequence of 2 or 3 floats, optional
        Acceleration of gravity [m/s^2]; none when left out.
    dt : float, optional
        Time step [s], shortened so that whole steps fill the duration of the run. When left out
        it is `safety` times the estimated stable one.
    safety : float
        Part of the estimated stable time step, above 0 and at most 1. The default is for
        stability; 0.1 closes the energy balance of hard impacts and fracture within 1e-3.
    scheme : {"velocity_verlet", "central_difference"}
        Time integrator.
    compatibility : {"corrected", "original"}
        Whether known defects of the original program are corrected or reproduced.
    threads : int, optional
        Number of threads, at least 1; when left out that of the environment variable
        PERIDEM_THREADS, or all processors. Results do not depend on it.
    strict : bool
        Refuse a time step above the estimated stable one instead of warning.
    allow_overlap : bool
        Accept bodies that overlap at the start.

    Raises
    ------
    InputError
        If an argument breaks its rule.

    References
    ----------
    Jha, Desai, Bhattacharya, Lipton, JMPS 151 (2021) 104376.

    Examples
    --------
    >>> import peridem as pd
    >>> model = pd.DEMModel(dimension=2, gravity=(0, -10))
    >>> model
    <DEMModel 2D: no bodies yet>
    """

    @checked
    def __init__(
        self,
        dimension: int = 2,
        *,
        gravity: Sequence[float] | None = None,
        dt: float | None = None,
        safety: float = SAFETY,
        scheme: str = "velocity_verlet",
        compatibility: str = "corrected",
        threads: int | None = None,
        strict: bool = False,
        allow_overlap: bool = False,
    ) -> None:
        who = "DEMModel"
        if dimension not in (2, 3):
            raise InputError(f"{who}: dimension = {dimension!r}: must be 2 or 3; choose one")
        pull = (0.0, 0.0, 0.0) if gravity is None else gravity
        self._plan: ModelPlan | None = ModelPlan(
            dimension=int(dimension),
            gravity=vector(pull, f"{who}: gravity", dimension, unit="m/s^2"),
            scheme=choice(scheme, _SCHEMES, f"{who}: scheme"),
            compatibility=choice(compatibility, ("corrected", "original"), f"{who}: compatibility"),
        )
        self._dt_wanted = None if dt is None else number(dt, f"{who}: dt", above=0, unit="s")
        self._safety = number(safety, f"{who}: safety", above=0)
        if self._safety > 1:
            raise InputError(f"{who}: safety = {safety!r}: must be at most 1; give 0.5 for half")
        self._prepare(compatibility, _thread_count(threads), strict, allow_overlap)

    @classmethod
    def from_deck(
        cls,
        path: str | os.PathLike[str],
        threads: int | None = None,
        compatibility: str | None = None,
        *,
        strict: bool = False,
        allow_overlap: bool = False,
    ) -> DEMModel:
        """Read a deck of the original program and place its bodies.

        Parameters
        ----------
        path : path-like
            The YAML file.
        threads : int, optional
            Number of threads, at least 1; all processors when left out. Results do not
            depend on it.
        compatibility : {"original", "corrected"}, optional
            Whether known defects of the original are reproduced; overrides
            ``Model.Compatibility`` of the deck (default corrected).
        strict : bool
            Refuse a time step above the estimated stable one instead of warning.
        allow_overlap : bool
            Accept bodies that overlap at the start. Both are looked at by `init`.

        Returns
        -------
        DEMModel

        Raises
        ------
        InputError
            If the deck, or a file it names, breaks a rule.
        """
        count = _thread_count(threads)
        if compatibility not in (None, "original", "corrected"):
            raise InputError(
                f"compatibility = {compatibility!r}: must be 'original' or 'corrected'; choose one"
            )
        deck = read_deck(path_of(path, "from_deck: path"))
        built = build_model(deck, threads=count, compatibility=compatibility)
        model = cls.__new__(cls)
        model._plan = None
        model._prepare(compatibility or deck.model.compatibility, count, strict, allow_overlap)
        model._take(deck, built)
        model._duration_known = True
        model._restarts = deck.restart is not None
        return model

    @classmethod
    def resume(
        cls,
        folder: str | os.PathLike[str],
        threads: int | None = None,
        tag: str | None = None,
    ) -> DEMModel:
        """Go on from the newest checkpoint in an output folder that is not damaged.

        The deck is found, and its mode of compatibility taken, from the checkpoint; a
        ``Restart`` block in it has had its effect. `run` goes on with the same interval of
        checkpoints and, given the same folder, with the same series of outputs. A model that was
        made in Python goes on from the deck in its output folder; when no deck can say it, run
        its script again with ``run(..., resume=True)``.

        Parameters
        ----------
        folder : path-like
            Output folder of the run.
        threads : int, optional
            Number of threads; results do not depend on it.
        tag : str, optional
            ``Output.Tag_PP`` of the run, when the folder has several.

        Returns
        -------
        DEMModel
            Initialised and started; `warnings` names damaged checkpoints.

        Raises
        ------
        InputError
            If no checkpoint is usable, or the deck or its files have changed since.
        """
        checkpoint, problems = newest_checkpoint(path_of(folder, "resume: folder"), tag)
        path = find_deck(checkpoint)
        model = cls.from_deck(path, threads, checkpoint.compatibility, allow_overlap=True)
        model._restarts = False
        model._go_on(checkpoint, problems)
        return model

    def __repr__(self) -> str:
        if self._built is None:
            assert self._plan is not None
            head = f"<DEMModel {self._plan.dimension}D: "
            return f"{head}{len(self._plan.bodies) or 'no'} bodies{_yet(self._plan)}>"
        bonds = f", {len(self.bonds.intact) // 2} bonds" if self._initialized else ""
        return (
            f"<DEMModel {self.dimension}D: {len(self.bodies)} bodies, {self.n_nodes} nodes{bonds}; "
            f"step {self.n}, t = {self.time:g} s>"
        )

    # Stepping.

    def set_intact(self, intact: ArrayLike) -> None:
        """Set which bonds are unbroken.

        Parameters
        ----------
        intact : array_like of bool or int, shape (n_bonds,)
            Zero for broken bonds, in the order of `bonds`.

        Raises
        ------
        InputError
            If the length is wrong or the two directions of a bond differ.
        """
        self.init()
        self._core.set_intact(np.ascontiguousarray(intact, dtype=np.uint8))

    def mark_started(
        self, n: int, time: float, nodes: NDArray[np.int32], elongations: FloatArray
    ) -> None:
        """Take the arrays of `state` and the bond flags as those of a running model.

        Parameters
        ----------
        n : int
            Number of steps taken.
        time : float
            Simulated time [s].
        nodes : ndarray, shape (k, 2)
            Node pairs of `friction_springs`.
        elongations : ndarray, shape (k, 3)
            Elongations [m] of these springs.
        """
        self._core.restore(n, time, nodes, elongations)

    def restore_energy(self, accounts: EnergyAccounts) -> None:
        """Go on with the energy accounts of a checkpoint."""
        self._tracks_energy = True
        self._core.restore_energy(accounts.flows, *accounts.forces, accounts.prescribed_works)

    def start(self) -> None:
        """Apply the initial velocity and compute the forces at t = 0; done once."""
        self.init()
        self._core.start()

    def step(self, n: int = 1) -> None:
        """Take `n` time steps.

        Parameters
        ----------
        n : int
            Number of steps, not negative. Ctrl-C takes effect after a whole step.

        Raises
        ------
        InputError
            If `n` is negative or not a whole number.
        NumericalError
            If a velocity runs away, or a position, velocity or force is no longer finite.
        """
        whole(n, "n", 0)
        self.start()
        while n > 0:
            n -= self.advance(n, PROGRESS_SECONDS)
        check_finite(self)

    def advance(self, n: int, seconds: float) -> int:
        """Take up to `n` steps of a started model in about `seconds`; return how many."""
        return int(self._core.advance(n, seconds))

    def compute_forces(self) -> None:
        """Compute f, theta and damage_z of the current u, x and v, breaking bonds."""
        self.init()
        self._core.compute_forces()

    # Running.

    @checked
    def run(
        self,
        output: str | os.PathLike[str] | None = None,
        steps: int | None = None,
        callback: Observer | None = None,
        every: float | None = None,
        progress: Observer | bool | None = None,
        *,
        until: float | None = None,
        tags: Sequence[str] | None = None,
        checkpoint_every: float | None = None,
        callback_every: float | None = None,
        record: Any = (),
        record_every: float | None = None,
        record_to: str | os.PathLike[str] | None = None,
        resume: bool = False,
    ) -> Result:
        """Run to a time, for some steps, or to the end of the deck.

        Intervals are numbers of steps when they are whole numbers (``50``), and times in seconds
        otherwise (``2e-5``).

        Parameters
        ----------
        output : path-like, optional
            Folder for vtu files and checkpoints; none are written without. A model made in
            Python is written there as a deck, too, if one can say it.
        steps : int, optional
            Number of steps. Before the first step of a model without `dt` it may be given
            together with `until`: then the time step is until / steps.
        callback : callable, optional
            Called with the model at the start and at intervals. Files of the outputs so far may
            still be on their way: they are written in the background.
        every : int or float, optional
            Interval of outputs; that of the deck, or a hundredth of the run, when left out. A
            model made in Python writes its last state, too, when no interval ends there.
        progress : bool or callable, optional
            Whether to say on standard error how long the run will be and how far it is; on a
            terminal only, when left out. A function is called with the model about ten times a
            second instead.
        until : float, optional
            Simulated time to stop at [s].
        tags : sequence of str, optional
            Arrays in the vtu files: tags of ``Output.Tags`` of a deck.
        checkpoint_every : int or float, optional
            Interval of checkpoints ``checkpoint_<step>.h5`` in `output`, of which the last two
            are kept; also written after the last step. By default none, and in a resumed run the
            interval it had. With `output`, a run that stops before the last step of the model
            (`steps`, Ctrl-C, SIGTERM) writes one in any case, to be gone on with.
        callback_every : int or float, optional
            Interval of `callback`; that of outputs when left out.
        record : list of str, recorders and functions, optional
            What to record, see `peridem.recorders`.
        record_every : int or float, optional
            Interval of recorders without one of their own; that of outputs when left out. The
            last state is recorded, too.
        record_to : path-like, optional
            File for what is recorded, .csv or .parquet; ``series.csv`` in `output` when left out.
            A name without a folder is a file in `output`, if that is given.
        resume : bool
            Go on from the newest checkpoint in `output`, bit for bit; start when there is none.
            For scripts that make a model and may be run again.

        Returns
        -------
        Result
            What was recorded, and a summary.

        Raises
        ------
        InputError
            If an argument breaks its rule or the folder cannot be written.
        NumericalError
            If a velocity runs away, or a position, velocity or force is no longer finite; with
            `output`, the state is in ``output_last.vtu``.
        KeyboardInterrupt
            After Ctrl-C: the step is whole, with `output` a checkpoint is written; it says so.
        Terminated
            Likewise after SIGTERM, with `output`; a SystemExit with code 143.

        Warns
        -----
        PeridemWarning
            Each of `warnings`, once.
        """
        if steps is not None:
            steps = whole(steps, "steps", 0)
        if until is not None:
            until = number(until, "until", above=0, unit="s")
        folder = None if output is None else path_of(output, "output")
        check_callable(callback, "callback")
        progress = checked_progress(progress)
        self._every_wanted = every if isinstance(every, float) else None
        last = self._resumed(folder, until, steps) if resume else self._last_step(until, steps)
        dt = self.dt
        self._plan_output(folder, every, tags)
        interval = self.output_interval

        def in_steps(name: str, value: float | None, default: int) -> int:
            return default if value is None else interval_in_steps(name, value, dt)

        recorded_every = in_steps("record_every", record_every, interval)
        series = SeriesRecorder(
            make_tables(
                record, recorded_every, lambda name, value: interval_in_steps(name, value, dt)
            ),
            series_file(record_to, folder, record),
            self.n if self._goes_on else None,
        )
        checkpoints = None
        if checkpoint_every is not None:
            checkpoints = interval_in_steps("checkpoint_every", checkpoint_every, dt)
        calls = in_steps("callback_every", callback_every, interval)
        given = {
            "every": (every, interval),
            "record_every": (record_every, recorded_every),
            "callback_every": (callback_every, calls),
        }
        told = RunTeller(self, last, folder, progress)
        self._note_warnings([*interval_warnings(last, given), *told.at_start(series)])
        self._warn()
        try:
            with told.shown() as observer:
                drive(self, Job(last, folder, callback, calls, observer, checkpoints, series))
        except (KeyboardInterrupt, Terminated) as error:
            raise told.stopped(error) from None
        self._note_warnings([*series.warnings(self), *told.at_end()])
        self._warn()
        return Result({**self.summary(), "warnings": list(self.warnings)}, folder, series)

    def _warn(self) -> None:
        """Raise what has become known as Python warnings, each once, at the caller of `run`."""
        new = [text for text in self.warnings if text not in self._warned]
        self._warned.update(new)
        warn_of(new, stacklevel=4)  # _warn, run, its check of the arguments, the user

    # For the loop of a run.

    @property
    def background(self) -> BackgroundWriter:
        """Who writes the files of a run while it goes on."""
        return self._background

    def note_output_time(self, seconds: float) -> None:
        """Count seconds of wall-clock time as spent on output."""
        self._output_seconds += seconds

    @property
    def goes_on(self) -> bool:
        """Whether outputs continue earlier ones."""
        return self._goes_on

    def note_goes_on(self, writes: bool) -> bool:
        """Tell whether outputs continue earlier ones, and note that they will if it `writes`."""
        goes_on = self._goes_on
        self._goes_on = goes_on or writes
        return goes_on


def _thread_count(threads: int | None) -> int:
    if threads is None and (said := os.environ.get("PERIDEM_THREADS", "")).isdecimal():
        return max(1, int(said))
    count = len(os.sched_getaffinity(0)) if threads is None else threads
    if not isinstance(count, int | np.integer) or isinstance(count, bool) or count < 1:
        raise InputError(f"threads = {threads!r}: must be at least 1; leave it out for all cores")
    return int(count)


def _yet(plan: ModelPlan) -> str:
    return "" if plan.bodies else " yet"


__all__ = ["DEMModel", "NumericalError", "Particle"]
