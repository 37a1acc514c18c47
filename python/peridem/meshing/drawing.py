"""Shapes as gmsh's CAD kernel (OpenCASCADE) has them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..geometry import Region, Shape, Solid
from ..geometry.base import FloatArray
from ..geometry.composite import Complex, Difference
from ..geometry.primitives import Ball, Box, Cylinder, Ellipse, Polygon

_SHARP = math.radians(40.0)
"""Angle between triangles from which their common edge is one of the body."""

_MOST_FACES = 2000
_FEWEST_TRIANGLES = 200

Entities = list[tuple[int, int]]
"""Dimension and number of each."""


def draw(gmsh: Any, geometry: Shape) -> None:
    """Draw a region in the current model of gmsh.

    Parameters
    ----------
    gmsh : module
        gmsh, initialised.
    geometry : Shape
        What to draw.

    Raises
    ------
    InputError
        If nothing is left of a combination of shapes.
    """
    entities = _drawn(gmsh.model.occ, geometry)
    if not entities:
        raise InputError(f"{geometry.type}: nothing is left of it; take less away")
    gmsh.model.occ.synchronize()


def draw_faces(gmsh: Any, points: FloatArray, faces: Sequence[Sequence[int]]) -> None:
    """Draw the solid within plane faces in the current model of gmsh."""
    _faces(gmsh.model.occ, points, faces)
    gmsh.model.occ.synchronize()


def draw_surface(gmsh: Any, points: FloatArray, triangles: NDArray[np.int64]) -> None:
    """Draw the solid within a closed surface that is to be meshed anew.

    The surface is cut at its sharp edges and into pieces that can be laid flat.
    """
    while len(triangles) < _FEWEST_TRIANGLES:  # with few, gmsh's search for pieces can be endless
        points, triangles = _subdivided(points, triangles)
    model = gmsh.model
    surface = model.addDiscreteEntity(2)
    model.mesh.addNodes(2, surface, np.arange(1, len(points) + 1), points.ravel())
    model.mesh.addElementsByType(surface, 2, [], (triangles + 1).ravel())
    model.mesh.classifySurfaces(_SHARP, True, True, np.pi)
    model.mesh.createGeometry()
    loop = model.geo.addSurfaceLoop([tag for _, tag in model.getEntities(2)])
    model.geo.addVolume([loop])
    model.geo.synchronize()


def _subdivided(
    points: FloatArray, triangles: NDArray[np.int64]
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Cut every triangle into four at the middles of its edges."""
    sides = np.vstack([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    edges, place = np.unique(np.sort(sides, axis=1), axis=0, return_inverse=True)
    middles = 0.5 * (points[edges[:, 0]] + points[edges[:, 1]])
    (a, b, c), (ab, bc, ca) = triangles.T, len(points) + place.reshape(3, -1)
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.vstack([points, middles]), np.vstack([np.column_stack(part) for part in parts])


def _drawn(occ: Any, geometry: Shape) -> Entities:
    for kind, drawer in _DRAWERS.items():
        if isinstance(geometry, kind):
            return drawer(occ, geometry)
    raise InputError(
        f"{geometry.type}: cannot be meshed by gmsh; mesh it elsewhere and use MeshFile(path=...)"
    )


def _ball(occ: Any, ball: Ball) -> Entities:
    x, y, z = ball.middle
    if ball.axes == 3:
        return [(3, occ.addSphere(x, y, z, ball.radius))]
    return [(2, occ.addDisk(x, y, z, ball.radius, ball.radius))]


def _box(occ: Any, box: Box) -> Entities:
    (x, y, z), sides = box.lower, box.sides
    if box.axes == 3:
        return [(3, occ.addBox(x, y, z, *sides))]
    return [(2, occ.addRectangle(x, y, z, *sides))]


def _ellipse(occ: Any, ellipse: Ellipse) -> Entities:
    long, short, angle = ellipse.a, ellipse.b, ellipse.angle
    if long < short:  # the CAD kernel wants the longer half axis first
        long, short, angle = short, long, angle + 0.5 * np.pi
    x, y, z = ellipse.middle
    tag = occ.addDisk(x, y, z, long, short)
    occ.rotate([(2, tag)], x, y, z, 0.0, 0.0, 1.0, angle)
    return [(2, tag)]


def _polygon(occ: Any, polygon: Polygon) -> Entities:
    return [(2, occ.addPlaneSurface([_loop(occ, polygon.vertices)]))]


def _region(occ: Any, region: Region) -> Entities:
    loops = [_loop(occ, loop) for loop in (region.outline, *region.holes)]
    return [(2, occ.addPlaneSurface(loops))]


def _loop(occ: Any, vertices: FloatArray) -> int:
    points = [occ.addPoint(*vertex) for vertex in vertices]
    ends = points[1:] + points[:1]
    return int(occ.addCurveLoop([occ.addLine(a, b) for a, b in zip(points, ends, strict=True)]))


def _solid(occ: Any, solid: Solid) -> Entities:
    if len(solid.triangles) > _MOST_FACES:
        raise InputError(
            f"{solid.type}: {len(solid.triangles)} triangles: at most {_MOST_FACES} can be put "
            "together with other shapes; use a coarser surface"
        )
    return _faces(occ, solid.points, solid.triangles.tolist())


def _faces(occ: Any, points: FloatArray, faces: Sequence[Sequence[int]]) -> Entities:
    tags = [occ.addPoint(*xyz) for xyz in points]
    lines: dict[tuple[int, int], int] = {}
    surfaces = []
    for face in faces:
        loop = []
        for i, j in zip(face, (*face[1:], face[0]), strict=True):
            if (j, i) not in lines and (i, j) not in lines:
                lines[i, j] = occ.addLine(tags[i], tags[j])
            loop.append(lines[i, j] if (i, j) in lines else -lines[j, i])
        surfaces.append(occ.addPlaneSurface([occ.addCurveLoop(loop)]))
    return [(3, occ.addVolume([occ.addSurfaceLoop(surfaces)]))]


def _cylinder(occ: Any, cylinder: Cylinder) -> Entities:
    return [(3, occ.addCylinder(*cylinder.base, *cylinder.axis, cylinder.radius))]


def _difference(occ: Any, shape: Difference) -> Entities:
    return _combined(occ.cut, _drawn(occ, shape.outer), _drawn(occ, shape.inner))


def _complex(occ: Any, shape: Complex) -> Entities:
    made: Entities = []
    for member, plus in zip(shape.members, shape.signs, strict=True):
        added = _drawn(occ, member)
        if made:
            made = _combined(occ.fuse if plus else occ.cut, made, added)
        elif plus:
            made = added
    return made


def _combined(operation: Callable[..., Any], first: Entities, second: Entities) -> Entities:
    found, _ = operation(first, second)
    return [(int(dimension), int(tag)) for dimension, tag in found]


_DRAWERS: dict[type[Shape], Callable[[Any, Any], Entities]] = {
    Ball: _ball,
    Box: _box,
    Ellipse: _ellipse,
    Polygon: _polygon,
    Region: _region,
    Solid: _solid,
    Cylinder: _cylinder,
    Difference: _difference,
    Complex: _complex,
}
