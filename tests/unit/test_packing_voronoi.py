"""Voronoi tessellations: cells tile the domain, keep gap and shortest side."""

import math

import numpy as np
import pytest
import shapely
from peridem.errors import InputError
from peridem.geometry import make_shape
from peridem.packing import voronoi

SQUARE = ((0.0, 0.0), (2.0, 1.0))
CUBE = ((0.0, 0.0, 0.0), (1.0, 2.0, 1.0))


def shortest_side(polygon):
    return np.hypot(*np.diff(shapely.get_coordinates(polygon), axis=0).T).min()


@pytest.mark.parametrize("options", [{}, {"lloyd": 3}, {"lloyd": 10, "min_edge": 0.02}])
@pytest.mark.parametrize("name", ["rectangle", "triangle", "frame", "circle"])
def test_cells_tile_the_domain(name, options):
    domain, area = {
        "rectangle": (SQUARE, 2.0),
        "triangle": (make_shape("triangle", [1.0]), 0.75 * math.sqrt(3.0)),
        "frame": (make_shape("annulus_rectangle", [0.5, 0.4, 1.5, 1.6]), 1.5 * 1.6 - 0.2),
        # the outline is a polygon of 128 sides
        "circle": (make_shape("circle", [1.0]), 64 * math.sin(math.pi / 64)),
    }[name]
    for seed in range(2):
        packing = voronoi(domain, count=60, seed=seed, **options)
        assert len(packing) == 60
        assert len(packing.shapes) == 60
        # sums of 60 areas: round-off 1e-15 each; corners of equal place are merged within 1e-6
        assert packing.volumes.sum() == pytest.approx(area, rel=1e-10)
        assert len(packing.overlaps()) == 0
        union = shapely.unary_union(shapely.set_precision(packing.polygons(), 1e-9))
        assert union.area == pytest.approx(area, rel=1e-6)
        if "min_edge" in options and name != "circle":  # its own sides of 0.049 remain
            assert min(shortest_side(p) for p in packing.polygons()) >= 0.02 * (1 - 1e-9)


def test_each_point_of_the_plane_belongs_to_the_nearest_seed():
    # by definition: the cell of a point is that of its nearest seed, so that with two cells
    # the common side is perpendicular to the line of the seeds, at its middle
    packing = voronoi(SQUARE, count=2, seed=3)
    one, two = packing.polygons()
    common = shapely.get_coordinates(
        shapely.intersection(one.buffer(1e-9), two.buffer(1e-9)).minimum_rotated_rectangle
    )
    seeds = np.random.Generator(np.random.PCG64(3)).random((20, 2))[:2] * (2.0, 1.0)
    distance = np.hypot(*(common[:, None] - seeds).transpose(2, 0, 1))
    np.testing.assert_allclose(distance[:, 0], distance[:, 1], atol=1e-7)


def test_grains_keep_the_gap():
    packing = voronoi(SQUARE, count=40, gap=0.02, lloyd=5, seed=1)
    polygons = packing.polygons()
    i, j = np.triu_indices(40, 1)
    distance = shapely.distance(polygons[i], polygons[j])
    assert distance.min() == pytest.approx(0.02, rel=1e-6)
    assert shapely.total_bounds(polygons)[:2].min() == pytest.approx(0.01, rel=1e-6)
    assert packing.porosity == pytest.approx(1 - shapely.area(polygons).sum() / 2.0, rel=1e-9)


def test_lloyd_makes_grains_more_alike():
    spread = [np.std(voronoi(SQUARE, count=60, lloyd=k, seed=1).volumes) for k in (0, 3, 12)]
    assert spread[0] > 1.5 * spread[1] > 1.5 * spread[2]


def test_shapes_lie_about_their_centroids():
    packing = voronoi(SQUARE, count=10, seed=2)
    for k, polygon in enumerate(packing.polygons()):
        np.testing.assert_allclose(packing.positions[k, :2], polygon.centroid.coords[0], atol=1e-12)


def test_solid_cells_tile_the_box():
    packing = voronoi(CUBE, count=30, seed=1)
    assert packing.volumes.sum() == pytest.approx(2.0, rel=1e-12)
    assert len(packing.overlaps()) == 0


def test_solid_grains_keep_the_gap():
    packing = voronoi(CUBE, count=12, gap=0.03, lloyd=2, seed=1)
    assert len(packing.overlaps()) == 0
    points = np.vstack([s_points(packing, k) for k in range(12)])
    assert points.min() == pytest.approx(0.015, rel=1e-9)
    assert (CUBE[1] - points).min() == pytest.approx(0.015, rel=1e-9)
    grown = voronoi(CUBE, count=12, lloyd=2, seed=1)
    assert (packing.volumes < grown.volumes).all()


def s_points(packing, k):
    shape = packing.geometries[k]
    return np.asarray(shape.points) + packing.positions[k]


@pytest.mark.parametrize("count", [1, 2, 5])
def test_few_cells_tile_too(count):
    assert voronoi(CUBE, count=count).volumes.sum() == pytest.approx(2.0, rel=1e-12)
    assert voronoi(SQUARE, count=count).volumes.sum() == pytest.approx(2.0, rel=1e-12)


def test_cells_are_the_same_for_the_same_seed():
    one, two = (voronoi(SQUARE, count=20, lloyd=2, min_edge=0.02, seed=8) for _ in range(2))
    np.testing.assert_array_equal(one.positions, two.positions)


@pytest.mark.parametrize(
    ("domain", "arguments", "text"),
    [
        (SQUARE, {"cout": 5}, r"did you mean count\?"),
        (SQUARE, {"count": 40, "gap": 0.5}, "gap = 0.5: the grain at .* vanishes"),
        (
            SQUARE,
            {"count": 40, "min_edge": 0.5},
            "min_edge = 0.5: a grain at .* would vanish or fold",
        ),
        (SQUARE, {"count": 40, "lloyd": -1}, "must be an integer >= 0"),
        (CUBE, {"count": 40, "gap": 0.9}, "a grain vanishes"),
        (CUBE, {"count": 4, "min_edge": 0.1}, "plane domains only"),
        (make_shape("sphere", [1.0]), {"count": 4}, "must be a box in 3D"),
        (make_shape("annulus_circle", [0.5, 1.0]), {"count": 1}, "all around a hole"),
    ],
)
def test_voronoi_refuses_what_cannot_be(domain, arguments, text):
    with pytest.raises(InputError, match=text):
        voronoi(domain, **arguments)
