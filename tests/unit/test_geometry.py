"""Shapes: closed forms of area, box and radius; points inside and outside by construction."""

import numpy as np
import pytest
from peridem.errors import InputError
from peridem.geometry import SHAPE_TYPES, make_shape

ROOT3 = np.sqrt(3.0)
ROUND_OFF = 1e-12  # relative; areas are a handful of operations on exact numbers

# type, parameters, area or volume, bounding radius, centre, leading length
CLOSED_FORMS = [
    ("line", [2.0], 2.0, 1.0, (0, 0, 0), 2.0),
    ("line", [0, 0, 0, 3, 4, 0], 5.0, 2.5, (1.5, 2, 0), 5.0),
    ("triangle", [2.0], 3 * ROOT3, 2.0, (0, 0, 0), 2.0),  # 3 sqrt(3)/4 r^2
    ("triangle", [2.0, 1, 2, 3], 3 * ROOT3, 2.0, (1, 2, 3), 2.0),
    ("square", [2.0], 4.0, np.sqrt(2.0), (0, 0, 0), 2.0),
    ("square", [2.0, 1, 1, 0], 4.0, np.sqrt(2.0), (1, 1, 0), 2.0),
    ("square", [0, 0, 0, 2, 2, 0], 4.0, np.sqrt(2.0), (1, 1, 0), 2.0),
    ("rectangle", [3.0, 4.0], 12.0, 2.5, (0, 0, 0), 3.0),
    ("rectangle", [3.0, 4.0, 1, 2, 0], 12.0, 2.5, (1, 2, 0), 3.0),
    ("rectangle", [1, 1, 0, 4, 5, 0], 12.0, 2.5, (2.5, 3, 0), 3.0),
    ("hexagon", [2.0], 6 * ROOT3, 2.0, (0, 0, 0), 2.0),  # 3 sqrt(3)/2 r^2
    ("hexagon", [2.0, 1, 2, 0], 6 * ROOT3, 2.0, (1, 2, 0), 2.0),
    ("hexagon", [2.0, 1, 2, 0, 0, 1, 0], 6 * ROOT3, 2.0, (1, 2, 0), 2.0),
    # two trapezia of height r sqrt(3)/2 between the widths r and 2w: (r + 2w) r sqrt(3)/2
    ("drum2d", [2.0, 0.5], 3 * ROOT3, 2.0, (0, 0, 0), 2.0),
    ("drum2d", [2.0, 0.5, 1, 0, 0], 3 * ROOT3, 2.0, (1, 0, 0), 2.0),
    ("drum2d", [2.0, 0.5, 1, 0, 0, 0, 1, 0], 3 * ROOT3, 2.0, (1, 0, 0), 2.0),
    ("circle", [2.0], 4 * np.pi, 2.0, (0, 0, 0), 2.0),
    ("circle", [2.0, 1, 2, 3], 4 * np.pi, 2.0, (1, 2, 3), 2.0),
    ("ellipse", [2.0, 1.0], 2 * np.pi, 2.0, (0, 0, 0), 2.0),
    ("ellipse", [1.0, 2.0, 1, 1, 0], 2 * np.pi, 2.0, (1, 1, 0), 1.0),
    ("ellipse", [2.0, 1.0, 1, 1, 0, 0.3], 2 * np.pi, 2.0, (1, 1, 0), 2.0),
    ("sphere", [3.0], 36 * np.pi, 3.0, (0, 0, 0), 3.0),
    ("sphere", [3.0, 1, 1, 1], 36 * np.pi, 3.0, (1, 1, 1), 3.0),
    ("cube", [2.0], 8.0, ROOT3, (0, 0, 0), 2.0),
    ("cube", [2.0, 1, 1, 1], 8.0, ROOT3, (1, 1, 1), 2.0),
    ("cuboid", [2.0, 3.0, 6.0], 36.0, 3.5, (0, 0, 0), 2.0),  # 2^2 + 3^2 + 6^2 = 7^2
    ("cuboid", [0, 0, 0, 2, 3, 6], 36.0, 3.5, (1, 1.5, 3), 2.0),
    ("cylinder", [3.0, 0, 0, 0, 0, 0, 8], 72 * np.pi, 5.0, (0, 0, 4), 3.0),
    ("cylinder", [3.0, 8.0, 1, 0, 0, 0, 2, 0], 72 * np.pi, 5.0, (1, 4, 0), 3.0),
    ("rectangle_minus_rectangle", [1, 1, 0, 2, 2, 0, 0, 0, 0, 3, 4, 0], 11.0, 2.5, (1.5, 2, 0), 0),
    ("rectangle_minus_rectangle", [0, 0, 0, 3, 4, 0, 1, 1, 0, 2, 2, 0], 11.0, 2.5, (1.5, 2, 0), 0),
    ("cuboid_minus_cuboid", [1, 1, 1, 2, 2, 2, 0, 0, 0, 2, 3, 6], 35.0, 3.5, (1, 1.5, 3), 0),
    ("annulus_circle", [1.0, 2.0], 3 * np.pi, 2.0, (0, 0, 0), 2.0),
    ("annulus_rectangle", [1, 1, 3, 4, 1, 2, 0], 11.0, 2.5, (1, 2, 0), 0),
]


