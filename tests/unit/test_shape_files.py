"""Shapes from files: STL surfaces, mesh files, drawings of gmsh, and what is wrong with them."""

import struct

import numpy as np
import peridem as pd
import pytest
from peridem.mesh import Mesh, read_mesh, uniform_rectangle_mesh, write_msh, write_nodes
from peridem.meshing import mesh_quality

# a tetrahedron of volume 1/6, faces oriented outwards
CORNERS = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
FACES = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]


def stl_text(faces=FACES, corners=CORNERS):
    """Text of an STL file, whose corners are repeated for every triangle."""
    lines = ["solid body"]
    for face in faces:
        vertices = [f"vertex {x:.7g} {y:.7g} {z:.7g}" for x, y, z in (corners[k] for k in face)]
        lines += ["facet normal 0 0 0", "outer loop", *vertices, "endloop", "endfacet"]
    return "\n".join([*lines, "endsolid body", ""])


def stl_bytes(faces=FACES, corners=CORNERS):
    """A binary STL file: single precision."""
    rows = [
        struct.pack("<12fH", 0, 0, 0, *(x for k in face for x in corners[k]), 0) for face in faces
    ]
    return b"binary".ljust(80) + struct.pack("<I", len(faces)) + b"".join(rows)


@pytest.fixture
def stl(tmp_path):
    def write(content):
        file = tmp_path / "body.stl"
        file.write_bytes(content if isinstance(content, bytes) else content.encode())
        return file

    return write


@pytest.mark.parametrize("content", [stl_text(), stl_bytes()], ids=["text", "binary"])
@pytest.mark.parametrize(("unit", "length"), [("mm", 1e-3), (0.5, 0.5)])
def test_stl_gives_the_body_in_its_unit(stl, content, unit, length):
    shape = pd.Surface.from_stl(stl(content), unit=unit)
    assert len(shape.points) == 4  # corners of neighbours became one
    assert shape.geometry.volume == pytest.approx(length**3 / 6, rel=1e-6)
    np.testing.assert_allclose(shape.geometry.center, 0.25 * length)
    mesh = shape.mesh(0.2 * length)
    # where pieces of the surface meet in short edges, these are collapsed; in between it is exact
    assert mesh_quality(mesh).volumes.sum() == pytest.approx(length**3 / 6, rel=0.01)
    assert shape.geometry.inside(mesh.points).all()


def test_stl_merges_corners_that_differ_in_the_last_digit(stl):
    content = stl_text().replace("vertex 1 0 0", "vertex 0.9999999 0 0", 1)
    assert len(pd.Surface.from_stl(stl(content)).points) == 4


def test_surface_inside_out_is_turned():
    shape = pd.Surface(points=CORNERS, triangles=[face[::-1] for face in FACES])
    assert shape.geometry.volume == pytest.approx(1 / 6)
    assert shape == pd.Surface(points=CORNERS, triangles=FACES)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (stl_text(FACES[:3]), "is open: 3 edges belong to one face only, the first from ("),
        (stl_text([(0, 1, 2), *FACES[1:]]), "is not oriented: 3 edges are passed twice"),
        ("solid body\nendsolid body\n", "body.stl"),
        ("not a surface at all", "body.stl"),
        (b"", "body.stl"),
        (stl_bytes()[:-30], "body.stl"),
    ],
    ids=["open", "turned", "no facets", "nonsense", "empty", "cut"],
)
def test_bad_stl_is_refused_with_a_remedy(stl, content, words):
    with pytest.raises(pd.InputError) as error:
        pd.Surface.from_stl(stl(content))
    assert words in str(error.value)


def test_missing_stl_and_unknown_unit_are_refused(stl, tmp_path):
    with pytest.raises(pd.InputError, match="does not exist"):
        pd.Surface.from_stl(tmp_path / "none.stl")
    with pytest.raises(pd.InputError, match="unit = 'inch': no such unit; use m, dm, cm, mm"):
        pd.Surface.from_stl(stl(stl_text()), unit="inch")


def test_flat_surface_is_refused():
    with pytest.raises(pd.InputError, match="encloses no volume"):
        pd.Surface(points=[(x, y, 0) for x, y, _ in CORNERS], triangles=FACES)


MESHES = {
    "triangle": lambda: pd.ConcaveHexagon(radius=1e-3, neck=1e-4).mesh(2e-4),
    "tetra": lambda: pd.Cylinder(radius=1e-3, height=1e-3).mesh(5e-4),
    "quad": lambda: uniform_rectangle_mesh(0.0, 0.0, 0.0, 1.0, 0.7, 0.0, 0.1),
}


