"""Pairs of balls near each other, for sizes that may differ widely."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from ..geometry.base import FloatArray

IndexArray = NDArray[np.intp]


def near_pairs(
    centers: FloatArray, radii: FloatArray, reach: float
) -> tuple[IndexArray, IndexArray]:
    """Return the pairs of balls whose surfaces are at most `reach` apart.

    Parameters
    ----------
    centers : ndarray, shape (n, d)
        Centres [m].
    radii : ndarray, shape (n,)
        Radii [m].
    reach : float
        Largest distance [m] of the surfaces.

    Returns
    -------
    i, j : ndarray of int
        The pairs with i < j, sorted.
    """
    # a tree for each octave of sizes, so that small balls are not asked over large distances
    octave = np.floor(np.log2(np.maximum(radii, 1e-300))).astype(int)
    classes = [np.flatnonzero(octave == level) for level in np.unique(octave)]
    trees = [cKDTree(centers[members]) for members in classes]
    found: list[NDArray[Any]] = []
    for a, members in enumerate(classes):
        far = 2.0 * radii[members].max() + reach
        if far > 0.0:
            found.append(members[trees[a].query_pairs(far, output_type="ndarray")])
        for b in range(a + 1, len(classes)):
            far = radii[members].max() + radii[classes[b]].max() + reach
            near = trees[a].sparse_distance_matrix(trees[b], far, output_type="ndarray")
            found.append(np.column_stack([members[near["i"]], classes[b][near["j"]]]))
    pairs = np.sort(np.vstack([np.empty((0, 2), dtype=np.intp), *found]), axis=1)
    i, j = pairs.T
    distance = np.sqrt(((centers[i] - centers[j]) ** 2).sum(axis=1))
    i, j = pairs[distance <= radii[i] + radii[j] + reach].T
    order = np.lexsort((j, i))
    return i[order], j[order]
