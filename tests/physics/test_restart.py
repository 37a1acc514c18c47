"""A run that is interrupted and goes on is the run that was never interrupted, bit for bit.

The case: two grains of 61 nodes strike each other askew, slide under friction, break.
"""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers import DeckFolder, changed
from peridem import DEMModel
from peridem.checkpoint import list_checkpoints
from peridem.interrupt import Terminated
from peridem.output import read_pvd, read_vtu

# These runs start in contact, so that its forces are there from the first step.
pytestmark = pytest.mark.filterwarnings("ignore:.*start in contact:peridem.PeridemWarning")

STEPS = 200
VARIANTS = [
    ("central_difference", "slip"),
    ("central_difference", "history"),
    ("velocity_verlet", "slip"),
    ("velocity_verlet", "history"),
]


def sliding_grains(
    folder: DeckFolder,
    scheme: str,
    friction: str,
    *,
    rings: int = 4,
    distance: float = 2.117e-3,
    fracture_energy: float = 10.0,
    steps: int = STEPS,
    vtu: bool = True,
) -> Path:
    """Deck of the case; contact soft enough to last many steps."""
    offset = (0.28 * distance, 0.96 * distance)
    deck = folder.grains(rings=rings, offset=offset, dt=1e-7, scheme=scheme, steps=steps)
    contact = {
        **deck["Contact"]["Zone_12"],
        **{"Kn_Factor": 0.01 * (rings / 4) ** 2, "Damping_On": True, "Epsilon": 0.9},
        **{"Friction_On": True, "Friction_Coeff": 0.5, "Friction_Model": friction},
    }
    zones = {"Horizon": 3.2e-3 / rings, "Gc": fracture_energy}
    changes: dict[str, Any] = {f"Contact.Zone_{ij}": contact for ij in ("11", "12", "22")}
    for zone in ("Zone_1", "Zone_2"):
        changes |= {f"Material.{zone}.{key}": value for key, value in zones.items()}
    changes["IC"] = {"Constant_Velocity": {"Velocity_Vector": [3, -2, 0], "Particle_List": [1]}}
    # Follows the time, so that a time that is off by a rounding shows.
    changes["Force_BC"] = {
        "Sets": 1,
        "Set_1": {
            "Particle_List": [0],
            "Direction": [1],
            "Time_Function": {"Type": "sin", "Parameters": [1e7, 1e6]},
            "Spatial_Function": {"Type": "constant"},
        },
    }
    changes["Output"] = {"Output_Interval": 20, "Tags": ["Displacement", "Damage_Z"]}
    changes["Output"]["Perform_Out"] = vtu
    path: Path = folder.write(changed(deck, changes))
    return path


def everything(model: DEMModel) -> dict[str, np.ndarray[Any, Any]]:
    """Copies of all that evolves."""
    names = ("x", "u", "v", "f", "theta", "damage_z")
    nodes, elongations = model.friction_springs()
    return {
        **{name: getattr(model.state, name).copy() for name in names},
        "intact": model.bonds.intact.copy(),
        "n": np.array(model.n),
        "time": np.array(model.time),
        "spring_nodes": nodes,
        "spring_elongations": elongations,
    }


def assert_same(found: DEMModel, expected: dict[str, np.ndarray[Any, Any]]) -> None:
    for name, values in everything(found).items():
        np.testing.assert_array_equal(values, expected[name], err_msg=name, strict=True)


def test_case_breaks_and_slides(deck_folder: DeckFolder) -> None:
    """The case holds what a restart could lose: broken bonds and stretched springs."""
    model = DEMModel.from_deck(sliding_grains(deck_folder, *VARIANTS[1]), threads=1)
    broken = set()
    springs = 0
    for _ in range(STEPS):
        model.step()
        broken.add(model.summary()["broken_bonds"])
        springs = max(springs, len(model.friction_springs()[0]))
    assert len(broken) > 10  # breaks in more than ten of the steps
    assert springs >= 4


