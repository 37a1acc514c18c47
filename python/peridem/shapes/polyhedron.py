"""Solids within plane faces, or within a closed surface of triangles, as STL files have it."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Hashable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..files import path_of
from ..geometry import Solid
from ..geometry.base import FloatArray
from . import surfaces
from .base import BodyShape, factor_of, length, point, points_of
from .surfaces import Faces, IntArray
from .units import unit_length

_MERGE = 1e-6  # of the size: coordinates of STL files have seven digits


@dataclass(frozen=True, kw_only=True, repr=False)
class Polyhedron(BodyShape):
    """A solid within plane faces.

    It stays where its points are; `centered` moves its centroid to the origin, where bodies
    that are placed and turned should have it.

    Parameters
    ----------
    points : sequence of points, shape (n, 3)
        Corners [m].
    faces : sequence of sequences of int
        Corners of each face, counted from 0, one after the other, in either sense.
    """

    points: ArrayLike
    faces: Sequence[Sequence[int]]

    def __post_init__(self) -> None:
        points = points_of("Polyhedron", "points", self.points)
        faces = surfaces.faces_of("Polyhedron", self.faces, len(points))
        length("Polyhedron", "size of points", float(np.ptp(points, axis=0).max()))
        surfaces.check_plane("Polyhedron", points, faces)
        surfaces.check_closed("Polyhedron", faces, points)
        faces = surfaces.oriented(faces)
        surfaces.check_oriented("Polyhedron", faces, points)
        volume = _solid(points, surfaces.triangulated(points, faces)).volume
        _check_volume("Polyhedron", volume, points)
        if volume < 0.0:
            faces = tuple(face[::-1] for face in faces)
        self._set(points=tuple((x, y, z) for x, y, z in points.tolist()), faces=faces)

    @classmethod
    def convex_hull(cls, points: ArrayLike) -> Polyhedron:
        """Make the convex hull of points, shape (n, 3) [m]."""
        from scipy.spatial import ConvexHull, QhullError

        given = points_of("Polyhedron", "points", points)
        try:
            hull = ConvexHull(given)
        except (QhullError, ValueError):
            raise InputError(
                "Polyhedron: points: span no volume; give at least four that are not in one plane"
            ) from None
        corners = np.sort(hull.vertices)
        faces = np.searchsorted(corners, hull.simplices)
        return cls(points=given[corners], faces=_without_flat_edges(given[corners], faces))

    @cached_property
    def geometry(self) -> Solid:
        """The region of space it fills: centre (centroid), bounding radius, volume, and so on."""
        points = np.array(self.points)
        return _solid(points, surfaces.triangulated(points, as_faces(self.faces)))

    def draw(self, gmsh: Any) -> None:
        """Draw the shape in the current model of gmsh, for the mesher."""
        from ..meshing.drawing import draw_faces

        draw_faces(gmsh, np.array(self.points), self.faces)

    def scaled(self, factor: float) -> Polyhedron:
        """Return the shape with all coordinates times `factor` (positive)."""
        points = factor_of("Polyhedron", factor) * np.array(self.points)
        return Polyhedron(points=points, faces=self.faces)

    def moved(self, by: Sequence[float]) -> Polyhedron:
        """Return the shape moved by 3 components [m]."""
        points = np.array(self.points) + point("Polyhedron", "by", by)
        return Polyhedron(points=points, faces=self.faces)


@dataclass(frozen=True, kw_only=True, repr=False)
class Surface(BodyShape):
    """A solid within a closed surface of triangles, as scanned or drawn bodies have it.

    The surface is meshed anew with the mesh size: triangles of the file may be smaller or
    larger. It stays where its points are; `centered` moves its centroid to the origin.

    Parameters
    ----------
    points : array_like, shape (n, 3)
        Corners [m].
    triangles : array_like of int, shape (m, 3)
        Corners of the triangles, counted from 0, all in the same sense seen from outside.
    source : str
        Where it is from.
    """

    points: FloatArray = field(compare=False)
    triangles: IntArray = field(compare=False)
    source: str = field(default="", compare=False)
    digest: str = field(init=False, repr=False)

    def __post_init__(self) -> None:
        where = self.source or "Surface"
        points = points_of(where, "points", self.points)
        faces = surfaces.faces_of(where, np.asarray(self.triangles).tolist(), len(points))
        if any(len(face) != 3 for face in faces):
            raise InputError(f"{where}: triangles: must have three corners; or use Polyhedron")
        length(where, "size of points", float(np.ptp(points, axis=0).max()))
        surfaces.check_closed(where, faces, points)
        surfaces.check_oriented(where, faces, points)
        triangles = np.array(faces, dtype=np.int64)
        used = np.unique(triangles)
        points, triangles = points[used], np.searchsorted(used, triangles)
        volume = _solid(points, triangles).volume
        _check_volume(where, volume, points)
        if volume < 0.0:  # all of it inside out
            triangles = np.ascontiguousarray(triangles[:, ::-1])
        digest = hashlib.sha256(points.tobytes() + triangles.tobytes()).hexdigest()
        points.flags.writeable = triangles.flags.writeable = False
        self._set(points=points, triangles=triangles, digest=digest)

    @classmethod
    def from_stl(cls, path: str | os.PathLike[str], *, unit: str | float = "m") -> Surface:
        """Read a closed surface from an STL file, text or binary.

        Parameters
        ----------
        path : path-like
            The file.
        unit : str or float
            Unit of its coordinates, such as ``"mm"``, or its length [m]; STL files do not say.

        Raises
        ------
        InputError
            If the file cannot be read, or its surface is not closed and oriented.
        """
        file = path_of(path, "Surface.from_stl: path")
        scale = unit_length("Surface", unit)
        points, triangles = _read_stl(file)
        size = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
        points, triangles = surfaces.merged(points, triangles, _MERGE * size)
        return cls(points=points * scale, triangles=triangles, source=str(file))

    @property
    def key(self) -> Hashable:
        """What tells its meshes from those of other shapes."""
        return f"Surface {self.digest}"

    @cached_property
    def geometry(self) -> Solid:
        """The region of space it fills: centre (centroid), bounding radius, volume, and so on."""
        return _solid(self.points, self.triangles)

    def draw(self, gmsh: Any) -> None:
        """Draw the shape in the current model of gmsh, for the mesher."""
        from ..meshing.drawing import draw_surface

        draw_surface(gmsh, self.points, self.triangles)

    def scaled(self, factor: float) -> Surface:
        """Return the shape with all coordinates times `factor` (positive)."""
        s = factor_of("Surface", factor)
        return Surface(points=s * self.points, triangles=self.triangles, source=self.source)

    def moved(self, by: Sequence[float]) -> Surface:
        """Return the shape moved by 3 components [m]."""
        points = self.points + np.array(point("Surface", "by", by))
        return Surface(points=points, triangles=self.triangles, source=self.source)

    def __repr__(self) -> str:
        source = f", source={self.source!r}" if self.source else ""
        return f"Surface({len(self.points)} points, {len(self.triangles)} triangles{source})"


def as_faces(faces: Sequence[Sequence[int]]) -> Faces:
    """Return faces as tuples."""
    return tuple(tuple(face) for face in faces)


def _solid(points: FloatArray, triangles: IntArray) -> Solid:
    solid = Solid(type="solid", points=points, triangles=triangles)
    if solid.volume == 0.0:
        return solid
    return Solid(
        type="solid", points=points, triangles=triangles, scale_length=solid.bounding_radius
    )


def _check_volume(where: str, volume: float, points: FloatArray) -> None:
    size = float(np.ptp(points, axis=0).max())
    if not abs(volume) > 1e-9 * size**3:
        raise InputError(
            f"{where}: the surface encloses no volume ({volume:.2g} m^3); give one that does"
        )


def _read_stl(file: Path) -> tuple[FloatArray, IntArray]:
    from ..mesh.reader import read_with_meshio

    if not file.is_file():
        raise InputError(f"{file}: STL file does not exist; correct the path")
    found = read_with_meshio(file, "stl")
    blocks = [np.asarray(block.data) for block in found.cells if block.type == "triangle"]
    if not blocks:
        raise InputError(f"{file}: the file has no triangles; export the body as STL again")
    return np.array(found.points, dtype=float), np.vstack(blocks).astype(np.int64)


def _without_flat_edges(points: FloatArray, triangles: IntArray) -> list[list[int]]:
    """Join the triangles of a convex hull that lie in one plane to polygons."""
    normals = np.cross(
        points[triangles[:, 1]] - points[triangles[:, 0]],
        points[triangles[:, 2]] - points[triangles[:, 0]],
    )
    inside = points.mean(axis=0)
    outward = np.einsum("ij,ij->i", normals, points[triangles[:, 0]] - inside) > 0.0
    normals[~outward] *= -1.0
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    offset = np.einsum("ij,ij->i", normals, points[triangles[:, 0]])
    size = float(np.ptp(points, axis=0).max())
    left, faces = set(range(len(triangles))), []
    while left:
        k = min(left)
        same = [
            m
            for m in left
            if normals[m] @ normals[k] > 1.0 - 1e-9 and abs(offset[m] - offset[k]) < 1e-9 * size
        ]
        left -= set(same)
        faces.append(_around(points, np.unique(triangles[same]), normals[k]))
    return faces


def _around(points: FloatArray, corners: IntArray, normal: FloatArray) -> list[int]:
    """Order the corners of a convex face by angle about its middle."""
    spokes = points[corners] - points[corners].mean(axis=0)
    first = spokes[0] / np.linalg.norm(spokes[0])
    angle = np.arctan2(spokes @ np.cross(normal, first), spokes @ first)
    return [int(corner) for corner in corners[np.argsort(angle)]]
