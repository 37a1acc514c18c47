"""Examples run on one thread: small models gain nothing by two, and lose much on a busy machine."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True)
def _one_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PERIDEM_THREADS", "1")
