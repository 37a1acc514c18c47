"""Arguments of the modelling functions: what they may be, and messages about those that may not."""

from __future__ import annotations

import functools
import inspect
import math
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import ValidationError

from ..deck.blocks import walk
from ..deck.fields import Block, join
from ..deck.messages import closest, field_at, rule_text, show
from ..errors import InputError

FloatArray = NDArray[np.float64]
P = ParamSpec("P")
R = TypeVar("R")
B = TypeVar("B", bound=Block)


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Refuse arguments that a function does not know, or lacks, with an `InputError`."""
    signature = inspect.signature(function)
    known = [name for name in signature.parameters if name != "self"]
    name = function.__qualname__.removesuffix(".__init__").rsplit(".", 1)[-1]

    @functools.wraps(function)
    def wrapper(*args: P.args, **kwargs: P.kwargs) -> R:
        for word in kwargs:
            if word not in known:
                raise InputError(f"{name}: {word}: unknown argument; {did_you_mean(word, known)}")
        try:
            signature.bind(*args, **kwargs)
        except TypeError as error:
            missing = re.search(r"missing a required.*argument: '(\w+)'", str(error))
            if missing is None:
                raise InputError(f"{name}: {error}; check the call") from None
            raise InputError(_missing(name, missing[1], kwargs)) from None
        return function(*args, **kwargs)

    return wrapper


_OF_ARGUMENTS = {
    "material": "the law that the body is made of, such as peridem.PDState(...)",
    "density": "in kg/m^3",
}


def _missing(function: str, argument: str, given: Mapping[str, Any]) -> str:
    """Say which argument a call lacks, of which body, and what to give."""
    body = f" (of {given['name']!r})" if isinstance(given.get("name"), str) else ""
    what = _OF_ARGUMENTS.get(argument)
    remedy = f"give {argument}=...{f', {what}' if what else ''}"
    return f"{function}: {argument}: missing{body}; {remedy}"


#: Names that other programs and decks give to arguments.
_OTHER_NAMES = {
    "e": "young_modulus",
    "k": "bulk_modulus",
    "g": "shear_modulus",
    "nu": "poisson_ratio",
    "gc": "fracture_energy",
    "kic": "fracture_toughness",
    "rho": "density",
    "delta": "horizon",
    "mu": "friction",
    "friction_coeff": "friction",
    "epsilon": "damping_ratio",
    "restitution": "damping_ratio",
    "beta_n_factor": "damping_factor",
    "kn": "stiffness",
    "position": "at",
    "center": "at",
    "orientation": "angle",
    "h": "mesh_size",
    "size": "mesh_size",
    "omega": "spin",
}


_BOND_BASED = "bond-based laws fix Poisson's ratio at 1/4; give young_modulus or bulk_modulus alone"
_FIXED = {"poisson_ratio": _BOND_BASED, "shear_modulus": _BOND_BASED, "nu": _BOND_BASED}


def did_you_mean(word: Any, known: Iterable[str]) -> str:
    """Remedy for a name that is not one of those known."""
    names = list(known)
    if word in _FIXED and "bulk_modulus" in names and "poisson_ratio" not in names:
        return _FIXED[word]
    near = _nearest(str(word), names)
    return f"did you mean {near}?" if near else f"known are {', '.join(names)}"


def _nearest(word: str, names: list[str]) -> str | None:
    """Name that a word stands for, begins, is a part of, or is most like."""
    other = _OTHER_NAMES.get(word.lower())
    if other in names:
        return other
    parts = [name for name in names if len(word) > 2 and word.lower() in name.lower()]
    return parts[0] if len(parts) == 1 else closest(word, names)


def choice(value: Any, known: Sequence[str], where: str) -> str:
    """Return one of some words, checked."""
    if not isinstance(value, str) or value not in known:
        near = _nearest(str(value), list(known))
        remedy = f"did you mean {near}?" if near else "choose one of them"
        raise InputError(f"{where} = {value!r}: must be one of {', '.join(known)}; {remedy}")
    return value


def number(
    value: Any,
    where: str,
    *,
    above: float | None = None,
    least: float | None = None,
    unit: str = "",
) -> float:
    """Return a finite number within its bounds, checked."""
    given = plain(value)
    remedy = f"give a number in {unit}" if unit else "correct it"
    if isinstance(given, bool) or not isinstance(given, int | float) or not math.isfinite(given):
        raise InputError(f"{where} = {value!r}: must be a finite number; {remedy}")
    if above is not None and not given > above:
        rule = "must be positive" if above == 0 else f"must be above {above:g}"
        raise InputError(f"{where} = {value!r}: {rule}; {remedy}")
    if least is not None and not given >= least:
        raise InputError(f"{where} = {value!r}: must be at least {least:g}; {remedy}")
    return float(given)


def whole(value: Any, where: str, least: int) -> int:
    """Return a whole number that is not below `least`, checked."""
    given = plain(value)
    if isinstance(given, bool) or not isinstance(given, int) or given < least:
        raise InputError(
            f"{where} = {value!r}: must be a whole number, at least {least}; correct it"
        )
    return given


def vector(value: Any, where: str, dimension: int, *, unit: str = "m") -> tuple[float, ...]:
    """Return three components of a vector given by two (in 2D) or three, checked."""
    rows = vectors([value], where, dimension, unit=unit)
    x, y, z = rows[0].tolist()
    return x, y, z


def vectors(value: Any, where: str, dimension: int, *, unit: str = "m") -> FloatArray:
    """Return vectors, shape (n, 3), given by two (in 2D) or three components, checked."""
    text = "(x, y) or (x, y, z)" if dimension == 2 else "(x, y, z)"
    try:
        array = np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.ndim != 2 or array.shape[1] not in ((2, 3) if dimension == 2 else (3,)):
        shown = show_value(value[0] if isinstance(value, list) and len(value) == 1 else value)
        raise InputError(
            f"{where} = {shown}: must be {text}; give numbers{f' in {unit}' if unit else ''}"
        )
    if not np.all(np.isfinite(array)):
        raise InputError(f"{where}: must be finite numbers in {unit}; replace nan and inf")
    if dimension == 2 and array.shape[1] == 3 and np.any(array[:, 2] != 0) and unit != "":
        raise InputError(f"{where}: z must be 0 in 2D; leave it out")
    result = np.zeros((len(array), 3))
    result[:, : array.shape[1]] = array
    return result


def check_callable(value: Any, where: str) -> None:
    """Refuse what is given and cannot be called with the model."""
    if value is not None and not callable(value):
        raise InputError(
            f"{where} = {show_value(value)}: must be a function of the model; give its name "
            "without ()"
        )


def plain(value: Any) -> Any:
    """Turn NumPy's scalars and arrays into those of Python, also inside tuples and lists."""
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    if isinstance(value, tuple | list):
        return [plain(one) for one in value]
    return value