@pytest.mark.parametrize("kind", MESHES)
def test_written_mesh_is_read_back_bit_for_bit(tmp_path, kind):
    mesh = MESHES[kind]()
    file = tmp_path / "body.msh"
    write_msh(mesh, file)
    found = read_mesh(file, 3 if kind == "tetra" else 2)
    assert found.points.tobytes() == mesh.points.tobytes()
    assert found.cells.tobytes() == mesh.cells.tobytes()
    assert found.cell_type == mesh.cell_type == kind
    # the uniform mesh has trapezoidal volumes, which are the integrals of its quads
    np.testing.assert_allclose(mesh_quality(found).volumes, mesh_quality(mesh).volumes, rtol=1e-12)


def test_extreme_numbers_are_read_back_bit_for_bit(tmp_path):
    values = [5e-324, -1.7976931348623157e99, 0.1, 1 / 3, np.nextafter(1, 2), 2.0**-40]
    points = np.array([(x, y, 0.0) for x, y in zip(values, values[::-1], strict=True)])
    cells = np.array([(0, 1, 2), (3, 4, 5)], dtype=np.int32)
    file = tmp_path / "extreme.msh"
    write_msh(Mesh(points, "triangle", cells, None, "made"), file)
    assert pd.shapes.files.read_raw_mesh(file).points.tobytes() == points.tobytes()


def test_nodes_with_volumes_are_read_back_bit_for_bit(tmp_path):
    rng = np.random.default_rng(1)
    points, volumes = rng.random((20, 3)), rng.random(20)
    cloud = Mesh(points, "none", np.empty((0, 0), dtype=np.int32), volumes, "made")
    file = tmp_path / "nodes.csv"
    write_nodes(cloud, file)
    found = read_mesh(file, 3)
    assert found.points.tobytes() == points.tobytes()
    assert found.volumes.tobytes() == volumes.tobytes()
    with pytest.raises(pd.InputError, match="use write_nodes"):
        write_msh(cloud, tmp_path / "nodes.msh")
    with pytest.raises(pd.InputError, match="use write_msh"):
        write_nodes(MESHES["triangle"](), file)


@pytest.mark.parametrize("write", [write_msh, write_nodes])
def test_writers_refuse_other_endings(tmp_path, write):
    with pytest.raises(pd.InputError, match=r"ends in '\.vtk': must be"):
        write(MESHES["quad"](), tmp_path / "mesh.vtk")


@pytest.mark.parametrize(
    "shape",
    [
        pd.Annulus(inner_radius=1e-3, outer_radius=2e-3),
        pd.Circle(radius=1e-3) + pd.Circle(radius=1e-3, center=(5e-3, 0)),  # two pieces
        pd.CuboidMinusCuboid(
            inner=pd.Cuboid.between((1, 1, 1), (2, 2, 2)),
            outer=pd.Cuboid.between((0, 0, 0), (3, 3, 3)),
        ),
    ],
    ids=["ring", "two discs", "hollow"],
)
def test_mesh_file_is_a_shape_with_the_region_of_its_elements(tmp_path, shape):
    mesh = shape.mesh(0.2 * shape.geometry.bounding_radius)
    file = tmp_path / "body.msh"
    write_msh(mesh, file)
    found = pd.MeshFile(path=file)
    assert found.dimension == shape.dimension and found.mesh().points is not mesh.points
    np.testing.assert_array_equal(found.mesh().points, mesh.points)
    volume = mesh_quality(mesh).volumes.sum()
    assert found.geometry.volume == pytest.approx(volume, rel=1e-9)
    assert found.geometry.inside(mesh.points).all()
    outside = [shape.geometry.center + np.array([0.0, 1.1 * shape.geometry.bounding_radius, 0.0])]
    assert not found.geometry.inside(outside).any()
    assert found.deck_keys is None
    assert found == pd.MeshFile(path=file) and hash(found) == hash(pd.MeshFile(path=file))


def test_mesh_file_is_scaled_and_moved(tmp_path):
    file = tmp_path / "body.msh"
    mesh = MESHES["triangle"]()
    write_msh(mesh, file)
    shape = pd.MeshFile(path=file, unit="mm").moved((1, 2)).scaled(2)
    np.testing.assert_allclose(shape.mesh().points, 2e-3 * mesh.points + [2, 4, 0], rtol=1e-15)
    np.testing.assert_allclose(shape.centered().geometry.center, 0.0, atol=1e-14)


