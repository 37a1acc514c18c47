"""VTU files, their time series, and what happens when they cannot be written."""

from __future__ import annotations

import csv
import errno
import resource
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from peridem import output
from peridem.errors import InputError
from peridem.output import OutputWriter, read_pvd, read_vtu, write_particle_locations
from peridem.vtu import _vtk_reason
from vtkmodules.vtkCommonMisc import vtkErrorCode

# Two triangles of one body, a quad of another; node 8 belongs to no element.
CELLS = [
    ("triangle", np.array([[0, 1, 2], [1, 3, 2]], dtype=np.int32)),
    ("quad", np.array([[4, 5, 6, 7]], dtype=np.int32)),
]
N_NODES = 9
# Values that text or single precision would spoil: 1/3, next to 1, smallest subnormal, -0, nan.
AWKWARD = [1 / 3, np.nextafter(1, 2), 5e-324, -0.0, np.nan, np.inf, 1e308, -1e-17, 0.1]


def arrays() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(1)
    return {
        "Velocity": rng.normal(size=(N_NODES, 3)),
        "Damage_Z": np.array(AWKWARD),
        "Particle_ID": np.array([0, 0, 0, 0, 1, 1, 1, 1, 2], dtype=np.int64),
        "Fixity": np.array([0, 1, 2, 3, 4, 5, 6, 7, 0], dtype=np.uint8),
    }


def points() -> np.ndarray:
    return np.random.default_rng(2).normal(size=(N_NODES, 3))


def writer(folder: Path, **options: Any) -> OutputWriter:
    return OutputWriter(
        folder, **{"tags": list(arrays()), "interval": 10, "cells": CELLS} | options
    )


def write(w: OutputWriter, k: int) -> Path:
    return w.write(k, 10 * k, 1e-6 * k / 3, arrays(), points=points())


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


@pytest.mark.parametrize("compress", ["zlib", "ascii", None])
def test_vtu_returns_every_value_bit_for_bit(tmp_path: Path, compress: Any) -> None:
    read = read_vtu(write(writer(tmp_path, compress=compress), 7))
    assert read["points"].tobytes() == points().tobytes()
    assert list(read["arrays"]) == list(arrays())
    for tag in ("Velocity", "Damage_Z"):
        want = arrays()[tag]
        assert read["arrays"][tag].dtype == np.float64
        # nan != nan, and text does not keep its sign bit: compare the others bitwise
        good = ~np.isnan(want)
        assert read["arrays"][tag][good].tobytes() == want[good].tobytes()
        assert np.isnan(read["arrays"][tag][~good]).all()
    for tag in ("Particle_ID", "Fixity"):
        assert read["arrays"][tag].dtype == np.int32
        assert read["arrays"][tag].tolist() == arrays()[tag].tolist()
    assert read["time"] == 1e-6 * 7 / 3
    assert read["step"] == 70


@pytest.mark.parametrize(
    ("compress", "mark"), [("zlib", b"vtkZLibDataCompressor"), (None, b'encoding="raw"')]
)
def test_vtu_is_appended_raw_binary(tmp_path: Path, compress: Any, mark: bytes) -> None:
    content = write(writer(tmp_path, compress=compress), 0).read_bytes()
    assert mark in content
    assert b'<AppendedData encoding="raw">' in content
    assert (b"vtkZLibDataCompressor" in content) == (compress == "zlib")


def test_vtu_elements_of_all_bodies_and_a_vertex_for_the_node_without(tmp_path: Path) -> None:
    cells = read_vtu(write(writer(tmp_path), 0))["cells"]
    assert [(name, nodes.tolist()) for name, nodes in cells] == [
        ("triangle", [[0, 1, 2], [1, 3, 2]]),
        ("quad", [[4, 5, 6, 7]]),
        ("vertex", [[8]]),
    ]


def test_vtu_points_only_has_one_vertex_per_node(tmp_path: Path) -> None:
    ((name, nodes),) = read_vtu(write(writer(tmp_path, fe_output=False), 0))["cells"]
    assert name == "vertex"
    assert nodes[:, 0].tolist() == list(range(N_NODES))


