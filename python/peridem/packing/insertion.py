"""Random sequential insertion: balls that overlap none of those before, the large ones first."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from ..geometry.base import FloatArray
from .pairs import IndexArray
from .regions import Region

_BLOCK = 64


def insert(
    rng: np.random.Generator,
    region: Region,
    radii: FloatArray,
    *,
    gap: float,
    placed: FloatArray,
    placed_radii: FloatArray,
    tries: int = 40,
) -> FloatArray:
    """Find places for balls among others.

    Parameters
    ----------
    rng : Generator
    region : Region
        Where they must lie, `gap` from its walls.
    radii : ndarray, shape (n,)
        Radii [m] of the new balls.
    gap : float
        Smallest distance [m].
    placed, placed_radii : ndarray, shape (m, d) and (m,)
        Those already there [m].
    tries : int
        Random places asked for each.

    Returns
    -------
    ndarray, shape (n, d)
        Centres [m]; NaN where none was found.
    """
    order = np.argsort(-radii, kind="stable")
    centers = np.full((len(radii), region.dimension), np.nan)
    for start in range(0, len(radii), _BLOCK):
        block = order[start : start + _BLOCK]
        _insert_block(
            rng,
            region,
            block,
            radii=radii,
            gap=gap,
            placed=placed,
            placed_radii=placed_radii,
            centers=centers,
            tries=tries,
        )
        done = block[~np.isnan(centers[block, 0])]
        placed = np.vstack([placed, centers[done]])
        placed_radii = np.concatenate([placed_radii, radii[done]])
    return centers


def _insert_block(
    rng: np.random.Generator,
    region: Region,
    block: IndexArray,
    *,
    radii: FloatArray,
    gap: float,
    placed: FloatArray,
    placed_radii: FloatArray,
    centers: FloatArray,
    tries: int,
) -> None:
    """Place a block of balls: places free of what was there, then free of each other."""
    asked = region.sample(rng, len(block) * tries)
    if len(asked) < len(block) * tries:
        return
    of = np.repeat(block, tries)
    depth, _ = region.push(asked, radii[of] + gap)
    free = depth <= 0.0
    if len(placed):
        reach = radii[block].max() + placed_radii.max() + gap
        near = cKDTree(asked).sparse_distance_matrix(cKDTree(placed), reach, output_type="ndarray")
        hit = near["v"] < radii[of][near["i"]] + placed_radii[near["j"]] + gap
        free[near["i"][hit]] = False
    done: list[int] = []
    for k, ball in enumerate(block):
        own = asked[k * tries : (k + 1) * tries][free[k * tries : (k + 1) * tries]]
        if len(own) and done:
            distance = np.linalg.norm(own[:, None] - centers[done], axis=2)
            own = own[(distance >= radii[ball] + radii[done] + gap).all(axis=1)]
        if len(own):
            centers[ball] = own[0]
            done.append(int(ball))
