"""Schema of the blocks Force_BC, Displacement_BC and IC."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal

from annotated_types import Len, Lt

from .fields import (
    REQUIRED,
    Block,
    Count,
    Flag,
    Index,
    Integer,
    Number,
    Numbered,
    Numbers,
    Text,
    Vector,
    key,
)
from .shapes import Geometry

#: Number of parameters of each function of time, T0 first. A rotation [T0, cx, cy, cz] is about
#: the z axis; three more, [ax, ay, az], are its axis.
TIME_PARAMETERS = {
    "constant": 1,
    "linear": 1,
    "quadratic": 2,
    "sin": 2,
    "rotation": 4,
    "linear_step": 3,
    "linear_slow_fast": 4,
}
_WITH_AXIS = 7
DISPLACEMENT_TIMES = ("constant", "linear", "quadratic", "sin", "rotation")
FORCE_TIMES = ("constant", "linear", "linear_step", "linear_slow_fast", "sin")
#: Number of parameters of each function of space.
SPATIAL_PARAMETERS = {
    "constant": 0,
    "hat_x": 1,
    "hat_y": 1,
    "sin_x": 1,
    "sin_y": 1,
    "linear_x": 1,
    "linear_y": 1,
    "rotation": 0,
}


def _count_problem(kind: str, given: int, needed: int) -> str:
    plural = "" if needed == 1 else "s"
    return f"{kind} needs {needed} parameter{plural}, has {given}; give the missing ones"


class TimeFunction(Block):
    """Set_k.Time_Function: how a load depends on time."""

    type: Literal[
        "constant", "linear", "quadratic", "sin", "rotation", "linear_step", "linear_slow_fast"
    ] = key("Type", "the function of time", default=REQUIRED)
    parameters: Numbers = key("Parameters", "the list [T0, ...] of its parameters", default=())

    def rules(self) -> Iterator[tuple[str, str]]:
        """Yield missing parameters, axes without direction and periods of zero length."""
        needed = TIME_PARAMETERS[self.type]
        if len(self.parameters) < needed:
            yield "Parameters", _count_problem(self.type, len(self.parameters), needed)
        elif self.type == "rotation" and needed < len(self.parameters) != _WITH_AXIS:
            yield (
                "Parameters",
                "must be [T0, cx, cy, cz] for a rotation about z, or [T0, cx, cy, cz, ax, ay, az] "
                f"for one about an axis; has {len(self.parameters)} numbers",
            )
        elif self.rotation_axis == (0.0, 0.0, 0.0):
            yield "Parameters", "must have an axis [ax, ay, az] that is not zero; correct it"
        elif self.type == "linear_step":
            growth, rest = self.parameters[1:3]
            if growth < 0 or rest < 0 or growth + rest == 0:
                yield "Parameters", "needs times T1, T2 >= 0 with T1 + T2 > 0; check both"

    @property
    def rotation_axis(self) -> tuple[float, float, float] | None:
        """Axis of a rotation that gives one; None otherwise."""
        if self.type != "rotation" or len(self.parameters) != _WITH_AXIS:
            return None
        ax, ay, az = self.parameters[4:7]
        return ax, ay, az

    def remarks(self) -> Iterator[tuple[str, str]]:
        """Yield parameters beyond those needed."""
        if self.type == "rotation":
            return
        if len(self.parameters) > TIME_PARAMETERS[self.type]:
            used = TIME_PARAMETERS[self.type]
            yield "Parameters", f"only the first {used} are used by {self.type}"


class SpatialFunction(Block):
    """Set_k.Spatial_Function: how a load depends on the reference position."""

    type: Literal[
        "constant", "hat_x", "hat_y", "sin_x", "sin_y", "linear_x", "linear_y", "rotation"
    ] = key("Type", "the function of space", default="constant")
    parameters: Numbers = key("Parameters", "the list [p0] of its parameters", default=())

    def rules(self) -> Iterator[tuple[str, str]]:
        """Yield missing parameters."""
        needed = SPATIAL_PARAMETERS[self.type]
        if len(self.parameters) < needed:
            yield "Parameters", _count_problem(self.type, len(self.parameters), needed)


class Region(Block):
    """Set_k.Region: where the nodes are."""

    retired: ClassVar[dict[str, str]] = {
        name: f"write it as Geometry: {{Type: {name.lower()}, Parameters: [...]}}"
        for name in ("Rectangle", "Circle", "Cuboid", "Sphere")
    }

    geometry: Geometry = key("Geometry", "the shape of the region", default=REQUIRED)


class LoadSet(Block):
    """What force and displacement sets have in common: nodes, direction, amplitude."""

    retired: ClassVar[dict[str, str]] = {
        "Wall_List": "walls and particles share one numbering: use Particle_List",
    }
    times: ClassVar[tuple[str, ...]] = ()

    region: Region | None = key("Region", "the region of the nodes")
    particle_list: tuple[Index, ...] | None = key("Particle_List", "the list of body ids, from 0")
    particle_exclude_list: tuple[Index, ...] | None = key(
        "Particle_Exclude_List", "the list of body ids that are left out, from 0"
    )
    direction: tuple[Annotated[Count, Lt(4)], ...] = key(
        "Direction", "the list of directions, 1 for x to 3 for z, e.g. [1, 2]", default=()
    )
    time_function: TimeFunction = key(
        "Time_Function",
        "how the load depends on time, Type and Parameters",
        default=TimeFunction.model_validate({"Type": "constant", "Parameters": [0.0]}),
    )
    spatial_function: SpatialFunction = key(
        "Spatial_Function", "how the load depends on the place", default=SpatialFunction()
    )
    selection_type: Text | None = key(
        "Selection_Type", "a name", ignored="it follows from Region and the lists"
    )

    def rules(self) -> Iterator[tuple[str, str]]:
        """Yield what is wrong with direction and functions."""
        time = self.time_function
        rotates = time.type == "rotation"
        if not self.direction and not rotates:
            yield "Direction", "missing; give the list of directions, e.g. [1, 2]"
        elif self.direction and len(set(self.direction)) < len(self.direction):
            yield "Direction", "names a direction twice; keep each once"
        if time.type not in self.times:
            yield "Time_Function.Type", f"must be one of {', '.join(self.times)} for these sets"
        if self.spatial_function.type == "rotation" and not rotates:
            yield "Spatial_Function.Type", "needs Time_Function.Type: rotation; use constant"

    def remarks(self) -> Iterator[tuple[str, str]]:
        """Yield sets that select no node."""
        if self.region is None and not self.particle_list:
            yield "", "selects no node: it has neither Region nor Particle_List"


class DisplacementSet(LoadSet):
    """Displacement_BC.Set_k: prescribed displacements."""

    times: ClassVar[tuple[str, ...]] = DISPLACEMENT_TIMES

    zero_displacement: Flag = key(
        "Zero_Displacement", "whether the nodes are held at rest", default=False
    )

    def rules(self) -> Iterator[tuple[str, str]]:
        """Yield what is wrong with direction and functions."""
        if "time_function" not in self.model_fields_set and not self.zero_displacement:
            yield "Time_Function", "missing; give Type and Parameters, or Zero_Displacement: true"
        yield from super().rules()


class ForceSet(LoadSet):
    """Force_BC.Set_k: a prescribed force density."""

    retired: ClassVar[dict[str, str]] = {
        **LoadSet.retired,
        "Zero_Displacement": "it belongs to Displacement_BC",
    }
    times: ClassVar[tuple[str, ...]] = FORCE_TIMES

    time_function: TimeFunction = key(
        "Time_Function", "how the force density depends on time [N/m^3]", default=REQUIRED
    )


class Displacements(Block):
    """Displacement_BC: prescribed displacements."""

    numbered: ClassVar[Numbered | None] = Numbered("Set_k", DisplacementSet)

    sets: Annotated[Integer, Lt(1001)] = key("Sets", "the number of sets", default=0, ge=0)


class Forces(Block):
    """Force_BC: gravity and force sets."""

    numbered: ClassVar[Numbered | None] = Numbered("Set_k", ForceSet)

    gravity: Vector | None = key(
        "Gravity", "the acceleration of gravity as [gx, gy, gz]", unit="m/s^2"
    )
    sets: Annotated[Integer, Lt(1001)] = key("Sets", "the number of sets", default=0, ge=0)


class InitialVelocity(Block):
    """IC.Constant_Velocity: the velocity some bodies start with."""

    velocity_vector: Vector = key(
        "Velocity_Vector", "the velocity as [vx, vy, vz]", unit="m/s", default=REQUIRED
    )
    particle_list: tuple[Index, ...] | None = key("Particle_List", "the list of body ids, from 0")
    spin: Annotated[tuple[Number, ...], Len(3, 3)] | None = key(
        "Spin",
        "the angular velocity of each body about its centre of mass as [wx, wy, wz]",
        unit="rad/s",
    )


class InitialCondition(Block):
    """IC: the initial condition."""

    numbered: ClassVar[Numbered | None] = Numbered("Set_k", InitialVelocity)

    sets: Annotated[Integer, Lt(100001)] = key(
        "Sets", "the number of further velocities, Set_1, Set_2, ...", default=0, ge=0
    )

    constant_velocity: InitialVelocity | None = key(
        "Constant_Velocity", "the initial velocity and the bodies that have it"
    )