@pytest.mark.parametrize("case", CLOSED_FORMS, ids=lambda case: f"{case[0]}{len(case[1])}")
def test_measures_match_closed_forms(case):
    kind, parameters, volume, radius, center, length = case
    shape = make_shape(kind, parameters)
    assert shape.type == kind
    assert shape.volume == pytest.approx(volume, rel=ROUND_OFF)
    assert shape.bounding_radius == pytest.approx(radius, rel=ROUND_OFF)
    np.testing.assert_allclose(shape.center, center, atol=1e-15)
    assert (shape.scale_length or 0) == pytest.approx(length)


def test_every_type_has_a_closed_form_above():
    assert {row[0] for row in CLOSED_FORMS} | {"complex"} == set(SHAPE_TYPES)


@pytest.mark.parametrize(("kind", "parameters"), [row[:2] for row in CLOSED_FORMS])
def test_box_and_bounding_radius_enclose_the_shape(kind, parameters):
    shape = make_shape(kind, parameters)
    lower, upper = shape.box
    size = shape.bounding_radius
    points = shape.center + np.random.default_rng(1).uniform(-1.2, 1.2, (2000, 3)) * size
    points[:, shape.dimension :] = shape.center[shape.dimension :]
    found = points[shape.inside(points)]
    assert kind == "line" or len(found) > 50
    slack = 2e-5 * (np.abs(points).max() + size)  # the fuzzy comparison's own width
    assert np.all(found[:, : shape.dimension] >= lower[: shape.dimension] - slack)
    assert np.all(found[:, : shape.dimension] <= upper[: shape.dimension] + slack)
    assert np.all(np.linalg.norm(found - shape.center, axis=1) <= size + slack)


@pytest.mark.parametrize(
    ("kind", "parameters"), [row[:2] for row in CLOSED_FORMS if row[0] != "line"]
)
def test_share_of_random_points_inside_is_the_share_of_volume(kind, parameters):
    shape = make_shape(kind, parameters)
    lower, upper = shape.box
    n, d = 20_000, shape.dimension
    points = np.tile(shape.center, (n, 1))
    points[:, :d] = np.random.default_rng(2).uniform(lower[:d], upper[:d], (n, d))
    share = shape.volume / np.prod((upper - lower)[:d])
    # five standard deviations of a binomial share
    assert shape.inside(points).mean() == pytest.approx(share, abs=5 * np.sqrt(share / n))


# vertices (first of the default axis) taken from the meshes of the original's decks:
# triangle points up, hexagon and the drum's neck to +x
@pytest.mark.parametrize(
    ("kind", "parameters", "vertices"),
    [
        ("triangle", [2.0], [(0, 2), (-ROOT3, -1), (ROOT3, -1)]),
        ("triangle", [2.0, 0, 0, 0, 1, 0, 0], [(2, 0), (-1, ROOT3), (-1, -ROOT3)]),
        ("hexagon", [2.0], [(2, 0), (1, ROOT3), (-1, ROOT3), (-2, 0), (-1, -ROOT3), (1, -ROOT3)]),
        (
            "drum2d",
            [2.0, 0.5],
            [(0.5, 0), (1, ROOT3), (-1, ROOT3), (-0.5, 0), (-1, -ROOT3), (1, -ROOT3)],
        ),
    ],
)
def test_polygon_vertices_lie_as_in_the_originals_meshes(kind, parameters, vertices):
    outline = make_shape(kind, parameters).boundary()
    np.testing.assert_allclose(outline[:-1, :2], vertices, atol=1e-14)
    np.testing.assert_array_equal(outline[0], outline[-1])


