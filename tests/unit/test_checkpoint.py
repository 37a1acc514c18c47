"""Checkpoints and the Restart block: what is kept, refused, fallen back to."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from helpers import MATERIAL, DeckFolder, box_mesh, changed, single_deck
from peridem import DEMModel, InputError, PeridemWarning
from peridem import checkpoint as ck
from peridem.checkpoint import CheckpointWriter, DamagedCheckpointError, read_checkpoint
from peridem.output import read_pvd, read_vtu
from peridem.restart import deduce_broken, restore
from peridem.vtu import Topology, write_vtu

STEPS = 60
TAGS = ["Displacement", "Velocity"]


@pytest.fixture
def plate(deck_folder: DeckFolder) -> dict[str, Any]:
    """Deck of a square of 25 nodes shaken in shear; it cracks, and cracks close."""
    mesh = deck_folder.mesh("plate", box_mesh((1e-3, 1e-3), (4, 4), jiggle=0.2))
    shape = {"Type": "square", "Parameters": [1.0e-3]}
    deck = single_deck(mesh, shape, dt=2.0e-7, steps=STEPS)
    deck["Material"]["Zone_1"] = {**MATERIAL, "Gc": 0.05}
    deck["Output"] = {"Output_Interval": 10, "Tags": TAGS}
    deck["Force_BC"] = {
        "Sets": 1,
        "Set_1": {
            "Particle_List": [0],
            "Direction": [1],
            "Time_Function": {"Type": "sin", "Parameters": [2.0e12, 2.5e5]},
            "Spatial_Function": {"Type": "linear_y", "Parameters": [1.0]},
        },
    }
    return dict(deck)


@pytest.fixture
def out(tmp_path: Path) -> Path:
    return tmp_path / "out"


def started(deck: Path, steps: int = 0) -> DEMModel:
    model = DEMModel.from_deck(deck, threads=1)
    model.step(steps)
    return model


def assert_same(found: DEMModel, expected: DEMModel) -> None:
    assert (found.n, found.time) == (expected.n, expected.time)
    for name in ("x", "u", "v", "f", "theta", "damage_z"):
        values = getattr(found.state, name)
        np.testing.assert_array_equal(values, getattr(expected.state, name), err_msg=name)
    np.testing.assert_array_equal(found.bonds.intact, expected.bonds.intact)


def test_case_breaks_some_bonds(deck_folder: DeckFolder, plate: dict[str, Any]) -> None:
    known = started(deck_folder.write(plate), STEPS).summary()
    assert 0 < known["broken_bonds"] < known["bonds"]


# What is in the file ------------------------------------------------------------------------


def test_checkpoint_holds_the_state(
    deck_folder: DeckFolder, plate: dict[str, Any], out: Path
) -> None:
    path = deck_folder.write(plate)
    model = started(path, 40)
    saved = read_checkpoint(CheckpointWriter(out, model, 7).write(model))
    assert saved.path == out / "checkpoint_40.h5"
    assert (saved.step, saved.time, saved.dt, saved.every) == (40, model.time, model.dt, 7)
    assert saved.compatibility == "corrected"
    assert saved.deck_sha256 == model.deck.sha256
    assert set(saved.inputs) == {"Mesh.Zone_1.File"}
    assert [place.resolve() for place in saved.deck_paths] == [path, path]
    for name, values in saved.nodes.items():
        np.testing.assert_array_equal(values, getattr(model.state, name), err_msg=name)
    np.testing.assert_array_equal(saved.intact, model.bonds.intact)
    assert saved.spring_nodes.shape == (0, 2)


def test_checkpoint_is_plain_hdf5(
    deck_folder: DeckFolder, plate: dict[str, Any], out: Path
) -> None:
    model = started(deck_folder.write(plate), 5)
    with h5py.File(CheckpointWriter(out, model).write(model)) as file:
        assert set(file) == {"bonds", "friction", "inputs", "nodes"}
        assert file.attrs["step"] == 5


def test_last_two_are_kept(deck_folder: DeckFolder, plate: dict[str, Any], out: Path) -> None:
    out.mkdir()
    half_written, of_other_run = out / ".checkpoint_7.h5.tmp", out / "checkpoint_999.h5"
    for file in (half_written, of_other_run, out / "checkpoint_other_3.h5", out / "mine.h5"):
        file.write_bytes(b"")
    with pytest.warns(
        PeridemWarning, match=r"earlier run are in .*out: checkpoint_999.h5; renamed"
    ):
        DEMModel.from_deck(deck_folder.write(plate), threads=1).run(out, checkpoint_every=25)
    assert (out / "checkpoint_999.h5.old").is_file()
    names = {path.name for path in out.iterdir() if path.suffix in (".h5", ".tmp")}
    # Steps 25, 50 and the last; other names and other tags are not ours to remove.
    assert names == {"checkpoint_50.h5", "checkpoint_60.h5", "checkpoint_other_3.h5", "mine.h5"}


def test_checkpoints_carry_the_tag(
    deck_folder: DeckFolder, plate: dict[str, Any], out: Path
) -> None:
    for tag, steps in (("a", 12), ("b_1", 34)):
        deck = deck_folder.write(changed(plate, {"Output.Tag_PP": tag}))
        DEMModel.from_deck(deck, threads=1).run(out, steps=steps, checkpoint_every=STEPS)
    assert DEMModel.resume(out, threads=1, tag="a").n == 12
    assert DEMModel.resume(out, threads=1, tag="b_1").n == 34
    with pytest.raises(InputError, match=r"several runs.*'a', 'b_1'.*--tag"):
        DEMModel.resume(out)


def test_interval_below_one_and_missing_folder_are_refused(
    deck_folder: DeckFolder, plate: dict[str, Any], out: Path
) -> None:
    model = DEMModel.from_deck(deck_folder.write(plate), threads=1)
    with pytest.raises(InputError, match="checkpoint_every = 0: must be at least 1"):
        model.run(out, checkpoint_every=0)
    with pytest.raises(InputError, match="checkpoint_every = 5: checkpoints need a folder"):
        model.run(checkpoint_every=5)


# Damage -------------------------------------------------------------------------------------


@pytest.fixture
def written(deck_folder: DeckFolder, plate: dict[str, Any], out: Path) -> Path:
    """Newest of two checkpoints, of steps 20 and 40."""
    model = DEMModel.from_deck(deck_folder.write(plate), threads=1)
    model.run(out, steps=40, checkpoint_every=20)
    return out / "checkpoint_40.h5"


def test_cut_checkpoint_is_refused(written: Path) -> None:
    whole = written.read_bytes()
    rng = np.random.default_rng(1)
    lengths = [0, 1, 100, 511, 512, 513, *rng.integers(514, len(whole) - 1, 20), len(whole) - 1]
    for length in map(int, lengths):
        written.write_bytes(whole[:length])
        with pytest.raises(DamagedCheckpointError, match=r"checkpoint_40\.h5.*damaged"):
            read_checkpoint(written)
    written.write_bytes(whole + b"\0")
    with pytest.raises(DamagedCheckpointError):
        read_checkpoint(written)


def test_every_flipped_bit_is_found(written: Path) -> None:
    whole = written.read_bytes()
    rng = np.random.default_rng(2)
    places = [*range(120), *rng.integers(120, len(whole), 80)]  # all of the header's text
    for place in map(int, places):
        damaged = bytearray(whole)
        damaged[place] ^= 1 << int(rng.integers(8))
        written.write_bytes(damaged)
        with pytest.raises(DamagedCheckpointError):
            read_checkpoint(written)


def test_damaged_checkpoint_falls_back_to_the_one_before(
    written: Path, out: Path, deck_folder: DeckFolder, plate: dict[str, Any]
) -> None:
    written.write_bytes(written.read_bytes()[:-9])
    model = DEMModel.resume(out, threads=1)
    assert model.n == 20
    assert "checkpoint_40.h5: the checkpoint is damaged" in model.warnings[-1]
    assert model.warnings[-1].endswith("going on from checkpoint_20.h5")
    with pytest.warns(PeridemWarning, match="the checkpoint is damaged"):
        model.run(out, steps=5)
    assert sorted(path.name for path in out.glob("*.h5")) == [
        "checkpoint_20.h5",
        "checkpoint_25.h5",
    ]
    assert_same(model, started(deck_folder.write(plate), 25))


def test_no_usable_checkpoint_is_an_error(written: Path, out: Path, tmp_path: Path) -> None:
    for path in out.glob("*.h5"):
        path.write_bytes(b"peridem checkpoint, schema 1\n")
    with pytest.raises(InputError, match="no checkpoint is usable") as caught:
        DEMModel.resume(out)
    assert str(caught.value).count("damaged") == 2
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match=r"no checkpoint .* is there; run the deck with"):
        DEMModel.resume(tmp_path / "empty")
    with pytest.raises(InputError, match="nowhere: the output folder cannot be read"):
        DEMModel.resume(tmp_path / "nowhere")


def test_newer_schema_is_refused(written: Path, out: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(ck, "SCHEMA", 2)
        deck = ck.read_checkpoint(written).deck_paths[1]
        model = started(deck, 3)
        CheckpointWriter(out, model).write(model)
    with pytest.raises(InputError, match=r"schema = 2: this version reads up to 1; update") as no:
        DEMModel.resume(out)
    assert not isinstance(no.value, DamagedCheckpointError)  # no silent step back


def _no_space(*_: object) -> None:
    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def _half_written(path: Path, data: bytes) -> None:
    with path.open("wb") as stream:
        stream.write(data[: len(data) // 2])
    _no_space()


@pytest.mark.parametrize(
    "broken",
    [
        (Path, "write_bytes", _half_written),
        (os, "fsync", _no_space),
        (Path, "replace", _no_space),
    ],
)
def test_disk_error_leaves_older_checkpoints_whole(
    written: Path,
    out: Path,
    monkeypatch: pytest.MonkeyPatch,
    broken: tuple[Any, str, Callable[..., None]],
) -> None:
    before = {path.name: path.read_bytes() for path in out.glob("*.h5")}
    model = DEMModel.resume(out, threads=1)
    model.step(3)
    writer = CheckpointWriter(out, model, None, model.last_checkpoint)
    with monkeypatch.context() as patch:
        patch.setattr(*broken)
        with pytest.raises(InputError, match=r"checkpoint_43\.h5: cannot be written: No space"):
            writer.write(model)
    assert {path.name: path.read_bytes() for path in out.glob("*.h5")} == before
    assert not list(out.glob(".*.tmp"))
    assert writer.write(model).name == "checkpoint_43.h5"  # and the next one succeeds


# Belonging ----------------------------------------------------------------------------------


def test_changed_deck_is_refused(written: Path, out: Path) -> None:
    deck = read_checkpoint(written).deck_paths[1]
    deck.write_text(deck.read_text() + "\n")
    with pytest.raises(InputError, match=r"is of another deck, or .* has changed since; restore"):
        DEMModel.resume(out)


def test_changed_mesh_is_refused(written: Path, out: Path, deck_folder: DeckFolder) -> None:
    deck_folder.mesh("plate", box_mesh((1e-3, 1e-3), (4, 4), jiggle=0.1))
    with pytest.raises(InputError, match=r"the files of Mesh\.Zone_1\.File have changed"):
        DEMModel.resume(out)


def test_other_mode_is_refused(written: Path) -> None:
    saved = read_checkpoint(written)
    model = DEMModel.from_deck(saved.deck_paths[1], threads=1, compatibility="original")
    with pytest.raises(InputError, match="compatibility = corrected: the model's is original"):
        restore(model, saved)
    assert not model.started


def test_mode_of_the_run_is_kept(deck_folder: DeckFolder, plate: dict[str, Any], out: Path) -> None:
    model = DEMModel.from_deck(deck_folder.write(plate), threads=1, compatibility="original")
    model.run(out, steps=3, checkpoint_every=9)
    assert DEMModel.resume(out, threads=1).compatibility == "original"


def test_started_model_is_not_restored(written: Path) -> None:
    saved = read_checkpoint(written)
    with pytest.raises(InputError, match="has started already"):
        restore(started(saved.deck_paths[1], 1), saved)


def test_other_instructions_warn(
    deck_folder: DeckFolder, plate: dict[str, Any], out: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    deck = deck_folder.write(plate)
    monkeypatch.setenv("PERIDEM_SIMD", "baseline")
    DEMModel.from_deck(deck, threads=1).run(out, steps=9, checkpoint_every=9)
    assert DEMModel.resume(out, threads=1).warnings == []
    monkeypatch.setattr(DEMModel, "instruction_set", property(lambda model: "avx2"))
    assert "not go on bit for bit; set PERIDEM_SIMD=baseline" in DEMModel.resume(out).warnings[0]


def test_folder_may_move_with_its_deck(written: Path, out: Path, tmp_path: Path) -> None:
    moved = tmp_path / "elsewhere"
    moved.mkdir()
    for path in list(tmp_path.iterdir()):
        if path != moved:
            shutil.move(path, moved)
    assert DEMModel.resume(moved / "out", threads=1).n == 40
    read_checkpoint(moved / "out" / written.name).deck_paths[0].unlink()
    with pytest.raises(InputError, match="its deck is no longer there"):
        DEMModel.resume(moved / "out")


# Restart block ------------------------------------------------------------------------------


def restarted(
    deck_folder: DeckFolder, plate: dict[str, Any], file: Path, step: int, **changes: Any
) -> DEMModel:
    block = {"Restart.File": str(file), "Restart.Step": step}
    model: DEMModel = deck_folder.model(plate, {**block, **changes})
    return model


def test_restart_block_with_checkpoint_is_exact(
    written: Path, deck_folder: DeckFolder, plate: dict[str, Any], tmp_path: Path
) -> None:
    longer = {"Model.Final_Time": 2 * plate["Model"]["Final_Time"], "Model.Time_Steps": 2 * STEPS}
    model = restarted(deck_folder, plate, written, 40, **longer, **{"Output.Output_Interval": 4})
    assert (model.n, model.started, model.warnings) == (40, True, [])
    model.run(tmp_path / "new")
    assert model.n == 2 * STEPS
    assert_same(model, started(deck_folder.write(changed(plate, longer)), 2 * STEPS))
    assert [path.name for _, path in read_pvd(tmp_path / "new" / "output.pvd")] == [
        f"output_{k}.vtu" for k in range(10, 31)
    ]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"Material.Zone_1.Gc": 0.06}, "other bodies, materials, contact or loads"),
        ({"Force_BC.Gravity": [0, -10, 0]}, "other bodies, materials, contact or loads"),
        ({"Model.Compatibility": "original"}, "compatibility = corrected"),
        ({"Model.Time_Steps": 2 * STEPS}, "time step = .* the deck's is .* same proportion"),
        ({"Restart.Step": 30}, r"Restart\.Step = 30: the checkpoint is of step 40"),
        ({"Restart.Step": STEPS + 1}, r"Restart\.Step = 61: must be at most Time_Steps = 60"),
        ({"Restart.Change_Reference_Free_Dofs": True}, "Change_Reference.*is not supported"),
    ],
)
def test_restart_block_refuses(
    written: Path,
    deck_folder: DeckFolder,
    plate: dict[str, Any],
    changes: dict[str, Any],
    message: str,
) -> None:
    with pytest.raises(InputError, match=message):
        restarted(deck_folder, plate, written, 40, **changes)


def write_state(path: Path, model: DEMModel, tags: list[str], *, single: bool = False) -> Path:
    """A vtu of the model; positions in single precision as the original's."""
    s = model.state
    arrays = {"Displacement": s.u, "Velocity": s.v, "Damage": model.broken_fraction()}
    x = s.x.astype(np.float32).astype(np.float64) if single else s.x
    write_vtu(
        path,
        topology=Topology((), model.n_nodes),
        points=x,
        arrays={tag: arrays[tag] for tag in tags},
        fields={"TIME": np.array([model.time])},
        compress=None,
    )
    return path


