"""Random packings: no overlap by brute force, what was asked for, the same for the same seed."""

import math
import os
import subprocess
import sys
import time

import numpy as np
import peridem.packing as packing_module
import pytest
import shapely
from peridem.errors import InputError
from peridem.geometry import make_shape
from peridem.packing import Grading, Hopper, LogNormal, Uniform, random

DISC, TRIANGLE = make_shape("circle", [1.0]), make_shape("triangle", [1.0])
WAIST, HEXAGON = make_shape("drum2d", [1.0, 0.3]), make_shape("hexagon", [1.0])
ELLIPSE, SPHERE = make_shape("ellipse", [1.0, 0.5]), make_shape("sphere", [1.0])
CUBE = make_shape("cube", [1.0])
SIZES = Uniform(0.9, 1.1)
BOX = ((0.0, 0.0), (24.0, 20.0))


def by_hand(packing):
    """Outlines straight from the shapes, not by the code under test."""
    polygons = []
    for k in range(len(packing)):
        outline = packing.shapes[packing.shape_index[k]].boundary()[:, :2] * packing.scales[k]
        c, s = math.cos(packing.angles[k]), math.sin(packing.angles[k])
        turned = outline @ np.array([[c, s], [-s, c]])
        polygons.append(shapely.Polygon(turned + packing.positions[k, :2]))
    return np.array(polygons)


def nearest(polygons):
    """Smallest distance of all pairs; 0 when two overlap."""
    i, j = np.triu_indices(len(polygons), 1)
    return shapely.distance(polygons[i], polygons[j]).min()


@pytest.mark.parametrize(
    ("shapes", "porosity"),
    [([DISC], 0.25), ([DISC, HEXAGON, TRIANGLE, WAIST], 0.3), ([ELLIPSE], 0.45)],
)
def test_random_grains_do_not_overlap_and_lie_inside(shapes, porosity):
    packing = random(shapes, BOX, porosity=porosity, sizes=SIZES, seed=3)
    polygons = by_hand(packing)
    assert nearest(polygons) > 0.0
    lower, upper = np.split(shapely.total_bounds(polygons), 2)
    assert (lower >= 0.0).all()
    assert (upper <= BOX[1]).all()
    # by the areas of the shapes, apart from Packing.porosity; met to within one grain
    area = (packing.scales**2 * [packing.shapes[k].volume for k in packing.shape_index]).sum()
    assert packing.porosity == pytest.approx(1 - area / 480.0, abs=1e-9)
    assert packing.porosity == pytest.approx(porosity, abs=1.1**2 * math.pi / 480.0)
    assert len(packing.overlaps()) == 0


def test_random_keeps_the_gap_to_grains_and_walls():
    packing = random([DISC, TRIANGLE, WAIST], BOX, porosity=0.5, sizes=SIZES, gap=0.15, seed=1)
    polygons = by_hand(packing)
    assert nearest(polygons) >= 0.15
    bounds = shapely.total_bounds(polygons)
    assert bounds[:2].min() >= 0.15
    assert (np.array(BOX[1]) - bounds[2:]).min() >= 0.15


def test_random_respects_corners_that_stick_into_the_domain():
    frame = make_shape("annulus_rectangle", [8.0, 6.0, 20.0, 20.0])
    packing = random([TRIANGLE, WAIST], frame, porosity=0.4, sizes=SIZES, seed=2)
    room = shapely.box(-10, -10, 10, 10).difference(shapely.box(-4, -3, 4, 3))
    polygons = by_hand(packing)
    assert shapely.difference(polygons, room.buffer(1e-9)).tolist() == [shapely.Polygon()] * len(
        polygons
    )
    assert nearest(polygons) > 0.0


def test_random_shares_out_shapes_by_their_weights():
    packing = random([DISC, TRIANGLE, WAIST], BOX, count=40, weights=[2, 1, 0], seed=1)
    # 26.67, 13.33, 0: the largest remainder is the first
    np.testing.assert_array_equal(np.bincount(packing.shape_index, minlength=3), [27, 13, 0])


