"""The placement file: columns by name, and one line of error for each problem."""

import pytest
from peridem.errors import InputError
from peridem.placement import Placement, read_particle_locations


@pytest.fixture
def csv(tmp_path):
    def write(text):
        path = tmp_path / "particle_locations.csv"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return path

    return write


def test_reads_bodies_in_order_with_lines(csv):
    path = csv("i, x, y, z, r, o\n1, 0.5, -0.25, 0.0, 0.125, 3.0\n\n0,1e-3,2,0,4,0\r\n")
    assert read_particle_locations(path, "loc_rad_orient", 2) == [
        Placement(1, (0.5, -0.25, 0.0), 0.125, 3.0, 2),
        Placement(0, (1e-3, 2.0, 0.0), 4.0, 0.0, 4),
    ]


def test_columns_are_found_by_name_in_any_order(csv):
    path = csv("o,r,z,y,x,i\n3,0.125,0,-0.25,0.5,1\n")
    assert read_particle_locations(path, "loc_rad_orient", 2) == [
        Placement(1, (0.5, -0.25, 0.0), 0.125, 3.0, 2)
    ]


@pytest.mark.parametrize("text", ["i,x,y,z,r\n0,1,2,3,4\n", "\ufeffi,x,y,z,r,o\n0,1,2,3,4,5\n"])
def test_orientation_is_left_open_for_loc_rad(csv, text):
    (body,) = read_particle_locations(csv(text), "loc_rad", 1)
    assert body == Placement(0, (1.0, 2.0, 3.0), 4.0, None, 2)


def test_axis_of_the_orientation_is_read_and_ids_are_passed_over(csv):
    path = csv("id,i,x,y,z,r,o,ax,ay,az\n7,0,1,2,3,4,5,0,-1,0.5\n")
    (body,) = read_particle_locations(path, "loc_rad_orient", 1)
    assert body == Placement(0, (1.0, 2.0, 3.0), 4.0, 5.0, 2, (0.0, -1.0, 0.5))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("i,x,y,z,r,o,ax\n0,1,2,3,4,5,1\n", [":1: header", "column ay, az is missing"]),
        ("i,x,y,z,r,o,ax,ay,az\n0,1,2,3,4,5,0,0,0\n", [":2: ax, ay, az = 0, 0, 0", "direction"]),
        ("i,x,y,z,r,o,ax,ay,az\n0,1,2,3,4,5,1,0,0\n", [":2: ax, ay, az = 1, 0, 0", "in 2D"]),
    ],
)
def test_bad_axis_is_refused(csv, text, words):
    with pytest.raises(InputError) as caught:
        read_particle_locations(csv(text), "loc_rad_orient", 1, dimension=2)
    assert all(word in str(caught.value) for word in words), caught.value


HEAD = "i,x,y,z,r,o\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("\n \n", "is empty"),
        (b"\xff\xfe\x00", "not text"),
        (HEAD, "only a header"),
        ("i,x,y,z,o\n0,0,0,0,1\n", ":1: header = 'i,x,y,z,o': column r is missing"),
        ("i,x,y,z,r\n0,0,0,0,1\n", "column o is missing; .*or use File_Data_Type: loc_rad"),
        ("i,x,y,z,r,o,x\n", ":1: column 'x': given more than once"),
        ("i,x,y,z,radius,o\n", "column 'radius': unknown; did you mean r"),
        ("i,x,y,z,r,o,colour\n", "column 'colour': unknown; use i, x, y, z, r and o"),
        ("0,0,0,0,1,0\n", "column '1': unknown"),
        (HEAD + "0,0,0,0,1\n", ":2: 5 values where the header names 6"),
        (HEAD + "0,0,0,0,1,0\n0,0,0,0,1,0,7\n", ":3: 7 values where the header names 6"),
        (HEAD + "0,zero,0,0,1,0\n", ":2: x = zero: must be a finite number"),
        (HEAD + "0,0,nan,0,1,0\n", ":2: y = nan: must be a finite number"),
        (HEAD + "0,0,0,0,inf,0\n", ":2: r = inf: must be a finite number"),
        (HEAD + "0,0,0,0,,0\n", ":2: r = : must be a finite number"),
        (HEAD + "0,0,0,0,0.0,0\n", ":2: r = 0.0: must be positive"),
        (HEAD + "0,0,0,0,-1,0\n", ":2: r = -1: must be positive"),
        (HEAD + "2,0,0,0,1,0\n", ":2: i = 2: must be a zone, an integer from 0 to 1"),
        (HEAD + "-1,0,0,0,1,0\n", ":2: i = -1: must be a zone"),
        (HEAD + "0.5,0,0,0,1,0\n", ":2: i = 0.5: must be a zone"),
    ],
)
def test_bad_file_says_line_rule_and_remedy(csv, text, words):
    path = csv(text)
    with pytest.raises(InputError, match=words) as error:
        read_particle_locations(path, "loc_rad_orient", 2)
    assert str(error.value).startswith(str(path))
    assert ";" in str(error.value)


def test_all_problems_are_reported_at_once_up_to_twenty(csv):
    path = csv(HEAD + "9,0,0,0,-1,0\n" + "0,a,0,0,1,0\n" * 30)
    with pytest.raises(InputError) as error:
        read_particle_locations(path, "loc_rad_orient", 1)
    lines = str(error.value).splitlines()
    assert len(lines) == 21
    assert ":2: i = 9" in lines[0]
    assert ":2: r = -1" in lines[1]
    assert lines[-1].endswith("and 12 more problems")  # 2 + 30 - 20


def test_missing_file_and_folder(tmp_path):
    with pytest.raises(InputError, match=r"none.csv: placement file does not exist"):
        read_particle_locations(tmp_path / "none.csv", "loc_rad", 1)
    with pytest.raises(InputError, match="cannot be read"):
        read_particle_locations(tmp_path, "loc_rad", 1)


def test_unknown_data_type_gets_a_suggestion(csv):
    with pytest.raises(InputError, match="did you mean loc_rad_orient"):
        read_particle_locations(csv(HEAD), "loc_rad_orientation", 1)
