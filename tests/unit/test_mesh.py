"""Meshes: what is read from each format, and what is refused."""

import struct

import meshio
import numpy as np
import pytest
from peridem.errors import InputError
from peridem.mesh import Mesh, read_mesh, uniform_rectangle_mesh

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
TRIANGLES = [(1, 2, 3), (1, 3, 4)]
CUBE_CORNER = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]


def msh2(points=SQUARE, elements=tuple((2, nodes) for nodes in TRIANGLES), numbers=None):
    """Text of an MSH 2.2 file; elements are (Gmsh type, node numbers)."""
    numbers = numbers or range(1, len(points) + 1)
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(points))]
    lines += [
        f"{k} {x!r} {y!r} {z!r}"
        for k, (x, y, z) in zip(numbers, np.array(points).tolist(), strict=True)
    ]
    lines += ["$EndNodes", "$Elements", str(len(elements))]
    for k, (kind, nodes) in enumerate(elements, 1):
        lines.append(f"{k} {kind} 2 0 1 " + " ".join(map(str, nodes)))
    return "\n".join([*lines, "$EndElements", ""])


MSH41 = """$MeshFormat
4.1 0 8
$EndMeshFormat
$Entities
0 0 1 0
1 0 0 0 1 1 0 0 0
$EndEntities
$Nodes
2 4 1 4
1 1 0 2
1
2
0 0 0
1 0 0
2 1 0 2
3
4
1 1 0
0 1 0
$EndNodes
$Elements
1 2 1 2
2 1 2 2
1 1 2 3
2 1 3 4
$EndElements
"""


def msh41_binary():
    """The mesh of MSH41 in Gmsh's binary form, without entities."""
    out = b"$MeshFormat\n4.1 1 8\n" + struct.pack("<i", 1) + b"\n$EndMeshFormat\n$Nodes\n"
    out += struct.pack("<4Q", 1, 4, 1, 4) + struct.pack("<3iQ", 2, 1, 0, 4)
    out += struct.pack("<4Q", 1, 2, 3, 4) + SQUARE.tobytes() + b"\n$EndNodes\n$Elements\n"
    out += struct.pack("<4Q", 1, 2, 1, 2) + struct.pack("<3iQ", 2, 1, 2, 2)
    out += struct.pack("<8Q", 1, 1, 2, 3, 2, 1, 3, 4) + b"\n$EndElements\n"
    return out


def msh22_binary():
    """The same in MSH 2.2 binary: one header for the two triangles, two tags each."""
    out = b"$MeshFormat\n2.2 1 8\n" + struct.pack("<i", 1) + b"\n$EndMeshFormat\n$Nodes\n4\n"
    for k, point in enumerate(SQUARE, 1):
        out += struct.pack("<i3d", k, *point)
    out += b"\n$EndNodes\n$Elements\n2\n" + struct.pack("<3i", 2, 2, 2)
    for k, nodes in enumerate(TRIANGLES, 1):
        out += struct.pack("<6i", k, 0, 1, *nodes)
    return out + b"\n$EndElements\n"


