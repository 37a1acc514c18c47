"""From a shape and a node distance to a mesh."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..mesh import Mesh
from ..mesh.checks import check_cells, check_points
from ..mesh.data import CellType
from . import cache as kept
from .session import gmsh_model, gmsh_version

if TYPE_CHECKING:
    from ..shapes.base import BodyShape

MOST_NODES = 2_000_000
"""More nodes than this are refused, unless `mesh_shape` is told otherwise."""

_VOLUME_OF_NODE = {2: math.sqrt(0.75), 3: math.sqrt(0.5)}
"""Nodal volume of the densest packing with node distance 1: triangular, fcc."""

_CELLS: dict[int, tuple[int, CellType]] = {2: (2, "triangle"), 3: (4, "tetra")}
"""gmsh's number and our name of the element in 2D and 3D."""


def mesh_shape(
    shape: BodyShape, mesh_size: float, *, cache: bool = True, most_nodes: int = MOST_NODES
) -> Mesh:
    """Mesh a shape evenly: triangles in 2D, tetrahedra in 3D.

    Parameters
    ----------
    shape : BodyShape
        What to mesh, such as ``peridem.Circle(radius=1e-3)``.
    mesh_size : float
        Distance [m] that neighbouring nodes should have.
    cache : bool
        Take the mesh from the cache, in memory or on disk, when it was made before.
    most_nodes : int
        Meshes that would have more nodes than this are refused.

    Returns
    -------
    Mesh
        The same nodes in the same order every time.

    Raises
    ------
    InputError
        If the size is not positive, larger than the shape or gives too many nodes, if gmsh is
        not installed or cannot mesh the shape.
    """
    size = _checked_size(shape, mesh_size, most_nodes)
    key = kept.mesh_key(shape.key, size, gmsh_version()) if cache else None
    found = kept.find(key)
    if found is None:
        found = kept.read_only(_generate(shape, size))
        kept.keep(key, found)
    return found


def _checked_size(shape: BodyShape, mesh_size: float, most_nodes: int) -> float:
    from ..shapes.base import length

    name = type(shape).__name__
    size = length(name, "mesh_size", mesh_size)
    geometry, d = shape.geometry, shape.dimension
    if size > geometry.bounding_radius:
        raise InputError(
            f"{name}: mesh_size = {size:g}: must be below the bounding radius "
            f"{geometry.bounding_radius:g} m of the shape, better a tenth of it; use "
            f"{geometry.bounding_radius / 10:.2g}"
        )
    volume = geometry.volume
    nodes = volume / (_VOLUME_OF_NODE[d] * size**d)
    if nodes > most_nodes:
        coarser = (volume / (_VOLUME_OF_NODE[d] * most_nodes)) ** (1.0 / d)
        raise InputError(
            f"{name}: mesh_size = {size:g}: gives about {nodes:.2g} nodes: at most {most_nodes} "
            f"are made; use {coarser:.2g} m or more"
        )
    return size


def _generate(shape: BodyShape, size: float) -> Mesh:
    name = type(shape).__name__
    with gmsh_model() as gmsh:
        try:
            shape.draw(gmsh)
            gmsh.option.setNumber("Mesh.MeshSizeMin", size)
            gmsh.option.setNumber("Mesh.MeshSizeMax", size)
            gmsh.model.mesh.generate(shape.dimension)
        except InputError:
            raise
        except Exception as error:  # gmsh raises bare Exception
            raise InputError(
                f"{name}: gmsh cannot mesh it with mesh_size = {size:g} m "
                f"({' '.join(str(error).split())}); use a smaller size or a simpler shape"
            ) from error
        return _collect(gmsh, shape.dimension, f"{name} meshed with mesh_size = {size:g} m")


def _collect(gmsh: Any, dimension: int, source: str) -> Mesh:
    """Nodes and elements of the model, nodes in gmsh's order."""
    kind, cell_type = _CELLS[dimension]
    tags, coordinates, _ = gmsh.model.mesh.getNodes()
    _, corners = gmsh.model.mesh.getElementsByType(kind)
    tags = tags.astype(np.int64)
    order = np.argsort(tags, kind="stable")
    tags, points = tags[order], coordinates.reshape(-1, 3)[order]
    numbers = np.searchsorted(tags, corners.astype(np.int64))
    used = np.unique(numbers)
    if not len(used):
        raise InputError(f"{source}: gmsh made no elements; use a smaller mesh_size")
    cells = np.searchsorted(used, numbers).reshape(-1, dimension + 1).astype(np.int32)
    points = np.ascontiguousarray(points[used]) + 0.0
    check_points(points, source)
    check_cells(points, cell_type, cells.astype(np.int64), source)
    return Mesh(points, cell_type, cells, None, source)
