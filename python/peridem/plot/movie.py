"""Animations: frames drawn by several processes, put together to gif or mp4."""

from __future__ import annotations

import contextlib
import importlib.util
import itertools
import os
import pickle
import shutil
import subprocess
import sys
import tempfile
import time as clock
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import replace_file
from .chains import ChainSource, explain_chains
from .fields import Field
from .outputs import Frame, Outputs
from .scene import Scene
from .sheet import colour_bar, draw_state, new_sheet, settle
from .snapshot import Snapshot

__all__ = ["MOVIES", "FrameJob", "draw_frames", "frame_images", "write_movie"]

MOVIES = (".gif", ".mp4")
Image = NDArray[np.uint8]

_WORTH_SECONDS = 12.0
"""Time [s] that the rest of the frames takes at least before processes are started for them."""
_GIF_COLOURS = 255


@dataclass(frozen=True)
class FrameJob:
    """Frames to be drawn, and how."""

    outputs: Outputs
    frames: Sequence[Frame]
    scene: Scene
    engine: str
    chains: ChainSource | None = None

    def snapshot(self, frame: Frame) -> Snapshot:
        """Read a state: what is needed of it, or all of it for a function of the caller's."""
        source = self.scene.source
        return self.outputs.snapshot(frame, source if isinstance(source, Field) else None)

    def part(self, frames: Sequence[Frame]) -> FrameJob:
        """Return the same with other frames."""
        return FrameJob(self.outputs, frames, self.scene, self.engine, self.chains)


class _Page:
    """One page that is drawn on again and again: layout, axes and colour bar are drawn once."""

    def __init__(self, job: FrameJob) -> None:
        self.job = job
        self.figure, (self.axes,) = new_sheet(job.scene)
        colour_bar(self.figure, [self.axes], job.scene)
        if job.chains is not None:
            explain_chains(self.figure, job.scene, job.chains)
        self._kept = {id(artist) for artist in self.axes.get_children()}
        self._background: Any = None

    def draw(self, snapshot: Snapshot) -> Image:
        job = self.job
        canvas: Any = self.figure.canvas
        self._clear()
        draw_state(self.axes, snapshot, job.scene, engine=job.engine, chains=job.chains)
        if self._background is None:
            settle(self.figure)
            canvas.draw()  # the layout, with the title and all else in its place
            self.figure.set_layout_engine("none")
            self._clear()
            canvas.draw()
            self._background = canvas.copy_from_bbox(self.figure.bbox)
            draw_state(self.axes, snapshot, job.scene, engine=job.engine, chains=job.chains)
        canvas.restore_region(self._background)
        moving = [one for one in self.axes.get_children() if id(one) not in self._kept]
        for artist in sorted(moving, key=lambda one: float(one.get_zorder())):
            self.axes.draw_artist(artist)
        any_axes: Any = self.axes
        any_axes.draw_artist(any_axes._left_title)
        picture = np.asarray(canvas.buffer_rgba())[..., :3]
        height, width = picture.shape[:2]
        # Films have even sides.
        return np.ascontiguousarray(picture[: height - height % 2, : width - width % 2])

    def _clear(self) -> None:
        for artist in list(self.axes.get_children()):
            if id(artist) not in self._kept:
                artist.remove()
        self.axes.set_title("", loc="left")


def draw_frames(job: FrameJob) -> Iterator[Image]:
    """Draw frames one after the other, all of the same size."""
    page = _Page(job)
    for frame in job.frames:
        yield page.draw(job.snapshot(frame))


def frame_images(job: FrameJob, workers: int | None) -> Iterator[Image]:
    """Draw frames, by several processes when that is faster.

    The second frame shows how long one takes.
    """
    if workers == 1:
        yield from draw_frames(job)
        return
    page = _Page(job)
    seconds = 0.0
    for frame in job.frames[:2]:
        start = clock.perf_counter()
        yield page.draw(job.snapshot(frame))
        seconds = clock.perf_counter() - start
    rest = job.frames[2:]
    count = len(os.sched_getaffinity(0)) if workers is None else workers
    count = min(count, len(rest))
    if count < 2 or (workers is None and seconds * len(rest) < _WORTH_SECONDS):
        for frame in rest:
            yield page.draw(job.snapshot(frame))
        return
    yield from _by_processes(job, rest, count)


def _by_processes(job: FrameJob, frames: Sequence[Frame], count: int) -> Iterator[Image]:
    """Draw frames in processes of their own, which import nothing of the caller's program."""
    ends = np.linspace(0, len(frames), count + 1).astype(int)
    with (
        tempfile.TemporaryDirectory(prefix="peridem-frames-") as folder,
        contextlib.ExitStack() as s,
    ):
        parts = []
        for k, (a, b) in enumerate(itertools.pairwise(ends)):
            paths = [Path(folder) / f"{number}.npy" for number in range(a, b)]
            task = Path(folder) / f"task{k}.pickle"
            task.write_bytes(pickle.dumps((job.part(frames[a:b]), paths)))
            process = subprocess.Popen(
                [sys.executable, "-m", "peridem.plot.worker", str(task)],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.PIPE,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
            )
            s.callback(_end, process)
            parts.append((process, paths))
        for process, paths in parts:
            for path in paths:
                yield _awaited(path, process)