@pytest.mark.parametrize(
    ("measure", "scale"),
    [("bounding", 0.5 / math.sqrt(2)), ("equivalent", 0.5 * math.sqrt(math.pi) / 2),
     ("leading", 0.25), ("scale", 0.5)],
)  # fmt: skip
def test_random_reads_sizes_by_the_measure(measure, scale):
    square = make_shape("square", [2.0])  # half diagonal sqrt 2, side 2, area 4 = pi (2/sqrt pi)^2
    packing = random(square, BOX, count=5, sizes=0.5, measure=measure)
    np.testing.assert_allclose(packing.scales, scale, rtol=1e-12)


def test_random_gives_the_grading_asked_for():
    sieves, passing = [0.4, 0.6, 1.0, 2.0], [0.0, 0.3, 0.6, 1.0]
    packing = random(DISC, ((0, 0), (30, 30)), porosity=0.4, sizes=Grading(sieves, passing), seed=5)
    found = packing.grading(sieves).passing
    # at either end of a bin one grain more or less, at most the largest of pi 1.0^2
    np.testing.assert_allclose(found, passing, atol=2 * math.pi / packing.volumes.sum())


def test_random_packs_sizes_that_differ_tenfold():
    packing = random(
        [DISC, HEXAGON], ((0, 0), (14, 12)), porosity=0.3, sizes=LogNormal(0.4, 0.4), seed=7
    )
    assert packing.radii.max() / packing.radii.min() > 8.0
    assert nearest(by_hand(packing)) > 0.0


def test_random_grains_lie_in_a_hopper():
    hopper = Hopper(width=20.0, outlet=4.0, funnel_height=10.0, height=20.0, at=(5.0, 1.0))
    packing = random([DISC, TRIANGLE], hopper, porosity=0.4, sizes=SIZES, seed=1)
    assert packing.domain == pytest.approx(10 * 20 + 10 * 12)  # rectangle and trapezium
    # discs by their distance from the walls of slope 10 : 8, worked out by hand
    disc = packing.shape_index == 0
    x, y = packing.positions[disc, 0] - 5.0, packing.positions[disc, 1] - 1.0
    r = packing.radii[disc]
    funnel = (y * 8 + 20 - 10 * np.abs(x)) / math.hypot(10, 8)
    assert (funnel >= r).all()
    assert (10.0 - np.abs(x) >= r).all()
    assert (np.minimum(y, 20.0 - y) >= r).all()
    outline = shapely.Polygon([(3, 1), (7, 1), (15, 11), (15, 21), (-5, 21), (-5, 11)])
    assert shapely.covers(outline, by_hand(packing)[~disc]).all()


@pytest.mark.parametrize("kind", ["box", "cylinder", "hopper", "probed"])
def test_random_solids_do_not_overlap_and_lie_inside(kind):
    cone = Hopper(width=12.0, outlet=4.0, funnel_height=6.0, height=12.0, dimension=3)
    domain = {
        "box": ((-6, -6, 0), (6, 6, 12)),
        "cylinder": make_shape("cylinder", [6.0, 0, 0, 0, 0, 0, 12.0]),
        "hopper": cone,
        "probed": make_shape("cuboid_minus_cuboid", [-2, -2, 4, 2, 2, 8, -6, -6, 0, 6, 6, 12]),
    }[kind]
    porosity = 0.88 if kind == "probed" else 0.75
    packing = random([SPHERE, CUBE], domain, porosity=porosity, sizes=Uniform(0.8, 1.0), seed=1)
    x, r = packing.positions, packing.radii
    apart = np.linalg.norm(x[:, None] - x, axis=2) - r - r[:, None]
    assert apart[np.triu_indices(len(r), 1)].min() >= 0.0
    rho, z = np.hypot(x[:, 0], x[:, 1]), x[:, 2]
    assert (np.minimum(z, 12 - z) >= r).all()
    if kind in ("box", "probed"):
        assert (6 - np.abs(x[:, :2]).max(axis=1) >= r - 1e-12).all()
    else:
        assert (6 - rho >= r).all()
    if kind == "hopper":  # wall from (2, 0) to (6, 6): 6 rho = 4 z + 12
        assert ((4 * z + 12 - 6 * rho) / math.hypot(6, 4) >= r).all()
        assert packing.domain == pytest.approx(6 * math.pi * 36 + 6 * math.pi / 3 * (36 + 12 + 4))
    if kind == "probed":  # the block in the middle; flat walls are felt, edges nearly
        outside = np.linalg.norm(np.maximum(np.abs(x - (0, 0, 6)) - 2.0, 0.0), axis=1)
        assert (outside >= 0.9 * r).all()


