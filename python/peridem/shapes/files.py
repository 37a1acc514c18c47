"""Shapes that were made elsewhere: mesh files and drawings of gmsh."""

from __future__ import annotations

import dataclasses
import hashlib
import os
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from ..files import path_of
from ..geometry import Shape as Geometry
from ..mesh import Mesh
from ..mesh.checks import checked_mesh
from ..mesh.data import RawMesh
from ..mesh.reader import read_raw_mesh
from .base import BodyShape, Point, factor_of, point
from .outlines import region_of_mesh
from .units import unit_length


@dataclass(frozen=True, kw_only=True, repr=False)
class MeshFile(BodyShape):
    """A body with the mesh of a file.

    Parameters
    ----------
    path : path-like
        A ``.msh`` (Gmsh 2.x or 4.1), ``.vtu``, ``.csv`` (nodes with volumes), or any format
        that meshio reads.
    dimension : int, optional
        2 keeps triangles or quads, 3 tetrahedra; what the file has unless given.
    unit : str or float
        Unit of its coordinates, such as ``"mm"``, or its length [m].
    offset : sequence of 2 or 3 float
        Added to the coordinates [m].
    """

    path: str | os.PathLike[str]
    dimension: int = 0
    unit: str | float = 1.0
    offset: Sequence[float] = (0.0, 0.0, 0.0)
    digest: str = field(default="", init=False, repr=False)
    _mesh: Mesh = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        file = path_of(self.path, "MeshFile: path")
        if self.dimension not in (0, 2, 3):
            raise InputError(f"MeshFile: dimension = {self.dimension!r}: must be 2 or 3")
        if not file.exists():
            raise InputError(
                f"MeshFile: path = {str(self.path)!r}: does not exist (it would be "
                f"{file.absolute()}); correct it"
            )
        raw = read_raw_mesh(file)
        dimension = self.dimension or _dimension(raw)
        unit = unit_length("MeshFile", self.unit)
        offset = point("MeshFile", "offset", self.offset)
        self._set(path=str(self.path), unit=unit, offset=offset, dimension=dimension)
        mesh = self._placed(checked_mesh(raw, dimension, str(file)))
        self._set(_mesh=mesh, digest=hashlib.sha256(file.read_bytes()).hexdigest())

    @cached_property
    def geometry(self) -> Geometry:
        """The region of space its elements fill; a ball around nodes without elements."""
        return region_of_mesh(self._mesh, self.dimension)

    @property
    def key(self) -> Hashable:
        """What tells its meshes from those of other shapes."""
        return f"MeshFile {self.digest} {self.dimension} {self.unit!r} {self.offset!r}"

    def mesh(self, mesh_size: float | None = None, *, cache: bool = True) -> Mesh:
        """Return the mesh of the file.

        Parameters
        ----------
        mesh_size : float, optional
            Must be left out: the file says.
        cache : bool
            Without effect; the mesh is kept in memory.

        Raises
        ------
        InputError
            If a mesh size is given.
        """
        if mesh_size is not None:
            raise InputError(
                f"MeshFile: mesh_size = {mesh_size!r}: must be left out: the mesh is that of "
                f"{self.path}"
            )
        return self._mesh

    def scaled(self, factor: float) -> MeshFile:
        """Return the shape scaled about the origin by `factor` (positive)."""
        s = factor_of("MeshFile", factor)
        offset = tuple(s * x for x in self.offset)
        return dataclasses.replace(self, unit=s * float(self.unit), offset=offset)

    def moved(self, by: Sequence[float]) -> MeshFile:
        """Return the shape moved by 2 or 3 components [m]."""
        shift = point("MeshFile", "by", by)
        offset = tuple(a + b for a, b in zip(self.offset, shift, strict=True))
        return dataclasses.replace(self, offset=offset)

    def _placed(self, mesh: Mesh) -> Mesh:
        from ..meshing.cache import read_only

        scale = float(self.unit)
        if scale == 1.0 and not any(self.offset):
            return read_only(mesh)
        points = scale * mesh.points + np.array(self.offset)
        volumes = None if mesh.volumes is None else scale**self.dimension * mesh.volumes
        return read_only(dataclasses.replace(mesh, points=points, volumes=volumes))


