"""What a row depends on besides its parameters: the function's source."""

from __future__ import annotations

import functools
import hashlib
import inspect
from collections.abc import Callable
from typing import Any

__all__ = ["source_mark"]


def source_mark(run: Callable[..., Any]) -> str:
    """Eight hexadecimal digits that change with the text of a function.

    Only the function itself is looked at, not what it calls. For one without a source file it
    is its bytecode.
    """
    bound = ""
    while isinstance(run, functools.partial):
        bound += repr((run.args, sorted(run.keywords.items())))
        run = run.func
    target = run if inspect.isroutine(run) else type(run)
    try:
        text = inspect.getsource(target)
    except (OSError, TypeError):
        code = getattr(run, "__code__", None)
        text = repr(target) if code is None else repr((code.co_code, code.co_names, _plain(code)))
    return hashlib.sha256((text + bound).encode()).hexdigest()[:8]


def _plain(code: Any) -> list[str]:
    """Constants of a bytecode, without addresses."""
    return [repr(getattr(one, "co_code", one)) for one in code.co_consts]
