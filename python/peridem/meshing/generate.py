"""Meshes and regions of shapes by gmsh, in this process."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..geometry import Shape as Geometry
from ..geometry.base import FloatArray
from ..mesh import Mesh
from ..mesh.checks import checked_mesh
from ..mesh.data import RawMesh
from .session import gmsh_model, is_discrete, set_options, start_model
from .short import collapse_short_edges
from .thin import SMALLEST_SHARE, local_size, set_sizes

if TYPE_CHECKING:
    from ..shapes.base import BodyShape

_KIND = {2: 2, 3: 4}
"""gmsh's number of the triangle and the tetrahedron, by dimension."""


def region_of_drawing(shape: BodyShape) -> Geometry:
    """Return the region that a drawing fills, curved edges and surfaces in fine steps."""
    from ..shapes.outlines import region_of_edges, region_of_mesh

    name = type(shape).__name__
    with gmsh_model() as gmsh:
        drawing = _drawn(gmsh, shape)
        if drawing.dimension == 3:
            _generate_uniform(drawing, drawing.diagonal / 30.0)
            return region_of_mesh(_collect(drawing, name), 3)
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 1000)
        _set_limits(gmsh, 0.0, drawing.diagonal)
        gmsh.model.mesh.generate(1)
        surfaces = gmsh.model.getEntities(2)
        edges = []
        for _, curve in gmsh.model.getBoundary(surfaces, combined=True, oriented=False):
            _, _, nodes = gmsh.model.mesh.getElements(1, curve)
            edges += [tags.astype(np.int64).reshape(-1, 2) for tags in nodes]
        tags, coordinates, _ = gmsh.model.mesh.getNodes()
    order = np.argsort(tags, kind="stable")
    points = drawing.placed(coordinates.reshape(-1, 3)[order])
    numbers = np.searchsorted(tags[order].astype(np.int64), np.vstack(edges))
    return region_of_edges(points, numbers, name)


@dataclass(frozen=True)
class Drawing:
    """A shape drawn in gmsh.

    Attributes
    ----------
    gmsh : module
        gmsh, initialised, with the drawing as its current model.
    name : str
        Name of the shape's class, for messages.
    dimension : int
        2 or 3.
    diagonal : float
        Diagonal of its box, in units of the drawing.
    scale, offset : float and ndarray, shape (3,)
        Unit and displacement [m] of the drawing.
    """

    gmsh: Any
    name: str
    dimension: int
    diagonal: float
    scale: float
    offset: FloatArray

    def placed(self, points: FloatArray) -> FloatArray:
        """Bring points of the drawing to the reference position [m]."""
        return np.asarray(self.scale * points + self.offset)

    def drawn(self, points: FloatArray) -> FloatArray:
        """Bring points of the reference position to the drawing."""
        return np.asarray((points - self.offset) / self.scale)


def generate(shape: BodyShape, size: float) -> Mesh:
    """Mesh a shape with gmsh in this process; `mesh_shape` checks, keeps and isolates.

    Parameters
    ----------
    shape : BodyShape
        What to mesh.
    size : float
        Node distance [m].

    Raises
    ------
    InputError
        If gmsh cannot mesh it.
    """
    source = f"{type(shape).__name__} meshed with mesh_size = {size:g} m"
    with gmsh_model() as gmsh:
        drawing = _drawn(gmsh, shape)
        step = size / drawing.scale
        _generate_uniform(drawing, step)
        mesh = _collect(drawing, source)
        sizes = local_size(mesh, size)
        if sizes.thin:
            wanted = sizes(mesh.points) / drawing.scale
            drawing = _drawn(gmsh, shape)  # anew: gmsh can hang when told to forget a mesh
            view = set_sizes(gmsh, drawing.drawn(mesh.points)[mesh.cells], wanted[mesh.cells])
            _generate_uniform(drawing, step)
            gmsh.view.remove(view)
            mesh = _collect(drawing, source)
    points, cells = collapse_short_edges(mesh.points, mesh.cells.astype(np.int64), sizes)
    return checked_mesh(RawMesh(points, {mesh.cell_type: cells}), drawing.dimension, source)


def _drawn(gmsh: Any, shape: BodyShape) -> Drawing:
    name = type(shape).__name__
    try:
        drawable, scale, offset = shape.drawable()
        start_model(gmsh)
        drawable.draw(gmsh)
        set_options(gmsh)
        if is_discrete(gmsh):  # curvature means nothing on facets
            gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", 0)
        dimension = int(gmsh.model.getDimension())
        box = np.array(gmsh.model.getBoundingBox(-1, -1)) if dimension >= 2 else np.zeros(6)
    except InputError:
        raise
    except Exception as error:  # gmsh raises bare Exception, a drawing function anything
        raise InputError(
            f"{name}: gmsh cannot draw it ({_said(error)}); correct the drawing"
        ) from error
    if dimension < 2:
        raise InputError(f"{name}: the drawing has no surface and no volume; add one")
    diagonal = float(np.linalg.norm(box[3:] - box[:3]))
    drawing = Drawing(gmsh, name, dimension, diagonal, scale, np.array(offset))
    if shape.has_center_node:
        _embed(drawing, shape.geometry.center)
    return drawing


def _embed(drawing: Drawing, point: FloatArray) -> None:
    """Let the mesh have a node at a point [m] of the reference position."""
    model = drawing.gmsh.model
    (entity,) = model.getEntities(drawing.dimension)
    tag = model.occ.addPoint(*drawing.drawn(point))
    model.occ.synchronize()
    model.mesh.embed(0, [tag], *entity)


def _generate_uniform(drawing: Drawing, size: float) -> None:
    """Mesh with one size, smaller only where asked for."""
    gmsh = drawing.gmsh
    _set_limits(gmsh, SMALLEST_SHARE * size, size)
    try:
        gmsh.model.mesh.generate(drawing.dimension)
    except Exception as error:  # gmsh raises bare Exception
        raise InputError(
            f"{drawing.name}: gmsh cannot mesh it with mesh_size = {size * drawing.scale:g} m "
            f"({_said(error)}); use a smaller size or a simpler shape, and check that its surface "
            "does not cross itself"
        ) from error


def _set_limits(gmsh: Any, smallest: float, largest: float) -> None:
    gmsh.option.setNumber("Mesh.MeshSizeMin", smallest)
    gmsh.option.setNumber("Mesh.MeshSizeMax", largest)


def _said(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def _collect(drawing: Drawing, source: str) -> Mesh:
    """Nodes and elements of the model in the reference position, nodes in gmsh's order."""
    dimension = drawing.dimension
    tags, coordinates, _ = drawing.gmsh.model.mesh.getNodes()
    _, corners = drawing.gmsh.model.mesh.getElementsByType(_KIND[dimension])
    if not len(corners):
        raise InputError(f"{source}: gmsh made no elements; use a smaller mesh_size")
    order = np.argsort(tags, kind="stable")
    numbers = np.searchsorted(tags[order].astype(np.int64), corners.astype(np.int64))
    used = np.unique(numbers)
    cells = np.searchsorted(used, numbers).reshape(-1, dimension + 1)
    points = drawing.placed(coordinates.reshape(-1, 3)[order][used])
    kind = "triangle" if dimension == 2 else "tetra"
    return checked_mesh(RawMesh(points + 0.0, {kind: cells}), dimension, source)