def test_restart_from_vtu_with_damage_is_exact(
    deck_folder: DeckFolder, plate: dict[str, Any], tmp_path: Path
) -> None:
    path = deck_folder.write(plate)
    first = started(path, 54)
    beyond = (strain(first) > critical_strain(first)).sum()
    assert beyond < (first.bonds.intact == 0).sum()  # some broken bonds have closed
    file = write_state(tmp_path / "state.vtu", first, [*TAGS, "Damage"])
    model = restarted(deck_folder, plate, file, 54)
    assert model.warnings == []
    assert_same(model, first)
    model.step(STEPS - 54)
    assert_same(model, started(path, STEPS))


def test_restart_from_vtu_without_bonds_warns(
    deck_folder: DeckFolder, plate: dict[str, Any], tmp_path: Path
) -> None:
    first = started(deck_folder.write(plate), 54)
    file = write_state(tmp_path / "state.vtu", first, TAGS, single=True)
    model = restarted(deck_folder, plate, file, 54)
    s, n_beyond = model.state, int((strain(first) > critical_strain(first)).sum())
    assert model.summary()["broken_bonds"] == n_beyond // 2
    assert len(model.warnings) == 1
    assert f"{n_beyond // 2} beyond their critical stretch" in model.warnings[0]
    np.testing.assert_array_equal(s.x, s.x_ref + s.u)  # better than single precision
    np.testing.assert_array_equal(s.v, first.state.v)
    assert (model.n, model.time) == (54, first.time)


