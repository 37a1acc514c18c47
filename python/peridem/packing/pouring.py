"""Grains that fall into a container and come to rest on each other."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError
from ..geometry.base import FloatArray
from .arguments import checked_names, generator, integer, number, vector
from .domains import domain_of
from .filling import mover_of, radii_of
from .insertion import insert
from .pairs import IndexArray
from .placing import made
from .recipe import Grains, Recipe
from .regions import Region, region_of
from .relaxation import separate, settle
from .result import Packing

_FALL = 0.4
"""Speed of falling grains, in mean radii per unit of time."""
_POURING, _RESTING = (4e-3, 1.0), (8e-4, 0.25)
"""Weight, in mean radii (how far a spring yields), and how far grains may sink yet and rest."""
_STEPS = 3000
_LOAD, _MOST_LOADS = 0.4, 40
"""Part of the free space that a load fills, and how many loads there may be."""
_FULL = 0.005
"""A container is full when a load brings less than this part of the grains."""


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
    recipe = Recipe("poured", shapes, sizes=sizes, weights=weights, measure=measure, angles=angles)
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
    pour = _Pour(recipe, region, gap, down, rng, int(_STEPS * effort))
    grains, centers = pour.all_of(grains)
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


@dataclass(frozen=True)
class _Pour:
    """What stays the same from load to load."""

    recipe: Recipe
    region: Region
    gap: float
    down: FloatArray
    rng: np.random.Generator
    steps: int

    def all_of(self, grains: Grains) -> tuple[Grains, FloatArray]:
        """Return the grains that found a place, in order, and their centres."""
        radii = radii_of(self.recipe, grains)
        volumes = self.recipe.volumes[grains.index] * grains.scales**self.recipe.dimension
        order, waiting = np.empty(0, dtype=np.intp), np.arange(len(radii))
        centers = np.empty((0, self.region.dimension))
        for _ in range(_MOST_LOADS):
            # less than the free space can take at random, so that large grains find a place too
            free = self.region.measure - float(volumes[order].sum())
            room = int(np.searchsorted(np.cumsum(volumes[waiting]), _LOAD * free))
            load = waiting[: max(1, room)]
            places = insert(
                self.rng, self.region, radii[load], gap=self.gap, placed=centers,
                placed_radii=radii[order],
            )  # fmt: skip
            found = ~np.isnan(places[:, 0])
            if not found.any():
                break
            order = np.concatenate([order, load[found]])
            centers = np.vstack([centers, places[found]])
            waiting = np.setdiff1d(waiting, order)
            grains, centers = self.sunk(grains, order, centers, _POURING)
            if len(waiting) == 0 or found.sum() < _FULL * len(order):
                break
        if len(order) == 0:
            return _taken(grains, order), centers
        grains, centers = self.sunk(grains, order, centers, _RESTING)
        return self._apart(_taken(grains, order), centers)

    def _apart(self, grains: Grains, centers: FloatArray) -> tuple[Grains, FloatArray]:
        """Remove overlaps; what was pressed into a full container comes out again, last first."""
        for _ in range(_MOST_LOADS):
            mover = mover_of(self.recipe, grains, centers, self.region, self.gap)
            outcome = separate(mover, self.steps, self.rng)
            n = len(centers)
            if outcome.worst <= 0.0:
                turned = mover.grains.angle[:n] % (2.0 * np.pi)
                angles = turned if self.recipe.dimension == 2 else grains.angles
                return replace(grains, angles=angles), mover.grains.center[:n]
            kept = np.arange(n - max(1, n // 50))
            grains, centers = _taken(grains, kept), mover.grains.center[kept]
        return _taken(grains, kept[:0]), centers[:0]

    def sunk(
        self, grains: Grains, order: IndexArray, centers: FloatArray, load: tuple[float, float]
    ) -> tuple[Grains, FloatArray]:
        """Let what is placed sink."""
        mover = mover_of(self.recipe, _taken(grains, order), centers, self.region, self.gap)
        weight, rest = load
        settle(mover, weight * mover.scale * self.down, _FALL * mover.scale, self.steps, rest=rest)
        n = len(order)
        if self.recipe.dimension == 2:
            angles = grains.angles.copy()
            angles[order] = mover.grains.angle[:n] % (2.0 * np.pi)
            grains = replace(grains, angles=angles)
        return grains, mover.grains.center[:n]


def _taken(grains: Grains, order: IndexArray) -> Grains:
    return Grains(
        grains.index[order], grains.scales[order], grains.angles[order], grains.axes[order]
    )
