"""From centres of grains to a packing."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..geometry import Shape
from ..geometry.base import FloatArray
from .overlaps import centers_of, part_outside, rotations
from .recipe import Grains, Recipe
from .regions import region_of
from .result import Packing


def made(
    recipe: Recipe, grains: Grains, centers: FloatArray, domain: float, container: Shape | None
) -> Packing:
    """Return the packing of grains whose centres are at `centers`, shape (n, d) [m]."""
    n, d = len(centers), recipe.dimension
    middle = np.zeros((n, 3))
    middle[:, :d] = centers
    # the centre of a shape need not be its origin, about which it is scaled and turned
    inner = np.array([g.center for g in recipe.geometries])[grains.index]
    turned = np.einsum("nij,nj->ni", rotations(grains.axes, grains.angles), inner)
    positions = middle - grains.scales[:, None] * turned
    return Packing(
        shapes=recipe.shapes,
        shape_index=grains.index,
        positions=positions,
        scales=grains.scales,
        angles=grains.angles,
        axes=grains.axes,
        domain=domain,
        container=container,
    )


def kept_inside(packing: Packing) -> NDArray[np.bool_]:
    """Tell which grains lie wholly in the container, up to round-off, shape (n,)."""
    assert packing.container is not None
    region, d = region_of(packing.container), packing.dimension
    out, _ = region.push(centers_of(packing)[:, :d], packing.radii)
    inside = np.asarray(out <= 1e-9 * packing.radii)
    if d == 2:
        near = np.flatnonzero(~inside)
        inside[near] = part_outside(packing.polygons()[near], region.polygon) == 0.0
    return inside
