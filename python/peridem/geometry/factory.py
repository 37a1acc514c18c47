"""From the deck's ``Type`` and ``Parameters`` to a shape."""

from __future__ import annotations

import difflib
import itertools
import math
from collections.abc import Callable, Sequence

import numpy as np

from ..errors import InputError
from .base import FloatArray, Shape, at_most
from .composite import Complex, Difference
from .primitives import Ball, Box, Cylinder, Ellipse, Line, Polygon

_MOST_SEARCHED_MEMBERS = 8


class _BadParametersError(ValueError):
    """A rule broken by the parameters of a shape, without the place."""


def _positive(**lengths: float) -> None:
    for name, value in lengths.items():
        if not value > 0.0:
            raise _BadParametersError(
                f"{name.replace('_', ' ')} = {value:g} must be positive; give a length in m"
            )


def _center(p: FloatArray, start: int) -> FloatArray:
    return p[start : start + 3].copy() if len(p) >= start + 3 else np.zeros(3)


def _direction(p: FloatArray, start: int, default: float) -> float:
    """Angle [rad] of the axis in the xy plane, `default` when there is none."""
    if len(p) < start + 3:
        return default
    if math.hypot(p[start], p[start + 1]) == 0.0:
        raise _BadParametersError(
            "the axis has no component in the xy plane; give for instance 1, 0, 0"
        )
    return math.atan2(p[start + 1], p[start])


def _corners(name: str, p: FloatArray, axes: int) -> Box:
    lower, upper = p[:3].copy(), p[3:6].copy()
    for axis, label in enumerate("xyz"):
        if lower[axis] > upper[axis]:
            raise _BadParametersError(
                f"the first corner has {label} = {lower[axis]:g} above the second's "
                f"{upper[axis]:g}; give the lower corner first"
            )
    sides = (upper - lower)[:axes]
    if not np.any(sides > 0.0):
        raise _BadParametersError("the two corners coincide; give a box with an extent")
    length = float(sides[0]) if sides[0] > 0.0 else None
    return Box(type=name, lower=lower, upper=upper, axes=axes, scale_length=length)


def _sized_box(name: str, sides: FloatArray, center: FloatArray, axes: int) -> Box:
    _positive(**{f"L{label}": float(side) for side, label in zip(sides, "xyz", strict=False)})
    half = np.zeros(3)
    half[:axes] = 0.5 * sides
    return Box(
        type=name,
        lower=center - half,
        upper=center + half,
        axes=axes,
        scale_length=float(sides[0]),
    )


def _equal_sided(name: str, p: FloatArray, axes: int) -> Box:
    if len(p) < 6:
        return _sized_box(name, np.full(axes, p[0]), _center(p, 1), axes)
    box = _corners(name, p, axes)
    if np.ptp(box.sides) > 1e-4 * box.sides.max():
        other = "rectangle" if axes == 2 else "cuboid"
        sides = ", ".join(f"{side:g}" for side in box.sides)
        raise _BadParametersError(f"the sides {sides} differ; use Type {other}")
    return box


def _polygon(
    name: str, r: float, center: FloatArray, polar: Sequence[tuple[float, float]]
) -> Polygon:
    d, a = np.array(polar).T
    vertices = center + np.column_stack([d * np.cos(a), d * np.sin(a), np.zeros_like(a)])
    return Polygon(type=name, radius=r, middle=center, vertices=vertices, scale_length=r)


def _line(name: str, p: FloatArray) -> Shape:
    if len(p) == 6:
        start, end = p[:3].copy(), p[3:].copy()
    else:
        _positive(length=p[0])
        half = np.array([0.5 * p[0], 0.0, 0.0])
        start, end = _center(p, 1) - half, _center(p, 1) + half
    length = float(np.linalg.norm(end - start))
    if length == 0.0:
        raise _BadParametersError("its two points coincide; give two different points")
    return Line(type=name, start=start, end=end, scale_length=length)


def _triangle(name: str, p: FloatArray) -> Shape:
    _positive(radius=p[0])
    angle = _direction(p, 4, default=0.5 * math.pi)
    polar = [(p[0], angle + k * 2.0 * math.pi / 3.0) for k in range(3)]
    return _polygon(name, float(p[0]), _center(p, 1), polar)


