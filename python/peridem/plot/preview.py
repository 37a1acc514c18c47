"""The bodies of a model before it is built: outlines of their shapes where they will stand."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from .camera import Camera
from .edges import boundary_edges
from .fields import label_colours
from .look import PIXELS_PER_INCH

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["preview"]

FloatArray = NDArray[np.float64]
_BOX_EDGES = [(i, j) for i in range(8) for j in range(i) if bin(i ^ j).count("1") == 1]


def preview(plan: Any) -> Figure | None:
    """Draw the bodies that were added to a model, coloured by material; None without bodies."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.figure import Figure

    if not plan.bodies:
        return None
    figure = Figure(figsize=(5.5, 4.0), dpi=PIXELS_PER_INCH, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    materials = list(dict.fromkeys(body.material for body in plan.bodies))
    hues = dict(zip(materials, label_colours(np.arange(float(len(materials)))), strict=True))
    camera = Camera.towards(-60.0, 25.0) if plan.dimension == 3 else None
    loops: list[FloatArray] = []
    colours, lines = [], []
    for body in plan.bodies:
        grey = body.is_wall or body.fixed
        outlines, closed = _outlines(body, camera)
        if closed:
            loops += outlines
            colours += [(0.74, 0.74, 0.74, 1.0) if grey else tuple(hues[body.material])] * len(
                outlines
            )
        else:
            lines += outlines
    every = np.concatenate([*loops, *lines])
    factor, unit = _unit(float(np.ptp(every, axis=0).max()))
    patches = PolyCollection(
        [loop * factor for loop in loops], facecolors=colours, edgecolors="0.35", linewidths=0.5
    )
    axes.add_collection(patches)
    axes.add_collection(LineCollection([x * factor for x in lines], colors="0.35", linewidths=0.5))
    low, high = every.min(axis=0) * factor, every.max(axis=0) * factor
    margin = 0.04 * float((high - low).max())
    axes.set(xlim=(low[0] - margin, high[0] + margin), ylim=(low[1] - margin, high[1] + margin))
    axes.set_aspect("equal")
    axes.spines[["top", "right"]].set_visible(False)
    axes.set_title("bodies before the first step", loc="left", fontsize=10)
    if camera is None:
        axes.set(xlabel=f"x [{unit}]", ylabel=f"y [{unit}]")
    else:
        axes.set_axis_off()
    return figure


def _unit(size: float) -> tuple[float, str]:
    if size >= 0.1:
        return 1.0, "m"
    return (1e3, "mm") if size >= 1e-4 else (1e6, "µm")


def _outlines(body: Any, camera: Camera | None) -> tuple[list[FloatArray], bool]:
    """Lines of a body in the plane of the picture, and whether they enclose it."""
    turn = Rotation.from_rotvec(body.angle * np.array(body.axis) / np.linalg.norm(body.axis))

    def placed(points: FloatArray) -> FloatArray:
        return np.asarray(turn.apply(points) * body.scale + np.array(body.at))

    if body.form.given is not None:
        mesh = body.form.given
        if camera is None and mesh.cells.shape[1] > 2:
            edges = boundary_edges([mesh.cells], len(mesh.points))
            return list(placed(mesh.points)[:, :2][edges]), False
        return _box(placed, mesh.points.min(axis=0), mesh.points.max(axis=0), camera), False
    geometry = body.form.shape.geometry
    if camera is not None:
        low, high = geometry.box
        return _box(placed, low, high, camera), False
    outline = geometry.boundary()
    gaps = np.flatnonzero(np.isnan(outline).any(axis=1))
    parts = np.split(outline, gaps)
    loops = [part[~np.isnan(part).any(axis=1)] for part in parts]
    if len(loops) > 1:  # a body with holes: its lines only
        return [placed(loop)[:, :2] for loop in loops], False
    return [placed(loops[0])[:, :2]], True


def _box(placed: Any, low: Any, high: Any, camera: Camera | None) -> list[FloatArray]:
    corners = np.array([[(low, high)[(k >> d) & 1][d] for d in range(3)] for k in range(8)])
    points = placed(corners)
    plane = points[:, :2] if camera is None else camera.project(points)
    return [plane[[i, j]] for i, j in _BOX_EDGES]
