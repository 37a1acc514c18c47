"""Details smaller than the mesh size: nodes that lie too close are made one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from .quality import simplex_quality
from .thin import edges_of, outer_faces

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

SHORT = 0.4
"""Edges shorter than this times the local node distance are collapsed."""

SHORTEST = 0.25
"""Edges shorter than this times the largest node distance are collapsed, thin places or not."""

_PASSES = 5
_GOOD = 0.15  # quality that elements around a collapsed edge keep, or half of what they had


def collapse_short_edges(
    points: FloatArray, cells: IntArray, size: Callable[[FloatArray], FloatArray]
) -> tuple[FloatArray, IntArray]:
    """Make one node of two that lie too close, as at corners of a body nearer than the mesh size.

    One such pair would set contact radius, mesh size and time step of a whole run. The outline
    moves by less than `SHORT` node distances there. Edges whose collapse would spoil elements
    or join two sides of the body stay.

    Parameters
    ----------
    points : ndarray, shape (n, 3)
        Nodes [m].
    cells : ndarray of int, shape (m, k)
        Triangles or tetrahedra.
    size : callable
        Wanted node distance [m] at given points.

    Returns
    -------
    points, cells
        Without the nodes and elements that vanished.
    """
    for _ in range(_PASSES):
        collapsed = _one_pass(points, cells, size)
        if collapsed is None:
            break
        points, cells = collapsed
    return points, cells


def _one_pass(
    points: FloatArray, cells: IntArray, size: Callable[[FloatArray], FloatArray]
) -> tuple[FloatArray, IntArray] | None:
    """Collapse short edges that do not touch each other; None if there is nothing to do."""
    edges = edges_of(cells)
    length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    wanted = size(0.5 * (points[edges[:, 0]] + points[edges[:, 1]]))
    short = np.flatnonzero(length < np.maximum(SHORT * wanted, SHORTEST * wanted.max()))
    if not len(short):
        return None
    points = points.copy()
    faces, _ = outer_faces(points, cells)
    on_boundary = np.zeros(len(points), dtype=bool)
    on_boundary[faces.ravel()] = True
    sides = {tuple(edge) for edge in np.sort(_face_edges(faces), axis=1).tolist()}
    touched = np.zeros(len(points), dtype=bool)
    replaced = np.arange(len(points))
    for k in short[np.argsort(length[short], kind="stable")]:
        a, b = (int(node) for node in edges[k])
        around = np.flatnonzero(((cells == a) | (cells == b)).any(axis=1))
        if touched[cells[around]].any() or (
            on_boundary[[a, b]].all() and (a, b) not in sides  # would join two sides
        ):
            continue
        place = _place(points, cells[around], a, b, on_boundary)
        if place is None:
            continue
        points[a], replaced[b] = place, a
        touched[cells[around]] = True
    if not touched.any():
        return None
    cells = replaced[cells]
    ordered = np.sort(cells, axis=1)
    cells = cells[(ordered[:, 1:] != ordered[:, :-1]).all(axis=1)]
    used = np.unique(cells)
    return points[used], np.searchsorted(used, cells)


def _face_edges(faces: IntArray) -> IntArray:
    if faces.shape[1] == 2:
        return faces
    return np.vstack([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def _place(
    points: FloatArray, around: IntArray, a: int, b: int, on_boundary: NDArray[np.bool_]
) -> FloatArray | None:
    """Place of the node that two become that changes the body least; None if all spoil elements."""
    has_a, has_b = (around == a).any(axis=1), (around == b).any(axis=1)
    both = has_a & has_b
    shared = set(np.unique(around[has_a])) & set(np.unique(around[has_b]))
    if shared != set(np.unique(around[both])):
        return None  # the edge closes a ring of elements, which would be pinched off
    if on_boundary[a] == on_boundary[b]:
        places = [points[a], points[b], 0.5 * (points[a] + points[b])]
    else:
        places = [points[a] if on_boundary[a] else points[b]]
    rest = around[~both]
    before = simplex_quality(points[rest])
    limit = min(_GOOD, 0.5 * float(np.abs(before).min(initial=1.0)))
    least, found = np.inf, None
    for place in places:
        corner = points[rest].copy()
        corner[(rest == a) | (rest == b)] = place
        quality = float((simplex_quality(corner) * np.sign(before)).min(initial=1.0))
        lost = abs(_volume(corner) - _volume(points[around]))
        if quality > limit and lost < least:  # corners and edges of the body stay
            least, found = lost, place.copy()
    return found


def _volume(corner: FloatArray) -> float:
    """Area or volume of elements, up to a factor."""
    arms = corner[:, 1:] - corner[:, :1]
    cross = np.cross(arms[:, 0], arms[:, 1])
    if corner.shape[1] == 3:
        return float(np.abs(cross[:, 2]).sum())
    return float(np.abs(np.einsum("ij,ij->i", cross, arms[:, 2])).sum())