def _dimension(raw: RawMesh) -> int:
    """3 for tetrahedra, or nodes that do not lie in one plane; else 2."""
    if len(raw.cells.get("tetra", ())):
        return 3
    if raw.cells or not len(raw.points):
        return 2
    return 3 if np.ptp(raw.points[:, 2]) > 0.0 else 2


@dataclass(frozen=True, kw_only=True, repr=False)
class GmshGeometry(BodyShape):
    """A body drawn with gmsh.

    It is meshed evenly with the mesh size; sizes that the drawing sets are ignored.

    Parameters
    ----------
    source : path-like or callable
        A file that gmsh opens as a drawing (``.geo``, ``.step``, ``.brep``), or a function
        that is given the module ``gmsh`` and draws in its current model, by
        ``gmsh.model.occ`` or ``gmsh.model.geo``. Meshes of a function are kept in memory
        only, for as long as it is the same object.
    unit : str or float
        Unit of its coordinates, such as ``"mm"``, or its length [m].
    offset : sequence of 2 or 3 float
        Added to the coordinates [m].
    """

    source: str | os.PathLike[str] | Callable[[Any], object]
    unit: str | float = 1.0
    offset: Sequence[float] = (0.0, 0.0, 0.0)
    digest: str = field(default="", init=False, repr=False)

    def __post_init__(self) -> None:
        offset = point("GmshGeometry", "offset", self.offset)
        self._set(unit=unit_length("GmshGeometry", self.unit), offset=offset)
        if callable(self.source):
            return
        try:
            file = Path(self.source)
            content = file.read_bytes()
        except (OSError, TypeError) as error:
            raise InputError(
                f"GmshGeometry: source = {self.source!r:.80}: cannot be read ({error}); give a "
                "file of gmsh, or a function that draws"
            ) from None
        if file.suffix.lower() == ".geo" and not content.endswith((b"\n", b"\r")):
            raise InputError(
                f"GmshGeometry: source = {file}: must end with a line break, or gmsh skips its "
                "last line; add one"
            )
        self._set(source=str(self.source), digest=hashlib.sha256(content).hexdigest())

    @property
    def key(self) -> Hashable:
        """What tells its meshes from those of other shapes; files are told by their content."""
        place = f"{self.unit!r} {self.offset!r}"
        if callable(self.source):
            return (self.source, place)
        return f"GmshGeometry {self.digest} {place}"

    @cached_property
    def geometry(self) -> Geometry:
        """The region of space it fills, curved surfaces in fine steps."""
        from ..meshing.make import region_of_drawing

        return region_of_drawing(self)

    def drawable(self) -> tuple[BodyShape, float, Point]:
        """Return the shape to be drawn, and scale and displacement [m] that bring it back."""
        x, y, z = self.offset
        return self, float(self.unit), (x, y, z)

    @property
    def is_portable(self) -> bool:
        """Whether another process can draw it: a file, not a function."""
        return not callable(self.source)

    def draw(self, gmsh: Any) -> None:
        """Draw the shape in the current model of gmsh, for the mesher."""
        from ..meshing.session import is_discrete

        if callable(self.source):
            self.source(gmsh)
        else:
            gmsh.merge(str(Path(self.source).absolute()))
        gmsh.model.geo.synchronize()
        gmsh.model.occ.synchronize()
        if not is_discrete(gmsh):
            gmsh.model.mesh.clear()  # that of the drawing; surfaces of triangles need theirs

    def scaled(self, factor: float) -> GmshGeometry:
        """Return the shape scaled about the origin by `factor` (positive)."""
        s = factor_of("GmshGeometry", factor)
        offset = tuple(s * x for x in self.offset)
        return dataclasses.replace(self, unit=s * float(self.unit), offset=offset)

    def moved(self, by: Sequence[float]) -> GmshGeometry:
        """Return the shape moved by 2 or 3 components [m]."""
        shift = point("GmshGeometry", "by", by)
        offset = tuple(a + b for a, b in zip(self.offset, shift, strict=True))
        return dataclasses.replace(self, offset=offset)
