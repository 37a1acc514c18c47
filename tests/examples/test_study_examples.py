"""Examples of studies, calibration and fracture run, in short forms, and give what they say."""

from __future__ import annotations

import math
import re
import subprocess
import sys
from pathlib import Path

import pandas
import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"


def run_example(name: str, output: Path, *arguments: str, short: bool = True) -> str:
    """Run an example in its short form; check that it drew its picture; return what it says."""
    pytest.importorskip("gmsh")
    done = subprocess.run(
        [
            sys.executable,
            EXAMPLES / f"{name}.py",
            *["--short"] * short,
            "--output",
            output,
            *arguments,
        ],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert (output / f"{name}.png").stat().st_size > 10_000
    return done.stdout


def numbers(text: str) -> list[float]:
    """Numbers in a text."""
    return [float(one) for one in re.findall(r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?", text)]


def test_restitution_is_calibrated_and_measured_again(tmp_path: Path) -> None:
    said = run_example("restitution", tmp_path)
    again = float(said.split("measured again: ")[1].split()[0])
    assert again == pytest.approx(0.8, abs=0.002 + 1e-4)
    table = pandas.read_csv(tmp_path / "study.csv").sort_values("damping_ratio")
    for _, rows in table.groupby("pair"):
        assert rows["restitution"].is_monotonic_increasing
        assert len(rows) == 3


def test_crushing_breaks_at_the_wanted_strength(tmp_path: Path) -> None:
    said = run_example("crushing", tmp_path)
    again = numbers(said.split("measured again: ")[1])[0]
    assert again == pytest.approx(2e6, rel=0.03)
    areas = pandas.read_csv(tmp_path / "fragments.csv")["volume"]
    # all of the disc, whose mesh is a polygon within it
    assert areas.sum() == pytest.approx(math.pi * 1e-6, rel=0.02)
    assert len(areas) > 1
    assert areas.iloc[0] < 0.9 * areas.sum()


def test_tension_tears_by_its_energy(tmp_path: Path) -> None:
    said = run_example("tension", tmp_path)
    (strain, expected), (speed, rayleigh) = map(numbers, said.splitlines())
    # The energy is that of an infinite strip, the horizon of 2.6 mm a quarter of the height.
    assert 0.95 * expected < strain < 1.2 * expected
    assert 0.2 * rayleigh < speed < rayleigh


def test_sphere_gives_its_momentum_to_the_plate(tmp_path: Path) -> None:
    said = run_example("sphere", tmp_path)
    _, impulse, change = numbers(said.splitlines()[0])
    # The force is sampled every fifth step.
    assert impulse == pytest.approx(change, rel=0.02)


def test_concave_grain_gives_its_momentum_to_the_wall(tmp_path: Path) -> None:
    run_example("concave", tmp_path)
    table = pandas.read_csv(tmp_path / "study.csv").sort_values("speed")
    assert table["momentum"].tolist() == pytest.approx(table["impulse"].tolist(), rel=0.02)
    slow, fast = table["broken"]
    assert slow < fast