def test_writer_stores_views_without_contiguous_memory(tmp_path: Path) -> None:
    wide = np.random.default_rng(3).normal(size=(N_NODES, 6))
    given = {"Velocity": wide[:, ::2], "Theta": wide[:, 1]}
    path = writer(tmp_path, tags=["Theta"]).write(0, 0, 0.0, given, points=points())
    read = read_vtu(path)["arrays"]
    assert list(read) == ["Theta", "Velocity"]  # the deck's tags first
    np.testing.assert_array_equal(read["Velocity"], wide[:, ::2])
    np.testing.assert_array_equal(read["Theta"], wide[:, 1])


def test_pvd_is_complete_after_every_file(tmp_path: Path) -> None:
    w = writer(tmp_path, tag_pp="a-1")
    for k in (0, 1, 10, 2):
        write(w, k)
        entries = read_pvd(tmp_path / "output_a-1.pvd")
        assert all(path.exists() for _, path in entries)
        assert len(entries) == len(w.files)
    root = ElementTree.parse(tmp_path / "output_a-1.pvd").getroot()
    assert (root.tag, root.attrib["type"]) == ("VTKFile", "Collection")
    assert [path.name for path in w.files] == [f"output_a-1_{k}.vtu" for k in (0, 1, 2, 10)]
    assert [time for time, _ in entries] == [1e-6 * k / 3 for k in (0, 1, 2, 10)]
    assert names(tmp_path) == {"output_a-1.pvd", *(path.name for path in w.files)}


def test_pvd_lists_a_file_written_twice_once(tmp_path: Path) -> None:
    w = writer(tmp_path)
    write(w, 3)
    write(w, 3)
    assert len(read_pvd(w.series)) == 1


def test_second_run_lists_its_own_files_and_deletes_none(tmp_path: Path) -> None:
    first = writer(tmp_path)
    for k in range(4):
        write(first, k)
    other = tmp_path / "output_tag_9.vtu"
    other.touch()
    second = writer(tmp_path)
    write(second, 0)
    assert [path.name for _, path in read_pvd(second.series)] == ["output_0.vtu"]
    assert [path.name for path in second.older_files] == [f"output_{k}.vtu" for k in (1, 2, 3)]
    assert other.exists()


def test_resumed_run_keeps_the_series_up_to_its_start(tmp_path: Path) -> None:
    first = writer(tmp_path)
    for k in range(5):
        write(first, k)
    (tmp_path / "output_1.vtu").unlink()
    second = writer(tmp_path, keep_until=1e-6 * 2 / 3)
    write(second, 3)
    assert [path.name for _, path in read_pvd(second.series)] == [
        f"output_{k}.vtu" for k in (0, 2, 3)
    ]


@pytest.mark.parametrize(
    "error", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt()]
)
def test_interrupted_write_leaves_the_old_file_and_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException
) -> None:
    w = writer(tmp_path)
    before = write(w, 0).read_bytes()
    present = names(tmp_path)

    def half(path: Path, **_: object) -> None:
        path.write_bytes(b"half a file")
        raise error

    monkeypatch.setattr(output, "write_vtu", half)
    expected = InputError if isinstance(error, OSError) else KeyboardInterrupt
    with pytest.raises(expected) as caught:
        write(w, 0)
    if expected is InputError:
        assert "output_0.vtu: cannot be written: No space left on device" in str(caught.value)
        assert "--output" in str(caught.value)
    assert (tmp_path / "output_0.vtu").read_bytes() == before
    assert names(tmp_path) == present


@pytest.mark.parametrize("compress", ["zlib", "ascii", None])
def test_full_disk_is_an_input_error_without_a_partial_file(tmp_path: Path, compress: Any) -> None:
    n = 5000  # about 120 kB of positions against a limit of 20 kB per file
    w = writer(tmp_path, tags=[], cells=[], compress=compress)
    full = r"output_0\.vtu: cannot be written: (File too large|No space left on device); free some"
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, hard))
    try:
        with pytest.raises(InputError, match=full):
            w.write(0, 0, 0.0, {}, points=np.random.default_rng(4).normal(size=(n, 3)))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert names(tmp_path) == set()


def test_folder_is_created_with_its_parents(tmp_path: Path) -> None:
    assert write(writer(tmp_path / "a" / "b"), 0).exists()


