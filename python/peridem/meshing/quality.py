"""How even the nodes of a mesh are."""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..mesh import Mesh

FloatArray = NDArray[np.float64]

SMALLEST_VOLUME = 0.01
"""A run refuses a nodal volume below this times h^d, h being the smallest node distance."""

UNEVEN = 0.3
"""Smallest node distance over that of most nodes, below which a mesh is called uneven."""

POOR = 0.1
"""Quality of an element below which it is called poor."""


class MeshWarning(UserWarning):
    """Nodes of a mesh are uneven; the text says which, why it matters and what to do."""


@dataclass(frozen=True, eq=False)
class MeshQuality:
    """How even the nodes of a mesh are.

    Attributes
    ----------
    volumes : ndarray, shape (n,)
        Nodal volumes [m^d], per unit thickness in 2D.
    distances : ndarray, shape (n,)
        Distance [m] of each node from the nearest other one.
    elements : ndarray, shape (m,)
        Quality of each element: 1 for the equilateral triangle, the regular tetrahedron and the
        square, 0 for a flat element.
    dimension : int
        2 for triangles and quads, 3 for tetrahedra.
    warnings : tuple of str
        What is wrong, with a remedy each; empty for a good mesh.
    """

    volumes: FloatArray = field(repr=False)
    distances: FloatArray = field(repr=False)
    elements: FloatArray = field(repr=False)
    dimension: int
    warnings: tuple[str, ...]

    @property
    def smallest_distance(self) -> float:
        """Smallest distance between two nodes [m], the mesh size h of a body."""
        return float(self.distances.min())

    @property
    def median_distance(self) -> float:
        """Median over the nodes of the distance to the nearest other one [m]."""
        return float(np.median(self.distances))

    @property
    def largest_distance(self) -> float:
        """Largest distance of a node from the nearest other one [m]."""
        return float(self.distances.max())

    @property
    def smallest_volume_ratio(self) -> float:
        """Smallest nodal volume over h^d; a run needs at least 0.01."""
        return float(self.volumes.min() / self.smallest_distance**self.dimension)

    @property
    def volume_spread(self) -> float:
        """Standard deviation of the nodal volumes over their mean; edges and corners count."""
        return float(self.volumes.std() / self.volumes.mean())

    @property
    def poorest_element(self) -> float:
        """Smallest quality of an element; NaN without elements."""
        return float(self.elements.min()) if len(self.elements) else float("nan")

    def __str__(self) -> str:
        lines = [
            f"{len(self.volumes)} nodes, {len(self.elements)} elements",
            f"node distance: {self.smallest_distance:.4g} smallest, {self.median_distance:.4g} "
            f"median, {self.largest_distance:.4g} largest [m]",
            f"nodal volume: {self.volumes.min():.4g} smallest, {self.volumes.max():.4g} largest "
            f"[m^{self.dimension}], smallest over h^{self.dimension}: "
            f"{self.smallest_volume_ratio:.3g}",
            f"poorest element: {self.poorest_element:.3g}",
        ]
        return "\n".join([*lines, *self.warnings])


def mesh_quality(mesh: Mesh) -> MeshQuality:
    """Measure how even the nodes of a mesh are.

    Parameters
    ----------
    mesh : Mesh
        Triangles, quads or tetrahedra, or nodes with volumes.

    Returns
    -------
    MeshQuality

    Raises
    ------
    InputError
        If the mesh consists of lines, or of a single node.
    """
    from scipy.spatial import cKDTree

    if mesh.cell_type == "line" or len(mesh.points) < 2:
        raise InputError(
            f"{mesh.source}: quality: must have two nodes and triangles, quads, tetrahedra or "
            "given volumes; give such a mesh"
        )
    dimension = 3 if mesh.cell_type == "tetra" or np.ptp(mesh.points[:, 2]) > 0.0 else 2
    distances = np.asarray(cKDTree(mesh.points).query(mesh.points, k=2)[0])[:, 1]
    volumes = nodal_volumes(mesh)
    elements = _element_quality(mesh)
    return MeshQuality(
        volumes=volumes,
        distances=distances,
        elements=elements,
        dimension=dimension,
        warnings=tuple(_warnings(mesh, volumes, distances, elements, dimension)),
    )


def nodal_volumes(mesh: Mesh) -> FloatArray:
    """Return the integrals of the nodes' shape functions, shape (n,) [m^d], or those given.

    Parameters
    ----------
    mesh : Mesh
        Triangles, quads or tetrahedra, or nodes with volumes.
    """
    if mesh.volumes is not None:
        return np.array(mesh.volumes)
    shares = _quad_shares(mesh) if mesh.cell_type == "quad" else _simplex_shares(mesh)
    volumes = np.bincount(mesh.cells.ravel(), shares.ravel(), minlength=len(mesh.points))
    return np.asarray(volumes, dtype=float)


