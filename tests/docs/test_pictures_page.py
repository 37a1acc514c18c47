"""The page on pictures: its snippets run, in their order, and leave the pictures it speaks of."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
from matplotlib.image import imread
from PIL import Image

PAGE = Path(__file__).parents[2] / "docs" / "pictures.md"


def test_snippets_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("gmsh")
    monkeypatch.chdir(tmp_path)
    snippets = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert len(snippets) == 4
    names: dict[str, Any] = {}
    for snippet in snippets:
        exec(compile(snippet, str(PAGE), "exec"), names)
    for name in ("impact.png", "grid.png", "r.png", "chains.png", "fragments.png", "damage.png"):
        assert imread(tmp_path / name).std() > 0.02, name
    for name in ("impact.gif", "down.gif"):
        with Image.open(tmp_path / name) as film:
            assert film.n_frames == 11, name


def test_pictures_of_the_page_are_there() -> None:
    text = PAGE.read_text(encoding="utf-8")
    for name in re.findall(r"!\[.*?\]\((.*?)\)", text):
        assert (PAGE.parent / name).stat().st_size > 10_000, name
