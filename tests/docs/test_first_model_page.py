"""The page on a first model: its script runs, in a short form, and its numbers are right."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import matplotlib as mpl
import pytest

PAGE = Path(__file__).parents[2] / "docs" / "first_model.md"


def test_script_runs_and_costs_what_the_page_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mpl.use("Agg")
    monkeypatch.chdir(tmp_path)
    page = PAGE.read_text(encoding="utf-8")
    script, cost = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    assert len(script.splitlines()) <= 40
    assert "until = 1.0 " in script
    names: dict[str, Any] = {}
    exec(compile(script.replace("until = 1.0 ", "until = 2e-3 "), str(PAGE), "exec"), names)
    model = names["model"]
    assert len(model.particles) == 51
    assert (tmp_path / "drum.png").stat().st_size > 10_000
    assert names["result"].fragments["count"].iloc[0] == 50
    # what the page quotes: time step, steps of a second, nodes
    said = re.search(
        r"peridem: (\d+) steps of (\S+) s, 0.5 of the stable one, which the bonds", page
    )
    assert said is not None
    step = model.stable_time_step()
    assert step.bonds < step.contact
    assert f"{0.5 * step.bonds:.3g}" == said[2]
    assert 50 * math.ceil(0.02 / (0.5 * step.bonds)) == int(said[1])  # whole steps in an output
    assert round(model.n_nodes, -2) == 3700
    # the table of costs: 3 MPa, 3 mm, horizon 9 mm
    exec(compile(cost, str(PAGE), "exec"), names)
    step = names["model"].stable_time_step()
    assert 0.5 * min(step.bonds, step.contact) == pytest.approx(24e-6, rel=0.05)
    assert names["model"].n_nodes == 2 * 61


def test_picture_of_the_page_is_there() -> None:
    found = re.findall(r"\]\((images/\S+)\)", PAGE.read_text(encoding="utf-8"))
    assert found == ["images/first_model.png"]
    assert (PAGE.parent / found[0]).is_file()
