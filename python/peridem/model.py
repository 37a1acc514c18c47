"""`DEMModel`: a run of a deck, from its bodies to its last step."""

from __future__ import annotations

import contextlib
import os
import time as clock
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .background import BackgroundWriter, Job
from .bodies import BodyPlan
from .bonds import Bonds
from .build import BuiltModel, build_model
from .checkpoint import CheckpointWriter, newest_checkpoint
from .checks import check_model, contact_time_step_note
from .compatibility import compatibility_notes
from .deck import Deck, read_deck
from .diagnostics import check_finite
from .errors import InputError, NumericalError
from .interrupt import StopSignals
from .particle import Particle, StableTimeStep
from .recorder import Recorder
from .restart import find_deck, restart_from_deck, restore

FloatArray = NDArray[np.float64]
Observer = Callable[["DEMModel"], object]

PROGRESS_SECONDS = 0.1
"""Longest time [s] between two looks at signals and progress, unless one step takes longer."""


class DEMModel:
    """Deformable, breakable grains in contact: the model of a deck and its state.

    Made by `from_deck`. `init` builds bonds and contact, `step` and `run` advance the time.
    The arrays of `state` are views of the core's memory: they show every step, stay valid as
    long as anything refers to them, and those that are writable (x, u, v, f, theta,
    damage_z) take what a driver writes between steps.

    Parameters
    ----------
    deck : Deck
        The deck.
    built : BuiltModel
        Its core model.

    References
    ----------
    Jha, Desai, Bhattacharya, Lipton, JMPS 151 (2021) 104376.
    """

    def __init__(
        self,
        deck: Deck,
        built: BuiltModel,
        compatibility: str,
        *,
        strict: bool = False,
        allow_overlap: bool = False,
    ) -> None:
        self.deck = deck
        self.compatibility = compatibility
        self.warnings = list(built.warnings)
        self.notes = [*deck.notes, *compatibility_notes(deck, built.bodies, compatibility)]
        self.bodies: list[BodyPlan] = built.bodies
        self._core = built.core
        self._bodies = built.core.particles
        self.stop_reason: str | None = None
        self._meshes = built.meshes
        self._output_seconds = 0.0
        self._background = BackgroundWriter()
        self._stable_time_step: StableTimeStep | None = None
        self._initialized = False
        self._strict = strict
        self._allow_overlap = allow_overlap
        self._restarts = deck.restart is not None
        self._goes_on = False
        self.output_interval = deck.output.output_interval
        self.checkpoint_every: int | None = None
        self.last_checkpoint: Path | None = None

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
        count = len(os.sched_getaffinity(0)) if threads is None else threads
        if count < 1:
            raise InputError(f"threads = {threads}: must be at least 1; leave it out for all cores")
        if compatibility not in (None, "original", "corrected"):
            raise InputError(
                f"compatibility = {compatibility!r}: must be 'original' or 'corrected'; choose one"
            )
        deck = read_deck(Path(path))
        built = build_model(deck, threads=count, compatibility=compatibility)
        return cls(
            deck,
            built,
            compatibility or deck.model.compatibility,
            strict=strict,
            allow_overlap=allow_overlap,
        )

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
        checkpoints and, given the same folder, with the same series of outputs.

        Parameters
        ----------
        folder : path-like
            Output folder of the run.
        threads : int, optional
            Number of threads; results do not depend on it.
        tag : str, optional
            ``Output.Tag_PP`` of the run, when the folder has several runs.

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
        model._restarts, model._goes_on = False, True
        restore(model, checkpoint)
        model.warnings += problems
        model.checkpoint_every, model.last_checkpoint = checkpoint.every, checkpoint.path
        return model

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return float(self._core.time)

    @property
    def dt(self) -> float:
        """Time step [s]."""
        return float(self._core.dt)

    @property
    def n(self) -> int:
        """Number of steps taken."""
        return int(self._core.n)

    @property
    def n_steps(self) -> int:
        """Number of steps of the deck."""
        return self.deck.model.time_steps

    @property
    def started(self) -> bool:
        """Whether forces are computed and steps can follow."""
        return bool(self._core.started)

    @property
    def threads(self) -> int:
        """Number of threads."""
        return int(self._core.threads)

    @property
    def instruction_set(self) -> str:
        """Processor instructions that the forces use: avx512, avx2 or baseline."""
        return str(self._core.instruction_set)

    @property
    def dimension(self) -> int:
        """Dimension of the model, 2 or 3."""
        return self.deck.model.dimension

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return len(self._core.state)

    @property
    def state(self) -> Any:
        """Arrays over all nodes, without copies.

        ``x_ref, x, u [m], v [m/s], f [N/m^3]`` of shape (n_nodes, 3); ``volume [m^3],
        density [kg/m^3], theta, weighted_volume, damage_z`` of shape (n_nodes,);
        ``particle_id, zone_id, fixity, force_fixity`` (bit d: direction d is prescribed,
        carries a force set). In 2D volumes are per unit thickness. ``x_ref``, ``volume``,
        ``density``, ``weighted_volume``, ids and fixities are read-only.
        """
        return self._core.state

    @property
    def bonds(self) -> Bonds:
        """Bond lists: offsets, indices, intact flags, lengths, weights; see `Bonds`."""
        return Bonds(self._core)

    @property
    def particles(self) -> list[Particle]:
        """Bodies in the order of their ids."""
        return [self.particle(k) for k in range(len(self._bodies))]

    def particle(self, k: int) -> Particle:
        """Body `k`; an InputError when there is none."""
        body = self._body(k)
        offsets = self.bonds.offsets
        n_bonds = int(offsets[body.stop] - offsets[body.start]) if self._initialized else 0
        return Particle(
            id=body.id,
            zone=body.zone,
            type="wall" if body.is_wall else "particle",
            start=body.start,
            stop=body.stop,
            center=self.state.x[body.center_node].copy(),
            bounding_radius=body.bounding_radius,
            mesh_size=body.mesh_size,
            horizon=body.horizon,
            volume=body.volume,
            n_bonds=n_bonds,
            constrained=body.constrained,
        )

    def _body(self, k: int) -> Any:
        if not isinstance(k, int | np.integer) or not 0 <= k < len(self._bodies):
            raise InputError(
                f"body = {k!r}: there is none; bodies are counted from 0 to {len(self._bodies) - 1}"
            )
        return self._bodies[int(k)]

    def start_center(self, k: int) -> FloatArray:
        """Where the centre of body `k` was at the start, shape (3,) [m]."""
        return np.array(self.state.x_ref[self._body(k).center_node])

    @property
    def cells(self) -> list[tuple[str, NDArray[np.int32]]]:
        """Cell type and connectivity, shape (m, k), of each body, in global node numbers."""
        return [
            (self._meshes[body.zone].cell_type, self._meshes[body.zone].cells + body.start)
            for body in self._bodies
        ]

    @property
    def timings(self) -> dict[str, float]:
        """Wall-clock seconds spent in each stage.

        ``output`` is the copying of states and what is written at once; vtu, csv and checkpoint
        files are written in the background, for which the run has waited ``output_wait``.
        """
        return {
            **self._core.timings(),
            "output": self._output_seconds,
            "output_wait": self._background.seconds_waited,
        }

    @property
    def memory_bytes(self) -> int:
        """Bytes held by the arrays of nodes and bonds."""
        return int(self._core.memory_bytes)

    def stable_time_step(self) -> StableTimeStep:
        """Estimate the largest stable time steps, on the safe side.

        Gershgorin bound of the linearised bond forces and of a full contact; see the core's
        ``DEMModel::stableTimeStep``.
        """
        self.init()
        if self._stable_time_step is None:  # it stays as it is: only the reference bonds count
            self._stable_time_step = StableTimeStep(*self._core.stable_time_step())
        return self._stable_time_step

    def contact_radius(self, p: int, q: int) -> float:
        """Contact radius Rc [m] of two bodies; an InputError when there is no such body."""
        self.init()
        return float(self._core.contact_law(self._body(p).id, self._body(q).id)["radius"])

    def contact_forces(self) -> FloatArray:
        """Force density of contact and its damping alone, shape (n_nodes, 3) [N/m^3].

        Computed from the current state, which stays as it is. On the nodes of a wall it is
        what the wall takes up; its sum times the volumes is the wall's reaction.
        """
        self.init()
        return np.asarray(self._core.contact_forces())

    def init(self) -> None:
        """Build bonds, laws and contact, check the model, set a ``Restart`` state; done once.

        Raises
        ------
        InputError
            If bodies overlap at the start (unless allowed), a test names a body that does not
            exist or, when strict, the time step is above the estimated stable one.
        """
        if self._initialized:
            return
        try:
            self._core.init()
        except InputError as error:
            raise InputError(f"{self.deck.path.name}: {error}") from error
        self._initialized = True
        try:
            self.warnings += check_model(
                self, strict=self._strict, allow_overlap=self._allow_overlap
            )
        except InputError:
            self._initialized = False
            raise
        note = contact_time_step_note(self)
        if note is not None:
            self.notes.append(note)
        if self._restarts:
            self._restarts, self._goes_on = False, True
            restart_from_deck(self)

    def friction_springs(self) -> tuple[NDArray[np.int32], FloatArray]:
        """Stretched tangential springs of the friction with history.

        Returns
        -------
        nodes : ndarray, shape (k, 2)
            Node pairs (i, j); the spring pulls i.
        elongations : ndarray, shape (k, 3)
            Elongations [m].
        """
        nodes, elongations = self._core.slips()
        return nodes, elongations

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
        _check_whole("n", n, 0)
        self.start()
        while n > 0:
            n -= self._core.advance(n, PROGRESS_SECONDS)
        check_finite(self)

    def compute_forces(self) -> None:
        """Compute f, theta and damage_z of the current u, x and v, breaking bonds."""
        self.init()
        self._core.compute_forces()

    def run(
        self,
        output: str | os.PathLike[str] | None = None,
        steps: int | None = None,
        callback: Observer | None = None,
        every: int | None = None,
        progress: Observer | None = None,
        *,
        checkpoint_every: int | None = None,
    ) -> None:
        """Run to the end of the deck, or for some steps.

        Parameters
        ----------
        output : path-like, optional
            Folder for the files of the deck's ``Output`` block; none are written without.
        steps : int, optional
            Number of steps; to the last step of the deck when left out.
        callback : callable, optional
            Called with the model at the start and after every `every` steps. Files of the
            outputs so far may still be on their way: they are written in the background.
        every : int, optional
            Interval of `callback`, by default the deck's ``Output_Interval``.
        progress : callable, optional
            Called with the model about ten times a second.
        checkpoint_every : int, optional
            Steps between checkpoints ``checkpoint_<step>.h5`` in `output`, of which the last
            two are kept; also written after the last step. By default none, and in a resumed
            run the interval it had. With `output`, a run that stops before the last step of the
            deck (`steps`, Ctrl-C, SIGTERM) writes one in any case, to be gone on with.

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
        every = self.deck.output.output_interval if every is None else every
        _check_whole("every", every, 1)
        if steps is not None:
            _check_whole("steps", steps, 0)
        self.init()
        last = self.n_steps if steps is None else self.n + steps
        with contextlib.ExitStack() as stack:
            signals = stack.enter_context(StopSignals(active=output is not None))
            checkpoints = self._open_checkpoints(output, checkpoint_every)
            recorder = stack.enter_context(self._open_recorder(output))
            stack.enter_context(self._background)
            self.start()
            self._observe(recorder, callback, every)
            while self.n < last and signals.noted is None and self.stop_reason is None:
                ends = [*recorder.intervals, every]
                ends += [checkpoints.every] if checkpoints and checkpoints.every else []
                stop = min(last, *(self._next(end) for end in ends))
                self._advance(stop - self.n, recorder)
                self._background.check()
                self._observe(recorder, callback, every)
                if checkpoints is not None and checkpoints.is_due(self.n):
                    self._save(checkpoints)
                if progress is not None:
                    progress(self)
            # A run that stops short can be gone on with.
            short = self.stop_reason is None and self.n < self.n_steps
            if checkpoints is not None and (
                checkpoints.every or signals.noted is not None or short
            ):
                self._save(checkpoints)

    def _next(self, interval: int) -> int:
        return (self.n // interval + 1) * interval

    def _advance(self, n: int, recorder: Recorder) -> None:
        with self._last_state(recorder):
            self._core.advance(n, PROGRESS_SECONDS)

    @contextlib.contextmanager
    def _last_state(self, recorder: Recorder) -> Iterator[None]:
        """Write the state that a numerical failure leaves, and say where it is."""
        try:
            yield
        except NumericalError as error:
            path = recorder.write_last()
            if path is None:
                raise
            raise NumericalError(f"{error}; the last state is in {path}") from error

    def _observe(self, recorder: Recorder, callback: Observer | None, every: int) -> None:
        with self._timed_output():
            with self._last_state(recorder):
                check_finite(self)
            recorder.record()
            self.stop_reason = recorder.stop_reason
        if callback is not None and self.n % every == 0:
            callback(self)

    def _open_recorder(self, output: str | os.PathLike[str] | None) -> Recorder:
        goes_on = self._goes_on
        self._goes_on = goes_on or output is not None
        folder = None if output is None else Path(output)
        return Recorder(self, folder, goes_on=goes_on, background=self._background)

    def _open_checkpoints(
        self, output: str | os.PathLike[str] | None, every: int | None
    ) -> CheckpointWriter | None:
        if output is None:
            if every is not None:
                raise InputError(
                    f"checkpoint_every = {every}: checkpoints need a folder; give output"
                )
            return None
        self.checkpoint_every = self.checkpoint_every if every is None else every
        return CheckpointWriter(output, self, self.checkpoint_every, self.last_checkpoint)

    def _save(self, checkpoints: CheckpointWriter) -> None:
        if checkpoints.last_step == self.n:
            return

        def take() -> Job:
            write = checkpoints.take(self)

            def save() -> None:
                self.last_checkpoint = write()

            return save

        with self._timed_output():
            self._background.submit(take)

    @contextlib.contextmanager
    def _timed_output(self) -> Iterator[None]:
        """Count the time of the ``with`` as output, but for waiting."""
        begin, waited = clock.perf_counter(), self._background.seconds_waited
        yield
        waited = self._background.seconds_waited - waited
        self._output_seconds += clock.perf_counter() - begin - waited

    def broken_fraction(self) -> FloatArray:
        """Fraction of each node's bonds that are broken, shape (n_nodes,).

        Zero for nodes without bonds.
        """
        offsets = self.bonds.offsets
        count = np.diff(offsets)
        total = np.concatenate([[0], np.cumsum(self.bonds.intact == 0)])
        broken = total[offsets[1:]] - total[offsets[:-1]]
        return np.asarray(broken / np.maximum(count, 1))

    def summary(self) -> dict[str, Any]:
        """Facts about the run so far: steps, time, nodes, bonds, broken bonds, memory."""
        intact = self.bonds.intact
        return {
            "steps": self.n,
            "time": self.time,
            "dt": self.dt,
            "bodies": len(self.bodies),
            "nodes": self.n_nodes,
            "bonds": len(intact) // 2,
            "broken_bonds": int((intact == 0).sum()) // 2,
            "memory_bytes": self.memory_bytes,
            "threads": self.threads,
            "compatibility": self.compatibility,
            "stop_reason": self.stop_reason,
        }


def _check_whole(name: str, value: Any, least: int) -> None:
    if not isinstance(value, int | np.integer) or value < least:
        raise InputError(
            f"{name} = {value!r}: must be a whole number, at least {least}; correct it"
        )


__all__ = ["DEMModel", "NumericalError", "Particle"]
