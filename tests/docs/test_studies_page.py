"""The page on studies and calibration: its snippets run, in their order, and give what it says."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import matplotlib as mpl
import pandas
import pytest

PAGE = Path(__file__).parents[2] / "docs" / "studies.md"


def test_snippets_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("gmsh")
    mpl.use("Agg")
    monkeypatch.chdir(tmp_path)
    snippets = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert len(snippets) == 7
    names: dict[str, Any] = {"__name__": "__main__"}
    for snippet in snippets:
        exec(compile(snippet, str(PAGE), "exec"), names)
    collisions = pandas.read_csv(tmp_path / "collisions" / "study.csv")
    # in the order in which they were done; the second snippet has added one
    assert sorted(collisions["speed"][:4]) == [1, 1, 4, 4]
    assert collisions["speed"].tolist()[4:] == [2]
    assert set(collisions["status"]) == {"done"}
    assert len(pandas.read_csv(tmp_path / "sampled" / "study.csv")) == 4
    assert names["found"].achieved == pytest.approx(1e6, rel=0.05)
    assert names["stone"].constants.gc == names["found"].value
    assert "broke: True" in capsys.readouterr().out