@pytest.fixture
def file(tmp_path):
    def write(content, name="mesh.msh"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


@pytest.mark.parametrize(
    "content",
    [msh2(), msh2().replace("\n", "\r\n"), MSH41, msh41_binary(), msh22_binary()],
    ids=["2.2", "2.2 dos", "4.1", "4.1 binary", "2.2 binary"],
)
def test_gmsh_formats_give_nodes_and_triangles_in_the_files_order(file, content):
    mesh = read_mesh(file(content), 2)
    np.testing.assert_array_equal(mesh.points, SQUARE)
    assert mesh.cell_type == "triangle"
    assert mesh.cells.dtype == np.int32
    assert mesh.cells.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert mesh.volumes is None


def test_node_numbers_may_be_sparse_and_unordered(file):
    content = msh2(elements=[(2, (70, 5, 900)), (2, (70, 900, 6))], numbers=[70, 5, 900, 6])
    assert read_mesh(file(content), 2).cells.tolist() == [[0, 1, 2], [0, 2, 3]]


def test_parameters_of_parametric_nodes_are_skipped(file):
    content = MSH41.replace("2 1 0 2\n", "2 1 1 2\n").replace(
        "1 1 0\n0 1 0\n", "1 1 0 0.3 0.4\n0 1 0 0.5 0.6\n"
    )
    np.testing.assert_array_equal(read_mesh(file(content), 2).points, SQUARE)


def test_large_mesh_is_read_and_its_bad_line_named(file):
    """A file of several times the length that is looked at together, with lines on its borders."""
    x, y = np.meshgrid(np.arange(120) / 7, np.arange(120) / 3)
    points = np.column_stack([x.ravel(), y.ravel(), 0 * x.ravel()])
    corner = (np.arange(119)[:, None] * 120 + np.arange(1, 120)).ravel()
    quads = corner[:, None] + [0, 1, 121, 120]
    text = msh2(points, [(3, nodes) for nodes in quads.tolist()])
    assert len(text) > 5e5
    mesh = read_mesh(file(text), 2)
    np.testing.assert_array_equal(mesh.points, points)
    np.testing.assert_array_equal(mesh.cells, quads - 1)
    lines = text.split("\n")
    for wrong in (5 + 11000, len(lines) - 1000):  # a node, an element, with one number too many
        damaged = [*lines[:wrong], f"{lines[wrong]} 7", *lines[wrong + 1 :]]
        with pytest.raises(InputError, match=rf"mesh.msh:{wrong + 1}: (node|element) line"):
            read_mesh(file("\n".join(damaged)), 2)


def test_node_numbers_with_gaps_are_those_of_the_elements(file):
    """Sorted numbers with and without gaps, unsorted ones: always the same mesh."""
    for numbers in ([1, 2, 3, 4], [7, 8, 9, 10], [1, 5, 6, 900], [4, 3, 2, 1]):
        triangles = [(2, tuple(numbers[k] for k in nodes)) for nodes in ((0, 1, 2), (0, 2, 3))]
        mesh = read_mesh(file(msh2(SQUARE, triangles, numbers)), 2)
        assert mesh.cells.tolist() == [[0, 1, 2], [0, 2, 3]]
        beyond = [(2, (numbers[0], numbers[1], max(numbers) + 1))]
        with pytest.raises(InputError, match=rf"node {max(numbers) + 1} of the element does not"):
            read_mesh(file(msh2(SQUARE, beyond, numbers)), 2)


def test_other_elements_are_skipped(file):
    elements = [(15, (1,)), (1, (1, 2)), (3, (1, 2, 3, 4)), (1, (2, 3))]
    mesh = read_mesh(file(msh2(elements=elements)), 2)
    assert (mesh.cell_type, mesh.cells.tolist()) == ("quad", [[0, 1, 2, 3]])


def test_lines_and_tetrahedra_are_kept_in_their_dimension(file):
    bar = read_mesh(file(msh2([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [(1, (1, 2)), (1, (2, 3))])), 1)
    assert (bar.cell_type, bar.cells.tolist()) == ("line", [[0, 1], [1, 2]])
    solid = msh2(CUBE_CORNER, [(2, (1, 2, 3)), (4, (1, 3, 2, 4))])  # inverted: only |volume| counts
    assert read_mesh(file(solid), 3).cells.tolist() == [[0, 2, 1, 3]]


def test_vtu_gives_mesh_and_nodal_volumes(tmp_path):
    path = tmp_path / "mesh.vtu"
    volumes = np.array([1 / 3, 1 / 6, 1 / 3, 1 / 6])
    meshio.Mesh(
        SQUARE, [("triangle", np.array(TRIANGLES) - 1)], point_data={"Nodal_Volume": volumes}
    ).write(path)
    mesh = read_mesh(path, 2)
    np.testing.assert_array_equal(mesh.points, SQUARE)
    assert mesh.cells.tolist() == [[0, 1, 2], [0, 2, 3]]
    np.testing.assert_array_equal(mesh.volumes, volumes)


@pytest.mark.parametrize(
    ("text", "z"),
    [
        ("id,x,y,volume\n0,0,0,0.5\n1,1,0,0.25\n", 0),
        ("id, x, y, z, volume\n0,0,0,2,0.5\n1,1,0,2,0.25\n", 2),
    ],
)
def test_csv_gives_nodes_with_volumes(file, text, z):
    mesh = read_mesh(file(text, "nodes.csv"), 2)
    np.testing.assert_array_equal(mesh.points, [[0, 0, z], [1, 0, z]])
    np.testing.assert_array_equal(mesh.volumes, [0.5, 0.25])
    assert (mesh.cell_type, len(mesh.cells)) == ("none", 0)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("a,b\n1,2\n", ":1: header"),
        ("id,x,y,volume\n", "only a header"),
        ("id,x,y,volume\n0,0,0\n", ":2: 3 values where the header names 4"),
        ("id,x,y,volume\n0,0,y,1\n", ":2: line = .* not a number"),
        ("id,x,y,volume\n0.5,0,0,1\n", ":2: id = 0.5: must be an integer"),
        ("id,x,y,volume\n0,0,0,1\n0,1,0,1\n", "id = 0 is given twice"),
        ("id,x,y,volume\n0,0,0,1\n1,1,0,-1\n", "volume of node 1 .* = -1: must be positive"),
        ("id,x,y,volume\n0,0,0,1\n1,1,0,nan\n", "volume of node 1 .* = nan: must be positive"),
        ("id,x,y,volume\n0,0,0,1\n1,nan,0,1\n", "position of node 1 .*must be finite"),
    ],
)
def test_bad_csv_is_refused(file, text, words):
    with pytest.raises(InputError, match=words):
        read_mesh(file(text, "nodes.csv"), 2)


