"""From a shape and a node distance to a mesh: checks, cache, and who makes it."""

from __future__ import annotations

import math
import warnings
from typing import TYPE_CHECKING

from ..errors import InputError
from ..geometry import Shape as Geometry
from ..mesh import Mesh
from . import cache as kept
from . import generate
from .quality import MeshWarning, mesh_quality
from .session import gmsh_version
from .worker import ask

if TYPE_CHECKING:
    from ..shapes.base import BodyShape

MOST_NODES = 2_000_000
"""More nodes than this are refused, unless `mesh_shape` is told otherwise."""

_VOLUME_OF_NODE = {2: math.sqrt(0.75), 3: math.sqrt(0.5)}
"""Nodal volume of the densest packing with node distance 1: triangular, fcc."""

_PATIENCE = 60.0  # [s] for any mesh
_PATIENCE_PER_NODE = 5e-3  # [s]; gmsh takes about 5e-5 in 2D and 2e-4 in 3D on a free core


def mesh_shape(
    shape: BodyShape, mesh_size: float, *, cache: bool = True, most_nodes: int = MOST_NODES
) -> Mesh:
    """Mesh a shape evenly: triangles in 2D, tetrahedra in 3D.

    Where the shape is thinner than two node distances, nodes lie closer: three across, down to
    half of `mesh_size`.

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

    Warns
    -----
    MeshWarning
        If nodes are so uneven that a run would suffer; see `mesh_quality`.
    """
    size = _checked_size(shape, mesh_size, most_nodes)
    key = kept.mesh_key(shape.key, size, gmsh_version()) if cache else None
    found = kept.find_in_memory(key)
    if found is not None:
        return found
    found = kept.find_on_disk(key)
    if found is None:
        found = kept.read_only(_made(shape, size))
        kept.write_to_disk(key, found)
    kept.remember(key, found)
    for text in mesh_quality(found).warnings:
        warnings.warn(text, MeshWarning, stacklevel=3)
    return found


def region_of_drawing(shape: BodyShape) -> Geometry:
    """Return the region that a drawing fills, curved edges and surfaces in fine steps.

    Parameters
    ----------
    shape : BodyShape
        Such as `peridem.GmshGeometry`.

    Raises
    ------
    InputError
        If gmsh cannot draw it, or it has no surface or volume.
    """
    if not shape.is_portable:
        return generate.region_of_drawing(shape)
    region = ask("region_of_drawing", shape, patience=_PATIENCE, what=type(shape).__name__)
    assert isinstance(region, Geometry)
    return region


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
    nodes = _expected_nodes(shape, size)
    if nodes > most_nodes:
        coarser = size * (nodes / most_nodes) ** (1.0 / d)
        raise InputError(
            f"{name}: mesh_size = {size:g}: gives about {nodes:.2g} nodes: at most {most_nodes} "
            f"are made; use {coarser:.2g} m or more"
        )
    return size


def _made(shape: BodyShape, size: float) -> Mesh:
    """Let gmsh make a mesh: in a process of its own, which may hang or crash, where it can."""
    if not shape.is_portable:
        return generate.generate(shape, size)
    patience = _PATIENCE + _PATIENCE_PER_NODE * _expected_nodes(shape, size)
    what = f"{type(shape).__name__} with mesh_size = {size:g} m"
    mesh = ask("generate", shape, size, patience=patience, what=what)
    assert isinstance(mesh, Mesh)
    return mesh


def _expected_nodes(shape: BodyShape, size: float) -> float:
    d = shape.dimension
    return shape.geometry.volume / (_VOLUME_OF_NODE[d] * size**d)
