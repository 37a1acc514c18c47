"""`DEMModel`: a run of a deck, from its bodies to its last step."""

from __future__ import annotations

import contextlib
import os
import time as clock
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .build import BodyPlan, BuiltModel, build_model
from .deck import Deck, read_deck
from .errors import InputError, NumericalError
from .output import OutputWriter, write_particle_locations

FloatArray = NDArray[np.float64]
Observer = Callable[["DEMModel"], object]

PROGRESS_SECONDS = 0.1
"""Longest time [s] between two looks at signals and progress, unless one step takes longer."""

_NOT_NODAL = ("Particle_Locations", "Strain_Stress")


@dataclass(frozen=True)
class Particle:
    """A body of the model: a particle or a wall.

    Attributes
    ----------
    id : int
        Number of the body; walls and particles share one numbering.
    zone : int
        Zone, counted from 0.
    type : {"particle", "wall"}
        Kind of body.
    start, stop : int
        Its nodes are ``start`` to ``stop - 1``.
    center : ndarray, shape (3,)
        Current position [m] of the node nearest to the centre of the shape.
    bounding_radius : float
        Radius [m] of the shape about its centre.
    mesh_size : float
        Smallest distance h [m] between two of its nodes.
    horizon : float
        Horizon [m].
    volume : float
        Sum of its nodal volumes [m^3], per unit thickness [m^2] in 2D.
    n_bonds : int
        Directed bonds, 0 before `DEMModel.init`.
    constrained : bool
        Whether the body never moves.
    """

    id: int
    zone: int
    type: str
    start: int
    stop: int
    center: FloatArray
    bounding_radius: float
    mesh_size: float
    horizon: float
    volume: float
    n_bonds: int
    constrained: bool


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

    def __init__(self, deck: Deck, built: BuiltModel, compatibility: str) -> None:
        self.deck = deck
        self.compatibility = compatibility
        self.warnings = list(built.warnings)
        self.bodies: list[BodyPlan] = built.bodies
        self._core = built.core
        self._meshes = built.meshes
        self._output_seconds = 0.0
        self._initialized = False

    @classmethod
    def from_deck(
        cls,
        path: str | os.PathLike[str],
        threads: int | None = None,
        compatibility: str | None = None,
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
        return cls(deck, built, compatibility or deck.model.compatibility)

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
    def threads(self) -> int:
        """Number of threads."""
        return int(self._core.threads)

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
    def bonds(self) -> Any:
        """Bond lists, empty before `init`.

        The bonds of node i are ``offsets[i]`` to ``offsets[i + 1] - 1``: ``indices`` the
        node at the other end, ``length`` r [m], ``weight`` J(r/eps) V_j, ``intact`` 1 or 0.
        """
        return self._core.bonds

    @property
    def particles(self) -> list[Particle]:
        """Bodies in the order of their ids."""
        offsets = self.bonds.offsets
        x = self.state.x

        def n_bonds(body: Any) -> int:
            return int(offsets[body.stop] - offsets[body.start]) if self._initialized else 0

        return [
            Particle(
                id=body.id,
                zone=body.zone,
                type="wall" if body.is_wall else "particle",
                start=body.start,
                stop=body.stop,
                center=x[body.center_node].copy(),
                bounding_radius=body.bounding_radius,
                mesh_size=body.mesh_size,
                horizon=body.horizon,
                volume=body.volume,
                n_bonds=n_bonds(body),
                constrained=body.constrained,
            )
            for body in self._core.particles
        ]

    @property
    def cells(self) -> list[tuple[str, NDArray[np.int32]]]:
        """Cell type and connectivity, shape (m, k), of each body, in global node numbers."""
        return [
            (self._meshes[body.zone].cell_type, self._meshes[body.zone].cells + body.start)
            for body in self._core.particles
        ]

    @property
    def timings(self) -> dict[str, float]:
        """Wall-clock seconds spent in each stage."""
        return {**self._core.timings(), "output": self._output_seconds}

    @property
    def memory_bytes(self) -> int:
        """Bytes held by the arrays of nodes and bonds."""
        return int(self._core.memory_bytes)

    def stable_time_step(self) -> float:
        """Estimate the largest stable time step [s], on the safe side.

        Gershgorin bound of the linearised bond forces and of a full contact; see the core's
        ``DEMModel::stableTimeStep``.
        """
        self.init()
        return float(min(self._core.stable_time_step()))

    def init(self) -> None:
        """Build bonds, laws and contact; done once."""
        self._core.init()
        self._initialized = True

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
        NumericalError
            If a velocity is no longer finite.
        """
        if n < 0:
            raise InputError(f"n = {n}: the number of steps must not be negative")
        self.start()
        while n > 0:
            n -= self._core.advance(n, PROGRESS_SECONDS)

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
    ) -> None:
        """Run to the end of the deck, or for some steps.

        Parameters
        ----------
        output : path-like, optional
            Folder for the files of the deck's ``Output`` block; none are written without.
        steps : int, optional
            Number of steps; to the last step of the deck when left out.
        callback : callable, optional
            Called with the model at the start and after every `every` steps.
        every : int, optional
            Interval of `callback`, by default the deck's ``Output_Interval``.
        progress : callable, optional
            Called with the model about ten times a second.

        Raises
        ------
        InputError
            If an argument breaks its rule or the folder cannot be written.
        NumericalError
            If a velocity is no longer finite; the state before is in the last output.
        KeyboardInterrupt
            After Ctrl-C: the step is whole and the outputs are closed.
        """
        interval = self.deck.output.output_interval
        every = interval if every is None else every
        if every < 1:
            raise InputError(f"every = {every}: must be at least 1")
        if steps is not None and steps < 0:
            raise InputError(f"steps = {steps}: must not be negative")
        last = self.n_steps if steps is None else self.n + steps
        with contextlib.ExitStack() as stack:
            writer = self._open_output(output, stack)
            self.start()
            self._observe(writer, callback, every)
            while self.n < last:
                stop = min(last, self._next(interval), self._next(every))
                self._core.advance(stop - self.n, PROGRESS_SECONDS)
                self._observe(writer, callback, every)
                if progress is not None:
                    progress(self)

    def _next(self, interval: int) -> int:
        return (self.n // interval + 1) * interval

    def _observe(self, writer: OutputWriter | None, callback: Observer | None, every: int) -> None:
        if writer is not None and self.n % writer.interval == 0:
            self._write(writer)
        if callback is not None and self.n % every == 0:
            callback(self)

    def _open_output(
        self, output: str | os.PathLike[str] | None, stack: contextlib.ExitStack
    ) -> OutputWriter | None:
        settings = self.deck.output
        if output is None or not settings.perform_out:
            return None
        return stack.enter_context(
            OutputWriter(
                Path(output),
                tags=[tag for tag in settings.tags if tag in self._arrays()],
                interval=settings.output_interval,
                cells=self.cells,
                tag_pp=settings.tag_pp or None,
                fe_output=settings.perform_fe_out,
                compress=None if settings.compress_type == "none" else settings.compress_type,
            )
        )

    def _write(self, writer: OutputWriter) -> None:
        begin = clock.perf_counter()
        arrays = {tag: make() for tag, make in self._arrays().items() if tag in writer.tags}
        k = self.n // writer.interval
        writer.write(k, self.n, self.time, arrays, points=self.state.x)
        if "Particle_Locations" in self.deck.output.tags:
            self._write_locations(writer, k)
        self._output_seconds += clock.perf_counter() - begin

    def _write_locations(self, writer: OutputWriter, k: int) -> None:
        bodies = self.particles
        write_particle_locations(
            writer.folder / f"{writer.path(k).stem.replace('output', 'particle_locations')}.csv",
            zone=[body.zone for body in bodies],
            centre=np.array([body.center for body in bodies]),
            radius=[body.bounding_radius for body in bodies],
        )

    def _arrays(self) -> dict[str, Callable[[], NDArray[Any]]]:
        """How the nodal array of each output tag is made."""
        s = self.state
        return {
            "Displacement": lambda: s.u,
            "Velocity": lambda: s.v,
            "Force_Density": lambda: s.f,
            "Force": lambda: s.f * s.volume[:, None],
            "Fixity": lambda: s.fixity.astype(np.int32),
            "Force_Fixity": lambda: s.force_fixity.astype(np.int32),
            "Particle_ID": lambda: s.particle_id,
            "Zone_ID": lambda: s.zone_id,
            "Nodal_Volume": lambda: s.volume,
            "Damage_Z": lambda: s.damage_z,
            "Damage": self.broken_fraction,
            "Theta": lambda: s.theta,
        }

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
        }


__all__ = ["DEMModel", "NumericalError", "Particle"]
