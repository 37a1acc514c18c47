"""Validate the blocks of a deck one by one, so that one bad block does not hide the others."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

from pydantic import ValidationError

from .fields import Block, Numbered, join
from .messages import Problems, field_at, nested_block, render_path, rule_text, unknown_key_text
from .schema import DeckFile

_ZONE_NAME = re.compile(r"[1-9]\d{0,8}")
_PAIR_NAME = re.compile(r"[1-9]\d{0,8}|[1-9]\d{0,3}_[1-9]\d{0,3}")


@dataclass
class ParsedBlock:
    """A top-level block after validation.

    Attributes
    ----------
    value : Block or None
        Its plain keys; None when one of them is wrong.
    items : dict of str to (Block or None)
        Its numbered blocks by name; None for those that are wrong.
    """

    value: Block | None = None
    items: dict[str, Block | None] = field(default_factory=dict)


@dataclass
class Parsed:
    """All blocks of a deck after validation, by name; what is absent has no entry."""

    blocks: dict[str, ParsedBlock] = field(default_factory=dict)
    notes: list[tuple[str, str]] = field(default_factory=list)

    def value(self, name: str) -> Block | None:
        """Plain keys of a block; None when it is absent or wrong."""
        block = self.blocks.get(name)
        return block.value if block is not None else None

    def items(self, name: str) -> dict[str, Block | None]:
        """Numbered blocks of a block."""
        block = self.blocks.get(name)
        return block.items if block is not None else {}


def parse_blocks(data: dict[str, Any], problems: Problems) -> Parsed:
    """Validate every block of a deck against the schema.

    Parameters
    ----------
    data : dict
        Values of the YAML file.
    problems : Problems
        Receives what is wrong.

    Returns
    -------
    Parsed
        The blocks that are right; None stands for those that are not.
    """
    parsed = Parsed()
    fields = {str(info.alias): info for info in DeckFile.model_fields.values()}
    missing = {name for name, info in fields.items() if info.is_required() and name not in data}
    for name, content in data.items():
        if name not in fields:
            text, meant = unknown_key_text(name, DeckFile, DeckFile)
            problems.add(name, text)
            missing.discard(meant or "")
            continue
        model = nested_block(fields[name])
        if model is not None:
            parsed.blocks[name] = _parse_top(name, content, model, problems, parsed.notes)
    for name in sorted(missing):
        problems.add(name, f"missing; give {fields[name].description}")
    return parsed


def _parse_top(
    name: str,
    content: Any,
    model: type[Block],
    problems: Problems,
    notes: list[tuple[str, str]],
) -> ParsedBlock:
    """Validate one top-level block and its numbered blocks."""
    block = ParsedBlock()
    if model.numbered is None or not isinstance(content, dict):
        block.value = validate(model, content, name, problems, notes)
        return block
    plain: dict[str, Any] = {}
    for item_name, item in content.items():
        if _is_item(item_name, model.numbered):
            path = join(name, item_name)
            kind = _item_model(item, model.numbered)
            block.items[item_name] = validate(kind, item, path, problems, notes)
        else:
            plain[item_name] = item
    block.value = validate(model, plain, name, problems, notes)
    return block


def _is_item(name: str, numbered: Numbered) -> bool:
    rest = name.removeprefix(numbered.prefix)
    pattern = _PAIR_NAME if numbered.pairs else _ZONE_NAME
    return rest != name and pattern.fullmatch(rest) is not None


def _item_model(item: Any, numbered: Numbered) -> type[Block]:
    if numbered.copy is not None and isinstance(item, dict) and numbered.copy_key in item:
        return numbered.copy
    return numbered.item


def validate(
    model: type[Block],
    content: Any,
    path: str,
    problems: Problems,
    notes: list[tuple[str, str]],
) -> Block | None:
    """Validate one block; None, with the problems added, when it is wrong.

    Parameters
    ----------
    model : type of Block
        Its schema.
    content : Any
        Its values.
    path : str
        Its key path, for messages.
    problems : Problems
        Receives what is wrong.
    notes : list of (str, str)
        Receives key path and remark for what has no effect.
    """
    if isinstance(content, dict):
        content = _respell(model, content, path, problems)
    try:
        block = model.model_validate(content)
    except ValidationError as error:
        _report(error, model, path, problems)
        return None
    wrong = False
    for where, inner in walk(block, path):
        for relative, text in inner.rules():
            problems.add(join(where, relative), text)
            wrong = True
        notes.extend((join(where, relative), text) for relative, text in inner.remarks())
    return None if wrong else block


def _respell(
    model: type[Block], content: dict[str, Any], path: str, problems: Problems
) -> dict[str, Any]:
    """Write synonyms the way the schema does."""
    spelled = dict(content)
    for other, name in model.synonyms.items():
        if other in spelled:
            if name in spelled:
                problems.add(join(path, other), f"is the same as {name}; keep one of them")
            else:
                spelled[name] = spelled[other]
                problems.source.alias(join(path, name), join(path, other))
            del spelled[other]
    return spelled


def _report(error: ValidationError, model: type[Block], path: str, problems: Problems) -> None:
    """Add pydantic's errors, without 'missing' where a misspelt key was probably meant."""
    errors = error.errors(include_url=False)
    meant: set[str] = set()
    for entry in errors:
        if entry["type"] == "extra_forbidden":
            *outer, name = entry["loc"]
            block = _block_at(model, tuple(outer))
            text, match = unknown_key_text(str(name), block, DeckFile)
            problems.add(render_path(path, entry["loc"]), text)
            if match is not None:
                meant.add(render_path(path, (*outer, match)))
    for entry in errors:
        here = render_path(path, entry["loc"])
        if entry["type"] == "too_short" and len(entry["input"]) >= entry["ctx"]["min_length"]:
            continue  # its wrong entries are reported one by one
        if entry["type"] == "extra_forbidden" or (entry["type"] == "missing" and here in meant):
            continue
        problems.add(here, rule_text(entry, field_at(model, entry["loc"])))


def _block_at(model: type[Block], location: tuple[int | str, ...]) -> type[Block]:
    found = field_at(model, location) if location else None
    return (nested_block(found) if found is not None else None) or model


def walk(block: Block, path: str) -> Iterator[tuple[str, Block]]:
    """Go through a block and the blocks inside it, with their key paths."""
    yield path, block
    for name, info in type(block).model_fields.items():
        value = getattr(block, name)
        if isinstance(value, Block) and name in block.model_fields_set:
            yield from walk(value, join(path, str(info.alias)))