def test_drum_is_concave_at_its_neck():
    drum = make_shape("drum2d", [1.0, 0.2])
    points = [(0.19, 0, 0), (0.21, 0, 0), (0.45, 0.85, 0), (-0.3, 0.0, 0)]
    assert drum.inside(points).tolist() == [True, False, True, False]


def test_axis_turns_the_shape():
    upright = make_shape("drum2d", [1.0, 0.2, 0, 0, 0, 0, 1, 0])
    assert upright.inside([(0, 0.19, 0), (0, 0.21, 0), (0.85, 0.45, 0)]).tolist() == [
        True,
        False,
        True,
    ]


def test_ellipse_angle_is_counter_clockwise():
    ellipse = make_shape("ellipse", [2.0, 1.0, 0, 0, 0, np.pi / 4])
    along = np.array([np.sqrt(0.5), np.sqrt(0.5), 0.0])
    across = along * [-1, 1, 1]
    points = [1.99 * along, 2.01 * along, 0.99 * across, 1.01 * across]
    assert ellipse.inside(points).tolist() == [True, False, True, False]
    # half width of the box: sqrt((a cos)^2 + (b sin)^2) = sqrt(5/2)
    np.testing.assert_allclose(ellipse.box[1], [np.sqrt(2.5), np.sqrt(2.5), 0.0])


def test_edge_counts_as_inside_and_fuzz_is_a_hundred_thousandth():
    box = make_shape("rectangle", [0, 0, 0, 1, 1, 0])
    x = [0.0, -0.9e-12, -1.1e-12, 1.0 + 0.9e-5, 1.0 + 1.1e-5]
    points = np.column_stack([x, np.full(5, 0.5), np.zeros(5)])
    # at 0 only the margin of 1e-12 counts, at 1 the relative 1e-5
    assert box.inside(points).tolist() == [True, True, False, True, False]
    circle = make_shape("circle", [1.0])
    assert circle.inside([(1 + 0.9e-5, 0, 0), (1 + 1.1e-5, 0, 0)]).tolist() == [True, False]


def test_plane_shapes_ignore_z_and_solids_do_not():
    assert make_shape("rectangle", [1, 1]).inside([(0, 0, 5)]).tolist() == [True]
    assert make_shape("circle", [1]).inside([(0, 0, 5)]).tolist() == [True]
    assert make_shape("sphere", [1]).inside([(0, 0, 5)]).tolist() == [False]
    assert make_shape("cuboid", [1, 1, 1]).inside([(0, 0, 0.6)]).tolist() == [False]


def test_region_without_thickness_selects_the_nodes_on_it():
    edge = make_shape("rectangle", [0, 0, 0, 0, 1, 0])
    assert edge.inside([(0, 0.5, 0), (0.1, 0.5, 0)]).tolist() == [True, False]


@pytest.mark.parametrize("order", [1, -1])
def test_container_open_at_the_top_takes_both_orders_and_has_no_lid(order):
    # as in the original's compression decks: the hole reaches the outer upper edge
    outer, inner = [0, 0, 0, 10, 8, 0], [1, 1, 0, 9, 8, 0]
    pair = [outer, inner][::order]
    wall = make_shape("rectangle_minus_rectangle", pair[0] + pair[1])
    points = [(0.5, 4, 0), (5, 0.5, 0), (5, 4, 0), (5, 8, 0), (0.5, 8, 0), (1, 4, 0), (5, 9, 0)]
    assert wall.inside(points).tolist() == [True, True, False, False, True, True, False]
    assert wall.volume == 80 - 56


