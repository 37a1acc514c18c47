"""Poured packings: grains rest on something, inside, without overlap."""

import numpy as np
import pytest
from peridem.errors import InputError
from peridem.geometry import make_shape
from peridem.packing import Hopper, Uniform, poured

DISC, TRIANGLE = make_shape("circle", [1.0]), make_shape("triangle", [1.0])
SPHERE = make_shape("sphere", [1.0])


def test_a_grain_falls_to_the_floor():
    packing = poured(DISC, ((0, 0), (10, 30)), count=1)
    # it comes to rest at y = 1, but for the margin of 2e-3 radii and the weight's 8e-4
    assert packing.positions[0, 1] == pytest.approx(1.0, abs=5e-3)


def test_poured_discs_fill_the_container_from_below():
    packing = poured(DISC, ((0, 0), (16, 40)), count=80, sizes=Uniform(0.9, 1.1), seed=2)
    assert len(packing.overlaps()) == 0
    x, r = packing.positions[:, :2], packing.radii
    assert (x[:, 1] - r).min() >= 0.0
    # each grain but those on the floor touches one below it; a twentieth of a radius is far
    # more than what overlaps left by the weight open, and far less than a fall
    reach = np.linalg.norm(x[:, None] - x, axis=2) - r - r[:, None]
    below = x[:, None, 1] > x[:, 1]
    carried = ((reach < 0.05) & below).any(axis=1) | (x[:, 1] - r < 0.05)
    assert carried.mean() > 0.97
    # the heap: discs up to half the height of the topmost, walls left out
    slab = (x[:, 1] > 3) & (x[:, 1] < 11)
    assert (np.pi * r[slab] ** 2).sum() / (16 * 8) > 0.75  # random close packing: 0.84


def test_poured_grains_slide_down_a_hopper_and_stay_inside():
    hopper = Hopper(width=16.0, outlet=3.0, funnel_height=8.0, height=30.0)
    packing = poured([DISC, TRIANGLE], hopper, count=60, seed=1)
    disc = packing.shape_index == 0
    x, y, r = *packing.positions[disc, :2].T, packing.radii[disc]
    assert (y >= r).all()
    assert ((y * 6.5 + 12 - 8 * np.abs(x)) / np.hypot(8, 6.5) >= r * (1 - 1e-12)).all()
    assert len(packing.overlaps()) == 0
    assert packing.positions[:, 1].max() < 14.0  # 60 grains of 2.2 in 68 + 16 (y - 8), loosely


def test_poured_falls_along_gravity_in_3d():
    packing = poured(SPHERE, ((0, 0, 0), (9, 9, 13)), count=30, gravity=(1, 0, 0), seed=1)
    x, r = packing.positions, packing.radii
    assert (9.0 - x[:, 0] >= r).all()
    assert x[:, 0].mean() > 6.5  # 24 fit at the wall in rows, so most lie there, at 8
    apart = np.linalg.norm(x[:, None] - x, axis=2) - r - r[:, None]
    assert apart[np.triu_indices(30, 1)].min() >= 0.0


def test_poured_fills_a_round_container_until_it_is_full():
    packing = poured(DISC, make_shape("circle", [6.0]), seed=1)
    assert packing.porosity < 0.45  # 20 discs would leave 0.444; 27 are the most known to fit
    assert (np.linalg.norm(packing.positions, axis=1) + 1.0 <= 6.0).all()
    assert len(packing.overlaps()) == 0


def test_poured_is_the_same_for_the_same_seed():
    one, two = (poured([DISC, TRIANGLE], ((0, 0), (9, 20)), count=15, seed=4) for _ in range(2))
    np.testing.assert_array_equal(one.positions, two.positions)
    np.testing.assert_array_equal(one.angles, two.angles)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"count": 60}, "container is full with .* grains"),
        ({"cuont": 60}, r"did you mean count\?"),
        ({"count": 1, "gravity": (0, 0)}, "must have a direction"),
        ({"count": 1, "gravity": 1.0}, "must be 2 numbers"),
    ],
)
def test_poured_refuses_what_does_not_fit(arguments, text):
    with pytest.raises(InputError, match=text):
        poured(DISC, ((0, 0), (8, 8)), **arguments)
