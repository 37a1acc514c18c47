"""Many bodies at once: from arrays, a table or a packing to one set of arguments for each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .arguments import did_you_mean, show_value, vectors

_WHO = "add_particles"
_PACKING = ("shapes", "shape_index", "positions", "scales", "angles")
_PLACES = ("x", "y", "z")
_AXES = ("ax", "ay", "az")
_VELOCITIES = ("vx", "vy", "vz")
_SPINS = ("wx", "wy", "wz")
_COLUMNS = (
    *_PLACES, "scale", "radius", "angle", *_AXES, *_VELOCITIES, "spin", *_SPINS, "shape",
)  # fmt: skip

Row = dict[str, Any]


def rows_of(source: Any, shape: Any, given: Mapping[str, Any], dimension: int) -> list[Row]:
    """Arguments of each body.

    Parameters
    ----------
    source : Packing, DataFrame or None
        Where the bodies are.
    shape : shape or sequence of shapes or None
        Their shapes.
    given : mapping
        The arguments at, scale, angle, axis, velocity and spin.
    dimension : int
        Dimension of the model.

    Returns
    -------
    list of dict
        With shape, at, scale, angle, axis, velocity and spin of each body.

    Raises
    ------
    InputError
        If the arguments do not fit together.
    """
    if source is not None and all(hasattr(source, name) for name in _PACKING):
        columns = _of_packing(source, shape, given)
    elif source is not None and hasattr(source, "columns"):
        columns = _of_table(source, shape, given)
    elif source is not None and shape is None and hasattr(source, "geometry"):
        return rows_of(None, source, given, dimension)  # a shape in the first place
    elif source is not None:
        raise InputError(
            f"{_WHO}: source = {show_value(source)}: must be a packing or a DataFrame; or leave it "
            "out and give shape and at"
        )
    else:
        columns = _of_arrays(shape, given, dimension)
    return _rows(columns, dimension)


def _of_packing(packing: Any, shape: Any, given: Mapping[str, Any]) -> Row:
    for name, value in {
        "shape": shape,
        **{k: given[k] for k in ("at", "scale", "angle", "axis")},
    }.items():
        if value is not None:
            raise InputError(
                f"{_WHO}: {name} = {show_value(value)}: is given by the packing; leave it out"
            )
    axes = getattr(packing, "axes", None)
    return {
        "shape": [packing.shapes[int(k)] for k in packing.shape_index],
        "at": np.asarray(packing.positions, dtype=float),
        "scale": np.asarray(packing.scales, dtype=float),
        "angle": np.asarray(packing.angles, dtype=float),
        "axis": None if axes is None else np.asarray(axes, dtype=float),
        "velocity": given["velocity"],
        "spin": given["spin"],
    }


def _names_of(table: Any) -> list[str]:
    """Names of the columns, checked."""
    names = [str(name) for name in table.columns]
    for name in names:
        if name not in _COLUMNS:
            raise InputError(f"{_WHO}: column {name!r}: is unknown; {did_you_mean(name, _COLUMNS)}")
    for one, other in (("radius", "scale"), *((name, "spin") for name in _SPINS)):
        if one in names and other in names:
            raise InputError(
                f"{_WHO}: column {one!r}: is given besides {other!r}; keep one of them"
            )
    for name in ("x", "y"):
        if name not in names:
            raise InputError(f"{_WHO}: column {name!r}: missing; the table needs x and y in m")
    return names


def _of_table(table: Any, shape: Any, given: Mapping[str, Any]) -> Row:
    names = _names_of(table)
    if given["at"] is not None:
        raise InputError(f"{_WHO}: at: is given besides the table; leave it out")
    columns: Row = dict(given)
    vectors_of = {"at": _PLACES, "velocity": _VELOCITIES, "axis": _AXES, "spin": _SPINS}
    for argument, parts in vectors_of.items():
        present = [name for name in parts if name in names]
        if present:
            _not_twice(argument, given)
            array = np.zeros((len(table), 3))
            for name in present:
                array[:, parts.index(name)] = _column(table, name)
            columns[argument] = array
    for argument in ("scale", "angle", "spin"):
        if argument in names:
            _not_twice(argument, given)
            columns[argument] = _column(table, argument)
    columns["shape"] = shape
    if "shape" in names:
        columns["shape"] = _picked(table["shape"], shape)
    if "radius" in names:
        _not_twice("scale", given)
        columns["scale"] = _column(table, "radius") / _radii(columns["shape"], len(table))
    return columns


def _radii(shapes: Any, n: int) -> NDArray[np.float64]:
    """Bounding radii [m] of the shapes as they are given."""
    listed = shapes if isinstance(shapes, Sequence) else [shapes] * n
    for shape in listed:
        if not hasattr(shape, "geometry"):
            raise InputError(f"{_WHO}: shape = {show_value(shape)}: must be a shape; give it")
    return np.array([shape.geometry.bounding_radius for shape in listed])


def _column(table: Any, name: str) -> NDArray[np.float64]:
    try:
        return np.asarray(table[name], dtype=float)
    except (TypeError, ValueError):
        raise InputError(
            f"{_WHO}: column {name!r}: must hold numbers only; correct the table"
        ) from None


def _not_twice(argument: str, given: Mapping[str, Any]) -> None:
    if given.get(argument) is not None:
        raise InputError(
            f"{_WHO}: {argument} = {show_value(given[argument])}: is given besides the column of "
            "the table; keep one of them"
        )


def _picked(positions: Any, shapes: Any) -> list[Any]:
    if not isinstance(shapes, Sequence):
        raise InputError(
            f"{_WHO}: shape = {show_value(shapes)}: must be a sequence of shapes, which the column "
            "'shape' counts from 0; give them"
        )
    picked = []
    for position in positions:
        if not isinstance(position, int | np.integer) or not 0 <= position < len(shapes):
            raise InputError(
                f"{_WHO}: column 'shape': {position!r}: must be from 0 to {len(shapes) - 1}; "
                "correct it"
            )
        picked.append(shapes[int(position)])
    return picked


def _of_arrays(shape: Any, given: Mapping[str, Any], dimension: int) -> Row:
    if shape is None:
        raise InputError(f"{_WHO}: shape: missing; give a shape such as Circle(radius=1e-3)")
    if given["at"] is None:
        raise InputError(f"{_WHO}: at: missing; give the places as an array of shape (n, 2)")
    return {**given, "shape": shape}


def _rows(columns: Row, dimension: int) -> list[Row]:
    """One set of arguments for each body; what is given once holds for all."""
    if np.size(columns["at"]) == 0:
        raise InputError(f"{_WHO}: at: has no places; give at least one")
    places = vectors(columns["at"], f"{_WHO}: at", dimension)
    n = len(places)
    shapes = columns["shape"]
    if not isinstance(shapes, Sequence):
        shapes = [shapes] * n
    if len(shapes) != n:
        raise InputError(
            f"{_WHO}: shape: {len(shapes)} shapes for {n} places: must be one, or one for each; "
            "correct it"
        )
    velocities = _spread_vectors(columns, "velocity", n, dimension, "m/s")
    axes = _spread_vectors(columns, "axis", n, 3, "")
    scalars = ["scale", "angle"]
    spins = None
    if _are_vectors(columns.get("spin"), n, dimension):
        spins = _spread_vectors(columns, "spin", n, 3, "rad/s")
    else:
        scalars.append("spin")
    numbers = {name: _spread(columns.get(name), name, n) for name in scalars}
    rows = []
    for k in range(n):
        row: Row = {"shape": shapes[k], "at": places[k].tolist()}
        row |= {name: float(values[k]) for name, values in numbers.items() if values is not None}
        for name, found in (("velocity", velocities), ("axis", axes), ("spin", spins)):
            if found is not None:
                row[name] = found[k].tolist()
        rows.append(row)
    return rows


def _spread(value: Any, name: str, n: int) -> Any:
    """Numbers, shape (n,); None when they are not given."""
    if value is None:
        return None
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        array = np.empty((0, 0))
    if array.shape not in ((), (n,)):
        raise InputError(
            f"{_WHO}: {name} = {show_value(value)}: must be a number, or {n} of them; correct it"
        )
    return np.broadcast_to(array, (n,))


def _are_vectors(value: Any, n: int, dimension: int) -> bool:
    """Whether spins are given as vectors rather than as one number or one for each of n bodies."""
    shape = np.shape(value)
    return len(shape) == 2 or (shape == (3,) and dimension == 3 and n != 3)


def _spread_vectors(columns: Row, name: str, n: int, dimension: int, unit: str) -> Any:
    """Vectors, shape (n, 3); None when they are not given."""
    value = columns.get(name)
    if value is None:
        return None
    rows = value if np.ndim(value) == 2 else [value]
    array = vectors(rows, f"{_WHO}: {name}", dimension, unit=unit)
    if len(array) not in (1, n):
        raise InputError(
            f"{_WHO}: {name}: {len(array)} vectors for {n} places: must be one, or one for each; "
            "correct it"
        )
    return np.broadcast_to(array, (n, 3))