GOOD = msh2()


@pytest.mark.parametrize(
    ("content", "dimension", "words"),
    [
        ("", 2, "is empty"),
        ("hello\n", 2, "no \\$MeshFormat header"),
        (GOOD[: GOOD.index("$EndNodes") - 9], 2, ":5: 4 nodes are announced"),
        (GOOD[: GOOD.index("$Elements")], 2, "section \\$Elements is missing"),
        (GOOD[: GOOD.index("$EndElements") - 4], 2, ":12: 2 elements are announced"),
        (GOOD.replace("\n4\n", "\n5\n"), 2, ":5: 5 nodes are announced"),
        (GOOD.replace("\n4\n", "\nfour\n"), 2, ":5: number of nodes = 'four'"),
        (GOOD.replace("3 1.0 1.0 0.0", "3 1.0 one 0.0"), 2, ":8: node line = '3 1.0 one 0.0'"),
        (GOOD.replace("3 1.0 1.0 0.0", "3 1.0 1.0"), 2, ":8: node line = '3 1.0 1.0'"),
        (GOOD.replace("3 1.0 1.0 0.0", "3 1.0 nan 0.0"), 2, "position of node 2 .*must be finite"),
        (GOOD.replace("3 1.0 1.0 0.0", "2 1.0 1.0 0.0"), 2, "node number 2 is given twice"),
        (GOOD.replace("2 2 2 0 1 1 3 4", "2 2 2 0 1 1 3 9"), 2, ":14: node 9 of the element"),
        (GOOD.replace("2 2 2 0 1 1 3 4", "2 2 2 0 1 1 3 0"), 2, ":14: node 0 of the element"),
        (GOOD.replace("2 2 2 0 1 1 3 4", "2 2 2 0 1 1 3"), 2, ":14: element line"),
        (GOOD.replace("2 2 2 0 1 1 3 4", "2 2 2 0 1 1 3 x"), 2, ":14: element line"),
        (GOOD.replace("2 2 2 0 1 1 3 4", ""), 2, ":14: element line"),
        (msh2(elements=[(1, (1, 2))]), 2, "no triangle or quad .*found: 1 line"),
        (msh2(elements=[(9, (1, 2, 3, 4, 1, 2))]), 2, "first order.*found: 1 triangle6"),
        (msh2(elements=[(2, (1, 2, 3)), (3, (1, 2, 3, 4))]), 2, "1 triangles and 1 quads"),
        (GOOD, 3, "flat in z"),
        (GOOD, 1, "extends 1 in y"),
        (msh2(CUBE_CORNER, [(4, (1, 2, 3, 4))]), 2, "extends 1 in z: must be flat"),
        (msh2(elements=[(2, (1, 2, 3))]), 2, "1 of 4 nodes belong to no triangle, .* node 3 "),
        (msh2([*SQUARE[:3], (1, 1 + 1e-12, 0)]), 2, "nodes 2 and 3 .* coincide"),
        (msh2([*SQUARE[:2], (2, 0, 0), (0, 1, 0)]), 2, "1 triangle elements have no volume"),
        (msh2(elements=[(2, (1, 2, 2)), (2, (1, 3, 4))]), 2, "have no volume"),
        (msh41_binary()[:-60], 2, "section \\$Elements: \\$EndElements is missing"),
        (MSH41.replace("1 1 0\n0 1 0\n", "1 1 0\n"), 2, "\\$Nodes: 6 values are announced"),
        (MSH41.replace("2 4 1 4", "2 5 1 5"), 2, "\\$Nodes: 5 nodes are announced and 4 given"),
        (MSH41.replace("1 2 1 2", "1 3 1 3"), 2, "3 elements are announced and 2 given"),
        (MSH41.replace("2 1 3 4\n$End", "2 1 3 8\n$End"), 2, "node 8 of the element"),
        (MSH41.replace("2 1 3 4\n$End", "2 1 3 0\n$End"), 2, "node 0 of the element"),
        (MSH41.replace("2 1 3 4\n$End", "2 1 3 x\n$End"), 2, "not a number"),
        (MSH41.replace("2 1 3 4\n$End", "2 1 3 1.5\n$End"), 2, "an integer belongs"),
        (MSH41.replace("1\n2\n0 0 0", "1\n4000000000\n0 0 0"), 2, "node 2 of the element"),
        (MSH41.replace("4.1 0", "7.5 0"), 2, "MSH version = 7.5"),
        (msh22_binary().replace(b"$Elements\n2", b"$Elements\n9"), 2, "\\$Elements: "),
    ],
)
def test_bad_msh_says_what_is_wrong(file, content, dimension, words, capsys):
    path = file(content)
    with pytest.raises(InputError, match=words) as error:
        read_mesh(path, dimension)
    assert str(error.value).startswith(str(path))
    assert ";" in str(error.value)
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("content", ["<VTKFile/>", "<VTKFile type='UnstructuredGrid'><Piece", "x"])
def test_bad_vtu_is_refused_without_leaving_the_program(file, content):
    with pytest.raises(InputError, match=r"mesh.vtu: the file"):
        read_mesh(file(content, "mesh.vtu"), 2)


