"""Public shapes: values, deck keys, regions, what is refused."""

import dataclasses
import pickle

import numpy as np
import peridem as pd
import pytest
from peridem.geometry import SHAPE_TYPES, make_shape
from peridem.shapes import BodyShape

ROUND_OFF = 1e-12  # relative; a handful of operations

CUBE = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
CUBE_FACES = [(0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5)]

# every shape that a deck knows by name, with its area or volume in closed form
DECK_SHAPES = {
    "circle": (pd.Circle(radius=2.0), 4 * np.pi),
    "ellipse": (pd.Ellipse(a=2.0, b=1.0, angle=0.3), 2 * np.pi),
    "square": (pd.Square(side=2.0), 4.0),
    "rectangle": (pd.Rectangle(width=3.0, height=4.0), 12.0),
    "triangle": (pd.Triangle(radius=2.0), 3 * np.sqrt(3)),  # 3 sqrt(3)/4 r^2
    "hexagon": (pd.Hexagon(radius=2.0), 6 * np.sqrt(3)),  # 3 sqrt(3)/2 r^2
    # two trapezia of height r sqrt(3)/2 between the widths r and the neck's
    "drum2d": (pd.ConcaveHexagon(radius=2.0, neck=1.0), 3 * np.sqrt(3)),
    "annulus_circle": (pd.Annulus(inner_radius=1.0, outer_radius=2.0), 3 * np.pi),
    "annulus_rectangle": (
        pd.AnnulusRectangle(inner_width=1.0, inner_height=2.0, outer_width=3.0, outer_height=4.0),
        10.0,
    ),
    "rectangle_minus_rectangle": (
        pd.RectangleMinusRectangle(
            inner=pd.Rectangle.between((1, 1), (9, 8)), outer=pd.Rectangle.between((0, 0), (10, 8))
        ),
        24.0,
    ),
    "sphere": (pd.Sphere(radius=3.0), 36 * np.pi),
    "cube": (pd.Cube(side=2.0), 8.0),
    "cuboid": (pd.Cuboid(width=2.0, depth=3.0, height=6.0), 36.0),
    "cylinder": (pd.Cylinder(radius=3.0, height=8.0), 72 * np.pi),
    "cuboid_minus_cuboid": (
        pd.CuboidMinusCuboid(
            inner=pd.Cuboid.between((1, 1, 1), (2, 2, 2)),
            outer=pd.Cuboid.between((0, 0, 0), (3, 3, 3)),
        ),
        26.0,
    ),
    "complex": (pd.Circle(radius=4.0) - pd.Circle(radius=3.0), 7 * np.pi),
}
OTHERS = [
    (pd.Polygon(points=[(0, 0), (4, 0), (4, 3)]), 6.0),
    (pd.Polygon(points=[(0, 0), (4, 0), (4, 4), (0, 4)], holes=[[(1, 1), (2, 1), (2, 2)]]), 15.5),
    (pd.Polyhedron(points=CUBE, faces=CUBE_FACES), 1.0),
    # tetrahedron: a sixth of the cube
    (pd.Polyhedron.convex_hull([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]), 1 / 6),
]
ALL = [*DECK_SHAPES.values(), *OTHERS]


def id_of(case):
    return type(case[0]).__name__ if isinstance(case, tuple) else None


def test_every_plane_and_solid_type_of_a_deck_has_a_public_shape():
    assert set(DECK_SHAPES) == set(SHAPE_TYPES) - {"line"}


@pytest.mark.parametrize("case", ALL, ids=id_of)
def test_area_or_volume_matches_the_closed_form(case):
    shape, volume = case
    assert shape.geometry.volume == pytest.approx(volume, rel=ROUND_OFF)


@pytest.mark.parametrize("kind", DECK_SHAPES)
def test_deck_keys_describe_the_same_region(kind):
    shape, volume = DECK_SHAPES[kind]
    keys = shape.deck_keys
    assert keys["Type"] == kind
    found = make_shape(
        keys["Type"],
        keys["Parameters"],
        keys.get("Vec_Type"),
        keys.get("Vec_Flag"),
        shape.dimension,
    )
    assert found.volume == pytest.approx(volume, rel=ROUND_OFF)
    np.testing.assert_array_equal(found.box, shape.geometry.box)
    assert found.bounding_radius == shape.geometry.bounding_radius


