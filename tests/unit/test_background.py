"""Outputs written while stepping goes on: order, bound, errors, interrupts, the same files."""

from __future__ import annotations

import errno
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers import DeckFolder, box_mesh, single_deck
from peridem import DEMModel, InputError, NumericalError, output
from peridem.background import BackgroundWriter, Job
from peridem.checkpoint import CheckpointWriter, read_checkpoint
from peridem.output import read_pvd, read_vtu
from peridem.recorder import Recorder

FAR = 60.0  # [s]; a test that waits so long fails


class Gate:
    """A job that stays at work until it is opened."""

    def __init__(self) -> None:
        self.begun, self.opened = threading.Event(), threading.Event()

    def take(self) -> Job:
        def job() -> None:
            self.begun.set()
            assert self.opened.wait(FAR)

        return job


def _raiser(error: BaseException) -> Callable[[], Job]:
    def job() -> None:
        raise error

    return lambda: job


# The queue ----------------------------------------------------------------------------------


def test_jobs_are_done_in_order_and_before_the_end() -> None:
    done: list[int] = []
    with BackgroundWriter() as background:
        for k in range(50):
            background.submit(lambda k=k: lambda: done.append(k))
    assert done == list(range(50))


def test_at_most_one_copy_waits_behind_the_one_at_work() -> None:
    gate, taken = Gate(), []

    def take(k: int) -> Job:
        taken.append(k)
        return lambda: None

    with BackgroundWriter() as background:
        background.submit(gate.take)
        assert gate.begun.wait(FAR)
        background.submit(lambda: take(1))
        third = threading.Thread(target=lambda: background.submit(lambda: take(2)))
        third.start()
        third.join(0.05)  # it would be through long before
        assert third.is_alive()
        assert taken == [1]
        gate.opened.set()
        third.join(FAR)
        assert taken == [1, 2]
    assert background.seconds_waited > 0.04


def test_failure_is_raised_at_the_next_opportunity_and_ends_the_queue() -> None:
    done: list[int] = []
    with pytest.raises(InputError, match="disk"), BackgroundWriter() as background:
        background.submit(_raiser(InputError("disk")))
        background.settle()
        with pytest.raises(InputError, match="disk"):
            background.check()
        background.submit(lambda: lambda: done.append(1))
    assert not done


def test_failure_is_raised_at_the_end() -> None:
    with pytest.raises(ValueError, match="last"), BackgroundWriter() as background:
        background.submit(_raiser(ValueError("last")))
    # and the next run starts without it
    with background:
        background.submit(lambda: lambda: None)


def test_an_error_of_the_run_waits_for_its_outputs() -> None:
    done: list[int] = []
    with pytest.raises(KeyError), BackgroundWriter() as background:
        background.submit(lambda: lambda: done.append(1))
        background.submit(lambda: lambda: done.append(2))
        raise KeyError
    assert done == [1, 2]


def test_a_numerical_failure_does_not_hide_that_of_an_output() -> None:
    with pytest.raises(NumericalError, match="node 3\ndisk"), BackgroundWriter() as background:
        background.submit(_raiser(InputError("disk")))
        raise NumericalError("node 3")


def test_an_interrupt_finishes_the_file_at_work_alone() -> None:
    gate, done = Gate(), []
    with pytest.raises(KeyboardInterrupt), BackgroundWriter() as background:
        background.submit(gate.take)
        assert gate.begun.wait(FAR)
        background.submit(lambda: lambda: done.append(1))
        threading.Timer(0.05, gate.opened.set).start()
        raise KeyboardInterrupt
    assert gate.opened.is_set()
    assert not done


# Runs ---------------------------------------------------------------------------------------


