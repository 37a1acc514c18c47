"""Thin places of a body: necks, plates and tips where even nodes would lie side to side."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..mesh import Mesh

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

ACROSS = 3
"""Nodes wanted across a thin place."""

SMALLEST_SHARE = 0.5
"""Smallest local node distance, by the mesh size.

The smallest distance of all bodies sets contact radius and time step of a run, so that a thin
place must not be meshed as finely as it would like to be.
"""

_THIN = 0.95  # of the mesh size, from which nodes lie closer
_GROWTH = 0.4  # of the local node distance, by the distance from a thin place
_OPPOSED = -0.9  # cosine between the normals of both sides; a tip of 26 degrees has it
_ACROSS = 0.25  # cosine between an edge and the normals, from which it leads across


def local_size(mesh: Mesh, size: float) -> SizeField:
    """Return the node distance wanted at points: smaller where the body is thin.

    Parameters
    ----------
    mesh : Mesh
        An even mesh of the body.
    size : float
        Its node distance [m].

    Returns
    -------
    SizeField
    """
    places, thickness = thin_places(mesh)
    wanted = np.clip(thickness / (ACROSS - 1), SMALLEST_SHARE * size, size)
    thin = wanted < _THIN * size
    return SizeField(places[thin], wanted[thin], size)


@dataclass(frozen=True, eq=False)
class SizeField:
    """Node distances wanted at some places, growing with the distance from them.

    Attributes
    ----------
    places : ndarray, shape (k, 3)
        Thin places [m].
    wanted : ndarray, shape (k,)
        Node distance there [m].
    size : float
        Node distance elsewhere [m].
    """

    places: FloatArray
    wanted: FloatArray
    size: float

    @property
    def thin(self) -> bool:
        """Whether there are thin places."""
        return len(self.places) > 0

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return the node distances wanted at points, shape (n, 3) [m]."""
        from scipy.spatial import cKDTree

        sizes = np.full(len(points), self.size)
        steps = np.round(self.wanted / self.size, 2)  # few distinct sizes, one tree each
        for step in np.unique(steps):
            distance, _ = cKDTree(self.places[steps == step]).query(points)
            np.minimum(sizes, step * self.size + _GROWTH * distance, out=sizes)
        return sizes


def set_sizes(gmsh: Any, corners: FloatArray, wanted: FloatArray) -> int:
    """Ask gmsh for elements of given sizes.

    Parameters
    ----------
    gmsh : module
        gmsh, with the model in question.
    corners : ndarray, shape (m, 3, 3) or (m, 4, 3)
        Corners of the elements of an even mesh of it, in the units of the model.
    wanted : ndarray, shape (m, 3) or (m, 4)
        Sizes at the corners, in the same units.

    Returns
    -------
    int
        Number of the view that holds the sizes, to be removed after meshing.
    """
    # gmsh wants x of all corners, then y, z, values
    data = np.concatenate([corners[:, :, k] for k in range(3)] + [wanted], axis=1)
    view = int(gmsh.view.add("peridem sizes"))
    kind = "ST" if corners.shape[1] == 3 else "SS"
    gmsh.view.addListData(view, kind, len(data), data.ravel())
    field = gmsh.model.mesh.field.add("PostView")
    gmsh.model.mesh.field.setNumber(field, "ViewTag", view)
    gmsh.model.mesh.field.setAsBackgroundMesh(field)
    return view


def thin_places(mesh: Mesh) -> tuple[FloatArray, FloatArray]:
    """Find edges of a mesh that lead from one side of the body to the opposite one.

    Parameters
    ----------
    mesh : Mesh
        Triangles or tetrahedra.

    Returns
    -------
    places : ndarray, shape (3 k, 3)
        Ends and middle of each such edge [m].
    thickness : ndarray, shape (3 k,)
        Thickness of the body there [m].
    """
    cells = mesh.cells.astype(np.int64)
    faces, normals = outer_faces(mesh.points, cells)
    normal = np.zeros_like(mesh.points)
    for k in range(faces.shape[1]):
        np.add.at(normal, faces[:, k], normals)
    length = np.linalg.norm(normal, axis=1)
    outside = length > 0.0
    normal[outside] /= length[outside, None]
    edges = edges_of(cells)
    a, b = edges[outside[edges].all(axis=1)].T
    opposed = np.einsum("ij,ij->i", normal[a], normal[b]) < _OPPOSED
    a, b = a[opposed], b[opposed]
    edge = mesh.points[b] - mesh.points[a]
    through = normal[b] - normal[a]
    through /= np.linalg.norm(through, axis=1)[:, None]
    thickness = np.einsum("ij,ij->i", edge, through)
    leads_across = thickness > _ACROSS * np.linalg.norm(edge, axis=1)
    ends = mesh.points[a[leads_across]], mesh.points[b[leads_across]]
    places = np.vstack([*ends, 0.5 * (ends[0] + ends[1])])
    return places, np.tile(thickness[leads_across], 3)


def outer_faces(points: FloatArray, cells: IntArray) -> tuple[IntArray, FloatArray]:
    """Faces that belong to one element, and their outward normals, as long as the face is large.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Nodes [m].
    cells : ndarray of int, shape (m, k)
        Triangles, whose faces are edges, or tetrahedra.
    """
    d = cells.shape[1] - 1
    sides = [[k for k in range(d + 1) if k != apex] for apex in range(d + 1)]
    faces = np.vstack([cells[:, side] for side in sides])
    apex = np.concatenate([cells[:, k] for k in range(d + 1)])
    _, first, count = np.unique(
        np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True
    )
    outer = np.sort(first[count == 1])
    faces, apex = faces[outer], apex[outer]
    span = points[faces[:, 1]] - points[faces[:, 0]]
    if d == 2:
        normals = np.column_stack([span[:, 1], -span[:, 0], np.zeros(len(span))])
    else:
        normals = 0.5 * np.cross(span, points[faces[:, 2]] - points[faces[:, 0]])
    inward = np.einsum("ij,ij->i", normals, points[apex] - points[faces[:, 0]]) > 0.0
    normals[inward] *= -1.0
    return faces, normals


def edges_of(cells: IntArray) -> IntArray:
    """Return the edges of triangles or tetrahedra, each once, shape (k, 2)."""
    pairs = itertools.combinations(range(cells.shape[1]), 2)
    ends = np.sort(np.vstack([cells[:, list(pair)] for pair in pairs]), axis=1)
    n = int(ends.max()) + 1
    names = np.unique(ends[:, 0] * n + ends[:, 1])
    return np.column_stack([names // n, names % n])
