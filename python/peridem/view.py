"""What can be seen of a model: its state, its bodies, what it is made of."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from .background import BackgroundWriter
from .bodies import BodyPlan
from .bonds import Bonds
from .deck import Deck
from .errors import InputError
from .mesh import Mesh
from .modelling.arguments import did_you_mean
from .modelling.bodies import Bodies, Body
from .particle import Particle, StableTimeStep

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FloatArray = NDArray[np.float64]


class ModelView(ABC):
    """What `DEMModel` shows of itself; see there."""

    compatibility: str
    stop_reason: str | None
    _initialized: bool
    _output_seconds: float
    _background: BackgroundWriter
    _stable_time_step: StableTimeStep | None
    _time_step_from: str
    _names: dict[str, Body | Bodies]

    @property
    @abstractmethod
    def deck(self) -> Deck:
        """The blocks of its deck, read or made."""

    @property
    @abstractmethod
    def bodies(self) -> list[BodyPlan]:
        """Where the bodies are from, by their ids."""

    @property
    @abstractmethod
    def _core(self) -> Any: ...

    @property
    @abstractmethod
    def _meshes(self) -> list[Mesh]: ...

    @abstractmethod
    def init(self) -> None:
        """Build what stays for the run."""

    @property
    @abstractmethod
    def _bodies(self) -> list[Any]: ...

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

        Gershgorin bound of the linearised bond forces, a full contact, and the spring between
        the ends of a broken bond; see the core's ``DEMModel::stableTimeStep``.
        """
        self.init()
        if self._stable_time_step is None:  # it stays as it is: only the reference bonds count
            self._stable_time_step = StableTimeStep(*self._core.stable_time_step())
        return self._stable_time_step

    def contact_radius(self, p: int, q: int) -> float:
        """Contact radius Rc [m] of two bodies; an InputError when there is no such body."""
        self.init()
        return float(self._core.contact_law(self._body(p).id, self._body(q).id)["radius"])

    def contact_stiffness(self, p: int, q: int) -> float:
        """Contact stiffness Kn [N/m^7] of two bodies; an InputError if there is no such body."""
        self.init()
        return float(self._core.contact_law(self._body(p).id, self._body(q).id)["kn"])

    def contact_forces(self) -> FloatArray:
        """Force density of contact and its damping alone, shape (n_nodes, 3) [N/m^3].

        Computed from the current state, which stays as it is. On the nodes of a wall it is
        what the wall takes up; its sum times the volumes is the wall's reaction.
        """
        self.init()
        return np.asarray(self._core.contact_forces())

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

    def broken_fraction(self) -> FloatArray:
        """Fraction of each node's bonds that are broken, shape (n_nodes,).

        Zero for nodes without bonds.
        """
        offsets = self.bonds.offsets
        count = np.diff(offsets)
        total = np.concatenate([[0], np.cumsum(self.bonds.intact == 0)])
        broken = total[offsets[1:]] - total[offsets[:-1]]
        return np.asarray(broken / np.maximum(count, 1))

    def touching_nodes(self) -> NDArray[np.int32]:
        """Pairs of nodes in contact, shape (k, 2), the smaller number first, each pair once."""
        self.init()
        return np.asarray(self._core.touching_nodes())

    def ids_of(self, which: Any) -> list[int]:
        """Ids of bodies.

        Parameters
        ----------
        which : Body, Bodies, int, str or sequence of them
            Bodies by handle, by id or by name.

        Raises
        ------
        InputError
            If there is no such body.
        """
        if isinstance(which, str):
            if which not in self._names:
                raise InputError(
                    f"body = {which!r}: there is none of this name; "
                    + (did_you_mean(which, self._names) if self._names else "give its id")
                )
            which = self._names[which]
        if isinstance(which, Body):
            return [which.id]
        if isinstance(which, Iterable):
            return [one for part in which for one in self.ids_of(part)]
        return [int(self._body(which).id)]

    def body_names(self) -> dict[int, str]:
        """Names of the bodies that have one, by their ids; those of a deck have none."""
        self._bodies  # noqa: B018  # builds the model
        named = ((name, body) for name, body in self._names.items() if isinstance(body, Body))
        return {body.id: name for name, body in named}

    def nodes_of(self, which: Any) -> NDArray[np.int64]:
        """Nodes of bodies, ascending; `which` as in `ids_of`."""
        self.init()
        parts = [self._bodies[k] for k in sorted(set(self.ids_of(which)))]
        return np.concatenate([np.arange(part.start, part.stop) for part in parts])

    def render(
        self, field: Any = None, path: str | os.PathLike[str] | None = None, **options: Any
    ) -> Path | Figure:
        """Draw the present state.

        Parameters
        ----------
        field : str, ndarray or callable, optional
            What the colours show; damage when left out.
        path : path-like, optional
            File to write; without it the figure is handed back.
        **options
            As in `peridem.plot.render`.

        Returns
        -------
        Path or Figure

        Raises
        ------
        InputError
            As `peridem.plot.render` says.
        """
        from .plot import render

        return render(self, field, None if path is None else Path(path), **options)

    def _repr_html_(self) -> str:
        """Table of the bodies and a small picture, for notebooks."""
        from .plot.notebook import model_html

        return model_html(self)

    def summary(self) -> dict[str, Any]:
        """Facts about the run so far: steps, time, nodes, bonds, broken bonds, memory."""
        intact = self.bonds.intact
        return {
            "dimension": self.dimension,
            "steps": self.n,
            "time": self.time,
            "dt": self.dt,
            "dt_from": self._time_step_from,
            "bodies": len(self.bodies),
            "nodes": self.n_nodes,
            "bonds": len(intact) // 2,
            "broken_bonds": int((intact == 0).sum()) // 2,
            "memory_bytes": self.memory_bytes,
            "threads": self.threads,
            "compatibility": self.compatibility,
            "stop_reason": self.stop_reason,
        }
