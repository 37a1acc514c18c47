"""Grains that fall into a container and come to rest on each other."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..geometry.base import FloatArray
from .arguments import checked_names, generator, integer, number, vector
from .domains import domain_of
from .filling import mover_of, radii_of
from .insertion import insert
from .placing import made
from .recipe import Grains, Recipe
from .regions import Region, region_of
from .relaxation import Mover, Outcome, separate, settle
from .result import Packing

_FALL = 0.25
"""Speed of falling grains, in mean radii per unit of time."""
_POURING, _RESTING = (4e-3, 1.0), (8e-4, 0.25)
"""Weight, in mean radii (how far a spring yields), and how far grains may sink yet and rest."""
_STEPS = 3000
_MOST_LOADS = 60


@checked_names
def poured(
    shapes: Any,
    domain: Any,
    *,
    count: int | None = None,
    sizes: Any = None,
    weights: Any = None,
    gap: float = 0.0,
    gravity: ArrayLike | None = None,
    angles: float | str = "random",
    measure: str = "bounding",
    seed: int = 0,
    effort: float = 1.0,
) -> Packing:
    """Pour grains into a container, load after load, until it holds them or is full.

    Each load is put at random into the free space, then sinks along gravity, sliding and turning,
    until it rests on what lies below. There is no friction: heaps are as flat and dense as they
    get. At the end overlaps left by the weight are removed, so grains nearly touch.

    Parameters
    ----------
    shapes, sizes, weights, gap, angles, measure, seed, effort
        See `random`.
    domain : shape or two corners
        The container, closed on all sides.
    count : int, optional
        Number of grains; by default as many as go in.
    gravity : array_like, optional
        Direction of the fall; by default -y in the plane, -z in 3D.

    Returns
    -------
    Packing
        In the order in which they were poured. The porosity is that of the whole container: cut
        out the heap to know its own.

    Raises
    ------
    InputError
        If an argument is wrong or the container is too small.
    """
    recipe = Recipe("poured", shapes, sizes, weights, measure, angles)
    shape = domain_of("poured", domain)
    recipe.check_domain(shape)
    region = region_of(shape)
    gap = number("poured", "gap", gap, least=0)
    effort = number("poured", "effort", effort, above=0)
    down = _down(recipe.dimension, gravity)
    rng = generator("poured", seed)
    if count is None:
        grains = recipe.draw_volume(region.measure, rng)
    else:
        grains = recipe.draw(integer("poured", "count", count), rng)
    grains, centers = _pour(recipe, grains, region, gap, down, rng, effort)
    if count is not None and len(centers) < count:
        raise InputError(
            f"poured: count = {count}: the container is full with {len(centers)} grains; give a "
            "larger domain or fewer grains, or leave count out"
        )
    return made(recipe, grains, centers, region.measure, shape)


def _down(dimension: int, gravity: ArrayLike | None) -> FloatArray:
    if gravity is None:
        gravity = (0.0,) * (dimension - 1) + (-1.0,)
    if np.size(gravity) == 3 and dimension == 2:
        gravity = np.ravel(gravity)[:2]
    if np.size(gravity) != dimension:
        raise InputError(
            f"poured: gravity = {gravity!r}: must be {dimension} numbers; give a direction such as "
            f"{(0.0,) * (dimension - 1) + (-1.0,)}"
        )
    down = vector("poured", "gravity", gravity, dimension)
    length = float(np.linalg.norm(down))
    if length == 0.0:
        raise InputError("poured: gravity = 0: must have a direction; give for instance (0, -1)")
    return np.asarray(down / length)


def _pour(
    recipe: Recipe,
    grains: Grains,
    region: Region,
    gap: float,
    down: FloatArray,
    rng: np.random.Generator,
    effort: float,
) -> tuple[Grains, FloatArray]:
    """Pour load after load; return the grains that found a place, in order, and their centres."""
    radii = radii_of(recipe, grains)
    order = np.empty(0, dtype=np.intp)
    centers = np.empty((0, region.dimension))
    waiting = np.arange(len(radii))
    steps = int(_STEPS * effort)
    for _ in range(_MOST_LOADS):
        # half of what the free space may take at random, so that none waits for being large
        free = region.measure - float((recipe.volumes[grains.index[order]]
                                       * grains.scales[order] ** recipe.dimension).sum())  # fmt: skip
        share = np.cumsum(recipe.volumes[grains.index[waiting]]
                          * grains.scales[waiting] ** recipe.dimension)  # fmt: skip
        load = waiting[: max(1, int(np.searchsorted(share, 0.3 * free)))]
        places = insert(rng, region, radii[load], gap, centers, radii[order])
        found = ~np.isnan(places[:, 0])
        if not found.any():
            break
        order = np.concatenate([order, load[found]])
        centers = np.vstack([centers, places[found]])
        waiting = np.setdiff1d(waiting, order)
        grains, centers = _sunk(recipe, grains, order, centers, region, gap, down, _POURING, steps, rng)
        if len(waiting) == 0:
            break
    grains, centers = _sunk(recipe, grains, order, centers, region, gap, down, _RESTING, steps, rng)
    return _taken(grains, order), centers


def _taken(grains: Grains, order: np.ndarray[Any, Any]) -> Grains:
    return Grains(
        grains.index[order], grains.scales[order], grains.angles[order], grains.axes[order]
    )


def _sunk(
    recipe: Recipe,
    grains: Grains,
    order: np.ndarray[Any, Any],
    centers: FloatArray,
    region: Region,
    gap: float,
    down: FloatArray,
    load: tuple[float, float],
    steps: int,
    rng: np.random.Generator,
) -> tuple[Grains, FloatArray]:
    """Let what is placed sink, then remove overlaps."""
    mover = mover_of(recipe, _taken(grains, order), centers, region, gap)
    weight, rest = load
    settle(mover, weight * mover.scale * down, _FALL * mover.scale, steps, rest=rest)
    outcome = separate(mover, steps, rng)
    _check(outcome, mover)
    n = len(order)
    if recipe.dimension == 2:
        angles = grains.angles.copy()
        angles[order] = mover.grains.angle[:n] % (2.0 * np.pi)
        grains = replace(grains, angles=angles)
    return grains, mover.grains.center[:n]


def _check(outcome: Outcome, mover: Mover) -> None:
    if outcome.worst > 0.0:
        raise InputError(
            f"poured: {mover.moving} grains: {outcome.count} overlap still by up to "
            f"{outcome.worst:.3g} m after {outcome.steps} steps; give a larger domain, fewer "
            "grains or effort = 3"
        )
