"""From broken rules to text: ``input.yaml:41: Material.Zone_2.Horizon = -1.0: must be ...``."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Sequence
from typing import Any, get_args

from pydantic.fields import FieldInfo

from peridem.errors import InputError

from .fields import Block, join
from .source import Source

_MAX_PROBLEMS = 50
_MAX_VALUE = 60
#: Likeness from which a key of the same block is meant rather than the same key of another.
_NEAR = 0.8
_ABSENT = object()


class Problems:
    """What is wrong with a deck, collected so that all of it is reported at once.

    Parameters
    ----------
    source : Source
        The deck's file, for lines and values.
    """

    def __init__(self, source: Source) -> None:
        self.source = source
        self._found: dict[tuple[int, str], None] = {}

    def add(self, path: str, text: str) -> None:
        """Add a problem with the key `path`; file, line and value are put in front."""
        line = self.source.line(path) or 0
        self._found[line, problem_text(self.source, path, text)] = None

    def add_formatted(self, path: str, text: str) -> None:
        """Add a problem whose text already begins with file and line."""
        self._found[self.source.line(path) or 0, text] = None

    def raise_if_any(self) -> None:
        """Raise one InputError with a line for each problem, in the order of the file."""
        if not self._found:
            return
        texts = [text for _, text in sorted(self._found, key=lambda problem: problem[0])]
        rest = len(texts) - _MAX_PROBLEMS
        if rest > 0:
            texts = [*texts[:_MAX_PROBLEMS], f"{self.source.path.name}: and {rest} more problems"]
        raise InputError("\n".join(texts))


def problem_text(source: Source, path: str, text: str) -> str:
    """Text of a problem, ``file:line: path = value: text``."""
    value = _lookup(source.data, path)
    shown = "" if value is _ABSENT or isinstance(value, dict) else f" = {show(value)}"
    return f"{source.where(path)}: {path or 'the deck'}{shown}: {text}"


def show(value: Any) -> str:
    """Write a value as the deck would, shortened."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, list):
        text = f"[{', '.join(show(item) for item in value[:20])}]"
    elif isinstance(value, dict):
        text = "{...}"
    elif isinstance(value, int) and abs(value) > 10**20:
        text = "a very large integer"
    else:
        text = value if isinstance(value, str) and value.isprintable() and value else repr(value)
    return text if len(text) <= _MAX_VALUE else f"{text[: _MAX_VALUE - 3]}..."


def _lookup(data: Any, path: str) -> Any:
    """Value at a key path such as ``Output.Tags[3]``."""
    for part in path.replace("[", ".[").split("."):
        if part.startswith("[") and isinstance(data, list):
            position = int(part[1:-1])
            data = data[position] if position < len(data) else _ABSENT
        elif isinstance(data, dict):
            data = data.get(part, _ABSENT)
        else:
            return _ABSENT
    return data


def render_path(path: str, location: Sequence[int | str]) -> str:
    """Key path of a location reported by pydantic inside the block `path`."""
    for part in location:
        path = f"{path}[{part}]" if isinstance(part, int) else join(path, part)
    return path


def field_at(model: type[Block], location: Sequence[int | str]) -> FieldInfo | None:
    """Find the declaration of the key at a location inside a block."""
    found: FieldInfo | None = None
    block: type[Block] | None = model
    for part in location:
        if isinstance(part, int) or block is None:
            continue
        found = next((f for f in block.model_fields.values() if f.alias == part), None)
        block = nested_block(found) if found else None
    return found


def nested_block(field: FieldInfo) -> type[Block] | None:
    """Find the block that a key holds, if it holds one."""
    for kind in (field.annotation, *get_args(field.annotation)):
        if isinstance(kind, type) and issubclass(kind, Block):
            return kind
    return None


