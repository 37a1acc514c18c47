"""Voronoi tessellations: a domain cut into grains that fit together.

References
----------
R. Quey, P. R. Dawson, F. Barbe, Large-scale 3D random polycrystals for the finite element method:
Generation, meshing and remeshing, Comput. Methods Appl. Mech. Eng. 200 (2011) 1729: short edges are
contracted ("regularisation").
"""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely
from scipy.spatial import Voronoi

from ..errors import InputError
from ..geometry import Shape
from ..geometry.base import FloatArray
from ..geometry.primitives import Box
from .arguments import checked_names, generator, integer, number
from .cells import Cells
from .domains import domain_of
from .polyhedra import convex_cells
from .regions import Region, region_of
from .result import Packing

_LEAST = 1e-6
"""Sides below this part of the domain's size are contracted in any case."""
_FAR = 1e3
"""Distance of the seeds that close the outermost cells, in sizes of the domain."""


@checked_names
def voronoi(
    domain: Any,
    *,
    count: int,
    gap: float = 0.0,
    lloyd: int = 0,
    min_edge: float = 0.0,
    seed: int = 0,
) -> Packing:
    """Cut a domain into the Voronoi cells of random points, each a grain of its own shape.

    Parameters
    ----------
    domain : shape or two corners
        Any plane shape, or a box in 3D.
    count : int
        Number of cells. Where a domain that is not convex cuts a part off a cell, a neighbour
        gets it.
    gap : float
        Distance [m] between grains: each is made smaller by half of it, at the domain's edge too.
        In a model it should be the contact radius, or the mesh size: grains that touch are refused.
    lloyd : int
        How often the points are moved to the centroids of their cells: 0 gives grains of very
        different sizes, 5 to 20 nearly equal ones.
    min_edge : float
        In the plane: sides shorter than this [m] are contracted to a point, before the gap is
        made, so that meshes need no tiny elements. Sides of the domain itself remain; at its
        inward corners a side may be impossible to contract, which is an error.
    seed : int
        Of the random numbers; the same seed gives the same cells.

    Returns
    -------
    Packing
        A shape for each grain, a `Polygon` or a convex `Polyhedron` about its centroid.

    Raises
    ------
    InputError
        If an argument is wrong, or the gap or `min_edge` leaves nothing of a grain.
    """
    shape = domain_of("voronoi", domain)
    count = integer("voronoi", "count", count)
    rounds = integer("voronoi", "lloyd", lloyd, least=0)
    gap = number("voronoi", "gap", gap, least=0)
    min_edge = number("voronoi", "min_edge", min_edge, least=0)
    region = region_of(shape)
    seeds = region.sample(generator("voronoi", seed), count)
    if shape.dimension == 2:
        return _plane(region, seeds, gap, rounds, min_edge)
    if not isinstance(shape, Box):
        raise InputError(
            f"voronoi: domain: a {shape.type}: must be a box in 3D; give two corners, or a plane "
            "domain"
        )
    if min_edge > 0.0:
        raise InputError("voronoi: min_edge: is for plane domains only; remove it")
    return _solid(shape, seeds, gap, rounds)


def _plane(region: Region, seeds: FloatArray, gap: float, rounds: int, min_edge: float) -> Packing:
    for _ in range(rounds):
        seeds = np.array([cell.centroid.coords[0] for cell in clipped_cells(region, seeds)])
    polygons = _whole(clipped_cells(region, seeds), seeds, region)
    if any(len(polygon.interiors) for polygon in polygons):
        raise InputError(
            "voronoi: count: a grain goes all around a hole of the domain; give more grains"
        )
    # sides of nearly no length come from corners of the domain near sides of cells
    least = _LEAST * float(np.hypot(*np.subtract(*region.box)))
    polygons = Cells(polygons, region.polygon).contracted(max(min_edge, least))
    if gap > 0.0:
        polygons = [_shrunk(polygon, gap) for polygon in polygons]
    corners = [_points(polygon) for polygon in polygons]
    return _packing(corners, region.shape, 2)