@pytest.mark.parametrize(("scheme", "friction"), VARIANTS)
def test_restart_at_any_step_is_exact(
    deck_folder: DeckFolder, tmp_path: Path, scheme: str, friction: str
) -> None:
    deck = sliding_grains(deck_folder, scheme, friction, vtu=False)
    whole = DEMModel.from_deck(deck, threads=1)
    whole.step(STEPS)
    expected = everything(whole)
    rng = np.random.default_rng(VARIANTS.index((scheme, friction)))
    stops = [0, 1, STEPS - 1, STEPS, *rng.choice(np.arange(2, STEPS - 1), 8, replace=False)]
    for stop in map(int, stops):
        out = tmp_path / f"out_{stop}"
        DEMModel.from_deck(deck, threads=1).run(out, steps=stop, checkpoint_every=STEPS)
        resumed = DEMModel.resume(out, threads=1)
        assert resumed.n == stop
        resumed.step(STEPS - stop)
        assert_same(resumed, expected)


def test_restart_of_a_restart_is_exact(deck_folder: DeckFolder, tmp_path: Path) -> None:
    deck = sliding_grains(deck_folder, *VARIANTS[3])
    whole = DEMModel.from_deck(deck, threads=1)
    whole.step(150)
    DEMModel.from_deck(deck, threads=1).run(tmp_path / "out", steps=37, checkpoint_every=10)
    DEMModel.resume(tmp_path / "out", threads=1).run(tmp_path / "out", steps=40)
    resumed = DEMModel.resume(tmp_path / "out", threads=1)
    assert resumed.n == 77  # written after the last step; the interval was kept
    names = [path.name for path in list_checkpoints(tmp_path / "out")]
    assert names == ["checkpoint_77.h5", "checkpoint_70.h5"]
    resumed.step(150 - 77)
    assert_same(resumed, everything(whole))


def test_restart_on_other_number_of_threads_is_exact(
    deck_folder: DeckFolder, tmp_path: Path
) -> None:
    # 2 x 1657 nodes and 9e4 directed bonds: both threads work, also within a body.
    size: dict[str, Any] = {"rings": 23, "distance": 2.02e-3, "fracture_energy": 1e-2}
    deck = sliding_grains(deck_folder, *VARIANTS[1], **size)
    whole = DEMModel.from_deck(deck, threads=1)
    whole.step(60)
    assert len(whole.bonds.intact) > 5e4
    assert whole.summary()["broken_bonds"] > 0
    DEMModel.from_deck(deck, threads=1).run(tmp_path / "out", steps=31, checkpoint_every=60)
    resumed = DEMModel.resume(tmp_path / "out", threads=2)
    resumed.step(29)
    assert_same(resumed, everything(whole))


