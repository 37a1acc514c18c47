"""The packing as a result: porosity, overlaps, grading by hand; tables, files, pictures, parts."""

import math

import numpy as np
import pytest
from peridem.errors import InputError
from peridem.geometry import make_shape
from peridem.packing import Packing, grid, hexagonal, random
from peridem.placement import read_particle_locations

DISC, SQUARE = make_shape("circle", [1.0]), make_shape("square", [2.0])
SPHERE, CUBE = make_shape("sphere", [1.0]), make_shape("cube", [2.0])


def placed(shapes, index, positions, *, scales=None, angles=None, container=None, domain=100.0):
    n = len(index)
    return Packing(
        shapes=tuple(shapes),
        shape_index=np.array(index),
        positions=np.array(positions, dtype=float),
        scales=np.ones(n) if scales is None else np.array(scales),
        angles=np.zeros(n) if angles is None else np.array(angles),
        axes=np.tile((0.0, 0.0, 1.0), (n, 1)),
        domain=domain,
        container=container,
    )


def test_porosity_counts_what_is_inside_only():
    box = make_shape("rectangle", [10.0, 10.0])
    packing = placed([DISC, SQUARE], [0, 0, 1, 0], [(0, 0, 0), (5, 0, 0), (5, 5, 0), (20, 0, 0)],
                     container=box)  # fmt: skip
    # a disc, half of one, a quarter of a square of 4, nothing
    assert packing.porosity == pytest.approx(1 - (1.5 * math.pi + 1.0) / 100.0, abs=1e-9)


def test_porosity_of_solids_counts_what_is_inside_only():
    box = make_shape("cuboid", [4.0, 4.0, 4.0])
    packing = placed([CUBE, SPHERE], [0, 1], [(2, 0, 0), (-2, 0, 0)], container=box, domain=64.0)
    # halves, of which 4096 points of a Sobol sequence find the parts to about 1/400
    expected = 1 - (0.5 * 8 + 0.5 * 4 / 3 * math.pi) / 64
    assert packing.porosity == pytest.approx(expected, abs=0.01)


def test_overlaps_are_found_with_their_depth():
    packing = placed([DISC, SQUARE], [0, 0, 1, 1], [(0, 0, 0), (1.5, 0, 0), (8, 0, 0), (9, 1, 0)])
    found = packing.overlaps()
    assert list(zip(found["first"], found["second"], strict=True)) == [(0, 1), (2, 3)]
    # discs: 2 - 1.5; squares share 1 by 1
    np.testing.assert_allclose(found.depth, [0.5, 1.0], rtol=1e-6)
    assert len(packing.overlaps(tolerance=0.7)) == 1


def test_overlaps_of_solids_go_by_faces_and_edges():
    turned = [0.0, math.pi / 4]
    near = placed([CUBE], [0, 0], [(0, 0, 0), (2.3, 0, 0)], angles=turned)
    # an edge at 2.3 - sqrt 2 = 0.886 < 1, the second further off at 2.5 - sqrt 2 = 1.086
    assert near.overlaps().depth.tolist() == pytest.approx([1 - (2.3 - math.sqrt(2))], rel=1e-9)
    far = placed([CUBE], [0, 0], [(0, 0, 0), (2.5, 0, 0)], angles=turned)
    assert len(far.overlaps()) == 0


def test_grading_is_the_mass_below_each_sieve():
    packing = placed([DISC], [0, 0, 0], [(0, 0, 0), (10, 0, 0), (20, 0, 0)], scales=[1, 2, 3])
    curve = packing.grading([2.0, 3.0, 4.0, 6.0])
    np.testing.assert_allclose(curve.sieve, [2, 3, 4, 6])
    np.testing.assert_allclose(curve.passing, [1 / 14, 1 / 14, 5 / 14, 1.0])  # areas 1, 4, 9
    by_area = placed([SQUARE], [0], [(0, 0, 0)]).grading([2.2, 2.3], measure="equivalent")
    np.testing.assert_allclose(by_area.passing, [0.0, 1.0])  # 2 sqrt(4 / pi) = 2.257


def test_csv_is_read_back_as_a_placement(tmp_path):
    packing = random([DISC, SQUARE], ((0, 0), (20, 20)), count=12, sizes=0.8, seed=1)
    path = packing.to_csv(tmp_path / "particle_locations.csv", first_zone=1)
    rows = read_particle_locations(path, "loc_rad_orient", 3, dimension=2)
    np.testing.assert_array_equal([row.zone for row in rows], packing.shape_index + 1)
    np.testing.assert_array_equal([row.site for row in rows], packing.positions)
    np.testing.assert_array_equal([row.orientation for row in rows], packing.angles)
    # leading lengths: radius 1; side 2 of the square, of radius sqrt 2
    expected = np.where(packing.shape_index == 0, 0.8, 0.8 * math.sqrt(2))
    np.testing.assert_allclose([row.radius for row in rows], expected, rtol=1e-12)
    assert path.read_text().startswith("i, x, y, z, r, o\n1, ") or "2, " in path.read_text()


