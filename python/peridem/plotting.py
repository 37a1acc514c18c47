"""Pictures of a state: bodies in their deformed configuration, coloured by a nodal field.

Uses matplotlib without a display (Agg) and without its global state. The source of a
picture is a VTU file or a model; `save_picture` is the short way to a file.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import InputError
from .files import replace_file
from .snapshot import FIELDS, Field, Mask, Snapshot
from .vtu import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import Collection
    from matplotlib.colors import Colormap, Normalize
    from matplotlib.figure import Figure

__all__ = ["Snapshot", "plot_cells", "plot_nodes", "save_picture"]

TORN = 1.3
"""An element with an edge longer than this times its reference length is left out."""
_DAMAGE_CAP = 2.0
_WALL_COLOUR = "0.72"
_INK = "0.25"
_SOUND = "#e9eef4"
_BROKEN = ((0.0, "#ffb347"), (0.5, "#e4572e"), (1.0, "#7d0a1e"))
_CORNERS = {"triangle": 3, "quad": 4}


def save_picture(
    path: Path | str,
    source: Snapshot | Path | str | Any,
    *,
    field: str = "Damage_Z",
    style: str | None = None,
    limits: tuple[float, float] | None = None,
    dpi: int = 160,
) -> Path:
    """Draw a state and save it as PNG, PDF or SVG (by the ending of `path`).

    Parameters
    ----------
    path : Path or str
        Picture to write; whole or absent.
    source : Snapshot, Path, str or DEMModel
        State to draw: a snapshot, a VTU file, or a model.
    field : str
        Tag to colour by; vectors by their length.
    style : {"cells", "nodes", None}
        Elements or nodes; by default elements in 2D where there are any.
    limits : (float, float), optional
        Ends of the colour scale.
    dpi : int
        Resolution of a PNG [dots per inch].

    Returns
    -------
    Path
        The picture.

    Raises
    ------
    InputError
        If the source cannot be read, has no such field, or the picture cannot be written.
    """
    path, snapshot = Path(path), _snapshot(source)
    if style not in (None, "cells", "nodes"):
        raise InputError(f"picture: style = {style}: is unknown; use cells or nodes")
    has_cells = any(name in _CORNERS for name, _ in snapshot.cells)
    if style is None:
        style = "cells" if has_cells and not snapshot.is_3d else "nodes"
    draw = plot_cells if style == "cells" else plot_nodes
    axes = draw(snapshot, field=field, limits=limits)
    kind = path.suffix.lstrip(".").lower() or "png"
    figure: Any = axes.figure
    if kind not in figure.canvas.get_supported_filetypes():
        raise InputError(f"{path}: ending .{kind} is no picture format known here; use .png")
    with replace_file(path) as temporary:
        figure.savefig(temporary, format=kind, dpi=dpi)
    return path


def plot_cells(
    source: Snapshot | Path | str | Any,
    *,
    field: str = "Damage_Z",
    limits: tuple[float, float] | None = None,
    axes: Axes | None = None,
) -> Axes:
    """Draw the triangles and quads of a 2D state, coloured by the mean of their nodes.

    Elements torn open by a crack (an edge longer than `TORN` times its reference length)
    are left out, so that cracks show as gaps. This needs the displacement.

    Parameters
    ----------
    source : Snapshot, Path, str or DEMModel
        State to draw.
    field : str
        Tag to colour by; vectors by their length.
    limits : (float, float), optional
        Ends of the colour scale.
    axes : Axes, optional
        Where to draw; a new figure by default.

    Returns
    -------
    Axes
        The axes; ``axes.figure`` is the figure.

    Raises
    ------
    InputError
        If the state is 3D, has no such field, or no triangles or quads.
    """
    from matplotlib.collections import PolyCollection

    snapshot = _snapshot(source)
    if snapshot.is_3d:
        raise InputError("picture: cells of a 3D state cannot be drawn; use style nodes")
    blocks = [nodes[~_torn(snapshot, nodes)] for name, nodes in snapshot.cells if name in _CORNERS]
    if not blocks:
        raise InputError("picture: there are no triangles or quads; use style nodes")
    values, plane = snapshot.values(field), snapshot.points[:, :2]
    scale = _Scale(snapshot)
    axes = axes if axes is not None else _new_figure(snapshot).add_subplot()
    colours, norm = _colour_scale(field, values[~snapshot.wall], limits)
    shown: Collection | None = None
    for nodes in blocks:
        wall = snapshot.wall[nodes[:, 0]]
        if wall.any():
            grey = PolyCollection(list(plane[nodes[wall]] * scale.factor))
            grey.set(facecolor=_WALL_COLOUR, edgecolor=_WALL_COLOUR, linewidth=0.2)
            axes.add_collection(grey)
        shown = PolyCollection(list(plane[nodes[~wall]] * scale.factor), cmap=colours, norm=norm)
        shown.set_array(values[nodes[~wall]].mean(axis=1))
        shown.set(edgecolor="face", linewidth=0.2)
        axes.add_collection(shown)
    _finish(axes, snapshot, scale, field, shown)
    return axes


def plot_nodes(
    source: Snapshot | Path | str | Any,
    *,
    field: str = "Damage_Z",
    limits: tuple[float, float] | None = None,
    axes: Axes | None = None,
) -> Axes:
    """Draw the nodes as discs whose area follows the nodal volume.

    In 3D the nodes on the surface of the tetrahedra are drawn (all nodes where there are
    no elements), in a 3D box. Parameters, return value and errors as in `plot_cells`.
    """
    snapshot = _snapshot(source)
    values, scale = snapshot.values(field), _Scale(snapshot)
    if axes is None:
        projection = "3d" if snapshot.is_3d else None
        axes = _new_figure(snapshot).add_subplot(projection=projection)
    chosen = _surface(snapshot) if snapshot.is_3d else np.ones(len(values), dtype=bool)
    colours, norm = _colour_scale(field, values[~snapshot.wall], limits)
    sizes = _disc_areas(snapshot, axes)
    dimension = 3 if snapshot.is_3d else 2
    where = snapshot.points[:, :dimension].T * scale.factor
    scatter: Any = axes.scatter  # of a plain or a 3D box
    wall, grain = chosen & snapshot.wall, chosen & ~snapshot.wall
    look: dict[str, Any] = {"linewidth": 0}
    if snapshot.is_3d:  # a thin rim tells one disc from the next
        look = {"linewidth": 0.3, "edgecolor": (0.0, 0.0, 0.0, 0.35), "depthshade": False}
    see_through = 0.12 if snapshot.is_3d else 1.0
    scatter(*where[:, wall], s=sizes[wall], color=_WALL_COLOUR, alpha=see_through, **look)
    # Damaged nodes last, so that a crack is not hidden below sound neighbours.
    order = np.flatnonzero(grain)[np.argsort(values[grain], kind="stable")]
    shown = scatter(
        *where[:, order], s=sizes[order], c=values[order], cmap=colours, norm=norm, **look
    )
    _finish(axes, snapshot, scale, field, shown)
    return axes


class _Scale:
    """Length unit of the ticks: the largest one in which the picture spans ten or more."""

    def __init__(self, snapshot: Snapshot) -> None:
        size = float(np.diff(_box(snapshot), axis=0).max())
        self.factor, self.unit = 1.0, "m"
        if size < 0.1:
            self.factor, self.unit = 1e3, "mm"
        if size < 1e-4:
            self.factor, self.unit = 1e6, "µm"


def _snapshot(source: Any) -> Snapshot:
    if isinstance(source, Snapshot):
        return source
    if isinstance(source, (str, Path)):
        return Snapshot.from_vtu(source)
    return Snapshot.from_model(source)


def _new_figure(snapshot: Snapshot) -> Figure:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    width, height = np.diff(_box(snapshot), axis=0)[0, :2]
    ratio = 1.0 if snapshot.is_3d else float(np.clip(height / max(width, 1e-300), 0.4, 1.8))
    # 5 inches of picture along the longer side, plus room for ticks and colour bar.
    figure = Figure(
        figsize=(5.0 / max(ratio, 1.0) + 1.9, 5.0 * min(ratio, 1.0) + 1.1), layout="constrained"
    )
    FigureCanvasAgg(figure)
    return figure


def _damage_colours() -> Colormap:
    """Sound material in quiet blues up to Z = 1, where the colour jumps to reds."""
    from matplotlib.colors import LinearSegmentedColormap

    sound = [(0.0, _SOUND), (0.25, "#b7c9dd"), (0.5, "#41719f")]
    broken = [(0.5 + 0.5 * position, colour) for position, colour in _BROKEN]
    return LinearSegmentedColormap.from_list("damage", sound + broken, N=512)


def _fraction_colours() -> Colormap:
    """Sound material pale, any broken bond in the reds of the damage."""
    from matplotlib.colors import LinearSegmentedColormap

    broken = [(0.1 + 0.9 * position, colour) for position, colour in _BROKEN]
    return LinearSegmentedColormap.from_list("fraction", [(0.0, _SOUND), *broken], N=512)


def _colour_scale(
    tag: str, values: Array, limits: tuple[float, float] | None
) -> tuple[Colormap, Normalize]:
    from matplotlib import colormaps
    from matplotlib.colors import Normalize

    if tag == "Damage_Z":
        return _damage_colours(), Normalize(*(limits or (0.0, _DAMAGE_CAP)))
    if tag == "Damage":
        return _fraction_colours(), Normalize(*(limits or (0.0, 1.0)))
    known = FIELDS.get(tag)
    colours = colormaps[known.colours if known else "viridis"]
    finite = values[np.isfinite(values)]
    if limits is None and len(finite):
        low, high = float(finite.min()), float(finite.max())
        if tag == "Theta":
            high = max(-low, high)
            low = -high
        limits = (low, high)
    return colours, Normalize(*(limits or (0.0, 1.0)))


def _finish(
    axes: Axes, snapshot: Snapshot, scale: _Scale, tag: str, shown: Collection | None
) -> None:
    """Equal axes with units, title with the time, colour bar."""
    box = _box(snapshot) * scale.factor
    axes.set(xlim=box[:, 0], ylim=box[:, 1], xlabel=f"x [{scale.unit}]", ylabel=f"y [{scale.unit}]")
    if hasattr(axes, "set_zlim"):
        space: Any = axes
        space.set(zlim=box[:, 2], zlabel=f"z [{scale.unit}]")
        space.set_box_aspect(np.diff(box, axis=0)[0])
        space.zaxis.label.set_color(_INK)
    else:
        axes.set_aspect("equal")
        axes.spines[["top", "right"]].set_visible(False)
        axes.spines[["left", "bottom"]].set_color(_INK)
    axes.tick_params(colors=_INK, labelsize=9)
    axes.xaxis.label.set_color(_INK)
    axes.yaxis.label.set_color(_INK)
    if snapshot.time is not None:
        axes.set_title(f"t = {_time(snapshot.time)}", loc="left", fontsize=11, color=_INK)
    if shown is not None:
        _colour_bar(axes, shown, tag)


def _colour_bar(axes: Axes, shown: Collection, tag: str) -> None:
    known = FIELDS.get(tag, Field("", tag))
    figure: Any = axes.figure
    low, high = shown.get_clim()
    damage = tag == "Damage_Z"
    bar = figure.colorbar(
        shown, ax=axes, shrink=0.85, pad=0.1 if hasattr(axes, "set_zlim") else 0.03,
        extend="max" if damage else "neither",
    )  # fmt: skip
    bar.set_label(known.label + (f" [{known.unit}]" if known.unit else ""), color=_INK)
    bar.outline.set_visible(False)
    bar.ax.tick_params(colors=_INK, labelsize=9)
    if damage and low is not None and high is not None and low < 1 < high:
        ticks = [low, 0.5, 1.0, 1.5, high]
        bar.set_ticks(ticks, labels=[f"{t:g}" if t != 1 else "1  bond\nbroken" for t in ticks])


def _box(snapshot: Snapshot) -> Array:
    """Corners of the picture, with a margin of 4 %.

    A few fragments far away do not shrink the bodies: beyond a quarter of the size of the
    middle 98 % of the nodes they are cut off.
    """
    finite = snapshot.points[np.isfinite(snapshot.points).all(axis=1)]
    if not len(finite):
        raise InputError("picture: no node has a finite position; draw an earlier state")
    low, high = np.quantile(finite, (0.01, 0.99), axis=0)
    reach = 0.25 * float((high - low).max())
    low = np.maximum(finite.min(axis=0), low - reach)
    high = np.minimum(finite.max(axis=0), high + reach)
    margin = 0.04 * float((high - low).max()) or 1.0
    return np.stack([low - margin, high + margin])


def _time(seconds: float) -> str:
    for factor, unit in ((1.0, "s"), (1e3, "ms"), (1e6, "µs")):
        if abs(seconds) * factor >= 0.1:
            return f"{seconds * factor:.4g} {unit}"
    return f"{seconds * 1e6:.3g} µs"


def _torn(snapshot: Snapshot, nodes: Array) -> Mask:
    moved = snapshot.fields.get("Displacement")
    if moved is None or not len(nodes):
        return np.zeros(len(nodes), dtype=bool)

    def edges(points: Array) -> Array:
        corners = points[nodes]
        lengths: Array = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
        return lengths

    long = edges(snapshot.points) > TORN * edges(snapshot.points - moved)
    return np.asarray(long.any(axis=1), dtype=bool)


def _surface(snapshot: Snapshot) -> Mask:
    """Nodes on faces that belong to one tetrahedron only; all where there are none."""
    chosen = np.ones(len(snapshot.points), dtype=bool)
    for name, nodes in snapshot.cells:
        if name != "tetra":
            continue
        faces = np.concatenate([np.delete(nodes, corner, axis=1) for corner in range(4)])
        unique, count = np.unique(np.sort(faces, axis=1), axis=0, return_counts=True)
        chosen[nodes.ravel()] = False
        chosen[unique[count == 1].ravel()] = True
    return chosen


def _disc_areas(snapshot: Snapshot, axes: Axes) -> Array:
    """Areas of the discs [points^2], so that together they fill the bodies."""
    figure: Any = axes.figure
    box = np.diff(_box(snapshot), axis=0)[0]
    points_per_metre = 72 * 0.75 * min(figure.get_size_inches()) / float(box[:2].max())
    volume = snapshot.fields.get("Nodal_Volume")
    if volume is None:
        volume = np.full(len(snapshot.points), box[:2].prod() / len(snapshot.points))
    edge = np.cbrt(volume) if snapshot.is_3d else np.sqrt(volume)
    return np.asarray(np.maximum(1.3 * (edge * points_per_metre) ** 2, 0.5))