def _whole(cells: list[Any], seeds: FloatArray, region: Region) -> list[Any]:
    """Give the parts of cells that a domain cuts off from their seeds to a neighbour."""
    if all(cell.geom_type == "Polygon" for cell in cells):
        return cells
    parts = [list(shapely.get_parts(cell)) for cell in cells]
    points = shapely.points(seeds)
    for k, point in enumerate(points):
        distance = shapely.distance(np.array(parts[k], dtype=object), point)
        parts[k] = [parts[k][m] for m in np.argsort(distance, kind="stable")]
    flat = Cells([part for own in parts for part in own], region.polygon).polygons()
    counts = np.array([len(own) for own in parts])
    first = np.cumsum(counts) - counts
    main = [flat[k] for k in first]
    for k in sorted(set(range(len(flat))) - set(first.tolist()), key=lambda k: flat[k].area):
        shared = shapely.length(shapely.intersection(np.array(main, dtype=object), flat[k]))
        best = int(np.argmax(shared))
        main[best] = shapely.union(main[best], flat[k])
    return main


def clipped_cells(region: Region, seeds: FloatArray) -> list[Any]:
    """Return the Voronoi cells of the seeds within a plane domain, in their order."""
    lower, upper = region.box
    middle, size = 0.5 * (lower + upper), float((upper - lower).max())
    turn = 2.0 * np.pi * np.arange(6) / 6.0
    around = middle + _FAR * size * np.column_stack([np.cos(turn), np.sin(turn)])
    # about the middle and in units of the size, for the accuracy of the far corners
    diagram = Voronoi((np.vstack([seeds, around]) - middle) / size)
    cells = []
    for k in range(len(seeds)):
        corners = diagram.vertices[diagram.regions[diagram.point_region[k]]] * size + middle
        cell = shapely.intersection(shapely.Polygon(corners).convex_hull, region.polygon)
        if cell.geom_type not in ("Polygon", "MultiPolygon"):
            parts = [p for p in shapely.get_parts(cell) if p.geom_type.endswith("Polygon")]
            cell = shapely.union_all(parts)
        cells.append(cell)
    return cells


def _shrunk(polygon: Any, gap: float) -> Any:
    smaller = shapely.buffer(polygon, -0.5 * gap, join_style="mitre", mitre_limit=1e6)
    if smaller.geom_type != "Polygon" or smaller.area <= 0.0:
        x, y = polygon.centroid.coords[0]
        raise InputError(
            f"voronoi: gap = {gap:g}: the grain at ({x:.3g}, {y:.3g}) of the width "
            f"{2.0 * shapely.maximum_inscribed_circle(polygon).length:.3g} m vanishes or falls "
            "apart; give a smaller gap, fewer grains or lloyd = 10"
        )
    return smaller


def _points(polygon: Any) -> FloatArray:
    """Corners of a polygon, counter-clockwise."""
    return np.asarray(shapely.get_coordinates(shapely.orient_polygons(polygon).exterior)[:-1])


def _solid(box: Box, seeds: FloatArray, gap: float, rounds: int) -> Packing:
    lower, upper = box.box
    for _ in range(rounds):
        seeds = np.array([_centroid(cell) for cell in convex_cells(seeds, lower, upper, 0.0)])
    return _packing(convex_cells(seeds, lower, upper, gap), box, 3)


def _packing(corners: list[FloatArray], domain: Shape, dimension: int) -> Packing:
    """Make a shape of each cell, about its centroid."""
    from .seam import polygon_shape, polyhedron_shape

    n = len(corners)
    middles = np.zeros((n, 3))
    shapes = []
    for k, points in enumerate(corners):
        middles[k, :dimension] = _centroid(points)
        make = polygon_shape if dimension == 2 else polyhedron_shape
        shapes.append(make(points - middles[k, :dimension]))
    return Packing(
        shapes=tuple(shapes),
        shape_index=np.arange(n),
        positions=middles,
        scales=np.ones(n),
        angles=np.zeros(n),
        axes=np.tile((0.0, 0.0, 1.0), (n, 1)),
        domain=region_of(domain).measure,
        container=domain,
    )


def _centroid(points: FloatArray) -> FloatArray:
    """Centroid of a polygon, or of the convex hull of points in space."""
    if points.shape[1] == 2:
        return np.array(shapely.Polygon(points).centroid.coords[0])
    from scipy.spatial import ConvexHull

    hull = ConvexHull(points)
    inner = points.mean(axis=0)
    a, b, c = (points[hull.simplices[:, k]] - inner for k in range(3))
    volume = np.abs(np.einsum("ij,ij->i", a, np.cross(b, c)))
    return np.asarray(inner + (volume @ (a + b + c)) / (4.0 * volume.sum()))