@pytest.mark.parametrize("case", ALL, ids=id_of)
def test_moved_and_scaled_shapes_have_moved_and_scaled_regions(case):
    shape, volume = case
    shift = np.array([3.0, -2.0, 1.0])
    changed = shape.scaled(2.0).moved(shift)
    geometry, before = changed.geometry, shape.geometry
    assert geometry.volume == pytest.approx(2.0**shape.dimension * volume, rel=1e-11)
    np.testing.assert_allclose(geometry.center, 2 * before.center + shift, atol=1e-12)
    np.testing.assert_allclose(geometry.box, 2 * np.array(before.box) + shift, atol=1e-12)
    assert geometry.bounding_radius == pytest.approx(2 * before.bounding_radius)
    np.testing.assert_allclose(changed.centered().geometry.center, 0.0, atol=1e-12)
    if shape.deck_keys is not None:
        assert changed.deck_keys["Type"] == shape.deck_keys["Type"]


@pytest.mark.parametrize("case", ALL, ids=id_of)
def test_shapes_are_values(case):
    shape, _ = case
    twin = pickle.loads(pickle.dumps(shape))
    assert twin == shape and hash(twin) == hash(shape) and twin.key == shape.key
    assert shape.scaled(2.0) != shape and shape.scaled(2.0).key != shape.key
    with pytest.raises(dataclasses.FrozenInstanceError):
        shape.dimension = 1


def test_pickled_regions_still_find_points():
    for shape, inside in ((OTHERS[0][0], (3, 1, 0)), (OTHERS[2][0], (0.5, 0.5, 0.5))):
        assert shape.geometry.inside([inside]).all()  # fills what is kept
        assert pickle.loads(pickle.dumps(shape.geometry)).inside([inside]).all()


def test_repr_shows_what_was_given_and_can_be_evaluated():
    shape = pd.Ellipse(a=2e-3, b=1e-3, center=(1, 2))
    assert repr(shape) == "Ellipse(a=0.002, b=0.001, center=(1.0, 2.0, 0.0))"
    assert eval(repr(shape), vars(pd)) == shape
    assert repr(pd.Circle(radius=1)) == "Circle(radius=1.0)"


def test_short_deck_keys_are_those_of_the_original():
    assert pd.Circle(radius=1e-3).deck_keys == {"Type": "circle", "Parameters": [1e-3]}
    assert pd.ConcaveHexagon(radius=2.0, neck=1.0).deck_keys["Parameters"] == [2.0, 0.5]
    keys = pd.Hexagon(radius=2.0, center=(1, 2)).deck_keys
    assert keys["Parameters"] == [2.0, 1.0, 2.0, 0.0, 1.0, 0.0, 0.0]


def test_composite_of_deck_shapes_is_a_complex_shape():
    ring = pd.Circle(radius=4) - pd.Circle(radius=3) + pd.Rectangle.between((-3, -0.5), (0, 0.5))
    assert ring.deck_keys == {
        "Type": "complex",
        "Parameters": [4.0, 0, 0, 0, 3.0, 0, 0, 0, -3.0, -0.5, 0, 0.0, 0.5, 0],
        "Vec_Type": ["circle", "circle", "rectangle"],
        "Vec_Flag": ["plus", "minus", "plus"],
    }
    points = [(3.5, 0, 0), (1, 0, 0), (-1, 0, 0), (-1, 1, 0)]
    assert ring.geometry.inside(points).tolist() == [True, False, True, False]


def test_shapes_unknown_to_decks_have_a_ball_of_the_same_centre_and_radius():
    triangle = pd.Polygon(points=[(0, 0), (4, 0), (4, 3)])
    assert triangle.deck_keys is None
    # centroid (8/3, 1), farthest corner (0, 0)
    expected = [np.hypot(8 / 3, 1), 8 / 3, 1.0, 0.0]
    keys = triangle.nearest_deck_keys
    assert keys["Type"] == "circle"
    np.testing.assert_allclose(keys["Parameters"], expected, rtol=ROUND_OFF)
    cube = pd.Polyhedron(points=CUBE, faces=CUBE_FACES).nearest_deck_keys
    assert cube["Type"] == "sphere"
    np.testing.assert_allclose(cube["Parameters"], [np.sqrt(0.75), 0.5, 0.5, 0.5])
    assert (triangle + pd.Circle(radius=1)).deck_keys is None


