"""The page on models in Python: its snippets run, in their order, and give what it says."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import matplotlib as mpl
import pytest

PAGE = Path(__file__).parents[2] / "docs" / "modelling.md"


def test_snippets_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    mpl.use("Agg")
    monkeypatch.chdir(tmp_path)
    snippets = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert len(snippets) > 8
    names: dict[str, Any] = {}
    for snippet in snippets:
        exec(compile(snippet, str(PAGE), "exec"), names)
    said = capsys.readouterr().out.splitlines()
    assert said[-1] == "True"  # the deck of the model gives its bits
    assert said[-2] == "60"  # 40 steps, and 20 after them
    # K = E / (3 (1 - 2 nu)), Gc = KIc^2 / E
    k, gc = (float(word) for word in said[3].split())
    assert k == pytest.approx(3e9 / 1.8, rel=1e-14)
    assert gc == pytest.approx(1e12 / 3e9, rel=1e-14)
    assert (tmp_path / "out" / "output_5.vtu").is_file()
    assert (tmp_path / "out" / "series.csv").is_file()
