"""The charts of a result."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib as mpl

mpl.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from results import primary, primary_us

Results = dict[str, dict[str, Any]]

COLORS = ("#3b6fb6", "#d1782a", "#4c9a5b", "#a04c8c", "#7a7a7a", "#c23b3b")
STAGES = ("peridynamic", "contact_search", "contact", "external", "integration")


def thread_families(results: Results) -> dict[str, dict[int, dict[str, Any]]]:
    """Models that were timed on several thread counts: name without threads, count, result."""
    families: dict[str, dict[int, dict[str, Any]]] = {}
    for name, result in results.items():
        threads = result["threads"]
        base = name.removesuffix(f"_t{threads}") if threads > 1 else name
        families.setdefault(base, {})[threads] = result
    return {base: by for base, by in families.items() if len(by) > 1 and 1 in by}


def _bars(ax: Axes, results: Results, key: str, color: str) -> None:
    names = list(results)
    values = [results[name][key] for name in names]
    medians = np.array([v["median"] for v in values])
    errors = np.abs(np.array([[v["min"], v["max"]] for v in values]).T - medians)
    places = np.arange(len(names))
    ax.barh(places, medians, xerr=errors, color=color, height=0.7, error_kw={"linewidth": 0.8})
    ax.set_yticks(places, names, fontsize=7)
    ax.invert_yaxis()


def draw_bonds(run: dict[str, Any], path: Path) -> bool:
    """Nanoseconds per directed bond and core, by case."""
    results = {
        name: r for name, r in run["cases"].items() if "ns_per_bond" in r and r["kind"] != "contact"
    }
    if not results:
        return False
    _, ax = plt.subplots(figsize=(8, 1.2 + 0.19 * len(results)))
    _bars(ax, results, "ns_per_bond", COLORS[0])
    least = [results[name].get("roofline", {}).get("least_ns_per_bond") for name in results]
    marks = [(k, x) for k, x in enumerate(least) if x is not None]
    if marks:
        ys, xs = zip(*marks, strict=True)
        ax.plot(xs, ys, "|", color=COLORS[5], markersize=7, label="least by the roofline")
        ax.legend(fontsize=8)
    ax.set_xlabel("whole step, ns per directed bond and core (median, min .. max)")
    ax.set_xlim(left=0)
    _save(path)
    return True


def draw_growth(run: dict[str, Any], path: Path) -> bool:
    """Cost of a node in a step against the number of nodes."""
    series: dict[str, list[dict[str, Any]]] = {}
    for name, r in run["cases"].items():
        if r["group"] == "figure24":
            series.setdefault("touching grains, 2D", []).append(r)
        if r["group"] == "peridynamics":
            series.setdefault(name.rsplit("_", 1)[0], []).append(r)
    series = {name: rows for name, rows in series.items() if len(rows) > 1}
    if not series:
        return False
    _, axes = plt.subplots(1, 2, figsize=(10, 4))
    for k, (name, rows) in enumerate(series.items()):
        rows.sort(key=lambda r: r["nodes"])
        nodes = [r["nodes"] for r in rows]
        color = COLORS[k % len(COLORS)]
        for ax, key in zip(axes, ("ns_per_node", "ns_per_bond"), strict=True):
            values = [r[key] for r in rows]
            ax.plot(nodes, [v["median"] for v in values], "o-", color=color, label=name, ms=4)
            low, high = ([v[end] for v in values] for end in ("min", "max"))
            ax.fill_between(nodes, low, high, color=color, alpha=0.15)
    for ax, what in zip(axes, ("node", "directed bond"), strict=True):
        ax.set_xscale("log")
        ax.set_ylim(bottom=0)
        ax.set_xlabel("nodes")
        ax.set_ylabel(f"ns per {what} and step, one core")
    axes[0].legend(fontsize=7)
    _save(path)
    return True


def draw_threads(run: dict[str, Any], path: Path) -> bool:
    """Speed-up over one thread."""
    families = thread_families(run["cases"])
    if not families:
        return False
    _, ax = plt.subplots(figsize=(5, 4))
    most = max(max(by) for by in families.values())
    ax.plot([1, most], [1, most], "--", color="0.6", label="ideal")
    for k, (name, by) in enumerate(families.items()):
        counts = sorted(by)
        one = primary_us(by[1])["median"]
        speed = [one / primary_us(by[t])["median"] for t in counts]
        ax.plot(counts, speed, "o-", color=COLORS[k % len(COLORS)], label=name, ms=4)
    ax.set_ylim(bottom=0)
    ax.set_xticks(sorted({t for by in families.values() for t in by}))
    ax.set_xlabel("threads")
    ax.set_ylabel("speed-up")
    ax.legend(fontsize=7)
    _save(path)
    return True


def draw_roofline(run: dict[str, Any], path: Path) -> bool:
    """Flops a second against flops a byte, under the ceilings of one core."""
    results = {name: r for name, r in run["cases"].items() if "roofline" in r and not r["simd"]}
    if not results:
        return False
    ceilings = run["ceilings"]
    isa = next(iter(results.values()))["instruction_set"]
    peak = ceilings["fma_gflop_s"][isa]
    _, ax = plt.subplots(figsize=(7.5, 5))
    intensity = np.logspace(-1.5, 2, 200)
    for key, what, style in (
        ("l2_gb_s", "L2", ":"), ("l3_gb_s", "L3", "-."), ("memory_gb_s", "memory", "-"),
    ):  # fmt: skip
        rate = ceilings[key]["read"]
        roof = np.minimum(peak, intensity * rate)
        label = f"{what}, {rate:.0f} GB/s"
        ax.plot(intensity, roof, style, color="0.35", linewidth=1.2, label=label)
    ax.text(90, peak * 1.06, f"{isa}: {peak:.1f} GFLOP/s a core", ha="right", fontsize=8)
    kinds: dict[str, list[tuple[float, float]]] = {}
    for r in results.values():
        options, roof = r["options"], r["roofline"]
        law = options.get("law", "PDState")
        layout = "one body" if options["count"] == 1 else "grains"
        state = ", broken" if options.get("broken") else ""
        label = f"{law} {options.get('dimension', 2)}D, {layout}{state}"
        point = (roof["flops_per_bond"] / roof["bytes_per_bond"], roof["gflop_s"])
        kinds.setdefault(label, []).append(point)
    for k, (label, points) in enumerate(kinds.items()):
        x, y = zip(*points, strict=True)
        marker = "osD^v*"[k // len(COLORS) % 6]
        ax.plot(x, y, marker, color=COLORS[k % len(COLORS)], label=label, ms=5)
    ax.set_xscale("log")
    ax.set_yscale("log")
    ax.set_xlabel("flops per byte that must be fetched")
    ax.set_ylabel("GFLOP/s of one core")
    ax.legend(fontsize=6, loc="lower right", ncols=2)
    _save(path)
    return True


def draw_profile(run: dict[str, Any], path: Path) -> bool:
    """Where a step goes, in percent."""
    results = {
        name: r for name, r in run["cases"].items() if primary(r) == "step" and r["kind"] == "step"
    }
    if not results:
        return False
    _, ax = plt.subplots(figsize=(8, 1.4 + 0.26 * len(results)))
    places, left = np.arange(len(results)), np.zeros(len(results))
    totals = np.array([primary_us(r)["median"] for r in results.values()])
    parts = {s: np.array([r["stages_us"].get(s, 0.0) for r in results.values()]) for s in STAGES}
    parts["other"] = np.maximum(0.0, totals - sum(parts.values()))
    for k, (stage, values) in enumerate(parts.items()):
        share = 100 * values / totals
        label = stage.replace("_", " ")
        ax.barh(places, share, left=left, color=COLORS[k % len(COLORS)], label=label)
        left += share
    ax.set_yticks(places, list(results), fontsize=7)
    ax.invert_yaxis()
    ax.set_xlabel("percent of the wall time of a step")
    ax.set_xlim(0, 100)
    ax.legend(fontsize=7, ncols=6, loc="lower center", bbox_to_anchor=(0.5, 1.0))
    _save(path)
    return True


def _save(path: Path) -> None:
    plt.tight_layout()
    plt.savefig(path, dpi=130)
    plt.close("all")


def draw_all(run: dict[str, Any], folder: Path) -> dict[str, Path]:
    """Draw every chart that the result has something for."""
    charts: dict[str, Callable[[dict[str, Any], Path], bool]] = {
        "bonds": draw_bonds,
        "growth": draw_growth,
        "threads": draw_threads,
        "roofline": draw_roofline,
        "profile": draw_profile,
    }
    paths = {name: folder / f"{name}.png" for name in charts}
    return {name: paths[name] for name, draw in charts.items() if draw(run, paths[name])}