def test_restart_from_vtu_warns_of_friction_springs(
    deck_folder: DeckFolder, tmp_path: Path
) -> None:
    contact = {"Friction_On": True, "Friction_Coeff": 0.5, "Friction_Model": "history"}
    grains = deck_folder.grains(rings=4, offset=(0.0, 2.5e-3))
    grains["Contact"]["Zone_12"] |= contact
    first = started(deck_folder.write(grains))
    file = write_state(tmp_path / "state.vtu", first, [*TAGS, "Damage"])
    (warning,) = restarted(deck_folder, grains, file, 0).warnings
    assert (
        "Restart.File: a vtu file does not hold the tangential springs of Friction_Mod" in warning
    )
    assert "they start unstretched; use a checkpoint (.h5)" in warning
    grains["Contact"]["Zone_12"]["Friction_On"] = False
    assert restarted(deck_folder, grains, file, 0).warnings == []


def strain(model: DEMModel) -> np.ndarray[Any, Any]:
    """|s| of each directed bond."""
    bonds, s = model.bonds, model.state
    i = np.repeat(np.arange(model.n_nodes), np.diff(bonds.offsets))
    y = s.x_ref[bonds.indices] - s.x_ref[i] + s.u[bonds.indices] - s.u[i]
    length = np.linalg.norm(s.x_ref[bonds.indices] - s.x_ref[i], axis=1)
    return np.asarray(np.abs(np.linalg.norm(y, axis=1) / length - 1))