def _awaited(path: Path, process: subprocess.Popen[bytes]) -> Image:
    """Read a frame as soon as its process has written it."""
    while not path.exists():
        if process.poll() is not None and not path.exists():
            said = process.stderr.read().decode(errors="replace") if process.stderr else ""
            last = said.strip().splitlines()[-1:] or [f"exit code {process.returncode}"]
            raise InputError(
                f"render: a process that draws frames has failed: {last[0]}; try workers=1"
            )
        clock.sleep(0.01)
    image = np.load(path)
    path.unlink()
    return np.asarray(image)


def _end(process: subprocess.Popen[bytes]) -> None:
    if process.poll() is None:
        process.terminate()
    process.wait()
    if process.stderr is not None:
        process.stderr.close()


def write_movie(path: Path, images: Iterator[Image], fps: float, shades: Image) -> int:
    """Write an animation, whole or not at all; return its number of frames.

    Parameters
    ----------
    path : Path
        File to write, .gif or .mp4.
    images : iterator of ndarray of uint8, shape (height, width, 3)
        Frames, all of one size.
    fps : float
        Frames per second.
    shades : ndarray of uint8, shape (n, 3)
        Colours that frames may have besides those of the first, for a gif.

    Raises
    ------
    InputError
        If what writes films is missing, or the file cannot be written.
    """
    with replace_file(path) as temporary:
        if path.suffix.lower() == ".gif":
            return _write_gif(temporary, images, fps, shades)
        return _write_mp4(temporary, images, fps)


def _write_gif(path: Path, images: Iterator[Image], fps: float, shades: Image) -> int:
    """All frames have one set of colours, made at the first: nothing flickers."""
    from PIL import Image as Pillow

    first = next(images)
    rows = -(-first.shape[0] * first.shape[1] // (4 * len(shades) * first.shape[1]))
    each = np.repeat(shades, rows, axis=0)[:, None]
    strip = np.repeat(each, first.shape[1], axis=1)
    palette = Pillow.fromarray(np.concatenate([first, strip])).quantize(_GIF_COLOURS)
    # The background, which is most of the picture, to the last bit.
    kept = (palette.getpalette() or [])[: 3 * _GIF_COLOURS]
    palette.putpalette([*kept, *first[0, 0].tolist()])

    page = first[0, 0]

    def reduced(picture: Image) -> Any:
        image = Pillow.fromarray(picture).quantize(palette=palette, dither=Pillow.Dither.NONE)
        numbers = np.array(image)
        numbers[(picture == page).all(axis=2)] = _GIF_COLOURS
        exact = Pillow.fromarray(numbers)
        exact.putpalette(palette.getpalette() or [])
        return exact

    frames = [reduced(first), *(reduced(picture) for picture in images)]
    frames[0].save(
        path, format="GIF", save_all=True, append_images=frames[1:], loop=0,
        duration=max(20, round(100 / fps) * 10), optimize=False,
    )  # fmt: skip
    return len(frames)


def find_ffmpeg() -> str:
    """Find the program that writes mp4.

    Raises
    ------
    InputError
        If there is none, naming what to install.
    """
    if importlib.util.find_spec("imageio_ffmpeg") is not None:
        import imageio_ffmpeg

        with contextlib.suppress(RuntimeError):
            return str(imageio_ffmpeg.get_ffmpeg_exe())
    found = shutil.which("ffmpeg")
    if found is None:
        raise InputError(
            "render: path: mp4 needs ffmpeg, which was not found; "
            'pip install "peridem[render]", install ffmpeg, or write a .gif'
        )
    return found


def _write_mp4(path: Path, images: Iterator[Image], fps: float) -> int:
    program = find_ffmpeg()
    first = next(images)
    height, width = first.shape[:2]
    command = [
        *(program, "-loglevel", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24"),
        *("-s", f"{width}x{height}", "-r", f"{fps:g}", "-i", "-", "-an", "-c:v", "libx264"),
        *("-pix_fmt", "yuv420p", "-crf", "16", "-movflags", "+faststart", "-f", "mp4", str(path)),
    ]
    count = 1
    with subprocess.Popen(command, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdin is not None and process.stderr is not None
        try:
            process.stdin.write(first.tobytes())
            for image in images:
                process.stdin.write(image.tobytes())
                count += 1
            process.stdin.close()
        except BrokenPipeError:
            pass
        except BaseException:
            process.kill()
            raise
        said = process.stderr.read().decode(errors="replace").strip()
    if process.returncode:
        reason = said.splitlines()[-1] if said else f"exit code {process.returncode}"
        raise InputError(f"{path.name}: ffmpeg cannot write it: {reason}; write a .gif instead")
    return count
