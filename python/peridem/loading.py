"""The loads of a deck, given to a core model: sets of displacements and forces, velocities."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from . import _core
from .bodies import BodyPlan, shape_of
from .deck import Deck
from .errors import InputError, InputErrors
from .loads import amplitude, empty_selection_warning, select_nodes

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
    warnings : list of str
        Filled with what the user should know, with file and line.
    """

    deck: Deck
    core: Any
    bodies: list[BodyPlan]
    warnings: list[str] = field(default_factory=list)

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
                self._add(self.core.add_displacement_set, moved, path)
        for k, force in enumerate(self.deck.force_sets):
            path = f"Force_BC.Set_{k + 1}"
            pushed = _core.ForceSet()
            with problems.collect():
                self._fill(pushed, force, "force", path)
                self._add(self.core.add_force_set, pushed, path)
        with problems.collect():
            self._add_initial_velocity()
        problems.raise_if_any()

    def _fill(self, result: Any, load: Any, kind: Kind, path: str) -> None:
        """Set nodes, amplitudes, directions and time function of a set of the core."""
        where = f"{self.deck.where(path)}: {path}"
        shape = None
        if load.region is not None:
            shape = shape_of(self.deck, load.region.geometry, f"{path}.Region.Geometry")
        x_ref, ids = self.core.state.x_ref, self.core.state.particle_id
        nodes = select_nodes(load, x_ref, ids, shape, where=where)
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

    def _add(self, add: Any, loaded: Any, path: str) -> None:
        try:
            add(loaded)
        except InputError as error:
            raise InputError(f"{self.deck.where(path)}: {path}: {error}") from error

    def _add_initial_velocity(self) -> None:
        velocity = self.deck.initial_velocity
        if velocity is None:
            return
        ids = list(velocity.particle_list or ())
        for body in ids:
            if body >= len(self.bodies):
                raise self.deck.error(
                    "IC.Constant_Velocity.Particle_List",
                    f"no body {body}: the deck has bodies 0 to {len(self.bodies) - 1}; "
                    "correct the list",
                )
        initial = _core.InitialVelocity()
        initial.bodies = ids
        initial.velocity = tuple(velocity.velocity_vector)
        self.core.add_initial_velocity(initial)
