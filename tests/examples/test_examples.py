"""Every example runs, in a short form, and gives what it says."""

from __future__ import annotations

import csv
import subprocess
import sys
from pathlib import Path

from matplotlib.image import imread

EXAMPLES = Path(__file__).parents[2] / "examples"


def run_example(folder: Path, name: str, *options: str, picture: str) -> list[dict[str, str]]:
    """Run an example, look for its picture, return the rows of its series."""
    done = subprocess.run(
        [sys.executable, EXAMPLES / name, *options, "--output", folder],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert (folder / picture).stat().st_size > 10_000
    with (folder / "series.csv").open() as stream:
        return list(csv.DictReader(stream))


def assert_damage_grows(rows: list[dict[str, str]]) -> None:
    """Bonds break, and stay broken."""
    broken = [float(row["damage.broken"]) for row in rows]
    assert broken == sorted(broken)
    assert 0 == broken[0] < broken[-1]


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


def test_drum_breaks_grains(tmp_path: Path) -> None:
    rows = run_example(tmp_path, "drum.py", "--until", "0.15", picture="drum.png")
    assert_damage_grows(rows)
    # Nothing breaks before a grain has fallen 1 mm (14 ms); the clay is gone if all of it breaks.
    assert float(rows[0]["damage.broken"]) == float(rows[4]["damage.broken"]) == 0
    assert 0 < float(rows[-1]["damage.fraction"]) < 0.5


def test_hopper_runs_out(tmp_path: Path) -> None:
    rows = run_example(
        tmp_path, "hopper.py", "--grains", "8", "--until", "0.3", picture="hopper.png"
    )
    assert_damage_grows(rows)
    out = [int(float(row["out"])) for row in rows]
    assert out[0] == 0
    assert out == sorted(out)
    # The lowest grains fall freely: 8 grains have no arch, the highest starts 0.1 m up (0.14 s).
    assert out[-1] == 8


def test_compression_loads_the_lid_and_breaks_grains(tmp_path: Path) -> None:
    rows = run_example(tmp_path, "compression.py", "--cells", "3", "2", picture="compression.png")
    assert_damage_grows(rows)
    lid = [float(row["reaction_lid.y"]) for row in rows]
    # The lid starts clear of the grains, and is pushed up by them.
    assert lid[0] == 0
    assert min(lid) >= 0
    # It hits the top row first, and bears on all rows at the end.
    assert sum(lid[-10:]) > 10 * sum(lid[:10])


def test_voronoi_rock_bears_when_its_joints_are_closed(tmp_path: Path) -> None:
    rows = run_example(
        tmp_path, "voronoi.py", "--grains", "20", "--speed", "1", picture="voronoi.png"
    )
    lid = [float(row["reaction_lid.y"]) for row in rows if row["reaction_lid.y"]]
    assert_damage_grows([row for row in rows if row["damage.broken"]])
    assert lid[0] == 0
    # Five or more joints lie over each other: their gaps are not closed in the first quarter.
    assert sum(lid[100:150]) > 3 * sum(lid[:50])


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


def test_packings_are_drawn_with_their_porosities(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, EXAMPLES / "packings.py", "--short", "--output", tmp_path],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    for name in ("packings.png", "tessellations.png", "solids.png"):
        assert imread(tmp_path / name).std() > 0.05, name


def test_examples_stay_short() -> None:
    for example in EXAMPLES.glob("*.py"):
        assert len(example.read_text().splitlines()) <= 80, example.name
