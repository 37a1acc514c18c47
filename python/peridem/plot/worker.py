"""Draws some frames of an animation in a process of its own."""

from __future__ import annotations

import pickle
import sys
from pathlib import Path

import numpy as np

from .movie import draw_frames


def main(task: Path) -> None:
    """Draw the frames of a task and leave each as an array under the name that it says."""
    job, paths = pickle.loads(task.read_bytes())
    for path, image in zip(paths, draw_frames(job), strict=True):
        temporary = path.with_suffix(".tmp")
        with temporary.open("wb") as stream:
            np.save(stream, image)
        temporary.rename(path)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
