"""Grains on lattices: rectangular grids, rows, hexagonal packings."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely

from ..errors import InputError
from ..geometry import Shape
from ..geometry.base import FloatArray
from ..geometry.primitives import Box, Polygon
from .arguments import checked_names, choice, generator, integer, number, vector
from .domains import domain_of
from .placing import kept_inside, made
from .recipe import Grains, Recipe
from .regions import region_of
from .result import Packing


@checked_names
def grid(
    shapes: Any,
    *,
    cells: tuple[int, ...] | None = None,
    domain: Any = None,
    count: int | None = None,
    sizes: Any = None,
    weights: Any = None,
    spacing: float | tuple[float, ...] | None = None,
    gap: float = 0.0,
    perturbation: float | tuple[float, ...] = 0.0,
    layout: str = "uniform",
    angles: float | str = "random",
    measure: str = "bounding",
    seed: int = 0,
) -> Packing:
    """Place grains on a rectangular grid, each moved at random about its point.

    The compressive test of Jha et al. (2021) begins so: 502 discs and hexagons with radii uniform
    between 0.9 and 1.1 mm, moved along x only so that no columns form, turned at random.

    Parameters
    ----------
    shapes : shape or sequence of shapes
        Plane or solid.
    cells : tuple of int, optional
        Points of the grid along each axis; the first lies in the cell at the origin.
    domain : shape or two corners, optional
        Instead of `cells`: as many as fit, those that would stick out left away.
    count : int, optional
        Keep the first so many.
    sizes, weights, measure
        See `random`.
    spacing : float or tuple, optional
        Distance [m] of the points along each axis. By default grains cannot overlap: twice the
        largest radius, the gap and the perturbation.
    gap : float
        Smallest distance [m] between grains, for the default spacing and for rows. In a model it
        should be the contact radius, or the mesh size: grains that touch are refused.
    perturbation : float or tuple
        Largest move [m] along each axis.
    layout : {"uniform", "rows"}
        ``rows``, in the plane and with a domain: grains lie side by side, `gap` apart, in rows
        as high as their largest grain; the gap is widened by up to twice the perturbation. The
        decks of the original are made so.
    angles : float or "random"
        Angle [rad] of all grains, or all directions alike.
    seed : int
        Of the random numbers; the same seed gives the same packing.

    Returns
    -------
    Packing
        Its domain is that given, or the box of the cells.

    Raises
    ------
    InputError
        If an argument is wrong, or grains would overlap.
    """
    recipe = Recipe("grid", shapes, sizes=sizes, weights=weights, measure=measure, angles=angles)
    gap = number("grid", "gap", gap, least=0)
    shake = np.abs(vector("grid", "perturbation", perturbation, recipe.dimension))
    rng = generator("grid", seed)
    inside = _one_of("grid", cells, domain, recipe)
    if choice("grid", "layout", layout, ("uniform", "rows")) == "rows":
        if inside is None or recipe.dimension != 2 or spacing is not None:
            raise InputError(
                "grid: layout = 'rows': must have a plane domain and no spacing; give domain, gap"
            )
        return _rows(recipe, inside, count=count, gap=gap, shake=shake, rng=rng)
    largest = _largest_radius(recipe)
    default = 2.0 * (largest + shake) + gap
    pitch = default if spacing is None else vector("grid", "spacing", spacing, recipe.dimension)
    if not (pitch > 0.0).all():
        raise InputError(f"grid: spacing = {spacing}: must be positive; give lengths in m")
    if inside is None:
        numbers = np.array([integer("grid", "cells", c) for c in cells or ()])
        inside = _box_shape(np.zeros(recipe.dimension), numbers * pitch)
        low = np.zeros(recipe.dimension)
    else:
        lower, upper = region_of(inside).box
        numbers = np.maximum(np.floor((upper - lower) / pitch + 1e-9), 1).astype(int)
        low = 0.5 * (lower + upper) - 0.5 * numbers * pitch
    steps = np.stack(np.meshgrid(*[np.arange(m) for m in numbers], indexing="ij"), axis=-1)
    order = tuple(reversed(range(recipe.dimension)))
    points = (
        low
        + (steps.transpose(*order, recipe.dimension).reshape(-1, recipe.dimension) + 0.5) * pitch
    )
    return _on_points(
        recipe, points, shake, inside=inside, cut=domain is not None, count=count, rng=rng
    )


@checked_names
def hexagonal(
    shapes: Any,
    *,
    cells: tuple[int, ...] | None = None,
    domain: Any = None,
    count: int | None = None,
    sizes: Any = None,
    weights: Any = None,
    spacing: float | None = None,
    gap: float = 0.0,
    perturbation: float | tuple[float, ...] = 0.0,
    angles: float | str = "random",
    measure: str = "bounding",
    seed: int = 0,
) -> Packing:
    """Place grains on the densest lattice: hexagonal in the plane, close-packed layers in 3D.

    Equal discs that touch leave the porosity 1 - pi / (2 sqrt 3) = 0.0931, equal spheres
    1 - pi / (3 sqrt 2) = 0.2595.

    Parameters
    ----------
    shapes, count, sizes, weights, gap, perturbation, angles, measure, seed
        See `grid`.
    cells : tuple of int, optional
        Grains in a row, rows and, in 3D, layers. The domain is then that of the cells of the
        lattice, one around each grain.
    domain : shape or two corners, optional
        Instead of `cells`: as many as fit, beginning at its lowest corner.
    spacing : float, optional
        Distance [m] of neighbours on the lattice; by default no grains can overlap.

    Returns
    -------
    Packing

    Raises
    ------
    InputError
        If an argument is wrong, or grains would overlap.
    """
    recipe = Recipe(
        "hexagonal", shapes, sizes=sizes, weights=weights, measure=measure, angles=angles
    )
    gap = number("hexagonal", "gap", gap, least=0)
    shake = np.abs(vector("hexagonal", "perturbation", perturbation, recipe.dimension))
    rng = generator("hexagonal", seed)
    inside = _one_of("hexagonal", cells, domain, recipe)
    largest = _largest_radius(recipe)
    default = 2.0 * (largest + float(np.linalg.norm(shake))) + gap
    pitch = default if spacing is None else number("hexagonal", "spacing", spacing, above=0)
    heights = pitch * np.array([1.0, np.sqrt(0.75), np.sqrt(2.0 / 3.0)])[: recipe.dimension]
    if inside is None:
        numbers = np.array([integer("hexagonal", "cells", c) for c in cells or ()])
        points = _close_packed(numbers, pitch)
        packing = _on_points(recipe, points, shake, inside=None, cut=False, count=None, rng=rng)
        container = _cells_of(points, pitch) if recipe.dimension == 2 else None
        area = float(np.prod(numbers * heights))
        whole = made(recipe, _grains_of(packing), points_of(packing), area, container)
        return whole if count is None else whole.select(np.arange(len(whole)) < count)
    lower, upper = region_of(inside).box
    span = upper - lower - 2.0 * largest
    numbers = np.floor(span / heights + 1e-9).astype(int) + 1
    if (span < 0.0).any():
        raise InputError(
            f"hexagonal: domain: is narrower than a grain of radius {largest:g}: none fits; "
            "give a larger domain or smaller grains"
        )
    points = lower + largest + _close_packed(numbers + (1, 0, 0)[: recipe.dimension], pitch)
    return _on_points(recipe, points, shake, inside=inside, cut=True, count=count, rng=rng)


def _grains_of(packing: Packing) -> Grains:
    return Grains(packing.shape_index, packing.scales, packing.angles, packing.axes)


def points_of(packing: Packing) -> FloatArray:
    """Return the centres of the grains, shape (n, d) [m]."""
    from .overlaps import centers_of

    return centers_of(packing)[:, : packing.dimension]


def _one_of(where: str, cells: Any, domain: Any, recipe: Recipe) -> Shape | None:
    """Return the domain; ask that either it or cells are given."""
    if (cells is None) == (domain is None):
        raise InputError(
            f"{where}: cells = {cells}, domain = {domain}: must give one of them; remove or add one"
        )
    if domain is None:
        if np.ndim(cells) != 1 or len(cells) != recipe.dimension:
            raise InputError(
                f"{where}: cells = {cells!r}: must be {recipe.dimension} integers, one for each "
                "axis; correct it"
            )
        return None
    shape = domain_of(where, domain)
    recipe.check_domain(shape)
    return shape


def _largest_radius(recipe: Recipe) -> float:
    radii = np.array([outline.radius for outline in recipe.outlines])
    if recipe.sizes is None:
        return float(radii.max())
    size = float(recipe.sizes.quantile(np.array([1.0]), recipe.dimension)[0])
    return float((radii / recipe.lengths).max() * size)


def _on_points(
    recipe: Recipe,
    points: FloatArray,
    shake: FloatArray,
    *,
    inside: Shape | None,
    cut: bool,
    count: int | None,
    rng: np.random.Generator,
) -> Packing:
    """Place a grain on each point; leave out what is too many or (cut) sticks out."""
    grains = recipe.draw(len(points), rng)
    centers = points + shake * (2.0 * rng.random(points.shape) - 1.0)
    area = 1.0 if inside is None else region_of(inside).measure
    packing = made(recipe, grains, centers, area, inside)
    if cut:
        packing = packing.select(kept_inside(packing))
    if count is not None:
        wanted = integer(recipe.where, "count", count)
        if wanted > len(packing):
            raise InputError(
                f"{recipe.where}: count = {wanted}: only {len(packing)} grains fit; give more "
                "cells, a larger domain or less spacing"
            )
        packing = packing.select(np.arange(wanted))
    found = packing.overlaps()
    if len(found):
        first, second, depth = found.iloc[int(found.depth.argmax())]
        raise InputError(
            f"{recipe.where}: {len(found)} pairs of grains overlap, grains {int(first)} and "
            f"{int(second)} by {depth:.3g} m: must not; give more spacing or less perturbation"
        )
    return packing


def _rows(
    recipe: Recipe,
    inside: Shape,
    *,
    count: int | None,
    gap: float,
    shake: FloatArray,
    rng: np.random.Generator,
) -> Packing:
    """Lay grains side by side in rows, from below."""
    lower, upper = region_of(inside).box
    smallest = np.min([o.radius for o in recipe.outlines] / recipe.lengths)
    if recipe.sizes is not None:
        smallest *= float(recipe.sizes.quantile(np.array([0.0]), 2)[0])
    pitch = 2.0 * smallest + gap
    most = int(np.prod(np.floor((upper - lower) / pitch) + 1.0))
    if count is not None:
        most = integer("grid", "count", count)
    grains = recipe.draw(most, rng)
    radii = grains.scales * np.array([o.radius for o in recipe.outlines])[grains.index]
    free = 2.0 * shake * rng.random((most, 2))
    points = np.full((most, 2), np.nan)
    x, y, top = lower[0], lower[1], lower[1]
    for k, r in enumerate(radii):
        if x + gap + free[k, 0] + 2.0 * r > upper[0] - gap:
            x, y = lower[0], top
        points[k] = x + gap + free[k, 0] + r, y + gap + free[k, 1] + r
        if points[k, 1] + r > upper[1] - gap:
            points[k] = np.nan
            break
        x, top = points[k, 0] + r, max(top, points[k, 1] + r)
    done = int(np.isnan(points[:, 0]).argmax()) if np.isnan(points).any() else most
    if count is not None and done < most:
        raise InputError(
            f"grid: count = {most}: only {done} grains fit; give a larger domain or a smaller gap"
        )
    chosen = Grains(grains.index[:done], grains.scales[:done], grains.angles[:done],
                    grains.axes[:done])  # fmt: skip
    packing = made(recipe, chosen, points[:done], region_of(inside).measure, inside)
    return packing.select(kept_inside(packing))


def _close_packed(numbers: FloatArray, pitch: float) -> FloatArray:
    """Points of rows that are moved by half a pitch in turn, layers likewise (ABAB)."""
    axes = [np.arange(m) for m in numbers]
    if len(axes) == 2:
        j, i = np.meshgrid(axes[1], axes[0], indexing="ij")
        x, y = i + 0.5 * (j % 2), np.sqrt(0.75) * j
        return pitch * np.column_stack([x.ravel(), y.ravel()])
    kk, jj, ii = np.meshgrid(axes[2], axes[1], axes[0], indexing="ij")
    columns = [
        ii + 0.5 * ((jj + kk) % 2),
        np.sqrt(0.75) * (jj + (kk % 2) / 3.0),
        np.sqrt(2.0 / 3.0) * kk,
    ]
    return pitch * np.column_stack([column.ravel() for column in columns])


def _cells_of(points: FloatArray, pitch: float) -> Shape:
    """Return the hexagonal cells of the lattice around all points, as one shape."""
    turn = np.pi / 6.0 + np.pi / 3.0 * np.arange(6)
    corner = pitch / np.sqrt(3.0) * np.column_stack([np.cos(turn), np.sin(turn)])
    # grown by round-off, so that neighbours melt into one
    cells = shapely.polygons(points[:, None] + (1.0 + 1e-9) * corner)
    outline = shapely.get_coordinates(shapely.unary_union(cells).exterior)[:-1]
    vertices = np.column_stack([outline, np.zeros(len(outline))])
    middle = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0))
    reach = float(np.linalg.norm(vertices - middle, axis=1).max())
    return Polygon(type="polygon", radius=reach, middle=middle, vertices=vertices)


def _box_shape(lower: FloatArray, upper: FloatArray) -> Shape:
    d = len(lower)
    ends = np.zeros((2, 3))
    ends[0, :d], ends[1, :d] = lower, upper
    kind = "rectangle" if d == 2 else "cuboid"
    return Box(type=kind, lower=ends[0], upper=ends[1], axes=d)
