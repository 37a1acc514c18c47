"""Reference meshes: lattices with disorder, by numpy, so that a million nodes take seconds."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int32]
Inside = Callable[[FloatArray], NDArray[np.bool_]]

DISORDER = 0.05
"""Nodes leave their lattice site by up to this part of the spacing, as in real meshes."""

SAMPLE = 64
"""Nodes whose neighbours are counted when a horizon is looked for in a large mesh."""


@dataclass(frozen=True)
class LatticeMesh:
    """Points (n, 3) [m], triangles (m, 3) or tetrahedra (m, 4), and the spacing h [m]."""

    points: FloatArray
    cells: IntArray
    h: float

    @property
    def cell_type(self) -> str:
        return "triangle" if self.cells.shape[1] == 3 else "tetra"


def polygon(corners: FloatArray) -> Inside:
    """Whether points lie in a polygon, by the even-odd rule."""

    def inside(points: FloatArray) -> NDArray[np.bool_]:
        x, y = points[:, 0], points[:, 1]
        within = np.zeros(len(points), dtype=bool)
        for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            if y0 == y1:
                continue
            crosses = (y0 > y) != (y1 > y)
            within ^= crosses & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0))
        return within

    return inside


def regular_polygon(radius: float, corners: int) -> Inside:
    """Whether points lie in a regular polygon of this circumradius."""
    angles = 2 * np.pi * np.arange(corners) / corners
    return polygon(radius * np.stack([np.cos(angles), np.sin(angles)], axis=1))


def drum(radius: float, waist: float) -> Inside:
    """Whether points lie in the hourglass that the decks call drum2d."""
    x, y = 0.5 * radius, 0.5 * np.sqrt(3) * radius
    half = 0.5 * waist
    corners = [(half, 0), (x, y), (-x, y), (-half, 0), (-x, -y), (x, -y)]
    return polygon(np.array(corners))


def ball(radius: float) -> Inside:
    """Whether points lie in a disc or a sphere."""
    return lambda points: np.einsum("ij,ij->i", points, points) <= radius * radius


def box(lower: FloatArray, upper: FloatArray) -> Inside:
    """Whether points lie in an upright rectangle; bounds as (x, y)."""
    d = len(lower)

    def inside(points: FloatArray) -> NDArray[np.bool_]:
        return np.all((points[:, :d] >= lower) & (points[:, :d] <= upper), axis=1)

    return inside


def triangular_lattice(
    inside: Inside, h: float, lower: tuple[float, float], upper: tuple[float, float]
) -> LatticeMesh:
    """Triangles of side h whose corners all lie inside; the bounds enclose the shape."""
    rise = h * np.sqrt(3) / 2
    columns = int((upper[0] - lower[0]) / h) + 3
    rows = int((upper[1] - lower[1]) / rise) + 3
    j, i = np.divmod(np.arange(rows * columns), columns)
    points = np.zeros((rows * columns, 3))
    points[:, 0] = (i + 0.5 * (j % 2)) * h
    points[:, 1] = j * rise
    # A node in the middle, so that the centre of a body is one.
    middle = (rows // 2) * columns + columns // 2
    center = 0.5 * (np.array(lower) + np.array(upper))
    points[:, :2] += center - points[middle, :2]
    a = np.flatnonzero((i < columns - 1) & (j < rows - 1))
    odd = j[a] % 2
    up = np.stack([a, a + 1, a + columns + odd], axis=1)
    down = np.stack([a + 1 - odd, a + columns + 1, a + columns], axis=1)
    return _trim(points, np.concatenate([up, down]), inside, h)


def cubic_lattice(inside: Inside, h: float, half: float) -> LatticeMesh:
    """Cubes of side h, each cut into six tetrahedra, whose corners all lie inside."""
    n = 2 * (int(half / h) + 1) + 1
    axis = (np.arange(n) - n // 2) * h
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    step = np.array([n * n, n, 1])
    cube = np.arange(n**3).reshape(n, n, n)[:-1, :-1, :-1].ravel()
    # Only whole cubes that can be inside: the others would be thrown away.
    keep = inside(points)
    corners = [(k >> 2) * step[0] + ((k >> 1) & 1) * step[1] + (k & 1) for k in range(8)]
    cube = cube[np.all([keep[cube + c] for c in corners], axis=0)]
    cells = []
    # Kuhn's simplices: from the lower corner to the upper one, one axis after the other.
    for order in ((0, 1, 2), (0, 2, 1), (1, 0, 2), (1, 2, 0), (2, 0, 1), (2, 1, 0)):
        path = np.concatenate([[0], np.cumsum(step[list(order)])])
        even = order in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
        cells.append(cube[:, None] + (path if even else path[[0, 2, 1, 3]]))
    return _trim(points, np.concatenate(cells), inside, h)


def _trim(points: FloatArray, cells: NDArray[np.int64], inside: Inside, h: float) -> LatticeMesh:
    """Drop cells that reach out and nodes without cell, then add the disorder."""
    cells = cells[np.all(inside(points)[cells], axis=1)]
    used = np.zeros(len(points), dtype=bool)
    used[cells.ravel()] = True
    number = np.cumsum(used) - 1
    kept = points[used]
    d = 2 if cells.shape[1] == 3 else 3
    kept[:, :d] += np.random.default_rng(1).uniform(-DISORDER * h, DISORDER * h, (len(kept), d))
    return LatticeMesh(kept, number[cells].astype(np.int32), float(h))


def fitted(make: Callable[[float], LatticeMesh], h: float, nodes: int) -> LatticeMesh:
    """A mesh of about so many nodes, by changing the spacing `h` that `make` takes."""
    mesh = make(h)
    d = 2 if mesh.cell_type == "triangle" else 3
    for _ in range(8):
        if abs(len(mesh.points) - nodes) <= 0.01 * nodes:
            break
        h *= (len(mesh.points) / nodes) ** (1 / d)
        other = make(h)
        if abs(len(other.points) - nodes) < abs(len(mesh.points) - nodes):
            mesh = other
    return mesh


def plane_shape(inside: Inside, radius: float, nodes: int) -> LatticeMesh:
    """A shape within the circle of this radius, of about so many nodes."""
    bounds = (-radius,) * 2, (radius,) * 2
    h = radius * np.sqrt(2 * np.pi / (np.sqrt(3) * nodes))
    return fitted(lambda h: triangular_lattice(inside, h, *bounds), h, nodes)


def disc(radius: float, nodes: int) -> LatticeMesh:
    """A disc of about so many nodes."""
    return plane_shape(ball(radius), radius, nodes)


def sphere(radius: float, nodes: int) -> LatticeMesh:
    """A sphere of about so many nodes."""
    h = radius * (4 * np.pi / (3 * nodes)) ** (1 / 3)
    return fitted(lambda h: cubic_lattice(ball(radius), h, radius + h), h, nodes)


def shuffled(mesh: LatticeMesh, seed: int = 1) -> LatticeMesh:
    """The same mesh with its nodes in random order, worse than any mesh generator's."""
    order = np.random.default_rng(seed).permutation(len(mesh.points))
    number = np.empty_like(order)
    number[order] = np.arange(len(order))
    return LatticeMesh(mesh.points[order], number[mesh.cells].astype(np.int32), mesh.h)