def test_nodes_without_elements_have_a_ball_around_them(tmp_path):
    file = tmp_path / "nodes.csv"
    file.write_text("id,x,y,volume\n0,0,0,1\n1,2,0,1\n2,2,2,1\n")
    shape = pd.MeshFile(path=file)
    # as a run takes it: the middle of the box, the farthest node
    assert shape.geometry.bounding_radius == pytest.approx(np.sqrt(2))
    np.testing.assert_allclose(shape.geometry.center, (1, 1, 0))
    np.testing.assert_array_equal(shape.scaled(3).mesh().volumes, 9.0)


def test_mesh_file_of_meshio_is_read(tmp_path):
    file = tmp_path / "body.vtk"
    file.write_text(
        "# vtk DataFile Version 3.0\nbody\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 3 double\n"
        "0 0 0 1 0 0 0 1 0\nCELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n5\n"
    )
    assert pd.MeshFile(path=file).geometry.volume == pytest.approx(0.5)


def test_bad_mesh_files_are_refused(tmp_path):
    file = tmp_path / "body.msh"
    write_msh(MESHES["triangle"](), file)
    for arguments, words in [
        ({"path": tmp_path / "none.msh"}, "does not exist"),
        ({"path": file, "dimension": 3}, "needs a solid mesh"),
        ({"path": file, "dimension": 4}, "must be 2 or 3"),
        ({"path": file, "unit": 0}, "unit = 0: must be positive"),
    ]:
        with pytest.raises(pd.InputError, match=words):
            pd.MeshFile(**arguments)
    with pytest.raises(pd.InputError, match="must be left out"):
        pd.MeshFile(path=file).mesh(1e-4)


def plate(gmsh):
    """Draw a plate of 2 x 1 with a round hole of radius 1/4."""
    occ = gmsh.model.occ
    occ.cut([(2, occ.addRectangle(0, 0, 0, 2, 1))], [(2, occ.addDisk(1, 0.5, 0, 0.25, 0.25))])


def test_drawing_function_is_meshed_and_has_its_region():
    shape = pd.GmshGeometry(source=plate, unit="mm")
    area = (2 - np.pi / 16) * 1e-6
    assert shape.dimension == 2
    # the hole in steps of 1/1000 of a turn
    assert shape.geometry.volume == pytest.approx(area, rel=1e-5)
    np.testing.assert_allclose(shape.geometry.center, (1e-3, 0.5e-3, 0), atol=1e-9)
    mesh = shape.mesh(1e-4)
    assert shape.mesh(1e-4) is mesh
    assert shape.geometry.inside(mesh.points).all()
    assert mesh_quality(mesh).volumes.sum() == pytest.approx(area, rel=0.01)
    moved = shape.centered().scaled(10)
    np.testing.assert_allclose(moved.geometry.center, 0.0, atol=1e-9)
    assert moved.geometry.volume == pytest.approx(100 * area, rel=1e-5)


def test_geo_file_is_meshed_with_the_size_asked_for(tmp_path):
    file = tmp_path / "box.geo"
    file.write_text(
        'SetFactory("OpenCASCADE");\nMesh.Algorithm = 5;\nMesh.MeshSizeMax = 0.4;\n'
        "Box(1) = {0, 0, 0, 1, 2, 1};\nMesh 1;\n"
    )
    shape = pd.GmshGeometry(source=file)
    assert shape.geometry.volume == pytest.approx(2.0)
    mesh = shape.mesh(0.2)
    box = pd.Cuboid.between((0, 0, 0), (1, 2, 1)).mesh(0.2)
    assert len(mesh.points) == pytest.approx(len(box.points), rel=0.1)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("Box(1) = {0, 0, 0, 1, 2, 1} blah\n", "cannot draw it"),
        ("Point(1) = {0, 0, 0, 1};\n", "no surface and no volume"),
        ("Box(1) = {0, 0, 0, 1, 2, 1};", "must end with a line break"),
    ],
)
def test_bad_geo_files_are_refused(tmp_path, text, words):
    file = tmp_path / "bad.geo"
    file.write_text(text)
    with pytest.raises(pd.InputError, match=words):
        pd.GmshGeometry(source=file).mesh(0.1)


def test_bad_drawings_are_refused(tmp_path):
    with pytest.raises(pd.InputError, match=r"cannot draw it \(division by zero\)"):
        pd.GmshGeometry(source=lambda gmsh: 1 / 0).mesh(0.1)
    with pytest.raises(pd.InputError, match="cannot be read"):
        pd.GmshGeometry(source=tmp_path / "none.geo")
    with pytest.raises(pd.InputError, match="source = 3: cannot be read"):
        pd.GmshGeometry(source=3)