def _hexagon(name: str, p: FloatArray) -> Shape:
    _positive(radius=p[0])
    angle = _direction(p, 4, default=0.0)
    polar = [(p[0], angle + k * math.pi / 3.0) for k in range(6)]
    return _polygon(name, float(p[0]), _center(p, 1), polar)


def _drum(name: str, p: FloatArray) -> Shape:
    r, w = float(p[0]), float(p[1])
    _positive(radius=r, half_neck_width=w)
    if w >= r:
        raise _BadParametersError(
            f"half neck width {w:g} must be below the radius {r:g}; "
            "give Parameters [r, w, ...] with w < r"
        )
    angle, sixth = _direction(p, 5, default=0.0), math.pi / 3.0
    offsets = [(w, 0.0), (r, sixth), (r, 2 * sixth), (w, 3 * sixth), (r, 4 * sixth)]
    offsets.append((r, 5 * sixth))
    polar = [(distance, angle + offset) for distance, offset in offsets]
    return _polygon(name, r, _center(p, 2), polar)


def _circle(name: str, p: FloatArray) -> Shape:
    _positive(radius=p[0])
    axes = 3 if name == "sphere" else 2
    r = float(p[0])
    return Ball(type=name, radius=r, middle=_center(p, 1), axes=axes, scale_length=r)


def _ellipse(name: str, p: FloatArray) -> Shape:
    _positive(first_half_axis=p[0], second_half_axis=p[1])
    return Ellipse(
        type=name,
        a=float(p[0]),
        b=float(p[1]),
        middle=_center(p, 2),
        angle=float(p[5]) if len(p) > 5 else 0.0,
        scale_length=float(p[0]),
    )


def _rectangle(name: str, p: FloatArray) -> Shape:
    return _corners(name, p, 2) if len(p) == 6 else _sized_box(name, p[:2], _center(p, 2), 2)


def _cuboid(name: str, p: FloatArray) -> Shape:
    return _corners(name, p, 3) if len(p) == 6 else _sized_box(name, p, np.zeros(3), 3)


def _cylinder(name: str, p: FloatArray) -> Shape:
    r = float(p[0])
    _positive(radius=r)
    base, axis = (p[1:4], p[4:7]) if len(p) == 7 else (p[2:5], p[5:8])
    norm = float(np.linalg.norm(axis))
    if norm == 0.0:
        raise _BadParametersError("the axis is zero; give the direction of the cylinder")
    if len(p) == 8:
        _positive(length=p[1])
        axis = axis * (p[1] / norm)
    return Cylinder(type=name, radius=r, base=base.copy(), axis=axis.copy(), scale_length=r)


def _corner_boxes(name: str, p: FloatArray, axes: int) -> Shape:
    return _box_minus_box(name, _corners("box", p[:6], axes), _corners("box", p[6:], axes))


def _box_minus_box(name: str, a: Box, b: Box) -> Difference:
    # the text says inner first, decks of the original have the outer first: take either
    outer, inner = (b, a) if _holds(b, a) else (a, b)
    if not _holds(outer, inner):
        raise _BadParametersError(
            "neither box lies within the other; give the inner two corners, then the outer two"
        )
    if not outer.volume > inner.volume or inner.volume == 0.0:
        raise _BadParametersError(
            "inner and outer box leave no wall and hole; give an inner box that is smaller"
        )
    return Difference(type=name, outer=outer, inner=inner)


def _holds(outer: Box, inner: Box) -> bool:
    n = outer.axes
    lower_ok = at_most(outer.lower[:n], inner.lower[:n]).all()
    return bool(lower_ok and at_most(inner.upper[:n], outer.upper[:n]).all())


def _ring(name: str, p: FloatArray) -> Shape:
    _positive(first_radius=p[0], second_radius=p[1])
    small, large = sorted((float(p[0]), float(p[1])))
    if small == large:
        raise _BadParametersError("both radii are equal; give an inner and an outer radius")
    c = _center(p, 2)
    return Difference(
        type=name,
        outer=Ball(type="circle", radius=large, middle=c, axes=2),
        inner=Ball(type="circle", radius=small, middle=c, axes=2),
        scale_length=large,
    )


