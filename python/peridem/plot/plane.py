"""States in 2D on matplotlib axes: elements or nodes in their places, coloured by a field."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .edges import boundary_edges, split
from .fields import label_colours
from .scene import Scene, shown_mask
from .snapshot import Snapshot
from .torn import torn

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_cells", "draw_nodes", "draw_plane"]

FloatArray = NDArray[np.float64]


def draw_plane(axes: Axes, snapshot: Snapshot, scene: Scene) -> None:
    """Draw a state in 2D, as elements where there are any."""
    style = scene.look.style
    has_cells = bool(snapshot.solids())
    if style == "cells" and not has_cells:
        raise InputError("render: style = cells: there are no triangles or quads; use style nodes")
    if has_cells and style != "nodes":
        draw_cells(axes, snapshot, scene)
    else:
        draw_nodes(axes, snapshot, scene)


def draw_cells(axes: Axes, snapshot: Snapshot, scene: Scene) -> None:
    """Draw triangles and quads in one colour each.

    Elements torn open by a crack (an edge longer than `TORN` times its reference length)
    are left out, so that cracks show as gaps. This needs the displacement.
    """
    from .mosaic import Mosaic

    plane = snapshot.deformed(scene.look.scale).points[:, :2] * scene.length[0]
    shown = shown_mask(snapshot, scene.look)
    whole, walls, grains, numbers = [], [], [], []
    values_of = snapshot.cell_values(scene.source)
    for values, (_, nodes) in zip(values_of, snapshot.solids(), strict=True):
        kept = ~torn(snapshot, nodes)
        coloured = shown[nodes[:, 0]]
        grain = nodes[kept & coloured]
        whole.append(grain)
        walls.append(nodes[kept & ~coloured])
        grains.append(split(grain))
        numbers.append(np.repeat(values[kept & coloured], nodes.shape[1] - 2))
    _draw_walls(axes, plane, walls, scene)
    triangles = plane[np.concatenate(grains)]
    mosaic = Mosaic(triangles, **_colouring(np.concatenate(numbers), scene))
    axes.add_collection(mosaic, autolim=False)
    _outline(axes, plane, whole, scene, colour=_line_colour(scene), width=0.5)


def _colouring(values: FloatArray, scene: Scene) -> dict[str, Any]:
    """Options that give a collection its colours."""
    if scene.field.kind == "labels" and scene.look.colours is None:
        return {"colours": label_colours(values)}
    masked = np.ma.masked_invalid(values)
    return {"array": masked, "cmap": scene.colours, "norm": scene.norm}


def _line_colour(scene: Scene) -> str:
    return "0.35" if scene.look.ink == "0.25" else "0.75"


def _draw_walls(axes: Axes, plane: FloatArray, walls: list[Any], scene: Scene) -> None:
    from .mosaic import Mosaic

    look = scene.look
    if look.walls == "hidden" or not sum(map(len, walls)):
        return
    if look.walls != "outline":
        triangles = plane[np.concatenate([split(nodes) for nodes in walls])]
        axes.add_collection(Mosaic(triangles, look.wall_colour), autolim=False)
    _outline(
        axes, plane, walls, scene, colour=look.ink, width=0.8 if look.walls == "outline" else 0.4
    )


def _outline(
    axes: Axes, plane: FloatArray, cells: list[Any], scene: Scene, *, colour: str, width: float
) -> None:
    from matplotlib.collections import LineCollection

    edges = boundary_edges(cells, len(plane))
    # Thinner where bodies are small in the picture: many lines must not darken it.
    spacing = np.median(np.linalg.norm(np.diff(plane[edges], axis=1), axis=2)) if len(edges) else 1
    pixels = spacing / (float(np.diff(scene.box, axis=0).max()) * scene.length[0]) * 900
    lines = LineCollection(
        list(plane[edges]), colors=colour, linewidths=width * min(1.0, pixels / 4)
    )
    lines.set(capstyle="round", in_layout=False)
    axes.add_collection(lines, autolim=False)


def draw_nodes(axes: Axes, snapshot: Snapshot, scene: Scene) -> None:
    """Draw the nodes as discs whose area follows the nodal volume."""
    values = snapshot.values(scene.source)
    plane = snapshot.deformed(scene.look.scale).points[:, :2] * scene.length[0]
    shown = shown_mask(snapshot, scene.look)
    sizes = _disc_areas(axes, snapshot, scene)
    if scene.look.walls != "hidden":
        wall = np.flatnonzero(~shown)
        colour = scene.look.wall_colour
        axes.scatter(
            plane[wall, 0],
            plane[wall, 1],
            s=sizes[wall],
            color=colour,
            linewidth=0,
            rasterized=True,
        )
    # High values last, so that a crack is not hidden below sound neighbours.
    order = np.flatnonzero(shown)[np.argsort(values[shown], kind="stable")]
    options = _colouring(values[order], scene)
    colours = options.pop("colours", None)
    options["c"] = options.pop("array", None) if colours is None else colours
    # A thin rim shows pale discs on a white page, where discs are large enough for one.
    rim = 0.3 if len(order) and np.median(sizes[order]) > 6 else 0.0
    axes.scatter(
        plane[order, 0],
        plane[order, 1], s=sizes[order], linewidth=rim, edgecolor=_line_colour(scene),
        plotnonfinite=True, rasterized=True, **options,
    )  # fmt: skip


def _disc_areas(axes: Axes, snapshot: Snapshot, scene: Scene) -> FloatArray:
    """Areas of the discs [points^2], so that together they fill the bodies."""
    figure: Any = axes.figure
    place = axes.get_subplotspec()
    rows, columns = (1, 1) if place is None else place.get_gridspec().get_geometry()
    width, height = figure.get_size_inches() / (columns, rows)
    span = np.diff(scene.box, axis=0)[0]
    points_per_metre = 72 * 0.78 * min(width / span[0], height / span[1])
    volume = snapshot.fields.get("Nodal_Volume")
    if volume is None:
        size = np.ptp(snapshot.points[:, :2], axis=0)
        volume = np.full(len(snapshot.points), 0.7 * size.prod() / len(snapshot.points))
    return np.asarray(np.maximum(1.3 * volume * points_per_metre**2, 0.3))
