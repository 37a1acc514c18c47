"""Random packings: insertion, then moving apart what overlaps."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import InputError
from ..geometry.base import FloatArray
from .arguments import checked_names, generator, integer, number
from .assembly import Assembly
from .domains import domain_of
from .insertion import insert
from .outlines import Outline
from .placing import made
from .recipe import Grains, Recipe
from .regions import Region, region_of
from .relaxation import Mover, Outcome, separate
from .result import Packing

_STEPS = 3000


@checked_names
def random(
    shapes: Any,
    domain: Any,
    *,
    count: int | None = None,
    porosity: float | None = None,
    sizes: Any = None,
    weights: Any = None,
    gap: float = 0.0,
    angles: float | str = "random",
    measure: str = "bounding",
    seed: int = 0,
    effort: float = 1.0,
) -> Packing:
    """Pack grains at random places, none overlapping.

    Grains are put at random places, the large ones first, as long as free places are found. The
    rest is put anywhere, and all are moved and turned until nothing overlaps. Sizes and shapes
    are fixed before, so they do not depend on how dense the packing is.

    Parameters
    ----------
    shapes : shape or sequence of shapes
        Plane or solid: anything with a ``geometry``.
    domain : shape or two corners
        Where to pack: any shape of the dimension of the grains, `Hopper`, or two corners of a
        rectangle or box [m]. Grains lie wholly inside.
    count : int, optional
        Number of grains; this or `porosity`.
    porosity : float, optional
        Part of the domain to leave free; met to about one grain.
    sizes : float or distribution, optional
        `Constant`, `Uniform`, `Normal`, `LogNormal`, `Grading`; by default shapes as they are.
    weights : sequence of float, optional
        How often each shape is taken, by number; equal by default.
    gap : float
        Smallest distance [m] between grains and from the walls. In a model it should be the
        contact radius, or the mesh size, which is a little more: grains that touch are refused.
    angles : float or "random"
        Angle [rad] at first (grains that are no discs turn while moved apart), or any.
    measure : {"bounding", "equivalent", "leading", "scale"}
        What a size is: the radius that encloses the grain, the radius of the circle or sphere of
        its area or volume, its leading length (``r`` of a deck), or the factor on the shape.
    seed : int
        Of the random numbers; the same seed gives the same packing.
    effort : float
        Factor on the steps spent on moving grains apart (3000).

    Returns
    -------
    Packing

    Raises
    ------
    InputError
        If an argument is wrong, or the grains could not be brought into the domain; the text
        says how much still overlapped.

    Notes
    -----
    In 3D grains are kept apart by the balls that enclose them.
    """
    recipe = Recipe("random", shapes, sizes=sizes, weights=weights, measure=measure, angles=angles)
    shape = domain_of("random", domain)
    recipe.check_domain(shape)
    region = region_of(shape)
    gap = number("random", "gap", gap, least=0)
    effort = number("random", "effort", effort, above=0)
    rng = generator("random", seed)
    grains = _drawn(recipe, region, count, porosity, rng)
    _check_room(recipe, grains, region)
    radii = radii_of(recipe, grains)
    nothing = np.empty((0, region.dimension))
    centers = insert(rng, region, radii, gap=gap, placed=nothing, placed_radii=np.empty(0))
    homeless = np.isnan(centers[:, 0])
    if homeless.any():
        centers[homeless] = region.sample(rng, int(homeless.sum()))
        mover = mover_of(recipe, grains, centers, region, gap)
        outcome = separate(mover, int(_STEPS * effort), rng)
        n = len(grains.scales)
        grains = replace(grains, angles=_angles(recipe, mover, n, grains))
        centers = mover.grains.center[:n]
        _check_outcome(recipe, grains, region, outcome)
    return made(recipe, grains, centers, region.measure, shape)


def _drawn(
    recipe: Recipe,
    region: Region,
    count: int | None,
    porosity: float | None,
    rng: np.random.Generator,
) -> Grains:
    if (count is None) == (porosity is None):
        raise InputError(
            f"random: count = {count}, porosity = {porosity}: must give one of them; remove or "
            "add one"
        )
    if count is not None:
        return recipe.draw(integer("random", "count", count), rng)
    remedy = "0.2 to 0.6 is common"
    free = number("random", "porosity", porosity, above=0, below=1, remedy=remedy)
    return recipe.draw_volume((1.0 - free) * region.measure, rng)


def radii_of(recipe: Recipe, grains: Grains) -> FloatArray:
    """Return the radii [m] that enclose the grains about their centres."""
    return np.array([outline.radius for outline in recipe.outlines])[grains.index] * grains.scales


def mover_of(
    recipe: Recipe, grains: Grains, centers: FloatArray, region: Region, gap: float
) -> Mover:
    """Return the grains between the walls; corners of the domain stand as fixed points."""
    corners = region.corners
    point = Outline(recipe.geometries[0], np.zeros(2), 0.0, ())
    outlines = [*recipe.outlines, point]
    extra = len(corners)
    assembly = Assembly(
        outlines,
        np.concatenate([grains.index, np.full(extra, len(outlines) - 1)]).astype(np.intp),
        np.concatenate([grains.scales, np.ones(extra)]),
        np.vstack([centers, corners]),
        np.concatenate([grains.angles, np.zeros(extra)]),
    )
    return Mover(assembly, region, gap, fixed=extra)


def _angles(recipe: Recipe, mover: Mover, n: int, grains: Grains) -> FloatArray:
    return grains.angles if recipe.dimension == 3 else mover.grains.angle[:n] % (2.0 * np.pi)


def _check_room(recipe: Recipe, grains: Grains, region: Region) -> None:
    """Refuse what cannot be: more grains than space."""
    filled = recipe.volumes[grains.index] * grains.scales**recipe.dimension
    part = float(filled.sum()) / region.measure
    if part >= 1.0:
        raise InputError(
            f"random: {len(filled)} grains fill {part:.3g} times the domain: must be below 1; "
            "give fewer or smaller grains"
        )


def _check_outcome(recipe: Recipe, grains: Grains, region: Region, outcome: Outcome) -> None:
    if outcome.worst <= 0.0:
        return
    filled = recipe.volumes[grains.index] * grains.scales**recipe.dimension
    porosity = 1.0 - float(filled.sum()) / region.measure
    raise InputError(
        f"random: {len(filled)} grains at porosity {porosity:.3f}: no packing without overlap was "
        f"found, after {outcome.steps} steps {outcome.count} grains overlap by up to "
        f"{outcome.worst:.3g} m; ask for a higher porosity or fewer grains, or give effort = 3 "
        "(docs/packing.md tells which porosities can be reached)"
    )
