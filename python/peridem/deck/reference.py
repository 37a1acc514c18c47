"""The reference page of all keys of a deck, written from the schema.

::

    python -m peridem.deck.reference > docs/deck_keys.md
"""

from __future__ import annotations

import inspect
import re
import sys
import types
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from annotated_types import Ge, Gt, Le, Len, Lt, MaxLen, MinLen
from pydantic.fields import FieldInfo

from peridem.geometry import SHAPE_TYPES, parameter_forms

from .fields import Block, join
from .messages import nested_block
from .schema import DeckFile
from .shapes import Geometry

_HEAD = """\
# Keys of a deck

All keys that a deck may have, block by block: kind of value, unit, default and bounds. In the
names k, i and j stand for numbers: `Material.Zone_k` is `Material.Zone_1`, `Material.Zone_2`, ...,
and `Contact.Zone_ij` is `Contact.Zone_11`, `Contact.Zone_12`, ... with i <= j
(with more than 110 zones, where `Zone_1111` would mean two pairs, `Contact.Zone_1_1`,
`Contact.Zone_1_2`, ...; fewer may be written so too). A key that is not
here is an error; rules between keys are said in the messages. This page is written by
`python -m peridem.deck.reference`.
"""
_TABLE = """\
| key | value | unit | default | bounds | what it is |
|---|---|---|---|---|---|"""
_KINDS: dict[Any, str] = {
    float: "number",
    int: "whole number",
    bool: "true or false",
    str: "text",
    Path: "file name",
}
_BOUNDS = ((Gt, "gt", "> {}"), (Ge, "ge", ">= {}"), (Lt, "lt", "< {}"), (Le, "le", "<= {}"))


def reference_page() -> str:
    """Return the page, Markdown."""
    parts = [_HEAD]
    for field in DeckFile.model_fields.values():
        model = nested_block(field)
        assert model is not None
        needed = "; required" if field.is_required() else ""
        about = _about(model)
        text = about[0].upper() + about[1:]
        parts += [f"## {field.alias}\n", f"{text}{needed}.\n", _TABLE]
        parts.append("\n".join(_rows(model, str(field.alias))) + "\n")
    return "\n".join([*parts, _shapes()])


def _shapes() -> str:
    rows = [f"| {name} | {_forms(name)} |" for name in SHAPE_TYPES]
    text = "`Parameters` of a shape, by its `Type`; any one of the lists, lengths in m.\n"
    return "\n".join(["## Shapes\n", text, "| Type | Parameters |\n|---|---|", *rows, ""])


def _forms(name: str) -> str:
    spaced = [re.sub(r", *", ", ", form) for form in parameter_forms(name)]
    forms = [f"`[{form}]`" for form in spaced]
    return " or ".join(forms) or "those of the shapes in `Vec_Type`, in a row"


def _about(model: type[Block]) -> str:
    """First line of a block's docstring without its name and the full stop."""
    line = (inspect.getdoc(model) or "").split("\n", 1)[0].rstrip(".")
    return line.split(": ", 1)[-1]


def _rows(model: type[Block], path: str) -> Iterator[str]:
    for field in model.model_fields.values():
        here = join(path, str(field.alias))
        yield _row(here, field)
        inner = nested_block(field)
        if inner is not None and not issubclass(inner, Geometry):
            yield from _rows(inner, here)
    if model.numbered is not None:
        here = join(path, model.numbered.label)
        yield f"| `{here}` | block | | | | {_about(model.numbered.item)} |"
        yield from _rows(model.numbered.item, here)
        if model.numbered.copy is not None:
            yield from _rows(model.numbered.copy, here)


def _row(path: str, field: FieldInfo) -> str:
    extra = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
    kind, bounds = _kind(field.annotation)
    bounds = [*bounds, *_bounds(field.metadata)]
    text = f"no effect: {extra['ignored']}" if "ignored" in extra else str(field.description)
    cells = [
        f"`{path}`",
        kind,
        str(extra.get("unit", "")),
        _default(field),
        ", ".join(dict.fromkeys(bounds)),
        text,
    ]
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _kind(annotation: Any) -> tuple[str, list[str]]:
    """Say what a value is, and give its bounds."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        kind, bounds = _kind(arguments[0])
        return kind, [*bounds, *_bounds(arguments[1:])]
    if origin in (Union, types.UnionType):
        return _kind(next(one for one in arguments if one is not type(None)))
    if origin is tuple:
        kind, bounds = _kind(arguments[0])
        plural = {"whole number": "whole numbers", "number": "numbers"}.get(kind, kind)
        return f"list of {plural}", bounds
    if origin is Literal:
        names = ", ".join(f"`{value}`" for value in arguments)
        return "[shape](#shapes)" if arguments == SHAPE_TYPES else names, []
    return _KINDS[annotation] if annotation in _KINDS else _block_kind(annotation), []


def _block_kind(model: type[Block]) -> str:
    shape = issubclass(model, Geometry)
    return "block `{Type, Parameters}` of a [shape](#shapes)" if shape else "block"


def _bounds(metadata: Any) -> list[str]:
    found = []
    for one in metadata:
        inner = one.metadata if isinstance(one, FieldInfo) else [one]
        for bound in inner:
            found += [
                text.format(getattr(bound, name))
                for kind, name, text in _BOUNDS
                if isinstance(bound, kind)
            ]
            least = bound.min_length if isinstance(bound, Len | MinLen) else 0
            most = bound.max_length if isinstance(bound, Len | MaxLen) else None
            if least and least == most:
                found.append(f"{least} entries" if least > 1 else "1 entry")
            elif least:
                found.append(f"at least {least} entries")
            elif most is not None:
                found.append(f"at most {most} entries")
    return sorted(found, key=lambda text: text[0] == "<")  # lower bounds first


def _default(field: FieldInfo) -> str:
    value = field.default
    if field.is_required():
        return "required"
    if value is None or value in ((), "") or isinstance(value, Block):
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    return f"{value:g}" if isinstance(value, float) else str(value)


if __name__ == "__main__":
    sys.stdout.write(reference_page())
