"""Closed surfaces of triangles or polygons: merging, orientation, what is wrong with them."""

from __future__ import annotations

import itertools
from collections import deque
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..geometry.base import FloatArray

IntArray = NDArray[np.int64]
Faces = tuple[tuple[int, ...], ...]

_FLAT = 1e-6  # of the size of the body


def merged(
    points: FloatArray, triangles: IntArray, tolerance: float
) -> tuple[FloatArray, IntArray]:
    """Make one point of those that lie within `tolerance` [m]; drop triangles without area."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    pairs = cKDTree(points).query_pairs(tolerance, output_type="ndarray")
    n = len(points)
    links = coo_matrix((np.ones(len(pairs), dtype=bool), (pairs[:, 0], pairs[:, 1])), (n, n))
    _, group = connected_components(links, directed=False)
    _, first, place = np.unique(group, return_index=True, return_inverse=True)
    order = np.argsort(np.argsort(first))  # numbered as they first occur
    kept = np.sort(first)
    numbers = order[place][triangles]
    a, b, c = numbers.T
    proper = numbers[(a != b) & (b != c) & (c != a)]
    return points[kept], proper.astype(np.int64)


def directed_edges(faces: Faces) -> tuple[IntArray, IntArray]:
    """Return the edges of all faces, shape (k, 2), in their sense, and the face of each."""
    edges = [(i, j) for face in faces for i, j in zip(face, (*face[1:], face[0]), strict=True)]
    owner = np.repeat(np.arange(len(faces)), [len(face) for face in faces])
    return np.array(edges, dtype=np.int64).reshape(-1, 2), owner


def check_closed(where: str, faces: Faces, points: FloatArray) -> None:
    """Raise InputError unless every edge belongs to exactly two faces."""
    edges, _ = directed_edges(faces)
    pairs, count = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    single, many = np.flatnonzero(count == 1), np.flatnonzero(count > 2)
    if len(single):
        i, j = pairs[single[0]].tolist()
        raise InputError(
            f"{where}: the surface is open: {len(single)} edges belong to one face only, the "
            f"first from {_shown(points[i])} to {_shown(points[j])}: a solid needs a closed "
            "surface; close the hole (in MeshLab: Close Holes), or merge points that are apart"
        )
    if len(many):
        i, j = pairs[many[0]].tolist()
        raise InputError(
            f"{where}: {len(many)} edges belong to more than two faces, the first from "
            f"{_shown(points[i])} to {_shown(points[j])}: must be two; remove inner or double "
            "faces"
        )


def check_oriented(where: str, faces: Faces, points: FloatArray) -> None:
    """Raise InputError unless neighbouring faces agree on inside and outside."""
    edges, _ = directed_edges(faces)
    pairs, count = np.unique(edges, axis=0, return_counts=True)
    twice = np.flatnonzero(count > 1)
    if len(twice):
        i, j = pairs[twice[0]].tolist()
        raise InputError(
            f"{where}: the surface is not oriented: {len(twice)} edges are passed twice in the "
            f"same sense, the first from {_shown(points[i])} to {_shown(points[j])}: neighbouring "
            "faces must agree on the outside; orient it (in MeshLab: Re-Orient All Faces "
            "Coherently)"
        )


def oriented(faces: Faces) -> Faces:
    """Turn faces of a closed surface so that neighbours agree, starting from the first."""
    edges, owner = directed_edges(faces)
    neighbours: dict[tuple[int, int], list[tuple[int, bool]]] = {}
    for (i, j), face in zip(edges.tolist(), owner.tolist(), strict=True):
        neighbours.setdefault((min(i, j), max(i, j)), []).append((face, i < j))
    links: list[list[tuple[int, bool]]] = [[] for _ in faces]
    for (a, a_up), (b, b_up) in neighbours.values():
        links[a].append((b, a_up == b_up))
        links[b].append((a, a_up == b_up))
    turned: dict[int, bool] = {}
    for start in range(len(faces)):  # every separate piece on its own
        if start in turned:
            continue
        turned[start] = False
        queue = deque([start])
        while queue:
            face = queue.popleft()
            for other, differs in links[face]:
                if other not in turned:
                    turned[other] = turned[face] ^ differs
                    queue.append(other)
    return tuple(face[::-1] if turned[k] else face for k, face in enumerate(faces))


def triangulated(points: FloatArray, faces: Faces) -> IntArray:
    """Cut plane polygons into triangles, in their sense."""
    if all(len(face) == 3 for face in faces):
        return np.array(faces, dtype=np.int64)
    return np.array([t for face in faces for t in _clipped(points, face)], dtype=np.int64)


def _clipped(points: FloatArray, face: tuple[int, ...]) -> list[tuple[int, int, int]]:
    """Cut ears off a plane polygon until nothing is left."""
    corners, normal = list(face), normal_of(points[list(face)])
    found: list[tuple[int, int, int]] = []
    while len(corners) > 3:
        for k in range(len(corners)):
            i, j, m = corners[k - 1], corners[k], corners[(k + 1) % len(corners)]
            rest = [other for other in corners if other not in (i, j, m)]
            if _is_ear(points[[i, j, m]], points[rest], normal):
                found.append((i, j, m))
                del corners[k]
                break
        else:  # crossed or flat; what is left is checked by its volume
            found += [(corners[0], a, b) for a, b in itertools.pairwise(corners[1:])]
            return found
    found.append((corners[0], corners[1], corners[2]))
    return found


def _is_ear(triangle: FloatArray, others: FloatArray, normal: FloatArray) -> bool:
    sides = np.roll(triangle, -1, axis=0) - triangle
    if not np.cross(sides[0], sides[1]) @ normal > 0.0:
        return False
    if not len(others):
        return True
    left = [
        np.cross(side, others - corner) @ normal
        for side, corner in zip(sides, triangle, strict=True)
    ]
    return not bool((np.array(left) >= 0.0).all(axis=0).any())


def normal_of(loop: FloatArray) -> FloatArray:
    """Return the area vector of a closed loop of corners, shape (k, 3) [m^2]."""
    spokes = loop - loop.mean(axis=0)
    return np.asarray(0.5 * np.cross(spokes, np.roll(spokes, -1, axis=0)).sum(axis=0))


def check_plane(where: str, points: FloatArray, faces: Faces) -> None:
    """Raise InputError for a face without area or whose corners are not in one plane."""
    size = float(np.ptp(points, axis=0).max())
    for k, face in enumerate(faces):
        loop = points[list(face)]
        normal = normal_of(loop)
        area = float(np.linalg.norm(normal))
        if not area > _FLAT**2 * size**2:
            raise InputError(f"{where}: faces[{k}] = {face}: has no area; leave it out")
        off = np.abs((loop - loop.mean(axis=0)) @ (normal / area)).max()
        if off > _FLAT * size:
            raise InputError(
                f"{where}: faces[{k}] = {face}: its corners are up to {off:.2g} m off a plane: "
                "must be plane; cut it into triangles"
            )


def faces_of(where: str, faces: Sequence[Sequence[int]], n_points: int) -> Faces:
    """Return faces as tuples of different existing corners.

    Raises
    ------
    InputError
        If a face has fewer than three corners, one twice or one that does not exist.
    """
    result: list[tuple[int, ...]] = []
    for k, face in enumerate(faces):
        try:
            corners = tuple(int(corner) for corner in face)
            whole = all(a == b for a, b in zip(corners, face, strict=True))
        except (TypeError, ValueError):
            whole, corners = False, ()
        rule = ""
        if not whole:
            rule = "must be a list of corner numbers"
        elif len(corners) < 3 or len(set(corners)) < len(corners):
            rule = "must have at least three corners, each once"
        elif not all(0 <= corner < n_points for corner in corners):
            rule = f"names a point that does not exist: there are {n_points}, counted from 0"
        if rule:
            raise InputError(f"{where}: faces[{k}] = {face!r:.60}: {rule}; correct the face")
        result.append(corners)
    if not result:
        raise InputError(f"{where}: has no faces; give those of a closed surface")
    return tuple(result)


def _shown(point: FloatArray) -> str:
    return "(" + ", ".join(f"{x:.6g}" for x in point) + ")"
