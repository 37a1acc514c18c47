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
_COLUMNS = (*_PLACES, "scale", "radius", "angle", *_AXES, *_VELOCITIES, "spin", "shape")

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
        The arguments at, scale, angle, velocity and spin.
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
        columns = _of_table(source, shape, given, dimension)
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
    for name, value in {"shape": shape, **{k: given[k] for k in ("at", "scale", "angle")}}.items():
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


def _of_table(table: Any, shape: Any, given: Mapping[str, Any], dimension: int) -> Row:
    names = [str(name) for name in table.columns]
    for name in names:
        if name not in _COLUMNS:
            raise InputError(f"{_WHO}: column {name!r}: is unknown; {did_you_mean(name, _COLUMNS)}")
    for name in ("x", "y"):
        if name not in names:
            raise InputError(f"{_WHO}: column {name!r}: missing; the table needs x and y in m")
    if given["at"] is not None:
        raise InputError(f"{_WHO}: at: is given besides the table; leave it out")
    columns: Row = dict(given)
    for argument, parts in (("at", _PLACES), ("velocity", _VELOCITIES), ("axis", _AXES)):
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
    if "radius" in names and "scale" not in names:
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
    places = vectors(columns["at"], f"{_WHO}: at", dimension)
    n = len(places)
    if n == 0:
        raise InputError(f"{_WHO}: at: has no places; give at least one")
    shapes = columns["shape"]
    if not isinstance(shapes, Sequence):
        shapes = [shapes] * n
    if len(shapes) != n:
        raise InputError(
            f"{_WHO}: shape: {len(shapes)} shapes for {n} places: must be one, or one for each; "
            "correct it"
        )
    velocities = _spread_vectors(columns.get("velocity"), n, dimension)
    axes = columns.get("axis")
    numbers = {name: _spread(columns.get(name), name, n) for name in ("scale", "angle", "spin")}
    rows = []
    for k in range(n):
        row: Row = {"shape": shapes[k], "at": places[k].tolist()}
        row |= {name: float(values[k]) for name, values in numbers.items() if values is not None}
        if velocities is not None:
            row["velocity"] = velocities[k].tolist()
        if axes is not None and dimension == 3:
            row["axis"] = list(map(float, axes[k]))
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


def _spread_vectors(value: Any, n: int, dimension: int) -> Any:
    if value is None:
        return None
    rows = value if np.ndim(value) == 2 else [value]
    array = vectors(rows, f"{_WHO}: velocity", dimension, unit="m/s")
    if len(array) not in (1, n):
        raise InputError(
            f"{_WHO}: velocity: {len(array)} vectors for {n} places: must be one, or one for each; "
            "correct it"
        )
    return np.broadcast_to(array, (n, 3))
