"""The loads of a deck, given to a core model: sets of displacements and forces, velocities."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from . import _core
from .bodies import BodyPlan, shape_of
from .deck import Deck
from .errors import InputError, InputErrors
from .loads import amplitude, empty_selection_warning, select_nodes
from .outside import NodeChoice, NodeValues, Outside

Kind = Literal["displacement", "force"]


@dataclass
class LoadBuilder:
    """Gives the loads of a deck to a core model.

    Attributes
    ----------
    deck : Deck
        The deck.
    core : _core.DEMModel
        The model, bodies placed.
    bodies : list of BodyPlan
        In the order of the body ids.
    outside : dict of (str, int) to Outside
        What a deck cannot say of its sets, by kind and index.
    functions : list of NodeValues
        Filled with the functions of time that the core calls, to be kept alive.
    warnings : list of str
        Filled with what the user should know, with file and line.
    """

    deck: Deck
    core: Any
    bodies: list[BodyPlan]
    outside: dict[tuple[str, int], Outside] = field(default_factory=dict)
    functions: list[NodeValues] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    _mover: NDArray[np.int64] | None = None

    def add_all(self) -> None:
        """Add all sets and the initial velocity.

        Raises
        ------
        InputError
            If a set names bodies that do not exist, or breaks another rule; with one line for
            each such set.
        """
        problems = InputErrors()
        for k, load in enumerate(self.deck.displacement_sets):
            path = f"Displacement_BC.Set_{k + 1}"
            moved = _core.DisplacementSet()
            moved.zero_displacement = load.zero_displacement
            moved.rotation_axis = load.time_function.rotation_axis or (0.0, 0.0, 1.0)
            with problems.collect():
                self._fill(moved, load, "displacement", path)
                outside = self.outside.get(("displacement", k))
                if outside is not None and outside.displacement is not None:
                    moved.set_displacement(self._function(outside, "displacement", load, moved))
                if outside is not None and outside.velocity is not None:
                    moved.set_velocity(self._function(outside, "velocity", load, moved))
                self._note_movers(np.array(moved.nodes, dtype=np.int64), load.direction, k + 1)
                self._add(self.core.add_displacement_set, moved, path)
        for k, force in enumerate(self.deck.force_sets):
            path = f"Force_BC.Set_{k + 1}"
            pushed = _core.ForceSet()
            with problems.collect():
                self._fill(pushed, force, "force", path)
                outside = self.outside.get(("force", k))
                if outside is not None and outside.density is not None:
                    pushed.set_density(self._function(outside, "density", force, pushed))
                self._add(self.core.add_force_set, pushed, path)
        with problems.collect():
            self._add_initial_velocities()
        problems.raise_if_any()

    def _fill(self, result: Any, load: Any, kind: Kind, path: str) -> None:
        """Set nodes, amplitudes, directions and time function of a set of the core."""
        where = f"{self.deck.where(path)}: {path}"
        shape = None
        if load.region is not None:
            shape = shape_of(self.deck, load.region.geometry, f"{path}.Region.Geometry")
        x_ref, ids = self.core.state.x_ref, self.core.state.particle_id
        nodes = select_nodes(load, x_ref, ids, shape, where=where)
        outside = self.outside.get((kind, int(path.rpartition("_")[2]) - 1))
        if outside is not None and outside.choose is not None:
            nodes = self._chosen(nodes, outside.choose)
        warning = empty_selection_warning(load, nodes, shape, where=where)
        if warning is not None:
            self.warnings.append(warning)
        time = load.time_function
        if time.type == "rotation":
            values = np.ones(len(nodes))
        else:
            if shape is None:
                boxes = np.array([self.bodies[k].box for k in ids[nodes]]).reshape(-1, 2, 3)
            else:
                boxes = np.broadcast_to(np.array(shape.box), (len(nodes), 2, 3))
            values = amplitude(load, kind, x_ref[nodes], boxes, where=where)
        result.nodes = [int(node) for node in nodes]
        result.amplitude = [float(value) for value in values]
        result.directions = sum(1 << (d - 1) for d in load.direction)
        result.time_function = _core.TimeFunction(
            _core.TimeFunctionType[time.type], list(time.parameters)
        )

    def _note_movers(
        self, nodes: NDArray[np.int64], directions: Sequence[int], number: int
    ) -> None:
        """Note which set moves nodes, and warn of those that an earlier one was to move."""
        if self._mover is None:
            self._mover = np.zeros((len(self.core.state.x_ref), 3), dtype=np.int64)
        axes = np.array(directions, dtype=np.int64) - 1
        before = self._mover[np.ix_(nodes, axes)]
        for other in np.unique(before[before > 0]):
            count = int((before == other).any(axis=1).sum())
            path = f"Displacement_BC.Set_{number}"
            self.warnings.append(
                f"{self.deck.where(path)}: {path}: moves {count} node{'' if count == 1 else 's'} "
                f"that Displacement_BC.Set_{other} moves in the same direction: the later one "
                "decides; take them out of one of the two"
            )
        self._mover[np.ix_(nodes, axes)] = number

    def _chosen(self, nodes: NDArray[np.int32], choose: NodeChoice) -> NDArray[np.int32]:
        """Those of some nodes that are chosen, body by body."""
        x_ref, ids = self.core.state.x_ref, self.core.state.particle_id
        kept = []
        for body in np.unique(ids[nodes]):
            own = nodes[ids[nodes] == body]
            numbers = own.astype(np.int64) - self.core.particles[int(body)].start
            kept.append(own[choose(x_ref[own], numbers)])
        return np.concatenate([*kept, np.empty(0, np.int32)])

    def _function(self, outside: Outside, name: str, load: Any, filled: Any) -> Any:
        label = f"{outside.label}: {name}"
        values = NodeValues(getattr(outside, name), len(filled.nodes), load.direction, label)
        self.functions.append(values)
        return values.weak()

    def _add(self, add: Any, loaded: Any, path: str) -> None:
        try:
            add(loaded)
        except InputError as error:
            raise InputError(f"{self.deck.where(path)}: {path}: {error}") from error

    def _add_initial_velocities(self) -> None:
        for number, velocity in enumerate(self.deck.initial_velocities):
            ids = list(velocity.particle_list or ())
            for body in ids:
                if body >= len(self.bodies):
                    raise self.deck.error(
                        "IC.Constant_Velocity.Particle_List" if number == 0 else "IC",
                        f"no body {body}: the deck has bodies 0 to {len(self.bodies) - 1}; "
                        "correct the list",
                    )
            initial = _core.InitialVelocity()
            initial.bodies = ids
            initial.velocity = tuple(velocity.velocity_vector)
            initial.spin = velocity.spin or (0.0, 0.0, 0.0)
            self.core.add_initial_velocity(initial)