def _frame(name: str, p: FloatArray) -> Shape:
    c = _center(p, 4)
    return _box_minus_box(name, _sized_box("box", p[:2], c, 2), _sized_box("box", p[2:4], c, 2))


_Builder = Callable[[str, FloatArray], Shape]

# type -> (dimension, {number of parameters: what they are}, builder); the first form is
# the one expected of a member of a complex shape
_FORMS: dict[str, tuple[int, dict[int, str], _Builder]] = {
    "line": (1, {4: "L,x,y,z", 1: "L", 6: "x0,y0,z0,x1,y1,z1"}, _line),
    "triangle": (2, {4: "r,x,y,z", 1: "r", 7: "r,x,y,z,ax,ay,az"}, _triangle),
    "square": (
        2,
        {4: "L,x,y,z", 1: "L", 6: "x0,y0,z0,x1,y1,z1"},
        lambda name, p: _equal_sided(name, p, 2),
    ),
    "rectangle": (
        2,
        {6: "x0,y0,z0,x1,y1,z1", 2: "Lx,Ly", 5: "Lx,Ly,x,y,z"},
        _rectangle,
    ),
    "hexagon": (2, {7: "r,x,y,z,ax,ay,az", 1: "r", 4: "r,x,y,z"}, _hexagon),
    "drum2d": (2, {5: "r,w,x,y,z", 2: "r,w", 8: "r,w,x,y,z,ax,ay,az"}, _drum),
    "circle": (2, {4: "r,x,y,z", 1: "r"}, _circle),
    "ellipse": (2, {6: "a,b,x,y,z,angle", 2: "a,b", 5: "a,b,x,y,z"}, _ellipse),
    "sphere": (3, {4: "r,x,y,z", 1: "r"}, _circle),
    "cube": (
        3,
        {4: "L,x,y,z", 1: "L", 6: "x0,y0,z0,x1,y1,z1"},
        lambda name, p: _equal_sided(name, p, 3),
    ),
    "cuboid": (3, {6: "x0,y0,z0,x1,y1,z1", 3: "Lx,Ly,Lz"}, _cuboid),
    "cylinder": (3, {7: "r,x,y,z,ax,ay,az", 8: "r,L,x,y,z,ax,ay,az"}, _cylinder),
    "rectangle_minus_rectangle": (
        2,
        {12: "inner x0,y0,z0,x1,y1,z1, outer x0,y0,z0,x1,y1,z1"},
        lambda name, p: _corner_boxes(name, p, 2),
    ),
    "cuboid_minus_cuboid": (
        3,
        {12: "inner x0,y0,z0,x1,y1,z1, outer x0,y0,z0,x1,y1,z1"},
        lambda name, p: _corner_boxes(name, p, 3),
    ),
    "annulus_circle": (2, {5: "r_in,r_out,x,y,z", 2: "r_in,r_out"}, _ring),
    "annulus_rectangle": (
        2,
        {7: "Lx_in,Ly_in,Lx_out,Ly_out,x,y,z", 4: "Lx_in,Ly_in,Lx_out,Ly_out"},
        _frame,
    ),
}
_SOLID_OF = {"circle": "sphere", "square": "cube", "rectangle": "cuboid"}
_SOLID_OF["rectangle_minus_rectangle"] = "cuboid_minus_cuboid"

SHAPE_TYPES: tuple[str, ...] = (*_FORMS, "complex")
"""Names that ``Type`` of a geometry may have."""


def parameter_forms(type: str) -> tuple[str, ...]:
    """Return the lists that ``Parameters`` of a shape may be, such as ``r,x,y,z``.

    Parameters
    ----------
    type : str
        One of `SHAPE_TYPES`; ``complex`` has none of its own.
    """
    forms = _FORMS[type][1] if type in _FORMS else {}
    return tuple(forms[n] for n in sorted(forms))