def critical_strain(model: DEMModel) -> float:
    """s0 of PDState: sqrt(Gc / ((3 G + (3/4)^4 (K - 5 G/3)) eps))."""
    k, g, horizon = MATERIAL["K"], MATERIAL["G"], MATERIAL["Horizon"]
    return float(np.sqrt(0.05 / ((3 * g + 0.75**4 * (k - 5 * g / 3)) * horizon)))


def test_restart_from_vtu_takes_time_from_step_when_they_disagree(
    deck_folder: DeckFolder, plate: dict[str, Any], tmp_path: Path
) -> None:
    first = started(deck_folder.write(plate), 10)
    file = write_state(tmp_path / "state.vtu", first, [*TAGS, "Damage"])
    model = restarted(deck_folder, plate, file, 20)
    assert (model.n, model.time) == (20, 20 * model.dt)
    assert "goes on from Step * dt = 4e-06 s" in model.warnings[0]


def test_restart_from_wrong_vtu_is_refused(
    deck_folder: DeckFolder, plate: dict[str, Any], tmp_path: Path
) -> None:
    first = started(deck_folder.write(plate), 10)
    file = write_state(tmp_path / "state.vtu", first, ["Displacement"])
    with pytest.raises(InputError, match=r"state\.vtu: no Velocity: a restart needs both tags"):
        restarted(deck_folder, plate, file, 10)
    first.state.x[7, 1] += 1e-5
    file = write_state(tmp_path / "moved.vtu", first, TAGS)
    with pytest.raises(InputError, match=r"node 7 .* is 1e-05 m from its place in the deck"):
        restarted(deck_folder, plate, file, 10)
    finer = deck_folder.mesh("finer", box_mesh((1e-3, 1e-3), (5, 5)))
    other = {"Mesh.Zone_1.File": finer}
    with pytest.raises(InputError, match="has 25 nodes, the deck 36"):
        restarted(deck_folder, plate, file, 10, **other)
    shutil.copy(file, tmp_path / "state.txt")
    with pytest.raises(InputError, match=r"must be a checkpoint \(\.h5\) or a vtu"):
        restarted(deck_folder, plate, tmp_path / "state.txt", 10)
    assert read_vtu(file)["step"] is None


