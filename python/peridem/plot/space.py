"""States in 3D: the surface of the bodies, seen by an orthographic camera.

PyVista draws it where it is installed and can; otherwise its triangles are painted here from back
to front. Places, colours, scale bar and axes are the same.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .camera import Camera, surface_of
from .fields import Field, label_colours
from .look import nice
from .scene import Scene, prefix, shown_mask
from .snapshot import Snapshot

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["Faces", "draw_space", "faces_of"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

WALL_ALPHA = 0.25
AMBIENT = 0.55
"""Part of the light that comes from everywhere: shading must not be taken for another colour."""


@dataclass(frozen=True)
class Faces:
    """What is seen of a state: triangles of grains with their colours, and of walls.

    Attributes
    ----------
    points : ndarray, shape (n, 3)
        Positions [m].
    grains, walls : ndarray, shape (m, 3)
        Triangles, turning left when seen from outside.
    colours : ndarray, shape (m, 4)
        Colours of the grains' triangles.
    """

    points: FloatArray
    grains: IntArray
    walls: IntArray
    colours: FloatArray


def draw_space(axes: Axes, snapshot: Snapshot, scene: Scene, *, engine: str) -> None:
    """Draw a state in 3D on plane axes, by PyVista or by painting."""
    assert scene.camera is not None
    if scene.look.style == "nodes" or not any(name == "tetra" for name, _ in snapshot.cells):
        if scene.look.style == "cells":
            raise InputError("render: style = cells: there are no tetrahedra; use style nodes")
        _paint_nodes(axes, snapshot, scene)
    else:
        faces = faces_of(snapshot, scene)
        if engine == "pyvista":
            from .vtk_engine import photograph

            _show(axes, photograph(faces, scene, _pixels(axes, scene)), scene)
        else:
            _paint(axes, faces, scene, scene.camera)
    _mark(axes, scene, scene.camera)


def faces_of(snapshot: Snapshot, scene: Scene) -> Faces:
    """Find the surface of a state and its colours."""
    surface = surface_of(snapshot)
    shown = shown_mask(snapshot, scene.look)[surface.faces[:, 0]]
    if isinstance(scene.source, Field) and scene.source.tag not in snapshot.fields:
        groups = zip(snapshot.cell_values(scene.source), snapshot.solids(), strict=True)
        tetra = [values for values, (name, _) in groups if name == "tetra"]
        values = np.concatenate(tetra)[surface.owner]
    else:
        nodal = snapshot.values(scene.source)
        labels = scene.field.kind == "labels"
        corners = nodal[surface.faces]
        values = corners[:, 0] if labels else corners.mean(axis=1)
    if scene.field.kind == "labels" and scene.look.colours is None:
        colours = label_colours(values)
    else:
        colours = np.asarray(scene.colours(scene.norm(np.ma.masked_invalid(values))))
    walls = surface.faces[~shown] if scene.look.walls != "hidden" else surface.faces[:0]
    points = snapshot.deformed(scene.look.scale).points
    return Faces(points, surface.faces[shown], walls, colours[shown])


def _paint(axes: Axes, faces: Faces, scene: Scene, camera: Camera) -> None:
    """Paint triangles from back to front, the farther ones covered by the nearer ones."""
    from .mosaic import Mosaic

    plane = camera.project(faces.points) * scene.length[0]
    depth = faces.points @ camera.towards_viewer
    normals = _normals(faces.points, faces.grains)
    seen = np.flatnonzero(normals @ camera.towards_viewer > 0)
    order = seen[np.argsort(depth[faces.grains[seen]].mean(axis=1), kind="stable")]
    light = camera.towards_viewer + 0.5 * camera.up - 0.5 * camera.right
    bright = np.clip(normals[order] @ (light / np.linalg.norm(light)), 0, 1)
    colours = faces.colours[order].copy()
    colours[:, :3] *= (AMBIENT + (1 - AMBIENT) * bright)[:, None]
    _paint_walls(axes, plane, faces, scene, camera)
    mosaic = Mosaic(plane[faces.grains[order]], colours, zorder=2)
    axes.add_collection(mosaic, autolim=False)


def _paint_walls(axes: Axes, plane: FloatArray, faces: Faces, scene: Scene, camera: Camera) -> None:
    """Paint the far sides of walls below the grains, and edges on either side of them."""
    from matplotlib.collections import LineCollection
    from matplotlib.colors import to_rgb

    from .mosaic import Mosaic

    if not len(faces.walls):
        return
    look = scene.look
    far = faces.walls[_normals(faces.points, faces.walls) @ camera.towards_viewer < 0]
    if look.walls != "outline":
        wall, page = np.array(to_rgb(look.wall_colour)), np.array(to_rgb(look.background))
        mixed = tuple(WALL_ALPHA * wall + (1 - WALL_ALPHA) * page)
        axes.add_collection(Mosaic(plane[far], mixed, zorder=1), autolim=False)
    edges = _sharp_edges(faces.points, faces.walls)
    depth = faces.points @ camera.towards_viewer
    middle = depth[faces.grains].mean() if len(faces.grains) else 0.0
    behind = depth[edges].mean(axis=1) < middle
    for part, layer in ((behind, 1.5), (~behind, 3)):
        lines = LineCollection(
            list(plane[edges[part]]), colors=look.ink, linewidths=0.5, alpha=0.6, zorder=layer
        )
        lines.set(capstyle="round", in_layout=False)
        axes.add_collection(lines, autolim=False)


def _sharp_edges(points: FloatArray, faces: IntArray) -> IntArray:
    """Edges, shape (m, 2), between faces that meet at more than 30 degrees, or with one face."""
    normals = _normals(points, faces)
    sides = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2)
    key = np.sort(sides, axis=1) @ np.array([len(points), 1])
    order = np.argsort(key, kind="stable")
    owner, key = order // 3, key[order]
    same = key[:-1] == key[1:]
    flat = np.zeros(len(key), dtype=bool)
    cosine = (normals[owner[:-1]] * normals[owner[1:]]).sum(axis=1)
    flat[:-1] |= same & (cosine > np.cos(np.pi / 6))
    flat[1:] |= same & (cosine > np.cos(np.pi / 6))
    return np.asarray(sides[order[~flat]])


def _normals(points: FloatArray, faces: IntArray) -> FloatArray:
    a, b, c = (points[faces[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    with np.errstate(invalid="ignore"):
        return np.asarray(normals / np.linalg.norm(normals, axis=1, keepdims=True))


def _paint_nodes(axes: Axes, snapshot: Snapshot, scene: Scene) -> None:
    """Paint the nodes as discs, from back to front."""
    assert scene.camera is not None
    points = snapshot.deformed(scene.look.scale).points
    plane, depth = scene.camera.project(points), points @ scene.camera.towards_viewer
    values, shown = snapshot.values(scene.source), shown_mask(snapshot, scene.look)
    if scene.field.kind == "labels" and scene.look.colours is None:
        colours = label_colours(values)
    else:
        colours = np.array(scene.colours(scene.norm(np.ma.masked_invalid(values))))
    from matplotlib.colors import to_rgba

    colours[~shown] = to_rgba(scene.look.wall_colour, WALL_ALPHA)
    kept = shown | (scene.look.walls != "hidden")
    order = np.flatnonzero(kept)[np.argsort(depth[kept], kind="stable")]
    figure: Any = axes.figure
    span = np.diff(scene.box, axis=0)[0]
    points_per_metre = 72 * 0.78 * float((figure.get_size_inches() / span).min())
    volume = snapshot.fields.get("Nodal_Volume")
    if volume is None:
        volume = np.full(len(points), 0.5 * np.ptp(points, axis=0).prod() / len(points))
    areas = np.maximum(1.3 * (np.cbrt(volume) * points_per_metre) ** 2, 0.3)
    x, y = plane[order].T * scene.length[0]
    rims = np.where(shown[order, None], (0.0, 0.0, 0.0, 0.35), 0.0)  # tell disc from disc
    axes.scatter(
        x, y, s=areas[order], c=colours[order], linewidth=0.3, edgecolor=rims, rasterized=True
    )


def _pixels(axes: Axes, scene: Scene) -> tuple[int, int]:
    """Size in which the picture of the bodies will be seen."""
    figure: Any = axes.figure
    width, height = np.diff(scene.box, axis=0)[0]
    longest = int(max(figure.get_size_inches()) * figure.dpi)
    return (
        max(64, round(longest * width / max(width, height))),
        max(64, round(longest * height / max(width, height))),
    )


def _show(axes: Axes, picture: NDArray[np.uint8], scene: Scene) -> None:
    (x0, y0), (x1, y1) = scene.box * scene.length[0]
    axes.imshow(picture, extent=(x0, x1, y0, y1), interpolation="antialiased", zorder=2)


def _mark(axes: Axes, scene: Scene, camera: Camera) -> None:
    """Draw a scale bar and the directions of the axes, below the bodies."""
    (x0, y0), (x1, y1) = scene.box
    factor, width, ink = scene.length[0], x1 - x0, scene.look.ink
    bar = nice(0.25 * width)
    size, unit = prefix([bar], "m")
    low = y0 - 0.06 * (y1 - y0)
    ends = np.array([x1 - 0.03 * width - bar, x1 - 0.03 * width]) * factor
    options: dict[str, Any] = {"color": ink, "clip_on": False, "zorder": 5}
    axes.plot(ends, [low * factor] * 2, linewidth=2.5, solid_capstyle="butt", **options)
    text: dict[str, Any] = {"color": ink, "fontsize": 9, "clip_on": False, "zorder": 5}
    axes.text(
        float(ends.mean()),
        low * factor,
        f"{bar / size:g} {unit}\n",
        ha="center",
        va="center",
        **text,
    )
    origin = np.array([x0 + 0.07 * width, low])
    arm = 0.05 * width
    for name, direction in zip("xyz", np.eye(3), strict=True):
        tip = origin + arm * camera.project(direction[None])[0]
        if np.linalg.norm(tip - origin) < 0.2 * arm:
            continue  # it points at the viewer
        line = np.stack([origin, tip]) * factor
        axes.plot(*line.T, linewidth=1.2, **options)
        x, y = (origin + 1.35 * (tip - origin)) * factor
        axes.text(x, y, name, ha="center", va="center", **text)