def test_csv_of_solids_names_the_axes(tmp_path):
    packing = random(CUBE, ((0, 0, 0), (9, 9, 9)), count=3, seed=1)
    rows = read_particle_locations(packing.to_csv(tmp_path / "p.csv"), "loc_rad_orient", 1)
    np.testing.assert_array_equal([row.axis for row in rows], packing.axes)


def test_frame_has_a_row_for_each_grain():
    frame = grid([DISC, SQUARE], cells=(2, 3), seed=1).to_frame()
    assert list(frame.columns) == ["shape", "x", "y", "z", "scale", "angle", "radius"]
    assert len(frame) == 6


def test_select_and_add_are_inverse():
    packing = random([DISC, SQUARE], ((0, 0), (20, 20)), count=10, seed=1)
    left = packing.positions[:, 0] < 10
    whole = packing.select(left) + packing.select(~left)
    order = np.concatenate([np.flatnonzero(left), np.flatnonzero(~left)])
    np.testing.assert_array_equal(whole.positions, packing.positions[order])
    np.testing.assert_array_equal(whole.shape_index, packing.shape_index[order])
    assert whole.shapes == packing.shapes
    assert whole.porosity == pytest.approx(packing.porosity, rel=1e-12)


def test_sum_of_packings_adds_their_domains():
    one, two = grid(DISC, cells=(2, 2)), grid(SQUARE, cells=(1, 2)).moved((10.0, 0.0))
    both = one + two
    assert both.domain == pytest.approx(16 + 16)  # cells of 2 by 2, and of 2 sqrt 2
    np.testing.assert_array_equal(both.shape_index, [0, 0, 0, 0, 1, 1])
    assert both.porosity == pytest.approx(1 - (4 * math.pi + 8) / 32, rel=1e-9)
    assert both.positions[-1, 0] == pytest.approx(10 + math.sqrt(2))


def test_arrays_are_read_only():
    packing = grid(DISC, cells=(2, 2))
    with pytest.raises(ValueError, match="read-only"):
        packing.positions[0] = 0.0


def test_repr_tells_number_size_and_porosity():
    text = repr(hexagonal(DISC, cells=(3, 3)))
    assert text == "Packing(9 grains of 1 shapes (circle), radii 1 to 1 m, porosity 0.093)"


@pytest.mark.parametrize("color", ["shape", "radius", "order"])
def test_plot_draws_every_grain(color):
    packing = grid([DISC, make_shape("annulus_circle", [0.4, 1.0])], cells=(3, 2), seed=1)
    axes = packing.plot(color=color)
    (collection,) = axes.collections
    assert len(collection.get_paths()) == 6
    bounds = packing.polygons()[0].bounds
    drawn = collection.get_paths()[0].vertices
    np.testing.assert_allclose([*drawn.min(axis=0), *drawn.max(axis=0)], bounds)


def test_plot_draws_solids():
    axes = random([SPHERE, CUBE], ((0, 0, 0), (9, 9, 9)), count=4, seed=1).plot()
    assert axes.name == "3d"
    assert len(axes.collections) == 1


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda p: p.select([True]), r"must be \(4,\)"),
        (lambda p: p.select([7]), "beyond the 4"),
        (lambda p: p.plot(color="shap"), r"did you mean shape\?"),
        (lambda p: p.sizes("bound"), r"did you mean bounding\?"),
        (lambda p: p.moved((1, 2, 3, 4)), "one for each axis"),
        (lambda p: p + random(SPHERE, ((0, 0, 0), (9, 9, 9)), count=1), "both plane or both in 3D"),
    ],
)
def test_packing_refuses_wrong_arguments(call, text):
    with pytest.raises(InputError, match=text):
        call(grid(DISC, cells=(2, 2)))


def test_csv_refuses_shapes_that_decks_cannot_scale(tmp_path):
    frame = make_shape("rectangle_minus_rectangle", [1, 1, 0, 2, 2, 0, 0, 0, 0, 3, 4, 0])
    with pytest.raises(InputError, match="has no leading length"):
        placed([frame], [0], [(0, 0, 0)]).to_csv(tmp_path / "p.csv")


def test_shapes_away_from_the_origin_are_placed_by_their_centre():
    away = make_shape("rectangle", [1.0, 1.0, 0.0, 3.0, 2.0, 0.0])  # centre (2, 1.5)
    packing = random(away, ((0, 0), (9, 9)), count=6, sizes=0.8, seed=2)
    assert len(packing.overlaps()) == 0
    for polygon in packing.polygons():
        assert polygon.area == pytest.approx(2.0 * (0.8 / math.hypot(1.0, 0.5)) ** 2, rel=1e-9)
        assert min(polygon.bounds[:2]) >= 0.0
        assert max(polygon.bounds[2:]) <= 9.0