def test_polygon_with_hole_contains_its_edges_but_not_the_hole():
    shape, _ = OTHERS[1]
    points = [(0, 0, 0), (0.5, 3, 0), (1.8, 1.4, 0), (1.5, 1, 0), (4.1, 1, 0), (4, 1, 9)]
    region = shape.geometry
    assert region.inside(points).tolist() == [True, True, False, True, False, True]
    strictly = region.contains(np.array(points, dtype=float), strict=True)
    assert strictly.tolist() == [False, True, False, False, False, False]
    assert not region.inside([(np.inf, 0, 0)]).any()


def test_polygon_does_not_depend_on_the_sense_of_its_corners_or_a_repeated_end():
    corners = [(0, 0), (4, 0), (4, 3)]
    given = [corners, corners[::-1], [*corners, corners[0]]]
    first, backwards, closed = (pd.Polygon(points=points).geometry for points in given)
    assert first.volume == backwards.volume == closed.volume == 6.0
    assert len(closed.outline) == 3


def test_regular_polygon_has_its_closed_form():
    shape = pd.Polygon.regular(corners=5, radius=2.0)
    # n/2 r^2 sin(2 pi/n)
    assert shape.geometry.volume == pytest.approx(10 * np.sin(2 * np.pi / 5), rel=ROUND_OFF)


def test_polyhedron_turns_its_faces_outwards():
    mixed = [face[::-1] if k % 2 else face for k, face in enumerate(CUBE_FACES)]
    for faces in (CUBE_FACES, mixed, [face[::-1] for face in CUBE_FACES]):
        solid = pd.Polyhedron(points=CUBE, faces=faces).geometry
        assert solid.volume == pytest.approx(1.0)
        points = [(0.5, 0.5, 0.5), (0, 0, 0), (1.01, 0.5, 0.5), (0.5, 0.5, 1)]
        assert solid.inside(points).tolist() == [True, True, False, True]
        strictly = solid.contains(np.array(points), strict=True)
        assert strictly.tolist() == [True, False, False, False]


def test_polyhedron_takes_concave_faces():
    corner = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    points = [(x, y, z) for z in (0, 1) for x, y in corner]
    sides = [(k, (k + 1) % 6, (k + 1) % 6 + 6, k + 6) for k in range(6)]
    shape = pd.Polyhedron(points=points, faces=[range(6), range(6, 12), *sides])
    assert shape.geometry.volume == pytest.approx(3.0)
    found = shape.geometry.inside([(0.5, 1.5, 0.5), (1.5, 1.5, 0.5), (1.5, 0.5, 0.5)])
    assert found.tolist() == [True, False, True]


def test_convex_hull_joins_triangles_in_one_plane():
    hull = pd.Polyhedron.convex_hull([*CUBE, (0.5, 0.5, 0.5), (0.2, 0.9, 0.4)])
    assert len(hull.points) == 8 and sorted(map(len, hull.faces)) == [4] * 6


BOW_TIE = [(0, 0), (1, 1), (1, 0), (0, 1)]
SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
FRAME = {"inner_width": 2, "inner_height": 1, "outer_width": 2, "outer_height": 2}