@pytest.fixture
def deck(deck_folder: DeckFolder) -> Path:
    """Deck of a plate that flies and shears, with all that is written."""
    mesh = deck_folder.mesh("plate", box_mesh((1e-3, 1e-3), (4, 4), jiggle=0.2))
    plate = single_deck(mesh, {"Type": "square", "Parameters": [1.0e-3]}, dt=2.0e-7, steps=60)
    tags = ["Displacement", "Velocity", "Force", "Damage", "Strain_Stress", "Particle_Locations"]
    plate["Output"] = {"Output_Interval": 10, "Tags": tags}
    plate["Force_BC"] = {
        "Sets": 1,
        "Set_1": {
            "Particle_List": [0],
            "Direction": [1],
            "Time_Function": {"Type": "sin", "Parameters": [2.0e12, 2.5e5]},
            "Spatial_Function": {"Type": "linear_y", "Parameters": [1.0]},
        },
    }
    return deck_folder.write(plate)


def _files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_files_are_those_written_at_once(
    deck: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    DEMModel.from_deck(deck, threads=1).run(tmp_path / "later", checkpoint_every=25)
    monkeypatch.setattr(BackgroundWriter, "submit", lambda _, take: take()())
    DEMModel.from_deck(deck, threads=1).run(tmp_path / "at_once", checkpoint_every=25)
    later, at_once = _files(tmp_path / "later"), _files(tmp_path / "at_once")
    assert later == at_once
    # 7 outputs of three kinds, two series, the table of bodies, the last two checkpoints (of 25,
    # 50 and 60)
    assert len(later) == 3 * 7 + 2 + 1 + 2


def test_output_holds_the_state_of_its_step(deck: Path, tmp_path: Path) -> None:
    model = DEMModel.from_deck(deck, threads=1)
    model.step(10)
    known = {name: np.array(getattr(model.state, name)) for name in ("x", "u", "v", "f")}
    volume = np.array(model.state.volume)
    gate = Gate()
    background = model._background
    with Recorder(model, tmp_path, background=background) as recorder, background:
        background.submit(gate.take)
        assert gate.begun.wait(FAR)
        recorder.record()
        model.step(7)  # the files of step 10 are not begun
        gate.opened.set()
    found = read_vtu(tmp_path / "output_1.vtu")
    assert found["step"] == 10
    np.testing.assert_array_equal(found["points"], known["x"])
    np.testing.assert_array_equal(found["arrays"]["Displacement"], known["u"])
    np.testing.assert_array_equal(found["arrays"]["Velocity"], known["v"])
    np.testing.assert_array_equal(found["arrays"]["Force"], known["f"] * volume[:, None])
    assert not np.array_equal(model.state.u, known["u"])


def test_checkpoint_taken_at_a_step_is_of_that_step(deck: Path, tmp_path: Path) -> None:
    model = DEMModel.from_deck(deck, threads=1)
    model.step(10)
    known = {name: np.array(getattr(model.state, name)) for name in ("x", "u", "v", "f", "theta")}
    write = CheckpointWriter(tmp_path, model, None).take(model)
    model.step(7)
    saved = read_checkpoint(write())
    assert (saved.step, saved.path.name) == (10, "checkpoint_10.h5")
    for name, values in known.items():
        np.testing.assert_array_equal(saved.nodes[name], values, err_msg=name)


def test_full_disk_ends_the_run_with_whole_files(
    deck: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = output.write_vtu

    def full_at_third(path: Path, **contents: Any) -> None:
        if "output_2" in path.name:
            path.write_bytes(b"half")
            raise OSError(errno.ENOSPC, "No space left on device")
        write(path, **contents)

    monkeypatch.setattr(output, "write_vtu", full_at_third)
    model = DEMModel.from_deck(deck, threads=1)
    with pytest.raises(InputError, match=r"output_2\.vtu: cannot be written: No space left"):
        model.run(tmp_path / "out")
    names = [path.name for _, path in read_pvd(tmp_path / "out" / "output.pvd")]
    assert names == ["output_0.vtu", "output_1.vtu"]
    assert sorted(path.name for path in (tmp_path / "out").glob("output_[0-9].vtu")) == names
    assert not list((tmp_path / "out").glob(".*"))
    assert model.timings["output_wait"] >= 0


def test_run_without_output_starts_no_thread(deck: Path) -> None:
    model = DEMModel.from_deck(deck, threads=1)
    model.run(steps=20)
    assert model._background._thread is None
    assert model.timings["output_wait"] < 0.1
