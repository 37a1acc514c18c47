"""Grids and hexagonal packings: porosities and places worked out by hand."""

import math

import numpy as np
import pytest
from peridem.errors import InputError
from peridem.geometry import make_shape
from peridem.packing import Uniform, grid, hexagonal

DISC, SPHERE = make_shape("circle", [1.0]), make_shape("sphere", [1.0])
HEXAGON = make_shape("hexagon", [1.0])


@pytest.mark.parametrize(
    ("make", "shape", "cells", "porosity"),
    [
        (grid, DISC, (4, 3), 1 - math.pi / 4),
        (grid, SPHERE, (2, 3, 4), 1 - math.pi / 6),
        (hexagonal, DISC, (5, 4), 1 - math.pi / (2 * math.sqrt(3))),
        (hexagonal, SPHERE, (3, 4, 5), 1 - math.pi / (3 * math.sqrt(2))),
    ],
)
def test_equal_grains_that_touch_leave_the_known_porosity(make, shape, cells, porosity):
    packing = make(shape, cells=cells)
    assert len(packing) == math.prod(cells)
    # discs that just touch a wall are cut there as polygons of 128 sides, on a grid of 1e-9
    assert packing.porosity == pytest.approx(porosity, abs=1e-6)
    assert len(packing.overlaps()) == 0
    centers = packing.positions
    distance = np.linalg.norm(centers[:, None] - centers, axis=2)[np.triu_indices(len(centers), 1)]
    assert distance.min() == pytest.approx(2.0, rel=1e-12)
    if make is hexagonal and shape is SPHERE:
        touching = np.isclose(distance, 2.0, rtol=1e-9).sum()
        assert touching == _contacts_of_close_packed_block(centers)


def _contacts_of_close_packed_block(centers):
    """Contacts by the definition of close packing: six in a layer, three below, three above."""
    layers = np.round(centers[:, 2] / math.sqrt(8.0 / 3.0)).astype(int)
    flat = np.linalg.norm(centers[:, None, :2] - centers[None, :, :2], axis=2)
    same = layers[:, None] == layers
    next_ = np.abs(layers[:, None] - layers) == 1
    touch = (same & np.isclose(flat, 2.0)) | (next_ & np.isclose(flat, 2.0 / math.sqrt(3.0)))
    return np.triu(touch, 1).sum()


def test_grid_fills_a_domain_with_as_many_as_fit():
    packing = grid(DISC, domain=((0, 0), (10.5, 6.5)))
    assert len(packing) == 15  # 5 by 3 of diameter 2, in the middle
    np.testing.assert_allclose(packing.positions[0], (1.25, 1.25, 0.0))
    assert packing.porosity == pytest.approx(1 - 15 * math.pi / (10.5 * 6.5), rel=1e-9)


def test_grid_leaves_out_what_sticks_out_of_a_round_domain():
    packing = grid(DISC, domain=make_shape("circle", [4.0]))
    # 4 by 4 centres at -3, -1, 1, 3: those at (3, 3) reach sqrt(18) + 1 > 4, at (3, 1) sqrt(10) + 1
    assert len(packing) == 4


def test_grid_places_the_502_grains_of_the_paper():
    # Jha et al. (2021), section 4.3: discs and hexagons, R = 1 + U(-0.1, 0.1) mm, moved along x
    sizes, shift = Uniform(0.9e-3, 1.1e-3), 0.1e-3
    shapes = [make_shape("circle", [1e-3]), make_shape("hexagon", [1e-3])]
    packing = grid(shapes, cells=(23, 22), count=502, sizes=sizes, perturbation=(shift, 0.0))
    assert len(packing) == 502
    assert set(np.bincount(packing.shape_index)) <= {249, 250, 251, 252, 253}  # 4 of 506 cut off
    assert 0.9e-3 <= packing.radii.min() < 0.91e-3
    assert 1.09e-3 < packing.radii.max() <= 1.1e-3
    pitch = 2 * 1.1e-3 + 2 * np.array([shift, 0.0])
    off = packing.positions[:, :2] / pitch - 0.5
    moved = (off - np.round(off)) * pitch
    assert 0.9 * shift < np.abs(moved[:, 0]).max() <= shift * (1 + 1e-9)
    assert np.abs(moved[:, 1]).max() < 1e-12
    assert np.ptp(packing.angles) > 6.0
    assert len(packing.overlaps()) == 0


def test_rows_lie_side_by_side_with_the_gap():
    packing = grid([DISC, HEXAGON], domain=((0, 0), (40, 30)), layout="rows", gap=0.1,
                   sizes=Uniform(0.5, 1.5), perturbation=(0.05, 0.0), seed=4)  # fmt: skip
    assert len(packing) > 150
    assert len(packing.overlaps()) == 0
    x, y, r = packing.positions[:, 0], packing.positions[:, 1], packing.radii
    assert (x - r).min() >= 0.1 - 1e-12
    assert (x + r).max() <= 40 - 0.1 + 1e-12
    assert (y + r).max() <= 30
    row = np.flatnonzero(np.diff(x) < 0)[0] + 1
    np.testing.assert_allclose((y - r)[:row], 0.1)  # the first row stands on the floor
    free = np.diff(x[:row]) - r[: row - 1] - r[1:row]
    assert (free >= 0.1 - 1e-12).all()
    assert (free <= 0.2 + 1e-12).all()


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda: grid(DISC, cels=(2, 2)), "cels: no such argument; did you mean cells?"),
        (lambda: grid(DISC), "must give one of them"),
        (lambda: grid(DISC, cells=(2, 2, 2)), "must be 2 integers"),
        (lambda: grid(DISC, cells=(2, 0)), "cells = 0: must be an integer >= 1"),
        (lambda: grid(DISC, cells=(2, 2), spacing=1.5), "overlap.*give more spacing"),
        (lambda: grid(DISC, cells=(2, 2), layout="row"), "did you mean rows"),
        (lambda: grid(DISC, cells=(2, 2), layout="rows"), "plane domain"),
        (lambda: grid(DISC, cells=(2, 2), count=5), "only 4 grains fit"),
        (lambda: grid(DISC, cells=(2, 2), perturbation="x"), "one for each axis"),
        (lambda: grid([DISC, SPHERE], cells=(2, 2)), "all plane or all solid"),
        (lambda: grid("disc", cells=(2, 2)), "must be a shape"),
        (lambda: hexagonal(DISC, domain=((0, 0), (1, 9))), "narrower than a grain"),
        (lambda: hexagonal(DISC, domain=((0, 0, 0), (9, 9, 9))), "dimension 3, the shapes 2"),
    ],
)
def test_lattices_refuse_what_does_not_fit(call, text):
    with pytest.raises(InputError, match=text):
        call()
