"""The page on diagnostics: its snippets run, in their order, and the balance closes."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "diagnostics.md"


def test_snippets_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    snippets = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert len(snippets) >= 6
    names: dict[str, Any] = {}
    for snippet in snippets:
        exec(compile(snippet, str(PAGE), "exec"), names)
    said = capsys.readouterr().out.splitlines()
    residual, warnings = said[0].split(" ", 1)
    assert float(residual) < 2e-3  # a fifth of the stable time step, see the page
    assert warnings == "[]"
    assert float(said[1]) > 0.01  # bonds broke
    columns = re.findall(r"^\| `(\w+)` \| (?:stored|in|out|\|)", PAGE.read_text("utf-8"), re.M)
    assert set(columns) <= set(names["energy"].columns)
    assert set(names["energy"].columns) - set(columns) <= {"input", "residual"}