def remedy(field: FieldInfo | None) -> str:
    """Say what to write for a key: its own remedy, or "give <description> in <unit>"."""
    if field is None:
        return "check the value"
    extra = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
    if "remedy" in extra:
        return str(extra["remedy"])
    unit = f" in {extra['unit']}" if "unit" in extra else ""
    return f"give {field.description}{unit}"


def rule_text(error: Any, field: FieldInfo | None) -> str:
    """Rule and remedy for one error of pydantic."""
    kind, context, value = error["type"], error.get("ctx", {}), error.get("input")
    if kind == "missing":
        return f"missing; {remedy(field)}"
    if kind == "flag":
        meaning = f": {field.description}" if field is not None else ""
        return f"must be true or false; write one of them{meaning}"
    if kind == "model_type":
        return "must be a block of keys; write them below it, indented"
    if kind == "literal_error":
        return _choice_text(str(context.get("expected", "")), value)
    rules = {
        "greater_than": f"must be above {context.get('gt')}",
        "greater_than_equal": f"must be at least {context.get('ge')}",
        "less_than": f"must be below {context.get('lt')}",
        "less_than_equal": f"must be at most {context.get('le')}",
        "too_short": f"must have at least {context.get('min_length')} entries",
        "too_long": f"must have at most {context.get('max_length')} entries",
        "tuple_type": "must be a list in brackets",
        "string_pattern_mismatch": "has characters that are not allowed",
    }
    rule = rules.get(kind, str(error["msg"]))
    if kind == "greater_than" and context.get("gt") == 0:
        rule = "must be positive"
    return f"{rule}; {remedy(field)}"


def _choice_text(expected: str, value: Any) -> str:
    choices = [part.strip("' ") for part in expected.replace(" or ", ", ").split(",")]
    rule = f"must be {'one of ' if len(choices) > 1 else ''}{', '.join(choices)}"
    close = closest(value, choices) if isinstance(value, str) else None
    return f"{rule}; did you mean {close}?" if close else f"{rule}; choose one of them"


def closest(word: str, known: Sequence[str], *, cutoff: float = 0.6) -> str | None:
    """Find the known word most like `word`, whatever the case."""
    lower = {name.lower(): name for name in known}
    match = difflib.get_close_matches(word.lower(), lower, n=1, cutoff=cutoff)
    return lower[match[0]] if match else None


def schema_keys(model: type[Block], path: str = "") -> Iterator[tuple[str, FieldInfo | None]]:
    """Every key path of a schema with its declaration; None for numbered blocks."""
    for field in model.model_fields.values():
        here = join(path, str(field.alias))
        yield here, field
        inner = nested_block(field)
        if inner is not None:
            yield from schema_keys(inner, here)
    if model.numbered is not None:
        here = join(path, model.numbered.label)
        yield here, None
        yield from schema_keys(model.numbered.item, here)
        if model.numbered.copy is not None:
            yield from schema_keys(model.numbered.copy, here)


def unknown_key_text(name: str, model: type[Block], root: type[Block]) -> tuple[str, str | None]:
    """Why a key is refused, and the key of the same block that was probably meant.

    Parameters
    ----------
    name : str
        The unknown key.
    model : type of Block
        The block it was found in.
    root : type of Block
        The schema, searched for blocks where the key is known.
    """
    if name in model.retired:
        return f"is not used; {model.retired[name]}", None
    if model.stray:
        return model.stray, None
    known = [str(field.alias) for field in model.model_fields.values()]
    if model.numbered is not None:
        known.append(model.numbered.label)
    near = closest(name, known, cutoff=_NEAR)
    if near is not None:
        return f"unknown key; did you mean {near}?", near
    homes = [path for path, _ in schema_keys(root) if path.split(".")[-1].lower() == name.lower()]
    if homes:
        return f"unknown key here; it belongs at {' or '.join(homes[:3])}", None
    match = closest(name, known)
    if match is not None:
        return f"unknown key; did you mean {match}?", match
    return f"unknown key; known here: {', '.join(known)}", None