def test_random_is_the_same_for_the_same_seed():
    one, two, other = (
        random([DISC, WAIST], BOX, porosity=0.35, sizes=SIZES, seed=s) for s in (5, 5, 6)
    )
    for name in ("positions", "scales", "angles", "shape_index"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
    assert not np.array_equal(one.positions, other.positions)


def test_random_does_not_depend_on_hash_randomisation():
    code = (
        "from peridem.packing import random, Uniform\n"
        "from peridem.geometry import make_shape\n"
        "shapes = [make_shape('circle', [1.0]), make_shape('drum2d', [1.0, 0.3])]\n"
        "p = random(shapes, ((0, 0), (14, 14)), porosity=0.4, sizes=Uniform(0.9, 1.1), seed=5)\n"
        "print(p.positions.tobytes().hex(), p.angles.tobytes().hex())\n"
    )
    runs = [
        subprocess.run(
            [sys.executable, "-c", code],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            check=True,
        ).stdout
        for seed in ("1", "2")
    ]
    assert runs[0] == runs[1]


def test_random_gives_up_on_what_cannot_be():
    start = time.perf_counter()
    with pytest.raises(InputError, match=r"porosity 0\.1.*overlap by up to.*higher porosity"):
        random(DISC, BOX, porosity=0.1, sizes=SIZES)
    # 1000 steps take about a second: a bound that only a hang can pass
    assert time.perf_counter() - start < 60.0
    with pytest.raises(InputError, match=r"fill 1\.31 times the domain"):
        random(DISC, BOX, count=200)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"porosty": 0.4}, r"random: porosty: no such argument; did you mean porosity\?"),
        ({}, "must give one of them"),
        ({"count": 3, "porosity": 0.4}, "must give one of them"),
        ({"count": 0}, "count = 0: must be an integer >= 1"),
        ({"porosity": 1.5}, "must be below 1"),
        ({"count": 3, "gap": -1}, "gap = -1: must be at least 0"),
        ({"count": 3, "weights": [1, 2]}, "must be 1 numbers"),
        ({"count": 3, "sizes": "big"}, "must be a length in m or a distribution"),
        ({"count": 3, "measure": "bouding"}, r"did you mean bounding\?"),
        ({"count": 3, "angles": "randm"}, r"did you mean random\?"),
        ({"count": 3, "seed": 1.5}, "seed = 1.5: must be an integer >= 0"),
    ],
)
def test_random_names_a_wrong_argument(arguments, text):
    with pytest.raises(InputError, match=text):
        random(DISC, BOX, **arguments)


@pytest.mark.parametrize(
    ("domain", "text"),
    [
        ("box", "must be a shape, or two corners"),
        (((0, 0), (0, 1)), "first corner must be below the second"),
        (((0, 0), (1, 1), (2, 2)), "must be two points"),
        (make_shape("line", [1.0]), "has no inside"),
        (((0, 0, 0), (9, 9, 9)), "dimension 3, the shapes 2"),
    ],
)
def test_random_names_a_wrong_domain(domain, text):
    with pytest.raises(InputError, match=text):
        random(DISC, domain, count=1)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"outlet": 3.0}, r"outlet = 3.0: must be at most 2.0"),
        ({"funnel_height": 5.0}, "must be at most 4.0"),
        ({"dimension": 4}, "must be 2 or 3"),
        ({"with": 4}, r"did you mean width\?"),
    ],
)
def test_hopper_names_a_wrong_argument(arguments, text):
    good = {"width": 2.0, "outlet": 0.5, "funnel_height": 1.0, "height": 4.0}
    with pytest.raises(InputError, match=text):
        Hopper(**(good | arguments))


def test_all_names_are_public():
    assert all(hasattr(packing_module, name) for name in packing_module.__all__)