def show_value(value: Any) -> str:
    """Write a value in a message, shortened."""
    text = show(plain(value)) if isinstance(value, str) else repr(plain(value))
    return text if len(text) <= 60 else f"{text[:57]}..."


def validated(model: type[B], values: Mapping[str, Any], who: str, names: Mapping[str, str]) -> B:
    """Make a block of a deck from the arguments of a function, by the rules of decks.

    Parameters
    ----------
    model : type of Block
        The schema of the block.
    values : mapping of str to Any
        Values by the key of the deck; those that are None are left out.
    who : str
        The function, for messages.
    names : mapping of str to str
        Argument for each key of the deck that a message may name.

    Raises
    ------
    InputError
        With one line for each rule that is broken, in terms of the arguments.
    """
    content = {key: plain(value) for key, value in values.items() if value is not None}
    try:
        block = model.model_validate(content)
    except ValidationError as error:
        lines = []
        for one in error.errors(include_url=False):
            path = ".".join(str(part) for part in one["loc"])
            rule = rule_text(one, field_at(model, one["loc"]))
            lines.append(_text(who, path, rule, content, names))
        raise InputError("\n".join(dict.fromkeys(lines))) from None
    broken = [
        _text(who, join(path, key), text, content, names)
        for path, inner in walk(block, "")
        for key, text in inner.rules()
    ]
    if broken:
        raise InputError("\n".join(broken))
    return block


def _text(
    who: str, path: str, text: str, content: Mapping[str, Any], names: Mapping[str, str]
) -> str:
    key = re.split(r"[.\[]", path)[0]
    argument = names.get(path) or names.get(key, key)
    value: Any = content
    for part in re.split(r"[.\[\]]+", path):
        if isinstance(value, Mapping):
            value = value.get(part)
        elif isinstance(value, list) and part.isdigit() and int(part) < len(value):
            value = value[int(part)]
    shown = "" if value is None or isinstance(value, Mapping) else f" = {show(value)}"
    head = f"{who}: {argument}{shown}: " if argument else f"{who}: "
    return head + in_words(text, names)


def in_words(text: str, names: Mapping[str, str]) -> str:
    """Put the names of arguments in place of the keys of a deck."""
    for key in sorted(names, key=len, reverse=True):
        if names[key]:
            text = re.sub(rf"(?<![\w.]){re.escape(key)}(?![\w])", names[key], text)
    return text