@pytest.mark.parametrize(
    ("make", "arguments", "words"),
    [
        (pd.Circle, {"radios": 1}, "Circle: radios: no such argument; did you mean radius?"),
        (pd.Circle, {"diameter": 1}, "write Circle(radius=..., center=...)"),
        (pd.Circle, {}, "Circle: radius: is missing"),
        (pd.Circle, {"radius": 0}, "radius = 0: must be positive; give a length in m"),
        (pd.Circle, {"radius": -1e-3}, "radius = -0.001: must be positive"),
        (pd.Circle, {"radius": float("nan")}, "must be finite"),
        (pd.Circle, {"radius": 1e30}, "must be between 1e-20 and 1e+20 m"),
        (pd.Circle, {"radius": "1 mm"}, "radius = '1 mm': must be a number in m"),
        (pd.Circle, {"radius": 1, "center": 3}, "center"),
        (pd.Circle, {"radius": 1, "center": (0, float("inf"))}, "must be finite"),
        (pd.Hexagon, {"radius": 1, "angle": None}, "angle = None: must be a number in rad"),
        (pd.ConcaveHexagon, {"radius": 1, "neck": 2}, "below twice the radius = 2"),
        (pd.Annulus, {"inner_radius": 2, "outer_radius": 1}, "must be below outer_radius = 1"),
        (pd.AnnulusRectangle, FRAME, "inner_width = 2: must be below outer_width = 2"),
        (pd.Rectangle.between, {"lower": (1, 0), "upper": (0, 1)}, "width = -1: must be positive"),
        (pd.Cylinder, {"radius": 1, "height": 1, "axis": (0, 0, 0)}, "axis"),
        (pd.Composite, {"members": [], "signs": []}, "0 members"),
        (pd.Composite, {"members": [3], "signs": [True]}, "must be a shape"),
        (pd.Composite, {"members": [pd.Circle(radius=1)], "signs": [False]}, "begin with True"),
        (pd.Polygon, {"points": BOW_TIE}, "at (0.5, 0.5): edges must not cross"),
        (pd.Polygon, {"points": SQUARE[:2]}, "2 corners: must be at least 3"),
        (pd.Polygon, {"points": [*SQUARE[:2], (2, 0)]}, "lie on a line"),
        (pd.Polygon, {"points": [(0, 0), (0, 0), (1, 0), (1, 1)]}, "points[0] and the next coin"),
        (pd.Polygon, {"points": [(0, 0), (1, float("nan")), (1, 1)]}, "points[1]"),
        (pd.Polygon, {"points": 3}, "must be points of two or three coordinates"),
        (pd.Polygon, {"points": "abc"}, "must be points of two or three coordinates"),
        (pd.Polygon, {"points": SQUARE, "holes": [[(2, 2), (3, 2), (3, 3)]]}, "inside and apart"),
        (pd.Polygon, {"points": SQUARE, "holes": 3}, "list of lists"),
        (pd.Polygon.regular, {"corners": 2, "radius": 1}, "at least 3"),
        (pd.Polyhedron, {"points": CUBE, "faces": CUBE_FACES[:5]}, "the surface is open"),
        (pd.Polyhedron, {"points": CUBE, "faces": [(0, 1, 8)] * 4}, "does not exist"),
        (pd.Polyhedron, {"points": CUBE, "faces": [(0, 1, 1)] * 4}, "each once"),
        (pd.Polyhedron, {"points": CUBE, "faces": [(0, 1, 3, 6), *CUBE_FACES[1:]]}, "off a plane"),
        (pd.Polyhedron, {"points": CUBE, "faces": [*CUBE_FACES, CUBE_FACES[0]]}, "more than two"),
        (pd.Polyhedron.convex_hull, {"points": SQUARE}, "span no volume"),
        (pd.Circle(radius=1).scaled, {"factor": -1}, "factor = -1: must be positive"),
    ],
)
def test_bad_arguments_say_which_value_rule_and_remedy(make, arguments, words):
    with pytest.raises(pd.InputError) as error:
        make(**arguments)
    assert words in str(error.value)


def test_arguments_without_name_are_refused():
    with pytest.raises(pd.InputError, match=r"write Circle\(radius=\.\.\., center=\.\.\.\)"):
        pd.Circle(1e-3)


def test_plane_and_solid_shapes_cannot_be_put_together():
    with pytest.raises(pd.InputError, match="plane shapes and solids"):
        pd.Circle(radius=1) + pd.Sphere(radius=1)


def test_all_shapes_are_exported():
    public = {name for name in pd.__all__ if isinstance(getattr(pd, name), type)}
    shapes = {name for name in public if issubclass(getattr(pd, name), BodyShape)}
    assert {type(shape).__name__ for shape, _ in ALL} <= shapes
    assert {"Surface", "MeshFile", "GmshGeometry"} <= shapes
