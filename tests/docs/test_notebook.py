"""The notebook runs, cell by cell, and what its cells end in can be shown."""

from __future__ import annotations

import ast
import base64
import io
import json
import re
from pathlib import Path
from typing import Any

import pytest
from matplotlib.image import imread

NOTEBOOK = Path(__file__).parents[2] / "docs" / "notebooks" / "first_steps.ipynb"


def run_cell(source: str, names: dict[str, Any]) -> Any:
    """Run a cell and return what it ends in, as a notebook does."""
    tree = ast.parse(source)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, str(NOTEBOOK), "exec"), names)
    if last is None:
        return None
    expression = ast.Expression(last.value)  # type: ignore[attr-defined]
    return eval(compile(expression, str(NOTEBOOK), "eval"), names)


def images(html: str) -> list[Any]:
    found = re.findall(r"data:image/png;base64,([^']+)'", html)
    return [imread(io.BytesIO(base64.b64decode(one))) for one in found]


def test_cells_run_and_show_what_they_say(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("gmsh")
    monkeypatch.chdir(tmp_path)
    cells = json.loads(NOTEBOOK.read_text(encoding="utf-8"))["cells"]
    sources = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    names: dict[str, Any] = {}
    shown = [run_cell(source, names) for source in sources]
    model_before = shown[1]
    assert model_before is names["model"]
    html = [one._repr_html_() for one in (names["model"], names["result"])]
    assert "step 0" not in html[0] and "3 bodies" not in html[0]
    assert len(images(html[0])) == 1
    assert len(images(html[1])) == 2  # the last state, the curves
    assert all(image.std() > 0.02 for text in html for image in images(text))
    assert "broken bonds" in html[1]
    assert (tmp_path / "first_steps" / "impact.gif").stat().st_size > 10_000
    assert "of its nodes have lost a bond" in capsys.readouterr().out


def test_model_shows_its_bodies_without_being_built() -> None:
    import peridem as pd
    from modelling_parts import SIZE, Block, Disc, glass, two_discs

    model = two_discs()
    html = model._repr_html_()
    assert "not built yet" in html
    assert len(images(html)) == 1
    fixed = {"at": (4e-3, 0), "fixed": True}  # the model is still open
    model.add_particle(Disc(), material=glass(), mesh_size=SIZE, **fixed)
    assert "fixed particle" in model._repr_html_()
    model.init()
    assert "fixed particle" in model._repr_html_()
    solid = pd.DEMModel(dimension=3)
    assert not images(solid._repr_html_())  # no bodies, no picture
    solid.add_particle(Block((1e-3, 1e-3, 1e-3)), material=glass(), mesh_size=2e-4)
    assert images(solid._repr_html_())[0].std() > 0.01