def test_deduced_bonds_follow_from_counts() -> None:
    # A chain 0-1-2-3-4 with broken bonds 01 and 12: node 0 has one bond and it is broken, so 01
    # is; node 1 lacks one more, 12; node 2 is complete, so 23 and 34 are intact.
    offsets = np.array([0, 1, 3, 5, 7, 8])
    indices = np.array([1, 0, 2, 1, 3, 2, 4, 3], dtype=np.int32)
    expected = np.array([1, 1, 1, 1, 0, 0, 0, 0], dtype=bool)
    none_known = np.zeros(8, dtype=bool)
    broken, missing = deduce_broken(offsets, indices, none_known, np.array([1, 2, 1, 0, 0]))
    np.testing.assert_array_equal(broken, expected)
    assert missing == 0
    # A ring 0-1-2-3 with two opposite broken bonds: either pair fits, so nothing follows.
    offsets = np.array([0, 2, 4, 6, 8])
    indices = np.array([1, 3, 0, 2, 1, 3, 0, 2], dtype=np.int32)
    broken, missing = deduce_broken(offsets, indices, none_known, np.array([1, 1, 1, 1]))
    assert not broken.any()
    assert missing == 4


@pytest.mark.parametrize("seed", range(5))
def test_deduced_bonds_are_never_wrong(seed: int, deck_folder: DeckFolder) -> None:
    rng = np.random.default_rng(seed)
    mesh = deck_folder.mesh("plate", box_mesh((1e-3, 1e-3), (6, 6)))
    deck = single_deck(mesh, {"Type": "square", "Parameters": [1.0e-3]})
    bonds = deck_folder.model(deck).bonds
    n = len(bonds.offsets) - 1
    i = np.repeat(np.arange(n), np.diff(bonds.offsets))
    pair = np.minimum(i, bonds.indices) * n + np.maximum(i, bonds.indices)
    names, which = np.unique(pair, return_inverse=True)
    truth = (rng.random(len(names)) < 0.02)[which]
    known = truth & (rng.random(len(names)) < 0.5)[which]
    counts = np.bincount(i[truth], minlength=n)
    found, missing = deduce_broken(bonds.offsets, bonds.indices, known, counts)
    assert not np.any(found & ~truth)
    assert missing == (truth & ~found).sum()
    assert np.all(found >= known)