def make_shape(
    type: str,
    parameters: Sequence[float],
    vec_type: Sequence[str] | None = None,
    vec_flag: Sequence[str] | None = None,
    dimension: int = 2,
    *,
    where: str = "geometry",
) -> Shape:
    """Make the shape that a deck describes.

    Parameters
    ----------
    type : str
        One of `SHAPE_TYPES`.
    parameters : sequence of float
        Lengths and positions [m]; for ``complex`` those of all members in a row.
    vec_type, vec_flag : sequence of str, optional
        Types of the members of a ``complex`` shape and ``plus`` or ``minus`` for each.
    dimension : int
        Dimension of the model, 1 to 3.
    where : str
        Start of an error message, such as ``input.yaml:41: Particle.Zone_1``.

    Returns
    -------
    Shape

    Raises
    ------
    InputError
        If the type is unknown, the number of parameters is none of the type's, a length
        is not positive, or a plane shape is asked for in a three-dimensional model.
    """
    try:
        p = _numbers(parameters)
        if type == "complex":
            return _complex(p, vec_type, vec_flag, dimension)
        _known(type, dimension)
        return _single(type, p)
    except _BadParametersError as error:
        shown = ", ".join(f"{value}" for value in parameters)
        raise InputError(f"{where}: {type} with Parameters = [{shown}]: {error}") from None


def _numbers(parameters: Sequence[float]) -> FloatArray:
    try:
        p = np.array(parameters, dtype=float).reshape(-1)
    except (TypeError, ValueError):
        raise _BadParametersError("Parameters must be numbers; write them as [a, b, ...]") from None
    if not np.isfinite(p).all():
        raise _BadParametersError("Parameters must be finite; replace nan and inf")
    return p


def _known(type: str, dimension: int) -> None:
    if type not in _FORMS:
        near = difflib.get_close_matches(str(type).lower(), SHAPE_TYPES, n=1)
        remedy = f"did you mean {near[0]}?" if near else "use one of " + ", ".join(SHAPE_TYPES)
        raise _BadParametersError(f"no such Type of geometry; {remedy}")
    if dimension == 3 and _FORMS[type][0] == 2:
        solid = _SOLID_OF.get(type, "a solid shape such as cuboid or sphere")
        raise _BadParametersError(f"a plane shape in a model of Dimension 3; use {solid}")


def _single(type: str, p: FloatArray) -> Shape:
    _, forms, build = _FORMS[type]
    if len(p) not in forms:
        meant = " | ".join(f"[{forms[n]}]" for n in sorted(forms))
        raise _BadParametersError(f"{len(p)} parameters are none of its forms; give {meant}")
    return build(type, p)


def _complex(
    p: FloatArray,
    vec_type: Sequence[str] | None,
    vec_flag: Sequence[str] | None,
    dimension: int,
) -> Complex:
    types, flags = list(vec_type or ()), list(vec_flag or ())
    if not types or len(types) != len(flags):
        raise _BadParametersError(
            f"Vec_Type has {len(types)} and Vec_Flag {len(flags)} entries; "
            "give both, one entry for each member"
        )
    for flag in flags:
        if flag not in ("plus", "minus"):
            raise _BadParametersError(f"Vec_Flag has {flag!r}; use plus or minus")
    if flags[0] != "plus":
        raise _BadParametersError("there is nothing to take away from yet; begin with plus")
    for type in types:
        _known(type, dimension)
    ends = np.cumsum(_split(types, len(p)))[:-1]
    parts = np.split(p, ends)
    members = tuple(_single(type, part) for type, part in zip(types, parts, strict=True))
    signs = tuple(flag == "plus" for flag in flags)
    return Complex(type="complex", members=members, signs=signs)


def _split(types: Sequence[str], total: int) -> list[int]:
    """Share out the parameters: the full forms, else the only way that fits."""
    counts = [list(_FORMS[type][1]) for type in types]
    full = [forms[0] for forms in counts]
    if sum(full) == total:
        return full
    if len(types) <= _MOST_SEARCHED_MEMBERS:
        fits = [c for c in itertools.product(*counts) if sum(c) == total]
        if len(fits) == 1:
            return list(fits[0])
    wanted = ", ".join(f"{type} {n}" for type, n in zip(types, full, strict=True))
    raise _BadParametersError(
        f"{total} parameters cannot be shared out among its members; give {wanted} "
        f"({sum(full)} in all)"
    )
