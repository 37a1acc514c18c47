"""The benchmarks: that they run and keep what they promise. No test asserts a time."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"


def run(*arguments: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(BENCHMARKS / "run.py"), *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    folder = tmp_path_factory.mktemp("report")
    done = run("two_circles", "pd2d_grains_1e4", "--quick", "--report", folder)
    assert done.returncode == 0, done.stderr
    return folder, json.loads((folder / "result.json").read_text())


def test_result_says_what_was_measured_where_and_how(
    result: tuple[Path, dict[str, Any]],
) -> None:
    _, run = result
    assert {"format", "date", "machine", "settings", "ceilings", "load", "cases", "skipped"} <= set(
        run
    )
    assert {"processor", "cores", "commit", "core_compiler", "peridem", "numpy", "caches"} <= set(
        run["machine"]
    )
    assert run["skipped"] == {} and list(run["cases"]) == ["two_circles", "pd2d_grains_1e4"]
    for case in run["cases"].values():
        for name in ("step_us", "step_cpu_us", "ns_per_bond", "ns_per_node"):
            assert 0 < case[name]["min"] <= case[name]["median"] <= case[name]["max"]
        assert case["nodes"] > 0 and case["instruction_set"] and case["memory_bytes"] > 0
        assert set(case["setup_s"]) == {"read_and_place", "bonds_and_contact", "first_forces"}
        assert {"peridynamic", "contact_search", "contact"} <= set(case["stages_us"])
    # The models are what their names say: 2 x 123 and 49 x 205 nodes, within the mesh's fit.
    circles, grains = run["cases"].values()
    assert circles["bodies"] == 2 and circles["nodes"] == pytest.approx(246, rel=0.05)
    assert circles["neighbours"] == pytest.approx(27.9, abs=0.3)
    assert grains["nodes"] == pytest.approx(1e4, rel=0.05)
    assert grains["neighbours"] == pytest.approx(45, abs=0.3)


def test_result_gives_the_share_of_the_measured_ceilings(
    result: tuple[Path, dict[str, Any]],
) -> None:
    _, run = result
    if not run["ceilings"]:
        pytest.skip("no C++ compiler here")
    assert run["ceilings"]["fma_gflop_s"]["baseline"] > 0
    for place in ("l2_gb_s", "l3_gb_s", "memory_gb_s", "memory_all_gb_s"):
        assert run["ceilings"][place]["read"] > 0
    roofline = run["cases"]["pd2d_grains_1e4"]["roofline"]
    # Jha et al. 2021, eqs. 9 and 10 in 2D: 37 flops a pair of nodes, and 12 a node to integrate.
    assert roofline["flops_per_bond"] == pytest.approx(37 / 2 + 12 / 45, rel=1e-3)
    assert roofline["share"] > 0 and roofline["bound"] in ("flops", "L2", "L3", "memory")


def test_report_shows_every_case_and_its_charts(result: tuple[Path, dict[str, Any]]) -> None:
    folder, run = result
    page = (folder / "report.md").read_text(encoding="utf-8")
    for name in run["cases"]:
        assert f"| {name} |" in page
    for title in ("Ceilings", "Where a step goes", "Memory", "Set-up", "Cost of a bond"):
        assert f"## {title}" in page
    pictures = {path.name for path in folder.glob("*.png")}
    assert {"bonds.png", "profile.png"} <= pictures
    assert all(f"({name})" in page for name in pictures)


def test_comparison_flags_what_is_slower_by_more_than_the_spread(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    from results import compare

    def times(low: float, median: float, high: float) -> dict[str, Any]:
        return {"step_us": {"min": low, "median": median, "max": high}}

    earlier = {"cases": {"a": times(9, 10, 11), "b": times(9, 10, 11), "gone": times(1, 1, 1)}}
    now = {"cases": {"a": times(11, 12.1, 13), "b": times(11, 11.9, 13), "new": times(1, 1, 1)}}
    found = compare(now, earlier)
    assert set(found) == {"a", "b"}
    # Half the spreads, 1 + 1 us, is what the medians may part by.
    assert found["a"]["slower"] and not found["b"]["slower"]
    assert found["a"]["ratio"] == pytest.approx(10 / 12.1)


def test_unknown_case_is_refused(tmp_path: Path) -> None:
    done = run("two_circle", "--output", tmp_path / "none.json")
    assert done.returncode == 2
    assert "no case or group 'two_circle'" in done.stderr


def test_broken_bonds_are_the_fraction_asked_for_in_both_directions(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.syspath_prepend(str(BENCHMARKS))
    import scenes

    scene = scenes.grains(count=4, nodes=205, neighbours=45, gap=10.0)
    model = scenes.core_model(scene, 1)
    model.init()
    broken = scenes.break_bonds(model, 0.1)  # refused if two directions differ
    # 4 grains of about 200 nodes: 18,000 pairs, standard deviation 0.0022 of the fraction.
    assert broken / len(model.bonds.indices) == pytest.approx(0.1, abs=0.012)
    assert broken == np.count_nonzero(model.bonds.intact == 0)