def _simplex_shares(mesh: Mesh) -> FloatArray:
    corner = mesh.points[mesh.cells]
    n = corner.shape[1]
    arms = corner[:, 1:] - corner[:, :1]
    cross = np.cross(arms[:, 0], arms[:, 1])
    if n == 3:
        size = 0.5 * np.linalg.norm(cross, axis=1)
    else:
        size = np.abs(np.einsum("ij,ij->i", cross, arms[:, 2])) / 6.0
    return np.repeat(size[:, None] / n, n, axis=1)


def _quad_shares(mesh: Mesh) -> FloatArray:
    """Integrals of the four bilinear functions by 2 x 2 Gauss points, exact for any quad."""
    corner = mesh.points[mesh.cells][:, :, :2]
    side = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    shares: FloatArray = np.zeros(mesh.cells.shape)
    for s, t in itertools.product((-1 / np.sqrt(3.0), 1 / np.sqrt(3.0)), repeat=2):
        value = 0.25 * (1 + s * side[:, 0]) * (1 + t * side[:, 1])
        ds = 0.25 * side[:, 0] * (1 + t * side[:, 1])
        dt = 0.25 * side[:, 1] * (1 + s * side[:, 0])
        u, v = np.einsum("k,mkd->md", ds, corner), np.einsum("k,mkd->md", dt, corner)
        shares += np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])[:, None] * value
    return shares


def simplex_quality(corner: FloatArray) -> FloatArray:
    """Size of elements over that of the regular one with the same mean squared edge.

    Parameters
    ----------
    corner : ndarray, shape (m, 3, 3) or (m, 4, 3)
        Corners of triangles in the xy plane, or of tetrahedra [m].

    Returns
    -------
    ndarray, shape (m,)
        1 for regular elements, 0 for flat ones; its sign tells the sense of the corners.
    """
    n = corner.shape[1]
    arms = corner[:, 1:] - corner[:, :1]
    edges = [corner[:, a] - corner[:, b] for a, b in itertools.combinations(range(n), 2)]
    mean = np.mean([np.sum(edge**2, axis=1) for edge in edges], axis=0)
    cross = np.cross(arms[:, 0], arms[:, 1])
    if n == 3:
        return np.asarray(0.5 * cross[:, 2] / (np.sqrt(3.0) / 4.0 * mean))
    volume = np.einsum("ij,ij->i", cross, arms[:, 2]) / 6.0
    return np.asarray(volume / (mean**1.5 / (6.0 * np.sqrt(2.0))))


def _element_quality(mesh: Mesh) -> FloatArray:
    if mesh.cell_type == "none":
        return np.empty(0)
    corner = mesh.points[mesh.cells]
    if mesh.cell_type != "quad":
        return np.abs(simplex_quality(corner))
    sides = np.roll(corner, -1, axis=1) - corner
    mean = np.mean(np.sum(sides**2, axis=2), axis=1)
    return np.asarray(_quad_shares(mesh).sum(axis=1) / mean)


def _warnings(
    mesh: Mesh, volumes: FloatArray, distances: FloatArray, elements: FloatArray, dimension: int
) -> list[str]:
    found = []
    h, usual = float(distances.min()), float(np.quantile(distances, 0.9))
    node = int(np.argmin(volumes))
    if not volumes[node] >= SMALLEST_VOLUME * h**dimension:
        found.append(
            f"{mesh.source}: node {node} (counted from 0): volume = {volumes[node]:.3g}: below "
            f"{SMALLEST_VOLUME} h^{dimension} = {SMALLEST_VOLUME * h**dimension:.3g} with the "
            f"smallest node distance h = {h:.3g} m: a run will refuse the mesh; use a smaller "
            "mesh size, or blunt sharp corners"
        )
    if h < UNEVEN * usual:
        node = int(np.argmin(distances))
        place = ", ".join(f"{x:.4g}" for x in mesh.points[node])
        found.append(
            f"{mesh.source}: node {node} (counted from 0) at ({place}): distance to the next = "
            f"{h:.3g} m: below {UNEVEN} times the usual {usual:.3g}: contact radius, mesh size "
            "and time step follow the smallest distance; use a smaller mesh size, or leave out "
            "details smaller than it"
        )
    if len(elements) and elements.min() < POOR:
        poor = int(np.sum(elements < POOR))
        found.append(
            f"{mesh.source}: {poor} of {len(elements)} elements are almost flat, the poorest is "
            f"number {int(np.argmin(elements))} with quality {elements.min():.2g}: below {POOR}: "
            "nodal volumes are uneven there; use a smaller mesh size"
        )
    return found
