"""Where the blocks of a model made in Python are from: no file, but calls."""

from __future__ import annotations

from dataclasses import dataclass

from ..deck.source import Source


@dataclass(frozen=True)
class ModelSource(Source):
    """Source of a deck that is in memory: keys have no lines."""

    def where(self, key_path: str) -> str:
        """Return what stands for file and line in messages."""
        return "model"
