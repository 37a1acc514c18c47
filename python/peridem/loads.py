"""Which nodes a set of loads acts on, and how its amplitude varies in space."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from .errors import InputError
from .geometry import Shape

FloatArray = NDArray[np.float64]


class FunctionLike(Protocol):
    """A function of time or space: its type and parameters."""

    @property
    def type(self) -> str:
        """Name of the function."""

    @property
    def parameters(self) -> Sequence[float]:
        """Its parameters, T0 or p0 first."""


class LoadSetLike(Protocol):
    """What is needed of a set of ``Displacement_BC`` or ``Force_BC``; ids count from 0."""

    @property
    def particle_list(self) -> Sequence[int] | None:
        """Bodies acted on."""

    @property
    def particle_exclude_list(self) -> Sequence[int] | None:
        """Bodies left out."""

    @property
    def time_function(self) -> FunctionLike | None:
        """Factor in time; None for a set that only holds its nodes at rest."""

    @property
    def spatial_function(self) -> FunctionLike:
        """Factor in space."""


def select_nodes(
    load: LoadSetLike,
    x_ref: FloatArray,
    particle_id: NDArray[np.integer],
    shape: Shape | None,
    *,
    where: str = "load set",
) -> NDArray[np.int32]:
    """Select the nodes of a load set.

    A node is selected when its reference position lies in the region (if there is one),
    its body is on the list (if there is one) and not on the list of excluded bodies. A
    set with neither region nor list selects nothing.

    Parameters
    ----------
    load : LoadSetLike
        The set.
    x_ref : ndarray, shape (n, 3)
        Reference positions [m].
    particle_id : ndarray of int, shape (n,)
        Body of each node.
    shape : Shape or None
        The region.
    where : str
        Start of an error message.

    Returns
    -------
    ndarray of int32, shape (k,)
        Ascending node numbers.

    Raises
    ------
    InputError
        If a list names a body that does not exist.
    """
    n_bodies = int(particle_id.max()) + 1 if len(particle_id) else 0
    _check_ids(load.particle_list, n_bodies, f"{where}: Particle_List")
    _check_ids(load.particle_exclude_list, n_bodies, f"{where}: Particle_Exclude_List")
    if shape is None and not load.particle_list:
        return np.empty(0, dtype=np.int32)
    selected = np.ones(len(x_ref), dtype=bool) if shape is None else shape.inside(x_ref)
    if load.particle_list:
        selected = selected & np.isin(particle_id, list(load.particle_list))
    if load.particle_exclude_list:
        selected = selected & ~np.isin(particle_id, list(load.particle_exclude_list))
    return np.flatnonzero(selected).astype(np.int32)


def _check_ids(ids: Sequence[int] | None, n_bodies: int, what: str) -> None:
    wrong = [i for i in ids or () if not 0 <= i < n_bodies]
    if wrong:
        raise InputError(
            f"{what} = {list(ids or ())}: no body {wrong[0]}; bodies are counted from 0 to "
            f"{n_bodies - 1}, zone by zone in the order of the placement file"
        )


def empty_selection_warning(
    load: LoadSetLike, nodes: NDArray[np.integer], shape: Shape | None, *, where: str
) -> str | None:
    """Return a warning for a set that acts on no node, else None."""
    if len(nodes):
        return None
    if shape is None and not load.particle_list:
        return f"{where}: the set has neither Region nor Particle_List and acts on nothing; add one"
    if shape is None:
        return f"{where}: the set's lists leave no body and it acts on nothing; correct the lists"
    lower, upper = shape.box
    return (
        f"{where}: no node lies in the set's region ({shape.type} from {_xyz(lower)} to "
        f"{_xyz(upper)}) and it acts on nothing; correct Region or the lists"
    )


def _xyz(point: FloatArray) -> str:
    return "(" + ", ".join(f"{value:g}" for value in point) + ")"


_SPATIAL = ("constant", "rotation", "hat_x", "hat_y", "sin_x", "sin_y", "linear_x", "linear_y")


def amplitude(
    load: LoadSetLike,
    kind: Literal["displacement", "force"],
    x_ref: FloatArray,
    boxes: FloatArray,
    *,
    where: str = "load set",
) -> FloatArray:
    """Amplitude of a load set at its nodes: the factor of the function of time.

    With T0 the first parameter of the time function, p0 that of the spatial function, x
    (or y) the reference position and hat the tent over the box (0 at its ends, 1 in its
    middle); a set without time function has amplitude 0, ``rotation`` is ``constant``:

    ========  ================  ===============
    spatial   displacement      force
    ========  ================  ===============
    constant  T0                T0
    hat_x     p0 hat            T0 p0 hat
    sin_x     T0 sin(pi p0 x)   T0 p0 sin(pi p0 x)
    linear_x  T0 p0 x           T0 p0^2 x
    ========  ================  ===============

    Parameters
    ----------
    load : LoadSetLike
        The set.
    kind : {"displacement", "force"}
        Which block of the deck it is from.
    x_ref : ndarray, shape (k, 3)
        Reference positions [m] of its nodes.
    boxes : ndarray, shape (k, 2, 3)
        Lower and upper corner [m] of the region, or of each node's body without region.
    where : str
        Start of an error message.

    Returns
    -------
    ndarray, shape (k,)

    Raises
    ------
    InputError
        If the spatial function is unknown, a parameter is missing, or the box of a hat
        has no width.
    """
    x_ref = np.asarray(x_ref, dtype=float).reshape(-1, 3)
    if load.time_function is None:
        return np.zeros(len(x_ref))
    t0 = _first(load.time_function, f"{where}: Time_Function")
    spatial = load.spatial_function
    if spatial.type not in _SPATIAL:
        raise InputError(
            f"{where}: Spatial_Function.Type = {spatial.type}: unknown; use one of "
            + ", ".join(_SPATIAL)
        )
    if spatial.type in ("constant", "rotation"):
        return np.full(len(x_ref), t0)
    p0 = _first(spatial, f"{where}: Spatial_Function")
    name, _, axis_name = spatial.type.partition("_")
    axis = "xy".index(axis_name)
    x = x_ref[:, axis]
    for_force = kind == "force"
    if name == "hat":
        hat = _hat(x, np.asarray(boxes, dtype=float).reshape(-1, 2, 3)[:, :, axis], where)
        return t0 * p0 * hat if for_force else p0 * hat
    carried = p0 if for_force else 1.0
    value = np.sin(np.pi * p0 * x) if name == "sin" else p0 * x
    return np.asarray(t0 * carried * value)


def _first(function: FunctionLike, what: str) -> float:
    if not function.parameters:
        raise InputError(
            f"{what}.Parameters = []: {function.type} needs at least one; give Parameters: [value]"
        )
    return float(function.parameters[0])


def _hat(x: FloatArray, ends: FloatArray, where: str) -> FloatArray:
    """Tent of height 1 between the two ends, shape (k, 2); 0 outside."""
    lower, upper = ends[:, 0], ends[:, 1]
    half = 0.5 * (upper - lower)
    if np.any(half <= 0.0):
        raise InputError(
            f"{where}: the box of the hat function has no width; give a region with an extent"
        )
    rise = np.minimum(x - lower, upper - x) / half
    return np.asarray(np.clip(rise, 0.0, 1.0))
