"""Looking at a state in 3D: an orthographic camera, and the surface that it sees."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .snapshot import Snapshot
from .torn import torn

__all__ = ["Camera", "Surface", "surface_of"]

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
_FACES = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
_BITS = 21  # of a node's number in the key of a face


@dataclass(frozen=True)
class Camera:
    """Directions of a picture in space: to the right, up, and towards the viewer."""

    right: FloatArray
    up: FloatArray
    towards_viewer: FloatArray

    @classmethod
    def towards(cls, azimuth: float, elevation: float) -> Camera:
        """Look from a direction, in degrees about z and above the xy-plane."""
        a, e = np.radians(azimuth), np.radians(elevation)
        back = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        right = np.array([-np.sin(a), np.cos(a), 0.0])
        return cls(right, np.cross(back, right), back)

    def project(self, points: FloatArray) -> FloatArray:
        """Places in the picture, shape (n, 2) [m]."""
        return np.asarray(points @ np.stack([self.right, self.up], axis=1))


@dataclass(frozen=True)
class Surface:
    """Triangles of the surface of bodies.

    Attributes
    ----------
    faces : ndarray, shape (m, 3)
        Nodes, turning left when seen from outside.
    owner : ndarray, shape (m,)
        Tetrahedron of each, counted over all tetrahedra.
    """

    faces: IntArray
    owner: IntArray


def surface_of(snapshot: Snapshot) -> Surface:
    """Faces that belong to one tetrahedron only, those of torn tetrahedra left out."""
    blocks = [nodes for name, nodes in snapshot.cells if name == "tetra"]
    cells = np.concatenate(blocks).astype(np.int64) if blocks else np.empty((0, 4), np.int64)
    kept = np.flatnonzero(~torn(snapshot, cells))
    faces = cells[kept][:, _FACES].reshape(-1, 3)
    owner = np.repeat(kept, 4)
    key = _keys(np.sort(faces, axis=1), len(snapshot.points))
    _, first, count = np.unique(key, return_index=True, return_counts=True)
    chosen = first[count == 1]
    faces, owner = faces[chosen], owner[chosen]
    # Outwards: away from the corner of the tetrahedron that is not on the face.
    centre = snapshot.points[cells[owner]].mean(axis=1) if len(owner) else np.empty((0, 3))
    a, b, c = (snapshot.points[faces[:, k]] for k in range(3))
    inwards = (np.cross(b - a, c - a) * (a - centre)).sum(axis=1) < 0
    faces[inwards] = faces[inwards][:, ::-1]
    return Surface(faces, owner)


def _keys(faces: IntArray, n_nodes: int) -> NDArray[Any]:
    """One number for each sorted face."""
    if n_nodes < 2**_BITS:
        return np.asarray((faces[:, 0] << 2 * _BITS) | (faces[:, 1] << _BITS) | faces[:, 2])
    return np.unique(faces, axis=0, return_inverse=True)[1].ravel()
