"""The page on examples: every example is on it, with a picture that is there."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "examples.md"


def test_every_example_has_its_place_and_a_picture() -> None:
    sections = re.split(r"^##+ ", PAGE.read_text(encoding="utf-8"), flags=re.MULTILINE)
    for example in (ROOT / "examples").glob("*.py"):
        (section,) = [one for one in sections if f"(../examples/{example.name})" in one]
        if example.name not in ("shapes.py", "packings.py"):  # theirs are on pages of their own
            assert re.search(r"!\[.+?\]\(images/", section), example.name


def test_pictures_of_the_page_are_there() -> None:
    for name in re.findall(r"!\[.*?\]\((.*?)\)", PAGE.read_text(encoding="utf-8")):
        assert (PAGE.parent / name).stat().st_size > 10_000, name


def test_examples_say_what_they_write() -> None:
    for example in (ROOT / "examples").glob("*.py"):
        text = example.read_text(encoding="utf-8")
        assert re.search(r"^writes \w", text.split('"""')[1], re.MULTILINE), example.name
