"""Every example runs, in a short form, and gives what it says."""

from __future__ import annotations

import csv
import subprocess
import sys
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_impact_records_energy_and_broken_bonds(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, EXAMPLES / "impact.py", "--steps", "400", "--output", tmp_path / "out"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    with (tmp_path / "out" / "impact.csv").open() as stream:
        header, *rows = csv.reader(stream)
    assert header == ["t [s]", "kinetic energy [J/m]", "broken bonds"]
    assert len(rows) == 400 // 50 + 1
    energy = [float(row[1]) for row in rows]
    broken = [int(row[2]) for row in rows]
    # The impact turns kinetic energy into deformation, and bonds only ever break.
    assert energy[-1] < 0.95 * energy[0]
    assert broken == sorted(broken)
    assert 0 == broken[0] < broken[-1]
    assert (tmp_path / "out" / "impact.png").stat().st_size > 10_000


def test_two_particles_rebound_less_with_damping(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, EXAMPLES / "two_particles.py", "--until", "1.5e-4", "--output", tmp_path],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    with (tmp_path / "two_particles.csv").open() as stream:
        header, *rows = csv.reader(stream)
    assert header == ["time", "no damping", "damping ratio 0.95", "damping ratio 0.8"]
    assert len(rows) == 1500 // 20 + 1
    assert [float(value) for value in rows[0][1:]] == pytest.approx([-1.0] * 3, rel=1e-12)
    free, little, much = (float(value) for value in rows[-1][1:])
    # Equal discs exchange their velocities; waves keep a part, damping takes more.
    assert 0 < much < 0.9 * little < 0.9 * free <= 0.9 * 1.01
    assert (tmp_path / "two_particles.png").stat().st_size > 10_000


def test_shapes_meshes_and_draws_every_shape(tmp_path: Path) -> None:
    picture = tmp_path / "shapes.png"
    done = subprocess.run(
        [sys.executable, EXAMPLES / "shapes.py", "--output", picture],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    rows = [line.split() for line in done.stdout.splitlines()]
    assert [row[0] for row in rows if row[0] in ("Circle", "Polyhedron")] == [
        "Circle",
        "Polyhedron",
    ]
    # No two nodes come nearer than the edges that the mesher collapses.
    assert all(float(row[3]) > 0.25 for row in rows)
    assert picture.stat().st_size > 10_000


def test_examples_stay_short() -> None:
    for example in EXAMPLES.glob("*.py"):
        assert len(example.read_text().splitlines()) <= 80, example.name