def test_folder_that_is_a_file_is_an_input_error(tmp_path: Path) -> None:
    (tmp_path / "out").touch()
    with pytest.raises(InputError, match=r"output folder .*out: cannot be created: .*--output"):
        writer(tmp_path / "out")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"interval": 0}, r"Output\.Output_Interval = 0: must be at least 1"),
        ({"compress": "lz4"}, r"Output\.Compress_Type = lz4: is not one of zlib, ascii"),
        ({"tag_pp": "../x"}, r"Output\.Tag_PP = '\.\./x': becomes part of file names"),
    ],
)
def test_option_that_breaks_its_rule(tmp_path: Path, options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        writer(tmp_path, **options)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"Damage_Z": None}, "no array for the tags Damage_Z"),
        ({"Velocity": np.zeros((N_NODES, 2))}, r"Velocity has shape \(9, 2\); \(9, 3\) is needed"),
        ({"Damage_Z": np.zeros(N_NODES - 1)}, r"Damage_Z has shape \(8,\); \(9,\) is needed"),
    ],
)
def test_array_that_does_not_fit_the_nodes(
    tmp_path: Path, change: dict[str, Any], message: str
) -> None:
    given = {tag: values for tag, values in (arrays() | change).items() if values is not None}
    with pytest.raises(ValueError, match=message):
        writer(tmp_path).write(0, 0, 0.0, given, points=points())


def test_cell_that_names_a_node_outside_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"name a node outside 0\.\.8"):
        write(writer(tmp_path, cells=[("triangle", np.array([[0, 1, N_NODES]]))]), 0)


@pytest.mark.parametrize("compress", ["zlib", "ascii", None])
def test_truncated_file_is_refused_wherever_it_ends(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], compress: Any
) -> None:
    content = write(writer(tmp_path, compress=compress), 0).read_bytes()
    cut = tmp_path / "cut.vtu"
    for length in range(0, content.rindex(b"</VTKFile>"), 97):  # prime: ends in every section
        cut.write_bytes(content[:length])
        with pytest.raises(InputError, match=r"cut\.vtu: not a readable VTU file"):
            read_vtu(cut)
    assert capfd.readouterr() == ("", "")  # VTK's own complaints stay away


def test_damaged_file_is_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = write(writer(tmp_path), 0)
    path.write_bytes(path.read_bytes().replace(b"<Points>", b"<Pointy>"))
    with pytest.raises(InputError, match="not a readable VTU file"):
        read_vtu(path)
    assert capfd.readouterr() == ("", "")


def test_missing_file_is_an_input_error(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_vtu(tmp_path / "none.vtu")
    with pytest.raises(InputError, match="cannot be read"):
        read_pvd(tmp_path / "none.pvd")


def test_pvd_that_is_none_is_an_input_error(tmp_path: Path) -> None:
    (tmp_path / "x.pvd").write_text("<VTKFile><DataSet/>")
    with pytest.raises(InputError, match="not a PVD time series"):
        read_pvd(tmp_path / "x.pvd")


def test_vtk_s_reasons_are_plain_words() -> None:
    assert _vtk_reason(vtkErrorCode.OutOfDiskSpaceError) == "No space left on device"
    assert _vtk_reason(vtkErrorCode.CannotOpenFileError) == "the file cannot be opened"
    assert _vtk_reason(errno.EFBIG) == "File too large"  # codes of the system are passed on


def test_folder_in_place_of_a_file_is_named_with_its_remedy(tmp_path: Path) -> None:
    (tmp_path / "output.pvd").mkdir()
    said = r"output\.pvd: cannot be written: a folder has its name; rename or remove the folder"
    with pytest.raises(InputError, match=said):
        write(writer(tmp_path), 0)
    with pytest.raises(InputError, match=r"output\.pvd: cannot be read: .*; rename or remove the"):
        writer(tmp_path, keep_until=1.0)


def test_particle_locations_return_every_digit(tmp_path: Path) -> None:
    centre = np.random.default_rng(5).normal(size=(3, 3))
    radius = [0.1, 1 / 3, 2e-7]
    path = write_particle_locations(
        tmp_path / "locations.csv", zone=[0, 0, 1], centre=centre, radius=radius
    )
    with path.open() as stream:
        rows = list(csv.DictReader(stream))
    assert [(int(row["id"]), int(row["i"])) for row in rows] == [(0, 0), (1, 0), (2, 1)]
    assert [[float(row[c]) for c in "xyz"] for row in rows] == centre.tolist()
    assert [float(row["r"]) for row in rows] == radius
