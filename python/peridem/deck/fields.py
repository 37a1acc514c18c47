"""What the models of a deck's blocks are made of: scalar types, keys, the base class.

Every key is declared once, with `key`: its name in the deck, a noun phrase saying what it is,
its unit, default and bounds. Validation, error messages and the reference page of the keys are
all taken from these declarations.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar

from annotated_types import Ge, Gt
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field
from pydantic_core import PydanticCustomError

REQUIRED: Any = ...


def _number(value: Any) -> float:
    """Accept finite YAML numbers only: no text, no booleans, no NaN."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise PydanticCustomError("number", "must be a number")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise PydanticCustomError("number", "must be a finite number")
    return number


def _integer(value: Any) -> int:
    """Accept whole numbers; 2e4 is one, 0.5, true and '3' are not."""
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if isinstance(value, bool) or not isinstance(value, int):
        raise PydanticCustomError("integer", "must be a whole number")
    if abs(value) > 2**53:
        raise PydanticCustomError("integer", "must be a whole number below 2^53")
    return value


def _flag(value: Any) -> bool:
    """Accept true and false, and 0 and 1 for them."""
    if isinstance(value, bool) or (isinstance(value, int) and value in (0, 1)):
        return bool(value)
    raise PydanticCustomError("flag", "must be true or false")


def _text(value: Any) -> str:
    """Accept text; a bare number or boolean is taken as the text it was written with."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str | int | float):
        return str(value)
    raise PydanticCustomError("text", "must be text")


def _file_name(value: Any) -> str:
    """Accept the name of a file."""
    name = _text(value).strip()
    if not name or "\0" in name:
        raise PydanticCustomError("file_name", "must be the name of a file")
    return name


Number = Annotated[float, BeforeValidator(_number)]
Positive = Annotated[float, BeforeValidator(_number), Gt(0)]
NonNegative = Annotated[float, BeforeValidator(_number), Ge(0)]
Integer = Annotated[int, BeforeValidator(_integer)]
Count = Annotated[int, BeforeValidator(_integer), Ge(1)]
Index = Annotated[int, BeforeValidator(_integer), Ge(0)]
Flag = Annotated[bool, BeforeValidator(_flag)]
Text = Annotated[str, BeforeValidator(_text)]
FileName = Annotated[Path, BeforeValidator(_file_name)]
Numbers = tuple[Number, ...]
Vector = Annotated[tuple[Number, ...], Field(min_length=2, max_length=3)]


def key(
    name: str,
    description: str,
    *,
    default: Any = None,
    unit: str | None = None,
    remedy: str | None = None,
    ignored: str | None = None,
    **bounds: Any,
) -> Any:
    """Declare one key of a block.

    Parameters
    ----------
    name : str
        The key as it is written in the deck.
    description : str
        A noun phrase that fits after "give".
    default : Any
        Value when the key is absent; `REQUIRED` makes it obligatory.
    unit : str, optional
        SI unit of the value.
    remedy : str, optional
        What to do when the value is refused; "give <description> in <unit>" when omitted.
    ignored : str, optional
        Why the key, although accepted, has no effect.
    **bounds
        Bounds understood by `pydantic.Field`.
    """
    extra = {"unit": unit, "remedy": remedy, "ignored": ignored}
    return Field(
        default,
        alias=name,
        description=description,
        json_schema_extra={k: v for k, v in extra.items() if v is not None},
        **bounds,
    )


@dataclass(frozen=True)
class Numbered:
    """Numbered blocks `Zone_1`, `Zone_2`, ... inside a block.

    Attributes
    ----------
    label : str
        How documentation and messages write them, e.g. ``Zone_k``; the part before the last
        underscore is the prefix.
    item : type of Block
        What such a block holds.
    copy : type of Block, optional
        What it holds instead when it copies another one.
    copy_key : str
        The key whose presence selects `copy`.
    """

    label: str
    item: type[Block]
    copy: type[Block] | None = None
    copy_key: str = ""

    @property
    def prefix(self) -> str:
        """Leading part of the names, e.g. ``Zone_``."""
        return self.label[: self.label.rindex("_") + 1]

    @property
    def pairs(self) -> bool:
        """Whether two numbers follow the prefix (``Zone_ij``)."""
        return self.label.endswith("_ij")


class Block(BaseModel):
    """A block of keys; unknown keys are errors, values are immutable."""

    model_config = ConfigDict(extra="forbid", frozen=True, populate_by_name=False)

    numbered: ClassVar[Numbered | None] = None
    #: Keys of other versions of the original, each with what to write instead.
    retired: ClassVar[dict[str, str]] = {}
    #: What to say of every key the schema does not know, instead of looking for a similar one.
    stray: ClassVar[str] = ""
    #: Other spellings of a key, each with the spelling of the schema.
    synonyms: ClassVar[dict[str, str]] = {}

    def rules(self) -> Iterator[tuple[str, str]]:
        """Yield ``(key, "rule; remedy")`` for every rule between keys that is broken.

        `key` is relative to the block; an empty one stands for the block itself.
        """
        return iter(())

    def remarks(self) -> Iterator[tuple[str, str]]:
        """Yield ``(key, remark)`` for what is accepted but has no effect."""
        return iter(())


def join(*parts: str) -> str:
    """Join the parts of a key path, leaving out empty ones."""
    return ".".join(part for part in parts if part)