def test_complex_applies_its_members_in_order():
    # ring with a bar across its hole, the rotating drum of the original's attrition deck
    parameters = [4.0, 0, 0, 0, 3.0, 0, 0, 0, -3.0, -0.5, 0, 0.0, 0.5, 0]
    kinds, flags = ["circle", "circle", "rectangle"], ["plus", "minus", "plus"]
    ring = make_shape("complex", parameters, kinds, flags)
    points = [(3.5, 0, 0), (1, 0, 0), (-1, 0, 0), (-1, 1, 0), (4.1, 0, 0), (0, 3, 0)]
    assert ring.inside(points).tolist() == [True, False, True, False, False, True]
    assert ring.bounding_radius == pytest.approx(4.0)
    np.testing.assert_allclose(ring.center, 0.0)
    kinds, flags = ["circle", "rectangle", "circle"], ["plus", "plus", "minus"]
    swapped = make_shape("complex", [*parameters[4:], 4.0, 0, 0, 0], kinds, flags)
    assert not swapped.inside(points).any()


def test_complex_finds_the_only_split_when_forms_are_short():
    shape = make_shape("complex", [4.0, 1.0], ["circle", "circle"], ["plus", "minus"])
    assert shape.inside([(3, 0, 0), (0.5, 0, 0)]).tolist() == [True, False]


@pytest.mark.parametrize(
    ("kind", "parameters", "words"),
    [
        ("circel", [1.0], "did you mean circle"),
        ("circle", [1.0, 2.0], "2 parameters are none of its forms; give [r] | [r,x,y,z]"),
        ("circle", [-1.0], "radius = -1 must be positive"),
        ("circle", [0.0], "radius = 0 must be positive"),
        ("circle", [float("nan")], "must be finite"),
        ("rectangle", [1, 1, 0, 0, 2, 0], "lower corner first"),
        ("rectangle", [1, 1, 0, 1, 1, 0], "coincide"),
        ("rectangle", [1.0, -1.0], "Ly = -1 must be positive"),
        ("square", [0, 0, 0, 1, 2, 0], "use Type rectangle"),
        ("drum2d", [1.0, 1.0], "must be below the radius"),
        ("hexagon", [1.0, 0, 0, 0, 0, 0, 1], "no component in the xy plane"),
        ("cylinder", [1.0, 0, 0, 0, 0, 0, 0], "axis is zero"),
        ("line", [0, 0, 0, 0, 0, 0], "coincide"),
        ("rectangle_minus_rectangle", [0, 0, 0, 2, 2, 0, 1, 1, 0, 3, 3, 0], "neither box"),
        ("rectangle_minus_rectangle", [0, 0, 0, 2, 2, 0, 0, 0, 0, 2, 2, 0], "leave no wall"),
        ("annulus_circle", [1.0, 1.0], "equal"),
    ],
)
def test_bad_parameters_say_place_rule_and_remedy(kind, parameters, words):
    with pytest.raises(InputError) as error:
        make_shape(kind, parameters, where="input.yaml:7: Particle.Zone_1")
    assert str(error.value).startswith(f"input.yaml:7: Particle.Zone_1: {kind} with Parameters")
    assert words in str(error.value)


@pytest.mark.parametrize(
    ("kinds", "flags", "parameters", "words"),
    [
        (None, None, [1.0], "give both"),
        (["circle"], ["plus", "minus"], [1.0], "give both"),
        (["circle"], ["add"], [1.0], "use plus or minus"),
        (["circle"], ["minus"], [1.0], "begin with plus"),
        (["circel"], ["plus"], [1.0], "did you mean circle"),
        (["circle", "circle"], ["plus", "plus"], [1.0, 2.0, 3.0], "cannot be shared out"),
    ],
)
def test_bad_complex_is_refused(kinds, flags, parameters, words):
    with pytest.raises(InputError, match=words):
        make_shape("complex", parameters, kinds, flags)


def test_plane_shape_is_refused_in_three_dimensions():
    with pytest.raises(InputError, match="use cuboid"):
        make_shape("rectangle", [1, 1], dimension=3)


def test_points_of_wrong_shape_are_refused():
    with pytest.raises(ValueError, match=r"shape \(n, 3\)"):
        make_shape("circle", [1.0]).inside(np.zeros((4, 2)))
