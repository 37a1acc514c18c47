"""`DEMModel`: a model of grains, from its bodies to its last step."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .bodies import BodyPlan
from .build import BuiltModel, build_model
from .checkpoint import Checkpoint, has_checkpoint, newest_checkpoint
from .checks import check_model, contact_time_step_note
from .compatibility import compatibility_notes
from .deck import Deck, Output, read_deck
from .diagnostics import check_finite
from .driving import PROGRESS_SECONDS, Job, Observer, drive
from .duration import exact_duration, interval_in_steps, steps_until
from .errors import InputError, NumericalError
from .mesh import Mesh
from .modelling.arguments import checked, choice, number, vector, whole
from .modelling.bodies import Bodies, Body
from .modelling.builder import ModelBuilder
from .modelling.export import check_sayable, write_deck
from .modelling.plan import Composition, ModelPlan
from .particle import Particle
from .restart import find_deck, restart_from_deck, restore
from .result import Result
from .series import SeriesRecorder, make_tables
from .view import FloatArray, ModelView

SAFETY = 0.5
"""Part of the estimated stable time step that is taken when none is given."""

DECK_FOLDER = "deck"
"""Folder, in that of the output, of the deck that a model made in Python is written as."""

TAGS = ("Displacement", "Velocity", "Particle_ID", "Damage_Z", "Damage")
"""Arrays in the vtu files of a model made in Python, unless said otherwise."""

_OUTPUTS = 100  # files of a run whose interval is not given
_SCHEMES = ("velocity_verlet", "central_difference")


class DEMModel(ModelBuilder, ModelView):
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
        Part of the estimated stable time step, above 0 and at most 1.
    scheme : {"velocity_verlet", "central_difference"}
        Time integrator.
    compatibility : {"corrected", "original"}
        Whether known defects of the original program are corrected or reproduced.
    threads : int, optional
        Number of threads, at least 1; all processors when left out. Results do not depend on it.
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

    def _prepare(self, compatibility: str, threads: int, strict: bool, allow_overlap: bool) -> None:
        """Set what models of decks and of Python have in common."""
        self.compatibility = compatibility
        self.warnings: list[str] = []
        self.notes: list[str] = []
        self.stop_reason: str | None = None
        self.output_interval = 1
        self.checkpoint_every: int | None = None
        self.last_checkpoint: Path | None = None
        self._composition: Composition | None = None
        self._built: BuiltModel | None = None
        self._deck: Deck | None = None
        self._names: dict[str, Body | Bodies] = {}
        self._thread_count = threads
        self._strict = strict
        self._allow_overlap = allow_overlap
        self._initialized = False
        self._duration_known = False
        self._time_step_from = "the deck"
        self._output_seconds = 0.0
        self._restarts = False
        self._goes_on = False

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
        deck = read_deck(Path(path))
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
        checkpoint, problems = newest_checkpoint(Path(folder), tag)
        path = find_deck(checkpoint)
        model = cls.from_deck(path, threads, checkpoint.compatibility, allow_overlap=True)
        model._restarts = False
        model._go_on(checkpoint, problems)
        return model

    def _go_on(self, checkpoint: Checkpoint, problems: list[str], **options: bool) -> None:
        restore(self, checkpoint, **options)
        self._goes_on = True
        self.warnings += problems
        self.checkpoint_every, self.last_checkpoint = checkpoint.every, checkpoint.path

    # What it is made of.

    def _take(self, deck: Deck, built: BuiltModel) -> None:
        self._deck, self._built = deck, built
        self.warnings += built.warnings
        self.notes += [*deck.notes, *compatibility_notes(deck, built.bodies, self.compatibility)]
        self.output_interval = deck.output.output_interval

    def _parts(self) -> BuiltModel:
        """Return the built model; models made in Python are built when they are first asked."""
        if self._built is None:
            assert self._plan is not None
            output = Output.model_validate({"Tags": list(TAGS), "Output_Interval": 1})
            composition = self._plan.compose(1.0, 1, output)
            try:
                built = build_model(
                    composition.deck, threads=self._thread_count, held=composition.held
                )
            except InputError as error:
                raise InputError(composition.words.say(str(error))) from error
            self._composition = composition
            for body in composition.layout.order:
                body._layout = composition.layout
            self._take(composition.deck, built)
            self._put_in_words()
        return self._built  # type: ignore[return-value]

    def _put_in_words(self) -> None:
        if self._composition is not None:
            say = self._composition.words.say
            self.warnings = [say(text) for text in self.warnings]
            self.notes = [say(text) for text in self.notes]

    @property
    def scripted(self) -> bool:
        """Whether the model was made in Python, not read from a deck."""
        return self._plan is not None

    @property
    def deck(self) -> Deck:
        """The blocks of its deck, read or made."""
        self._parts()
        assert self._deck is not None
        return self._deck

    @property
    def bodies(self) -> list[BodyPlan]:
        """Where the bodies are from, by their ids."""
        return self._parts().bodies

    @property
    def _core(self) -> Any:
        return self._parts().core

    @property
    def _meshes(self) -> list[Mesh]:
        return self._parts().meshes

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

    # Building.

    def init(self) -> None:
        """Build bonds, laws and contact, check the model, set a ``Restart`` state; done once.

        Nothing can be added to the model afterwards.

        Raises
        ------
        InputError
            If bodies overlap at the start (unless allowed), a test names a body that does not
            exist or, when strict, the time step is above the estimated stable one.
        """
        self._initialize(None, None)

    def _initialize(self, until: float | None, steps: int | None) -> None:
        if self._initialized:
            self._fix_duration(until, steps)
            return
        core = self._core
        try:
            core.init()
        except InputError as error:
            raise InputError(self._say(f"{self.deck.path.name}: {error}")) from error
        self._initialized = True
        try:
            self._fix_duration(until, steps)
            self.warnings += check_model(
                self, strict=self._strict, allow_overlap=self._allow_overlap
            )
        except InputError as error:
            self._initialized = False
            raise InputError(self._say(str(error))) from error
        note = contact_time_step_note(self)
        if note is not None:
            self.notes.append(note)
        self._put_in_words()
        if self._restarts:
            self._restarts, self._goes_on = False, True
            restart_from_deck(self)

    def _say(self, text: str) -> str:
        return text if self._composition is None else self._composition.words.say(text)

    def _fix_duration(self, until: float | None, steps: int | None) -> None:
        """Choose the time step of a model made in Python, before its first step."""
        if not self.scripted or self.started:
            return
        if until is not None and steps is not None:
            if self._dt_wanted is not None:
                raise InputError(
                    f"run: steps = {steps}: is given besides until and dt; keep two of them"
                )
            self._time_step_from = "until / steps"
            self._set_duration(until, steps)
            return
        dt = self._wanted_time_step()
        if until is not None:
            self._set_duration(until, max(steps_until(until, dt), 1))
        elif steps is not None:
            self._set_duration(*exact_duration(dt, steps))
        elif not self._duration_known:
            self._set_duration(dt, 1)
            self._duration_known = False

    def _wanted_time_step(self) -> float:
        if self._dt_wanted is not None:
            self._time_step_from = "given"
            return self._dt_wanted
        limits = self._core.stable_time_step()
        limit = min(value for value in limits if value > 0)
        if not np.isfinite(limit):
            raise InputError(
                "DEMModel: dt: missing; no stable time step can be estimated without bonds and "
                "contact: give it"
            )
        self._time_step_from = f"{self._safety:g} of the estimated stable one, {limit:.3g} s"
        return self._safety * float(limit)

    def _set_duration(self, final_time: float, steps: int) -> None:
        self._core.set_duration(final_time, steps)
        self._note_duration(final_time, steps)

    def _note_duration(self, final_time: float, steps: int) -> None:
        """Let the deck say how long the run is."""
        deck = self.deck
        model = deck.model.model_copy(update={"final_time": final_time, "time_steps": steps})
        deck.source.data["Model"] |= {"Final_Time": final_time, "Time_Steps": steps}
        self._deck = replace(deck, model=model)
        self._duration_known = True

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
        progress: Observer | None = None,
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
            Called with the model at the start and at intervals.
        every : int or float, optional
            Interval of outputs; that of the deck, or a hundredth of the run, when left out.
        progress : callable, optional
            Called with the model about ten times a second.
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
            Interval of recorders without one of their own; that of outputs when left out.
        record_to : path-like, optional
            File for what is recorded, .csv or .parquet; ``series.csv`` in `output` when left out.
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
            After Ctrl-C: the step is whole, a checkpoint written, the outputs are closed.
        Terminated
            Likewise after SIGTERM, with `output`; a SystemExit with code 143.
        """
        if steps is not None:
            steps = whole(steps, "steps", 0)
        if until is not None:
            until = number(until, "until", above=0, unit="s")
        folder = None if output is None else Path(output)
        last = self._resumed(folder, until, steps) if resume else self._last_step(until, steps)
        dt = self.dt
        self._plan_output(folder, every, tags)
        interval = self.output_interval
        if record_to is None and folder is not None and record:
            record_to = folder / "series.csv"

        def in_steps(name: str, value: float | None, default: int) -> int:
            return default if value is None else interval_in_steps(name, value, dt)

        series = SeriesRecorder(
            make_tables(
                record,
                in_steps("record_every", record_every, interval),
                lambda name, value: interval_in_steps(name, value, dt),
            ),
            None if record_to is None else Path(record_to),
            self.n if self._goes_on else None,
        )
        checkpoints = None
        if checkpoint_every is not None:
            checkpoints = interval_in_steps("checkpoint_every", checkpoint_every, dt)
        calls = in_steps("callback_every", callback_every, interval)
        drive(self, Job(last, folder, callback, calls, progress, checkpoints, series))
        return Result(self.summary(), folder, series)

    def _last_step(self, until: float | None, steps: int | None) -> int:
        """Fix the duration and return the step to stop after."""
        if not self.scripted and until is not None and steps is not None:
            raise InputError(f"steps = {steps}: is given besides until; keep one of them")
        if until is None and steps is None and self.scripted and not self._duration_known:
            raise InputError("run: until: missing; give the time to stop at in s, or steps")
        if self.started and until is not None and steps is not None:
            raise InputError(
                f"run: steps = {steps}: is given besides until, but the time step is chosen "
                "already; keep one of them"
            )
        fresh = not self.started
        self._initialize(until, steps)
        if until is not None:
            last = self.n_steps if fresh and self.scripted else steps_until(until, self.dt)
        else:
            last = self.n_steps if steps is None else self.n + steps
        if self.scripted and last > self.n_steps:
            self._note_duration(*exact_duration(self.dt, last))
        return last

    def _resumed(self, folder: Path | None, until: float | None, steps: int | None) -> int:
        """Go on from the newest checkpoint of a folder and return the step to stop after."""
        if folder is None:
            raise InputError("run: resume = True: needs the folder of the checkpoints; give output")
        if self._built is not None and self.started:
            raise InputError("run: resume = True: the model has started already; make a new one")
        if not has_checkpoint(folder):
            return self._last_step(until, steps)
        checkpoint, problems = newest_checkpoint(folder)
        if self.scripted:
            self._initialize(until, steps)
            # The time step of the run so far, to the last bit, whatever the end is now.
            if not 0.5 * self.dt < checkpoint.dt <= self.dt * (1 + 1e-6):
                self._check_time_step(checkpoint, until, steps)
            if until is not None:
                last = max(steps_until(until, checkpoint.dt), checkpoint.step)
            else:
                last = checkpoint.step + (steps or 0)
            final_time, n = exact_duration(checkpoint.dt, last)
            self._core.set_duration(final_time, n)
            self._note_duration(final_time, n)
            self._go_on(checkpoint, problems, changed_deck=True)
            return last
        self._go_on(checkpoint, problems)
        return self._last_step(until, steps)

    def _check_time_step(
        self, checkpoint: Checkpoint, until: float | None, steps: int | None
    ) -> None:
        raise InputError(
            f"{checkpoint.path}: time step = {checkpoint.dt!r} s: the model's is {self.dt!r} s; "
            "give the dt of the run so far"
        )

    def _plan_output(
        self, folder: Path | None, every: float | None, tags: Sequence[str] | None
    ) -> None:
        """Let the deck say what is written, where and how often."""
        changes: dict[str, Any] = {}
        if every is not None:
            changes["output_interval"] = interval_in_steps("every", every, self.dt)
        elif self.scripted and not self._goes_on:
            changes["output_interval"] = max(1, self.n_steps // _OUTPUTS)
        if tags is not None:
            changes["tags"] = _checked_tags(tags)
        if changes:
            output = self.deck.output.model_copy(update=changes)
            self._deck = replace(self.deck, output=output)
            self.output_interval = output.output_interval
        if folder is not None and self.scripted:
            self._write_own_deck(folder)

    def _write_own_deck(self, folder: Path) -> None:
        """Write the model as a deck into its output folder, for `resume`, if a deck can say it."""
        composition = self._composition
        assert composition is not None
        try:
            check_sayable(self.deck, composition.held)
        except InputError:
            return
        output = self.deck.output.model_copy(update={"path": Path("..")})
        path = write_deck(
            replace(self.deck, output=output), composition.held, folder / DECK_FOLDER
        ).resolve()
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        self._deck = replace(self.deck, path=path, sha256=digest)

    def _deck_to_write(self) -> Deck:
        return self.deck

    def _composed(self, who: str) -> Composition:
        if self._plan is None:
            raise InputError(
                f"{who}: the model is that of {self.deck.path}; copy the files of the deck"
            )
        self.init()
        if not self._duration_known:
            raise InputError(
                f"{who}: the duration is not known; call run first, or set_duration(until=...)"
            )
        assert self._composition is not None
        return self._composition

    def set_duration(self, until: float, steps: int | None = None) -> None:
        """Say how long the model is to run, for `to_deck`; `run` does so by itself.

        Parameters
        ----------
        until : float
            Simulated time [s].
        steps : int, optional
            Number of steps; the time step is then until / steps.

        Raises
        ------
        InputError
            If an argument breaks its rule, or the model is of a deck.
        """
        if not self.scripted:
            raise InputError("set_duration: the model is that of a deck; change its Final_Time")
        end = number(until, "set_duration: until", above=0, unit="s")
        count = None if steps is None else whole(steps, "set_duration: steps", 1)
        self._last_step(end, count)

    # For the loop of a run.

    def note_output_time(self, seconds: float) -> None:
        """Count seconds of wall-clock time as spent on output."""
        self._output_seconds += seconds

    def note_goes_on(self, writes: bool) -> bool:
        """Tell whether outputs continue earlier ones, and note that they will if it `writes`."""
        goes_on = self._goes_on
        self._goes_on = goes_on or writes
        return goes_on


def _thread_count(threads: int | None) -> int:
    count = len(os.sched_getaffinity(0)) if threads is None else threads
    if not isinstance(count, int | np.integer) or isinstance(count, bool) or count < 1:
        raise InputError(f"threads = {threads!r}: must be at least 1; leave it out for all cores")
    return int(count)


def _yet(plan: ModelPlan) -> str:
    return "" if plan.bodies else " yet"


def _checked_tags(tags: Any) -> tuple[str, ...]:
    from typing import get_args

    from .deck.schema import Tag

    given = [tags] if isinstance(tags, str) else list(tags)
    for tag in given:
        choice(tag, get_args(Tag), "tags")
    return tuple(dict.fromkeys(given))


__all__ = ["DEMModel", "NumericalError", "Particle"]