def horizon_for(mesh: LatticeMesh, neighbours: float) -> float:
    """Horizon [m] within which the mean node of the mesh has so many neighbours."""
    n = len(mesh.points)
    chosen = np.arange(n)
    if n > 2000:
        chosen = np.random.default_rng(1).choice(n, SAMPLE, replace=False)
    # The horizon is that distance below which neighbours * nodes of the sample's pairs lie.
    nearest = min(n - 1, int(4 * neighbours) + 8)
    pairs = []
    for i in chosen:
        squared = ((mesh.points - mesh.points[i]) ** 2).sum(axis=1)
        pairs.append(np.partition(squared, nearest)[: nearest + 1])
    ordered = np.sort(np.concatenate(pairs))
    wanted = min(len(ordered) - 1, round((neighbours + 1) * len(chosen)))  # + 1: the node itself
    return float(np.sqrt(0.5 * (ordered[wanted - 1] + ordered[wanted])))


def write_msh(path: Path, mesh: LatticeMesh) -> None:
    """Write a MSH 2.2 file."""
    kind = 2 if mesh.cell_type == "triangle" else 4
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(mesh.points))]
    lines += [f"{k} {x:.17g} {y:.17g} {z:.17g}" for k, (x, y, z) in enumerate(mesh.points, 1)]
    lines += ["$EndNodes", "$Elements", str(len(mesh.cells))]
    for k, cell in enumerate((mesh.cells + 1).tolist(), 1):
        lines.append(f"{k} {kind} 2 1 1 " + " ".join(map(str, cell)))
    path.write_text("\n".join([*lines, "$EndElements", ""]))