def test_resume_continues_output_series(deck_folder: DeckFolder, tmp_path: Path) -> None:
    """The first part ends at step 125 as if killed: its last checkpoint is that of step 50."""
    deck = sliding_grains(deck_folder, *VARIANTS[1])
    DEMModel.from_deck(deck, threads=1).run(tmp_path / "whole")
    model = DEMModel.from_deck(deck, threads=1)
    model.run(tmp_path / "parts", steps=50, checkpoint_every=50)
    model.checkpoint_every = None
    model.run(tmp_path / "parts", steps=75)  # goes on beyond the checkpoint
    assert len(read_pvd(tmp_path / "parts" / "output.pvd")) == 7
    DEMModel.resume(tmp_path / "parts", threads=1).run(tmp_path / "parts")
    names = ["output.pvd", *(f"output_{k}.vtu" for k in range(STEPS // 20 + 1))]
    for name in names:
        whole, parts = ((tmp_path / run / name).read_bytes() for run in ("whole", "parts"))
        assert whole == parts, name


def test_resume_keeps_the_new_interval_of_outputs(deck_folder: DeckFolder, tmp_path: Path) -> None:
    deck = json.loads(sliding_grains(deck_folder, *VARIANTS[0]).read_text())
    # Met from the start, so that from step 20 on there is an output every 5 steps.
    criterion = {"Type": "max_node_dist", "Parameters": [1e-3], "New_Interval": 5}
    path = deck_folder.write(changed(deck, {"Output.Output_Criteria": criterion}))
    DEMModel.from_deck(path, threads=1).run(tmp_path / "whole", steps=60)
    DEMModel.from_deck(path, threads=1).run(tmp_path / "parts", steps=33, checkpoint_every=60)
    DEMModel.resume(tmp_path / "parts", threads=1).run(tmp_path / "parts", steps=27)
    series = [read_pvd(tmp_path / run / "output.pvd") for run in ("whole", "parts")]
    steps = [[read_vtu(file)["step"] for _, file in entries] for entries in series]
    assert steps[0] == [0, 20, *range(25, 65, 5)]
    assert steps[1] == steps[0]


_CHILD = """
import sys
from peridem import DEMModel
DEMModel.from_deck(sys.argv[1], threads=1).run(sys.argv[2], checkpoint_every=3)
"""


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_killed_run_goes_on_exactly(deck_folder: DeckFolder, tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    deck = sliding_grains(deck_folder, *VARIANTS[int(rng.integers(4))], steps=10**6)
    out = tmp_path / "out"
    child = subprocess.Popen([sys.executable, "-c", _CHILD, str(deck), str(out)])
    wait_for_checkpoint(child, out)
    with pytest.raises(subprocess.TimeoutExpired):
        child.wait(rng.uniform(0.0, 0.4))  # the random moment, most likely within a write
    child.kill()
    assert child.wait(60) == -signal.SIGKILL
    resumed = DEMModel.resume(out, threads=1)
    assert resumed.n % 3 == 0
    whole = DEMModel.from_deck(deck, threads=1)
    whole.step(resumed.n + 50)
    resumed.step(50)
    assert_same(resumed, everything(whole))


def wait_for_checkpoint(child: subprocess.Popen[Any], out: Path) -> None:
    """Return once the child has written a checkpoint; fail when it ends before."""
    while not any(out.glob("checkpoint_*.h5")):
        with pytest.raises(subprocess.TimeoutExpired):
            child.wait(0.01)


COMMAND = [sys.executable, "-c", "from peridem.cli import main; main()"]


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_command_stops_and_resumes(
    deck_folder: DeckFolder, tmp_path: Path, number: signal.Signals, code: int
) -> None:
    deck = sliding_grains(deck_folder, *VARIANTS[1], steps=10**6)
    out = tmp_path / "out"
    arguments = ["--threads", "1", "--checkpoint-every", "10"]
    child = subprocess.Popen(
        [*COMMAND, "run", str(deck), "--output", str(out), *arguments],
        stderr=subprocess.PIPE,
        text=True,
    )
    wait_for_checkpoint(child, out)
    child.send_signal(number)
    _, words = child.communicate(timeout=60)
    assert child.returncode == code, words
    newest = list_checkpoints(out)[0]
    assert f"Go on from {newest.name} with `peridem resume {out}`" in words
    stopped = int(newest.stem.split("_")[1])
    resumed = subprocess.run(
        [*COMMAND, "resume", str(out), "--threads", "1", "--steps", "30"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert f"Finished after step {stopped + 30}" in resumed.stdout
    log = (out / "peridem.log").read_text()
    assert f"resumed from {newest} after step {stopped}" in log
    whole = DEMModel.from_deck(deck, threads=1)
    whole.step(stopped + 30)
    assert_same(DEMModel.resume(out, threads=1), everything(whole))


@pytest.mark.parametrize(
    ("number", "error"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, Terminated)]
)
@pytest.mark.parametrize("every", [None, 13])
def test_signal_stops_after_the_step_with_a_checkpoint(
    deck_folder: DeckFolder,
    tmp_path: Path,
    number: signal.Signals,
    error: type[BaseException],
    every: int | None,
) -> None:
    deck = sliding_grains(deck_folder, *VARIANTS[1])
    model = DEMModel.from_deck(deck, threads=1)
    before = signal.getsignal(number)

    def stop(model: DEMModel) -> None:
        if model.n == 45:
            signal.raise_signal(number)

    with pytest.raises(error) as caught:
        model.run(tmp_path, callback=stop, callback_every=5, checkpoint_every=every)
    assert getattr(caught.value, "code", 143) == 143
    assert signal.getsignal(number) is before
    assert model.last_checkpoint == tmp_path / "checkpoint_45.h5"
    assert len(read_pvd(tmp_path / "output.pvd")) == 3
    resumed = DEMModel.resume(tmp_path, threads=1)
    resumed.step(STEPS - 45)
    whole = DEMModel.from_deck(deck, threads=1)
    whole.step(STEPS)
    assert_same(resumed, everything(whole))


def test_second_signal_acts_at_once(deck_folder: DeckFolder, tmp_path: Path) -> None:
    model = DEMModel.from_deck(sliding_grains(deck_folder, *VARIANTS[0]), threads=1)

    def stop_twice(model: DEMModel) -> None:
        if model.n == 20:
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)
            pytest.fail("the second Ctrl-C had no effect")

    with pytest.raises(KeyboardInterrupt):
        model.run(tmp_path, callback=stop_twice)
    assert model.last_checkpoint is None
