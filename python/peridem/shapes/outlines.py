"""The region of space that a mesh or a drawing fills."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..geometry import Region, Shape, Solid
from ..geometry.base import FloatArray
from ..geometry.composite import Complex
from ..geometry.primitives import Ball
from ..mesh import Mesh

_FACES_OF_TETRA = np.array([(1, 2, 3), (0, 3, 2), (0, 1, 3), (0, 2, 1)])  # outwards, opposite 0..3


def region_of_mesh(mesh: Mesh, dimension: int) -> Shape:
    """Return what the elements of a mesh fill; a circle or sphere around nodes without elements."""
    if mesh.cell_type == "none":
        return _around(mesh.points, dimension)
    if dimension == 3:
        return _solid(mesh.points, mesh.cells.astype(np.int64))
    import shapely

    flat = shapely.polygons(mesh.points[mesh.cells][:, :, :2])
    return _region(shapely.union_all(flat), float(mesh.points[0, 2]), mesh.source)


def region_of_edges(points: FloatArray, edges: NDArray[np.int64], source: str) -> Shape:
    """Return the plane region whose boundary are the edges, shape (m, 2) of numbers of points."""
    import shapely

    rings = shapely.get_parts(shapely.polygonize(shapely.linestrings(points[edges][:, :, :2])))
    filled = [shapely.Polygon(ring.exterior) for ring in rings]
    if not filled:
        raise InputError(f"{source}: its edges enclose nothing; draw closed outlines")
    region = functools.reduce(shapely.symmetric_difference, filled)
    return _region(region, float(points[0, 2]), source)


def _region(found: Any, z: float, source: str) -> Shape:
    import shapely

    parts = [part for part in shapely.get_parts(found) if part.geom_type == "Polygon"]
    if not parts:
        raise InputError(f"{source}: it fills no area; mesh a plane surface")
    regions = [_one_region(part, z) for part in parts]
    if len(regions) == 1:
        return regions[0]
    return Complex(type="pieces", members=tuple(regions), signs=(True,) * len(regions))


def _one_region(part: Any, z: float) -> Region:
    loops = [np.asarray(ring.coords)[:-1, :2] for ring in (part.exterior, *part.interiors)]
    solid = [np.column_stack([loop, np.full(len(loop), z)]) for loop in loops]
    region = Region(type="region", outline=solid[0], holes=tuple(solid[1:]))
    return Region(
        type="region",
        outline=region.outline,
        holes=region.holes,
        scale_length=region.bounding_radius,
    )


def _solid(points: FloatArray, tetrahedra: NDArray[np.int64]) -> Solid:
    corner = points[tetrahedra]
    a, b, c = (corner[:, k] - corner[:, 0] for k in (1, 2, 3))
    inverted = np.einsum("ij,ij->i", np.cross(a, b), c) < 0.0
    cells = tetrahedra.copy()
    cells[inverted, :2] = cells[inverted, 1::-1]
    faces = cells[:, _FACES_OF_TETRA].reshape(-1, 3)
    _, first, count = np.unique(
        np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
    )
    outer = faces[np.sort(first[count == 1])]
    used = np.unique(outer)
    triangles = np.searchsorted(used, outer)
    solid = Solid(type="solid", points=points[used], triangles=triangles)
    return Solid(
        type="solid",
        points=solid.points,
        triangles=triangles,
        scale_length=solid.bounding_radius,
    )


def _around(points: FloatArray, dimension: int) -> Ball:
    center = 0.5 * (points.min(axis=0) + points.max(axis=0))
    radius = float(np.linalg.norm(points - center, axis=1).max())
    kind = "circle" if dimension == 2 else "sphere"
    return Ball(type=kind, radius=radius, middle=center, axes=dimension, scale_length=radius)
