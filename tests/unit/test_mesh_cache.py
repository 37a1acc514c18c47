"""The cache of meshes: what is found again, what is not, and files that are damaged."""

import dataclasses

import numpy as np
import peridem as pd
import pytest
from peridem import meshing
from peridem.meshing import cache, clear_cache, make

GRAINS = [
    pd.Circle(radius=1e-3),
    pd.Hexagon(radius=1e-3),
    pd.Triangle(radius=1e-3),
    pd.ConcaveHexagon(radius=1e-3, neck=5e-4),
]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty cache, in memory and on disk."""
    monkeypatch.setenv("PERIDEM_CACHE", str(tmp_path / "meshes"))
    clear_cache(disk=False)
    yield tmp_path / "meshes"
    clear_cache(disk=False)


@pytest.fixture
def calls(monkeypatch):
    """The shapes that gmsh was asked to mesh."""
    made = []
    original = make._made

    def counted(shape, size):
        made.append(shape)
        return original(shape, size)

    monkeypatch.setattr(make, "_made", counted)
    return made


def files_of(folder):
    return sorted(file.name for file in folder.iterdir())


def test_500_grains_of_4_shapes_are_meshed_4_times(folder, calls):
    grains = [GRAINS[k % 4] for k in range(500)]
    meshes = [dataclasses.replace(grain).mesh(3e-4) for grain in grains]  # equal, not the same
    assert calls == GRAINS
    assert len({id(mesh) for mesh in meshes}) == 4
    assert len(files_of(folder)) == 4


def test_mesh_on_disk_is_taken_by_a_new_process(folder, calls):
    first = GRAINS[0].mesh(3e-4)
    clear_cache(disk=False)  # as in a new process
    second = GRAINS[0].mesh(3e-4)
    assert len(calls) == 1 and second is not first
    np.testing.assert_array_equal(first.points, second.points)
    np.testing.assert_array_equal(first.cells, second.cells)
    assert (first.cell_type, first.source) == (second.cell_type, second.source)
    assert second.cells.dtype == np.int32


def test_shape_size_and_version_tell_meshes_apart(folder, calls, monkeypatch):
    GRAINS[0].mesh(3e-4)
    GRAINS[0].mesh(3.0001e-4)
    pd.Circle(radius=1.0001e-3).mesh(3e-4)
    monkeypatch.setattr(make, "gmsh_version", lambda: "99.0")
    GRAINS[0].mesh(3e-4)
    assert len(calls) == len(files_of(folder)) == 4


def test_damaged_file_is_ignored_and_made_anew(folder, calls):
    mesh = GRAINS[0].mesh(3e-4)
    (file,) = folder.iterdir()
    whole = file.read_bytes()
    flipped = bytearray(whole)
    flipped[len(whole) // 3] ^= 1
    for content in (b"", b"nonsense", whole[: len(whole) // 2], bytes(flipped)):
        file.write_bytes(content)
        clear_cache(disk=False)
        np.testing.assert_array_equal(GRAINS[0].mesh(3e-4).points, mesh.points)
        assert file.read_bytes() == whole
    assert len(calls) == 5


def test_writing_is_whole_or_absent(folder, monkeypatch):
    def fails(*args, **kwargs):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez", fails)
    assert len(GRAINS[0].mesh(3e-4).points) > 10
    assert files_of(folder) == []


@pytest.mark.parametrize("value", ["off", "0", ""])
def test_cache_on_disk_can_be_switched_off(folder, calls, monkeypatch, value):
    monkeypatch.setenv("PERIDEM_CACHE", value)
    assert meshing.cache_folder() is None
    first = GRAINS[0].mesh(3e-4)
    assert GRAINS[0].mesh(3e-4) is first  # in memory
    assert len(calls) == 1 and not folder.exists()


def test_folder_follows_xdg_cache_home(monkeypatch, tmp_path):
    monkeypatch.delenv("PERIDEM_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert meshing.cache_folder() == tmp_path / "peridem"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert meshing.cache_folder() == tmp_path / ".cache" / "peridem"


def test_folder_that_cannot_be_written_costs_no_mesh(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("PERIDEM_CACHE", str(tmp_path / "file" / "below"))
    clear_cache(disk=False)
    assert len(GRAINS[1].mesh(3.1e-4).points) > 10


def test_clear_cache_removes_meshes_and_nothing_else(folder):
    GRAINS[0].mesh(3e-4)
    GRAINS[1].mesh(3e-4)
    (folder / "notes.txt").write_text("mine")
    assert clear_cache() == 2
    assert files_of(folder) == ["notes.txt"]
    assert clear_cache() == 0


def test_cache_false_neither_reads_nor_keeps(folder, calls):
    first = GRAINS[0].mesh(3e-4, cache=False)
    assert GRAINS[0].mesh(3e-4, cache=False) is not first
    assert len(calls) == 2 and not folder.exists()


def test_meshes_are_locked(folder):
    for mesh in (GRAINS[0].mesh(3e-4), GRAINS[0].mesh(3e-4, cache=False)):
        with pytest.raises(ValueError, match="read-only"):
            mesh.points[0] = 0.0
    clear_cache(disk=False)
    with pytest.raises(ValueError, match="read-only"):  # from disk too
        GRAINS[0].mesh(3e-4).cells[0] = 0


def test_memory_forgets_the_oldest(folder, monkeypatch):
    monkeypatch.setattr(cache, "_MOST_IN_MEMORY", 2)
    monkeypatch.setenv("PERIDEM_CACHE", "off")
    first, *_ = (grain.mesh(3e-4) for grain in GRAINS[:3])
    assert GRAINS[0].mesh(3e-4) is not first