def test_missing_file_folder_and_unknown_format(tmp_path, file):
    with pytest.raises(InputError, match=r"none.msh: mesh file does not exist"):
        read_mesh(tmp_path / "none.msh", 2)
    (tmp_path / "folder.msh").mkdir()
    with pytest.raises(InputError, match="cannot be read"):
        read_mesh(tmp_path / "folder.msh", 2)
    with pytest.raises(InputError, match=r"only .msh, .vtu and .csv"):
        read_mesh(file("x", "mesh.stl"), 2)


def test_every_prefix_of_a_mesh_is_refused_or_whole(file):
    """Cut the file at each byte: never another exception, never a smaller mesh."""
    complete = GOOD.rindex("$EndElements") + len("$EndElements")
    for cut in range(complete):
        with pytest.raises(InputError):
            read_mesh(file(GOOD[:cut]), 2)
    assert len(read_mesh(file(GOOD[:complete]), 2).cells) == 2


@pytest.mark.parametrize("content", [MSH41.encode(), msh41_binary(), msh22_binary()])
def test_damaged_bytes_give_a_mesh_or_an_input_error(file, content):
    rng = np.random.default_rng(3)
    for _ in range(150):
        damaged = bytearray(content)
        damaged[rng.integers(len(damaged))] = rng.integers(256)
        try:
            mesh = read_mesh(file(bytes(damaged)), 2)
        except InputError:
            continue
        assert np.isfinite(mesh.points).all()
        assert mesh.cells.min() >= 0
        assert mesh.cells.max() < len(mesh.points)


def test_uniform_mesh_counts_orders_and_weighs_its_nodes():
    # 0.75 / 0.2 gives 3 quads of 0.25, 0.5 / 0.2 gives 2 of 0.25: corners, edges, inside
    # own 1, 2, 4 quarters of a cell
    mesh = uniform_rectangle_mesh(1.0, 2.0, 0.5, 1.75, 2.5, 0.5, 0.2)
    assert isinstance(mesh, Mesh)
    x, y = [1.0, 1.25, 1.5, 1.75], [2.0, 2.25, 2.5]
    np.testing.assert_array_equal(mesh.points, [[a, b, 0.5] for b in y for a in x])
    quarters = [1, 2, 2, 1, 2, 4, 4, 2, 1, 2, 2, 1]
    np.testing.assert_allclose(mesh.volumes, np.array(quarters) * 0.25**2 / 4, rtol=1e-15)
    assert mesh.cell_type == "quad"
    assert mesh.cells[:4].tolist() == [[0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [4, 5, 9, 8]]
    assert len(mesh.cells) == 6


def test_uniform_mesh_of_the_reference_case():
    # single_rect_inbuilt of the original: 231 nodes, the second at 2e-4, volumes 1e-8 in
    # the corner and 2e-8 beside it
    mesh = uniform_rectangle_mesh(0, 0, 0, 0.004, 0.002, 0, 1.999e-4)
    assert mesh.points.shape == (231, 3)
    np.testing.assert_allclose(mesh.points[[1, 21]], [[2e-4, 0, 0], [0, 2e-4, 0]], rtol=1e-15)
    np.testing.assert_allclose(mesh.volumes[:2], [1e-8, 2e-8], rtol=1e-12)


@pytest.mark.parametrize(
    ("h", "words"),
    [
        (0.0, "must be finite and the size positive"),
        (-1.0, "must be finite and the size positive"),
        (float("nan"), "must be finite"),
        (1.5, "longer than the rectangle's side 1 in x"),
        (1e-4, "100020001 nodes"),
        (1e-300, "elements in x"),
    ],
)
def test_uniform_mesh_refuses_impossible_sizes(h, words):
    with pytest.raises(InputError, match=words):
        uniform_rectangle_mesh(0, 0, 0, 1, 1, 0, h, where="input.yaml:20: Mesh.Zone_1")
