"""What a body is made of: nodal volumes, mesh size, centre node, neighbours and bonds."""

# ruff: noqa: N803 - symbols of the paper

from dataclasses import dataclass

import numpy as np

from .comparison import greater, less


def nodal_volumes(points, cells):
    """(31) V_i, the integral of phi_i: each corner of a simplex takes its equal part."""
    edges = points[cells[:, 1:]] - points[cells[:, :1]]
    d = edges.shape[1]
    gram = edges @ edges.transpose(0, 2, 1)
    size = np.sqrt(np.linalg.det(gram)) / {1: 1, 2: 2, 3: 6}[d]
    volumes = np.zeros(len(points))
    np.add.at(volumes, cells, (size / (d + 1))[:, None])
    return volumes


def distances(a, b):
    """|b_j - a_i|, shape (len(a), len(b))."""
    return np.linalg.norm(b[None, :, :] - a[:, None, :], axis=2)


def mesh_size(X, *, fuzzy):
    """(35) h, the smallest distance of two nodes; `fuzzy`: the original's running minimum."""
    i, j = np.triu_indices(len(X), k=1)
    return smallest(np.linalg.norm(X[j] - X[i], axis=1), fuzzy=fuzzy)


def smallest(values, *, fuzzy):
    """The minimum; `fuzzy`: replaced only by what is smaller by more than the tolerance."""
    if not fuzzy:
        return min(values)
    found = np.inf
    for value in values:
        if not np.isfinite(found) or less(value, found):
            found = value
    return found


def center_node(points, center, radius, *, fuzzy):
    """Node nearest to the centre of the shape and nearer than the radius, else node 0."""
    node, nearest = 0, radius
    for i, distance in enumerate(np.linalg.norm(points - center, axis=1)):
        if less(distance, nearest) if fuzzy else distance < nearest:
            node, nearest = i, distance
    return node


@dataclass(frozen=True)
class Bonds:
    """Directed bonds of a body, ascending: from node i to node j (numbers in the body)."""

    i: np.ndarray
    j: np.ndarray
    r: np.ndarray  # |X_j - X_i| [m]
    w: np.ndarray  # J(r / eps) V_j, the part of V_j inside the horizon
    m: np.ndarray  # weighted volume of each node


def partial_volume(r, horizon, h):
    """Part of V_j inside the horizon: (eps + h/2 - r) / h near its edge."""
    return np.where(greater(r, horizon - h / 2), (horizon + h / 2 - r) / h, 1.0)


def make_bonds(X, V, horizon, h, influence):
    """Neighbours are the nodes with dx^2 + dy^2 + dz^2 < eps^2, strictly."""
    dx, dy, dz = (X[None, :, d] - X[:, None, d] for d in range(3))
    near = dx * dx + dy * dy + dz * dz < horizon * horizon
    np.fill_diagonal(near, val=False)
    i, j = np.nonzero(near)
    r = np.linalg.norm(X[j] - X[i], axis=1)
    w = influence(r / horizon) * V[j] * partial_volume(r, horizon, h)
    return Bonds(i, j, r, w, m=sum_at(i, r**2 * w, len(X)))  # (34) m = sum of r^2 J V_j


def sum_at(i, values, n):
    """Sum values over the bonds of each node."""
    total = np.zeros((n, *np.shape(values)[1:]))
    np.add.at(total, i, values)
    return total
