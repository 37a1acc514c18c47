"""Loads of a model being built: prescribed motion and force densities, as sets of a deck."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ..deck import DisplacementSet, ForceSet, Geometry
from ..deck.loads import (
    DISPLACEMENT_TIMES,
    FORCE_TIMES,
    SPATIAL_PARAMETERS,
    TIME_PARAMETERS,
)
from ..errors import InputError
from ..geometry import make_shape
from ..outside import FloatArray, NodeChoice, Outside, TimeCallable
from .arguments import choice, number, plain, show_value, validated, vector
from .bodies import Body

Kind = Literal["displacement", "force"]
Matches = Callable[[Body], bool]

_NAMES = {
    "Time_Function.Parameters": "",
    "Time_Function": "",
    "Spatial_Function.Parameters": "space",
    "Spatial_Function": "space",
    "Region": "region",
    "Region.Geometry": "region",
    "Direction": "directions",
    "Geometry": "region",
    "Region.Geometry.Parameters": "region",
    "Parameters": "its parameters",
}


@dataclass(frozen=True)
class LoadPart:
    """One set of loads.

    Attributes
    ----------
    kind : {"displacement", "force"}
        Block of the deck it belongs to.
    label : str
        What messages call it.
    matches : callable or None
        Tells which bodies it acts on; None for all nodes of its region.
    content : dict
        Keys of the set, but for the bodies.
    outside : Outside or None
        What of it a deck cannot say.
    """

    kind: Kind
    label: str
    matches: Matches | None
    content: Mapping[str, Any]
    outside: Outside | None = None

    def block(self, bodies: Sequence[int] | None) -> DisplacementSet | ForceSet:
        """Make the set for the bodies of these ids."""
        content = dict(self.content)
        if bodies is not None:
            content["Particle_List"] = list(bodies)
        if self.kind == "displacement":
            return validated(DisplacementSet, content, self.label, _NAMES)
        return validated(ForceSet, content, self.label, _NAMES)


@dataclass
class Target:
    """Which nodes a load acts on, and along which directions.

    Attributes
    ----------
    matches : callable or None
        Tells which bodies; None for all nodes of the region.
    region : dict or None
        Keys of the region in a deck.
    choose : callable or None
        Chooses nodes where no deck can.
    directions : list of int
        Directions, 1 to 3.
    dimension : int
        Dimension of the model.
    """

    matches: Matches | None
    region: dict[str, Any] | None
    choose: NodeChoice | None
    directions: list[int]
    dimension: int
    space: Mapping[str, Any] | None = field(default=None)

    def part(
        self,
        kind: Kind,
        label: str,
        time: tuple[str, list[float]],
        directions: Sequence[int] | None = None,
        **functions: TimeCallable | None,
    ) -> LoadPart:
        """Make a load on the target; `time` is the name of a function and its parameters."""
        content: dict[str, Any] = {
            "Direction": list(self.directions if directions is None else directions),
            "Time_Function": {"Type": time[0], "Parameters": time[1]},
        }
        if self.space is not None:
            content["Spatial_Function"] = dict(self.space)
        if self.region is not None:
            content["Region"] = {"Geometry": self.region}
        outside = None
        if self.choose is not None or any(functions.values()):
            outside = Outside(label=label, choose=self.choose, **functions)
        part = LoadPart(kind, label, self.matches, content, outside)
        part.block([0])  # the rules are checked now, whatever the bodies
        return part


def parse_directions(value: Any, dimension: int, who: str) -> list[int] | None:
    """Directions, 1 to 3, from a text such as ``"xy"`` or a list of numbers; None if not given."""
    if value is None:
        return None
    known = "xyz"[:dimension]
    given = [known.find(c) + 1 for c in value] if isinstance(value, str) else plain(value)
    given = [given] if isinstance(given, int) else given
    good = isinstance(given, list) and given and len(set(map(str, given))) == len(given)
    if not good or not all(isinstance(d, int) and 1 <= d <= dimension for d in given):
        raise InputError(
            f"{who}: directions = {show_value(value)}: must name each direction once, as {known!r} "
            f"or {list(range(1, dimension + 1))} or some of them; correct it"
        )
    return sorted(given)


def parse_space(value: Any, who: str) -> dict[str, Any] | None:
    """Block ``Spatial_Function`` from a name and its parameter, ``("hat_y", p0)``."""
    if value is None:
        return None
    name, *parameters = [value] if isinstance(value, str) else list(plain(value))
    known = [key for key in SPATIAL_PARAMETERS if key != "rotation"]
    name = choice(name, known, f"{who}: space")
    _check_count(name, parameters, SPATIAL_PARAMETERS[name], f"{who}: space")
    return {"Type": name, "Parameters": parameters}


def _check_count(name: str, parameters: Sequence[Any], most: int, where: str) -> None:
    """Refuse parameters that a built-in function would not use; decks may have them."""
    if len(parameters) > most:
        raise InputError(
            f"{where} = {show_value((name, *parameters))}: {name} has {most} "
            f"parameter{'' if most == 1 else 's'}, {len(parameters)} are given; leave the rest out"
        )


def parse_region(
    value: Any, dimension: int, who: str
) -> tuple[dict[str, Any] | None, NodeChoice | None]:
    """Region as keys of a deck, or as a choice of nodes where no deck can say it."""
    if value is None:
        return None, None
    if isinstance(value, Mapping):
        return _tried({key: plain(one) for key, one in value.items()}, dimension, who), None
    if hasattr(value, "geometry"):
        keys = getattr(value, "deck_keys", None)
        if keys is not None:
            return dict(keys), None
        shape = value.geometry
        return None, lambda x, _: np.asarray(shape.inside(x))
    if callable(value):
        return None, _choice_by(value, who)
    corners = plain(value)
    if isinstance(corners, list) and len(corners) == 2:
        lower, upper = (vector(one, f"{who}: region", dimension) for one in corners)
        kind = "rectangle" if dimension == 2 else "cuboid"
        return _tried({"Type": kind, "Parameters": [*lower, *upper]}, dimension, who), None
    raise InputError(
        f"{who}: region = {show_value(value)}: must be two corners, a shape, the keys of a shape "
        "in a deck, or a function of positions (n, 3) that returns n flags; give one of them"
    )


def _tried(keys: dict[str, Any], dimension: int, who: str) -> dict[str, Any]:
    """Return the keys of a region after a shape was made of them."""
    region = validated(Geometry, keys, f"{who}: region", {})
    parameters = region.parameters or ()
    where = f"{who}: region"
    make_shape(region.type, parameters, region.vec_type, region.vec_flag, dimension, where=where)
    return keys


def _choice_by(function: Callable[[FloatArray], Any], who: str) -> NodeChoice:
    def choose(x: FloatArray, _: NDArray[np.int64]) -> NDArray[np.bool_]:
        flags = np.asarray(function(x))
        if flags.shape != (len(x),) or flags.dtype != np.bool_:
            raise InputError(
                f"{who}: region: the function gives an array of shape {flags.shape} and type "
                f"{flags.dtype}: must be one flag for each of {len(x)} positions; correct it"
            )
        return flags

    return choose


def parse_nodes(value: Any, who: str) -> NodeChoice | None:
    """Choice of nodes by their numbers in the body, from 0."""
    if value is None:
        return None
    wanted = np.asarray(value)
    if wanted.ndim != 1 or wanted.dtype.kind not in "iu" or not len(wanted) or wanted.min() < 0:
        raise InputError(
            f"{who}: nodes = {show_value(value)}: must be numbers of nodes in the body, from 0; "
            "give a list of whole numbers"
        )

    def choose(_: FloatArray, numbers: NDArray[np.int64]) -> NDArray[np.bool_]:
        missing = np.setdiff1d(wanted, numbers)
        if len(missing):
            raise InputError(
                f"{who}: nodes: {missing[0]}: no such node; the body has nodes 0 to "
                f"{int(numbers.max(initial=0))}"
            )
        return np.isin(numbers, wanted)

    return choose


def _by_component(value: Any, target: Target, where: str) -> list[tuple[float, list[int]]]:
    """Split a number or vector into values and the directions that have them."""
    given = plain(value)
    if not isinstance(given, list):
        return [(number(given, where), target.directions)]
    if len(given) not in (target.dimension, 3):
        raise InputError(
            f"{where} = {show_value(value)}: must have {target.dimension} components; None leaves "
            "a direction free"
        )
    directions: dict[float, list[int]] = {}
    for axis, component in enumerate(given):
        if target.dimension == 2 and axis == 2:
            if component not in (None, 0):
                raise InputError(f"{where} = {show_value(value)}: z must be 0 in 2D; leave it out")
            continue
        if component is None:
            continue
        if axis + 1 in target.directions:
            directions.setdefault(number(component, where), []).append(axis + 1)
    if not directions:
        raise InputError(f"{where} = {show_value(value)}: names no direction; give a component")
    return list(directions.items())


def _named(value: Any, known: Sequence[str], where: str) -> tuple[str, list[float]] | None:
    """Return a built-in function of time given as (name, parameters...); None for other values."""
    given = plain(value)
    if isinstance(given, str):
        given = [given]
    if not isinstance(given, list) or not given or not isinstance(given[0], str):
        return None
    parameters = [number(one, f"{where}: parameter {k}") for k, one in enumerate(given[1:], 1)]
    name = choice(given[0], known, where)
    _check_count(name, parameters, TIME_PARAMETERS[name], where)
    return name, parameters


def motion_parts(target: Target, label: str, displacement: Any, velocity: Any) -> list[LoadPart]:
    """Make the sets of a motion prescribed by its displacement, its velocity or both."""
    if displacement is None and velocity is None:
        raise InputError(f"{label}: nothing is given; give displacement, velocity or rotation")
    if callable(displacement) or callable(velocity):
        for name, one in (("displacement", displacement), ("velocity", velocity)):
            if one is not None and not callable(one):
                raise InputError(
                    f"{label}: {name} = {show_value(one)}: must be a function of time, as the "
                    "other one is; give lambda t: ..."
                )
        functions = {"displacement": displacement, "velocity": velocity}
        return [target.part("displacement", label, ("constant", [1.0]), **functions)]
    if displacement is not None and velocity is not None:
        raise InputError(
            f"{label}: velocity = {show_value(velocity)}: is given besides displacement; keep one"
        )
    if displacement is None:
        pairs = _by_component(velocity, target, f"{label}: velocity")
        return [
            target.part("displacement", label, ("linear", [rate]), directions)
            for rate, directions in pairs
        ]
    names = [name for name in DISPLACEMENT_TIMES if name != "rotation"]
    named = _named(displacement, names, f"{label}: displacement")
    if named is not None:
        return [target.part("displacement", label, named)]
    pairs = _by_component(displacement, target, f"{label}: displacement")
    return [
        target.part("displacement", label, ("constant", [value]), directions)
        for value, directions in pairs
    ]


def rotation_part(target: Target, label: str, rate: Any, about: Any, axis: Any) -> LoadPart:
    """Set of a rotation with a constant rate [rad/s] about a point."""
    d = target.dimension
    parameters = [number(rate, f"{label}: rotation", unit="rad/s")]
    point = (0.0, 0.0, 0.0) if about is None else vector(about, f"{label}: about", d)
    parameters += point
    if axis is not None:
        parameters += vector(axis, f"{label}: axis", 3, unit="")
    return target.part("displacement", label, ("rotation", parameters))


def force_parts(target: Target, label: str, density: Any) -> list[LoadPart]:
    """Make the sets of a force density."""
    if callable(density):
        return [target.part("force", label, ("constant", [1.0]), density=density)]
    named = _named(density, FORCE_TIMES, f"{label}: density")
    if named is not None:
        return [target.part("force", label, named)]
    pairs = _by_component(density, target, f"{label}: density")
    return [
        target.part("force", label, ("constant", [value]), directions)
        for value, directions in pairs
        if value != 0
    ]
