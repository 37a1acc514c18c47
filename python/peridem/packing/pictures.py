"""Pictures of packings, with matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from ..geometry.base import FloatArray
from ..geometry.primitives import Ball
from .arguments import choice
from .overlaps import _Body, centers_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .result import Packing

_INK = "0.2"
_SHAPE_COLOURS = (
    "#7fa8d1",
    "#e9b872",
    "#8fbf8f",
    "#c98ba4",
    "#a9a3cf",
    "#d98f6c",
    "#86bdb9",
    "#bfb58a",
)


def draw(packing: Packing, ax: Axes | None, color: str) -> Axes:
    """Draw a packing, see `Packing.plot`."""
    choice("Packing.plot", "color", color, ("shape", "radius", "order"))
    solid = packing.dimension == 3
    if ax is None:
        from matplotlib.figure import Figure

        figure: Any = Figure(figsize=(6.4, 6.4), layout="constrained")
        ax = figure.add_subplot(projection="3d" if solid else None)
    faces = _colours(packing, color)
    if solid:
        _draw_solids(packing, ax, faces)
    else:
        _draw_outlines(packing, ax, faces)
    ax.set(xlabel="x [m]", ylabel="y [m]")
    return ax


def _colours(packing: Packing, color: str) -> Any:
    from matplotlib import colormaps
    from matplotlib.colors import Normalize, to_rgba_array

    if color == "shape":
        # a tessellation has a shape for each grain; then neighbours should only differ
        names = [_SHAPE_COLOURS[k % len(_SHAPE_COLOURS)] for k in packing.shape_index]
        return to_rgba_array(names) if names else np.empty((0, 4))
    values = packing.radii if color == "radius" else np.arange(len(packing))
    return colormaps["viridis"](Normalize()(values))


def _draw_outlines(packing: Packing, ax: Any, faces: Any) -> None:
    from matplotlib.collections import PathCollection
    from matplotlib.path import Path

    paths = []
    for polygon in packing.polygons():
        rings = [ring for part in shapely.get_parts(polygon)
                 for ring in (part.exterior, *part.interiors)]  # fmt: skip
        paths.append(Path.make_compound_path(
            *[Path(shapely.get_coordinates(ring), closed=True) for ring in rings]
        ))  # fmt: skip
    ax.add_collection(PathCollection(paths, facecolors=faces, edgecolors=_INK, linewidths=0.4))
    if packing.container is not None:
        outline = packing.container.boundary()
        ax.plot(outline[:, 0], outline[:, 1], color=_INK, linewidth=1.4)
    ax.autoscale_view()
    ax.set_aspect("equal")


def _draw_solids(packing: Packing, ax: Any, faces: Any) -> None:
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection
    from scipy.spatial import ConvexHull

    centers, radii = centers_of(packing), packing.radii
    polygons: list[FloatArray] = []
    colours: list[Any] = []
    for k in range(len(packing)):
        body = _Body.of(packing, k)
        if body is None or isinstance(packing.geometries[packing.shape_index[k]], Ball):
            mesh = centers[k] + radii[k] * _ball()
        else:
            hull = ConvexHull(body.points)
            mesh = body.points[hull.simplices]
        polygons += list(mesh)
        colours += [_shaded(faces[k], mesh)]
    if polygons:
        colour = np.vstack(colours)
        ax.add_collection3d(Poly3DCollection(polygons, facecolors=colour, edgecolors=colour,
                                             linewidths=0.2))  # fmt: skip
        points = np.vstack(polygons)
        low, high = points.min(axis=0), points.max(axis=0)
        ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
        ax.set_box_aspect(high - low)
    ax.set_zlabel("z [m]")


def _shaded(colour: Any, triangles: FloatArray) -> Any:
    """Light from above and the left."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    outward = triangles.mean(axis=1) - triangles.mean(axis=(0, 1))
    normal *= np.where((normal * outward).sum(axis=1) < 0, -1.0, 1.0)[:, None]
    length = np.linalg.norm(normal, axis=1)
    light = normal @ np.array([-0.35, -0.5, 0.8]) / np.where(length > 0, length, 1.0)
    shade = 0.68 + 0.32 * light.clip(-1.0, 1.0)
    return np.column_stack([shade[:, None] * colour[:3], np.ones(len(shade))])


def _ball() -> FloatArray:
    """Triangles of a unit ball, shape (m, 3, 3)."""
    from scipy.spatial import ConvexHull

    k = np.arange(60) + 0.5
    z, turn = 1.0 - k / 30.0, np.pi * (1.0 + 5.0**0.5) * k
    rho = np.sqrt(1.0 - z * z)
    points = np.column_stack([rho * np.cos(turn), rho * np.sin(turn), z])
    return np.asarray(points[ConvexHull(points).simplices])
