"""Sets of parameters: from a grid or rows, checked against the function that takes them."""

from __future__ import annotations

import hashlib
import inspect
import itertools
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from ..errors import InputError
from ..modelling.arguments import did_you_mean, plain, show_value

OWN_COLUMNS = ("id", "status", "error", "seconds", "source", "version")
"""Columns of the table that are neither parameters nor results."""

Parameters = dict[str, Any]


def sets_of(rows: Any, grid: Mapping[str, Any]) -> list[Parameters]:
    """Combine every row with every combination of the grid.

    Raises
    ------
    InputError
        If there are none, a value cannot be identified, or two sets are the same.
    """
    base = [{}] if rows is None else _rows(rows)
    axes = {name: _values(name, given) for name, given in grid.items()}
    sets = []
    for row in base:
        for combination in itertools.product(*axes.values()):
            again = set(row) & set(axes)
            if again:
                name = min(again)
                raise InputError(
                    f"study: {name}: is a column of rows and given besides them; keep one of them"
                )
            sets.append({**row, **dict(zip(axes, combination, strict=True))})
    if rows is None and not grid:
        raise InputError("study: parameters: missing; give rows, or a list such as speed=[1, 2]")
    _check(sets)
    return sets


def identity(parameters: Parameters) -> str:
    """Return 12 hexadecimal digits that depend on the names and values of parameters."""
    text = json.dumps(_canonical(parameters), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def check_signature(run: Callable[..., Any], sets: Sequence[Parameters], given: set[str]) -> None:
    """Refuse sets with parameters that the function does not know, or lacks.

    Parameters
    ----------
    run : callable
        The function of a study.
    sets : sequence of dict
        Sets of parameters.
    given : set of str
        Arguments that the study itself gives.

    Raises
    ------
    InputError
        Naming the parameter.
    """
    name = getattr(run, "__name__", type(run).__name__)
    try:
        known = inspect.signature(run).parameters
    except (TypeError, ValueError):
        return
    takes_any = any(one.kind is one.VAR_KEYWORD for one in known.values())
    named = [key for key, one in known.items() if one.kind in (1, 3)]
    needed = {key for key in named if known[key].default is inspect.Parameter.empty}
    for parameters in sets:
        for key in parameters:
            if key not in named and not takes_any:
                raise InputError(
                    f"study: {key}: {name}() has no such parameter; {did_you_mean(key, named)}"
                )
        lacking = needed - set(parameters) - given
        if lacking:
            raise InputError(
                f"study: {min(lacking)}: {name}() needs it; give a value or a list of values"
            )


def cell(value: Any) -> str:
    """Write a value into a cell of the table, on one line."""
    value = plain(value)
    if value is None:
        return ""
    if isinstance(value, list | dict):
        return json.dumps(_canonical(value))
    return repr(value) if isinstance(value, bool | int | float) else line(value)


def line(text: object) -> str:
    """Put text on one line."""
    return " / ".join(str(text).split("\n"))


def _rows(rows: Any) -> list[Parameters]:
    if hasattr(rows, "to_dict") and hasattr(rows, "columns"):
        return [{str(key): value for key, value in row.items()} for row in rows.to_dict("records")]
    if isinstance(rows, Mapping) or not isinstance(rows, Iterable) or isinstance(rows, str):
        raise InputError(
            f"study: rows = {show_value(rows)}: must be a DataFrame or a list of dicts; "
            "write [{'speed': 1.0}]"
        )
    listed = list(rows)
    for k, row in enumerate(listed):
        if not isinstance(row, Mapping) or any(not isinstance(key, str) for key in row):
            raise InputError(
                f"study: rows[{k}] = {show_value(row)}: must be a dict of values by name; "
                "write {'speed': 1.0}"
            )
    return [dict(row) for row in listed]


def _values(name: str, given: Any) -> list[Any]:
    if isinstance(given, str | bytes) or not isinstance(given, Iterable):
        return [given]
    if isinstance(given, Mapping):
        raise InputError(
            f"study: {name} = {show_value(given)}: must be a value or a list of values; correct it"
        )
    values = list(given)
    if not values:
        raise InputError(f"study: {name} = []: is empty; give at least one value")
    return values


def _check(sets: list[Parameters]) -> None:
    if not sets:
        raise InputError("study: rows: is empty; give at least one set of parameters")
    seen: dict[str, int] = {}
    for k, parameters in enumerate(sets):
        for name in parameters:
            if name in OWN_COLUMNS:
                raise InputError(
                    f"study: {name}: is the name of a column of the table of results; rename it"
                )
        try:
            key = identity(parameters)
        except TypeError as error:
            raise InputError(
                f"study: {error}: must be a number, text, True, False, None or a list of these; "
                "give a name and look it up in the function"
            ) from None
        if key in seen:
            raise InputError(
                f"study: rows[{k}] = {show_value(parameters)}: is the same as rows[{seen[key]}]; "
                "remove it, or tell them apart by a parameter such as seed"
            )
        seen[key] = k


def _canonical(value: Any, name: str = "") -> Any:
    """Turn equal values into the same JSON: 1, 1.0 and NumPy's 1 are one value."""
    value = plain(value)
    if isinstance(value, Mapping):
        return {str(key): _canonical(one, str(key)) for key, one in value.items()}
    if isinstance(value, list):
        return [_canonical(one, name) for one in value]
    if isinstance(value, float) and value.is_integer():
        return int(value)
    if value is None or isinstance(value, str | bool | int | float):
        return value
    raise TypeError(f"{name} = {show_value(value)}")
