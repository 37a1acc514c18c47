"""One picture or several in a grid: figure, axes with units, titles, colour bar."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from .chains import ChainSource, draw_chains
from .fields import DAMAGE_CAP, label_colours
from .look import PIXELS_PER_INCH
from .plane import draw_plane
from .scene import Scene, prefix, time_text
from .snapshot import Snapshot
from .space import draw_space

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["colour_bar", "draw_state", "grid_shape", "new_sheet", "settle"]

_LONG_SIDE = 5.0
"""Inches of the longer side of a picture without a wanted size."""
_PAGE = 1.4
"""Width of a grid without a wanted size, by its height."""


def grid_shape(count: int, scene: Scene) -> tuple[int, int]:
    """Rows and columns of a grid with few holes, on a page a little wider than tall."""
    width, height = np.diff(scene.box, axis=0)[0]
    wanted = _PAGE if scene.look.size is None else scene.look.size[0] / scene.look.size[1]
    shapes = [(-(-count // columns), columns) for columns in range(1, count + 1)]

    def badness(shape: tuple[int, int]) -> float:
        rows, columns = shape
        page = columns * width / (rows * height)
        return abs(float(np.log(page / wanted))) + 1.5 * (rows * columns - count) / count

    return min(shapes, key=badness)


def new_sheet(scene: Scene, count: int = 1) -> tuple[Figure, list[Axes]]:
    """Make a figure for so many states, with axes in the look of the scene."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rows, columns = grid_shape(count, scene) if count > 1 else (1, 1)
    figure = Figure(
        figsize=_inches(scene, rows, columns),
        dpi=PIXELS_PER_INCH,
        layout="compressed",
        facecolor=scene.look.background,
    )
    FigureCanvasAgg(figure)
    grid: Any = figure.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
    axes = list(grid.ravel())
    for unused in axes[count:]:
        unused.remove()
    for k, one in enumerate(axes[:count]):
        lowest = k + columns >= count
        _dress(one, scene, left=k % columns == 0, bottom=lowest)
    return figure, axes[:count]


def _inches(scene: Scene, rows: int, columns: int) -> tuple[float, float]:
    if scene.look.size is not None:
        return scene.look.size[0] / PIXELS_PER_INCH, scene.look.size[1] / PIXELS_PER_INCH
    x, y = np.diff(scene.box, axis=0)[0]
    ratio = float(np.clip(y / x, 0.3, 2.0))
    side = _LONG_SIDE if rows * columns == 1 else min(4.0, 13.0 / max(rows, columns))
    width, height = side / max(ratio, 1.0), side * min(ratio, 1.0)
    ticks = scene.look.axes and scene.camera is None
    return (
        columns * width + 1.3 + 0.6 * ticks,
        rows * (height + 0.35) + 0.2 + 0.5 * ticks,
    )


def _dress(axes: Axes, scene: Scene, *, left: bool, bottom: bool) -> None:
    """Give axes their box, units and colours."""
    factor, unit = scene.length
    ink = scene.look.ink
    box = scene.box * factor
    axes.set(xlim=box[:, 0], ylim=box[:, 1], facecolor=scene.look.background)
    axes.set_aspect("equal")
    if scene.camera is not None or not scene.look.axes:
        axes.set_axis_off()
        if scene.camera is not None:  # room for the scale bar
            low, high = box[:, 1]
            axes.set_ylim(low - 0.1 * (high - low), high)
        return
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(ink)
    axes.tick_params(colors=ink, labelsize=9, labelleft=left, labelbottom=bottom)
    if bottom:
        axes.set_xlabel(f"x [{unit}]", color=ink)
    if left:
        axes.set_ylabel(f"y [{unit}]", color=ink)


def draw_state(
    axes: Axes, snapshot: Snapshot, scene: Scene, *, engine: str, chains: ChainSource | None = None
) -> None:
    """Draw a state, its title and its force chains."""
    whole = snapshot  # chains end at walls that are hidden, too
    if scene.look.walls == "hidden":
        snapshot = snapshot.without_walls()
    if scene.camera is None:
        draw_plane(axes, snapshot, scene)
    else:
        draw_space(axes, snapshot, scene, engine=engine)
    if chains is not None:
        draw_chains(axes, whole, scene, chains)
    when = time_text(snapshot.time, scene.last_time, several=scene.several)
    title = "   ".join(part for part in (scene.look.title, when) if part)
    axes.set_title(title, loc="left", fontsize=10.5, color=scene.look.ink)


def colour_bar(figure: Figure, axes: Sequence[Axes], scene: Scene) -> None:
    """Draw the scale of the colours, with unit, beside the pictures."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.ticker import FuncFormatter

    if scene.field.kind == "labels" and scene.look.colours is None:
        _name_labels(axes[0], scene)
        return
    low, high = float(scene.norm.vmin or 0.0), float(scene.norm.vmax or 0.0)
    size, unit = prefix((low, high), scene.field.unit)
    bar = figure.colorbar(
        ScalarMappable(scene.norm, scene.colours), ax=list(axes), shrink=0.85, pad=0.02,
        aspect=22, extend=scene.extend,
    )  # fmt: skip
    ink = scene.look.ink
    bar.set_label(scene.field.label + (f" [{unit}]" if unit else ""), color=ink)
    bar.outline.set_visible(False)
    bar.ax.tick_params(colors=ink, labelsize=9)
    if scene.field.kind == "damage" and low < 1 < high <= 1.5 * DAMAGE_CAP:
        ticks = [tick for tick in (low, 0.5, 1.0, 1.5, 2.0, high) if low <= tick <= high]
        texts = [f"{tick:g}" if tick != 1 else "1  bond\nbroken" for tick in dict.fromkeys(ticks)]
        bar.set_ticks(list(dict.fromkeys(ticks)), labels=texts)
    elif size != 1.0:
        bar.formatter = FuncFormatter(lambda value, _: f"{value / size:.4g}")
        bar.update_ticks()


def settle(figure: Figure) -> None:
    """Lay a sheet out twice.

    Axes of equal scales take their shape in the first pass; room for their titles and labels is
    found in the second. With one alone they may stick out of the page.
    """
    engine: Any = figure.get_layout_engine()
    for _ in range(2):
        engine.execute(figure)


def _name_labels(axes: Axes, scene: Scene) -> None:
    """Say what the colours of labels are; name them where they are few."""
    from matplotlib.patches import Patch

    low, high = int(scene.norm.vmin or 0), int(scene.norm.vmax or 0)
    ink = scene.look.ink
    if high - low > 9:
        text = f"{scene.field.label}: {low} to {high}, colours in turn"
        axes.set_title(text, loc="right", fontsize=9, color=ink)
        return
    handles = [
        Patch(color=tuple(label_colours(np.array([float(k)]))[0]), label=f"{k}")
        for k in range(low, high + 1)
    ]
    legend = axes.legend(
        handles=handles, title=scene.field.label, loc="upper left", bbox_to_anchor=(1.01, 1.0),
        frameon=False, fontsize=9, labelcolor=ink,
    )  # fmt: skip
    legend.get_title().set_color(ink)
