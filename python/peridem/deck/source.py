"""The text of a deck: YAML 1.2 into plain values, with the line of every key."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from peridem.errors import InputError

_TAG = "tag:yaml.org,2002:"
_MAX_DEPTH = 40
_MAX_NODES = 500_000


@dataclass(frozen=True)
class Source:
    """A deck's file, its values and the line of each key.

    Attributes
    ----------
    path : Path
        Absolute path of the file.
    data : dict
        The values; keys whose value is empty (null) are left out.
    lines : dict of str to int
        Line of each key path (``Material.Zone_2.Horizon``, ``Output.Tags[3]``), from 1.
    sha256 : str
        Hash of the file's bytes, hexadecimal.
    problems : list of (str, str)
        Key path and text of what is wrong with the keys themselves.
    """

    path: Path
    data: dict[str, Any]
    lines: dict[str, int]
    sha256: str
    problems: list[tuple[str, str]] = field(default_factory=list)

    def line(self, key_path: str) -> int | None:
        """Line of a key, or of the nearest block around it that is in the file."""
        while key_path:
            if key_path in self.lines:
                return self.lines[key_path]
            cut = max(key_path.rfind("."), key_path.rfind("["))
            key_path = key_path[:cut] if cut > 0 else ""
        return None

    def alias(self, key_path: str, written: str) -> None:
        """Let a key be found at the line of another spelling of it."""
        if written in self.lines:
            self.lines[key_path] = self.lines[written]

    def where(self, key_path: str) -> str:
        """File and line of a key, ``input.yaml:41``, for messages."""
        line = self.line(key_path)
        return self.path.name if line is None else f"{self.path.name}:{line}"


def load_source(path: str | Path) -> Source:
    """Read the file of a deck.

    Parameters
    ----------
    path : str or Path
        The YAML file.

    Returns
    -------
    Source
        Values and lines.

    Raises
    ------
    InputError
        When the file is missing, unreadable, empty, not YAML or not a mapping.
    """
    file = Path(path)
    raw = _read_bytes(file)
    root = _compose(file, raw)
    if root is None:
        raise InputError(f"{file.name}: the deck is empty; it needs at least a Model block")
    if not isinstance(root, MappingNode):
        line = root.start_mark.line + 1
        raise InputError(
            f"{file.name}:{line}: the deck must be a mapping of blocks; start with 'Model:'"
        )
    walk = _Walk(file.name)
    data = walk.mapping(root, "", 0)
    return Source(
        path=file.resolve(),
        data=data,
        lines=walk.lines,
        sha256=hashlib.sha256(raw).hexdigest(),
        problems=walk.problems,
    )


def _read_bytes(file: Path) -> bytes:
    try:
        if not file.exists():
            raise InputError(f"{file}: the deck does not exist; check the path")
        if not file.is_file():
            raise InputError(f"{file}: the deck is not a file; give the YAML file itself")
        return file.read_bytes()
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(
            f"{file}: the deck cannot be read ({reason}); check the path and its permissions"
        ) from error


def _compose(file: Path, raw: bytes) -> Node | None:
    """Parse the text into YAML nodes."""
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw[: error.start].count(b"\n") + 1
        raise InputError(
            f"{file.name}:{line}: the deck is not UTF-8 text; save it as UTF-8"
        ) from error
    try:
        node: Node | None = YAML(typ="safe", pure=True).compose(text)
        return node
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        place = f"{file.name}:{mark.line + 1}" if mark else file.name
        parts = [part for part in (error.context, error.problem) if part]
        raise InputError(
            f"{place}: not valid YAML: {', '.join(parts)}; check indentation, colons and brackets"
        ) from error
    except (YAMLError, ValueError) as error:
        reason = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        raise InputError(f"{file.name}: not valid YAML: {reason}; check the text") from error
    except RecursionError as error:
        raise InputError(
            f"{file.name}: blocks are nested too deeply; check the brackets"
        ) from error
    except Exception as error:  # the YAML parser fails in other ways on some broken texts
        raise InputError(f"{file.name}: not valid YAML ({error}); check the text") from error


class _Walk:
    """Turn nodes into values, noting lines; aliases are followed, loops refused."""

    def __init__(self, file_name: str) -> None:
        self.file_name = file_name
        self.lines: dict[str, int] = {}
        self.problems: list[tuple[str, str]] = []
        self.nodes = 0

    def value(self, node: Node, path: str, depth: int) -> Any:
        self.nodes += 1
        if depth > _MAX_DEPTH or self.nodes > _MAX_NODES:
            raise InputError(
                f"{self.file_name}:{node.start_mark.line + 1}: {path[:80]}: nested or repeated "
                "beyond any deck; check brackets and aliases"
            )
        if isinstance(node, MappingNode):
            return self.mapping(node, path, depth)
        if isinstance(node, SequenceNode):
            return self.sequence(node, path, depth)
        return _scalar(node)

    def mapping(self, node: MappingNode, path: str, depth: int) -> dict[str, Any]:
        values: dict[str, Any] = {}
        for key_node, value_node in node.value:
            line = key_node.start_mark.line + 1
            if not isinstance(key_node, ScalarNode):
                self.problems.append((path, f"the key in line {line} must be a word"))
                continue
            name = str(key_node.value)
            here = f"{path}.{name}" if path else name
            if here in self.lines:
                self._duplicate(here, line)
                continue
            self.lines[here] = line
            value = self.value(value_node, here, depth + 1)
            if value is not None:
                values[name] = value
        return values

    def _duplicate(self, path: str, line: int) -> None:
        first = self.lines[path]
        text = f"given twice, in lines {first} and {line}; keep one of them"
        self.problems.append((path, text))

    def sequence(self, node: SequenceNode, path: str, depth: int) -> list[Any]:
        values = []
        for position, item in enumerate(node.value):
            here = f"{path}[{position}]"
            self.lines[here] = item.start_mark.line + 1
            values.append(self.value(item, here, depth + 1))
        return values


def _scalar(node: Node) -> Any:
    """Value of a scalar by its YAML 1.2 tag; whatever is not a number or boolean is text."""
    text = str(node.value)
    tag = str(node.tag)
    if tag == _TAG + "null":
        return None
    if tag == _TAG + "bool":
        return text.lower() == "true"
    digits = text.replace("_", "").lower()
    try:
        if tag == _TAG + "int":
            based = digits.lstrip("+-")[:2] in ("0x", "0o", "0b")
            return int(digits, 0) if based else int(digits)
        if tag == _TAG + "float":
            return float(digits.replace(".inf", "inf").replace(".nan", "nan"))
    except ValueError:
        return text
    return text
