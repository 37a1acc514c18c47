"""Puts the tests' own modules, `helpers` and `reference`, within reach of every test."""

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from helpers import DeckFolder


def pytest_addoption(parser: pytest.Parser) -> None:
    """Let the number of mutated decks be chosen."""
    parser.addoption("--fuzz", type=int, metavar="N", help="run N more mutants of decks and files")


def pytest_configure() -> None:
    """Let Ctrl-C be tested where the tests themselves run with it ignored (nohup, some CI)."""
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def deck_folder(tmp_path: Path) -> DeckFolder:
    """Decks with their meshes in a temporary folder."""
    return DeckFolder(tmp_path)


@pytest.fixture(scope="session", autouse=True)
def _mesh_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep meshes in a folder of the tests, not in the user's."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PERIDEM_CACHE", str(tmp_path_factory.mktemp("meshes")))
        yield
