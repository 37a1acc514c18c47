"""From the samples of several processes to figures, and from two results to ratios."""

from __future__ import annotations

import statistics
from collections.abc import Iterable
from typing import Any

from roofline import roofline

FORMAT = 1
PRIMARY = ("step", "contact", "setup_total")
"""Which of a case's times stands for it."""

QUIET = 0.97
"""Below this part of the wall time on the processor, a run on one thread was disturbed."""


def spread(values: Iterable[float]) -> dict[str, float]:
    """Smallest, median and largest."""
    values = list(values)
    return {"min": min(values), "median": statistics.median(values), "max": max(values)}


def merge(case: dict[str, Any], rounds: list[dict[str, Any]]) -> dict[str, Any]:
    """One result of all rounds of a case.

    Times get ``min``, ``median`` and ``max`` over all repeats of all rounds; set-up and memory over
    the rounds.
    """
    result = {**case}
    last = rounds[-1]
    result |= {k: v for k, v in last.items() if k not in ("samples", "stages_us", "setup_s")}
    samples: dict[str, list[float]] = {}
    for one in rounds:
        for name, values in one["samples"].items():
            samples.setdefault(name, []).extend(values)
    result |= {name: spread(values) for name, values in samples.items()}
    result["samples"] = samples
    stages = [stage for one in rounds for stage in one.get("stages_us", [])]
    if stages:
        result["stages_us"] = {key: statistics.median(s[key] for s in stages) for key in stages[0]}
    names = last["setup_s"]
    result["setup_s"] = {name: spread(one["setup_s"][name] for one in rounds) for name in names}
    name = primary(result)
    if name in ("step", "contact"):
        times = result[f"{name}_us"]
        for what, count in (("node", result["nodes"]), ("bond", result["bonds"])):
            if what == "node" or name == "step":
                factor = 1e3 * case["threads"] / max(count, 1)
                result[f"ns_per_{what}"] = {k: v * factor for k, v in times.items()}
        cpu = result[f"{name}_cpu_us"]["median"]
        result["busy"] = cpu / times["median"] / case["threads"]
    if "force_us" in result:
        factor = 1e3 * case["threads"] / result["bonds"]
        result["force_ns_per_bond"] = {k: v * factor for k, v in result["force_us"].items()}
    return result


def primary(result: dict[str, Any]) -> str:
    """Name of the time that stands for a case."""
    return next(name for name in PRIMARY if f"{name}_us" in result)


def primary_us(result: dict[str, Any]) -> dict[str, float]:
    """Min, median and max [microseconds] of the time that stands for a case."""
    times: dict[str, float] = result[f"{primary(result)}_us"]
    return times


def add_rooflines(run: dict[str, Any]) -> None:
    """Add the share of the ceiling to every peridynamics case."""
    for result in run["cases"].values():
        share = roofline(result, run["ceilings"], run["machine"]["caches"])
        if share is not None:
            result["roofline"] = share


def compare(now: dict[str, Any], earlier: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """Ratios to an earlier result, case by case.

    ``ratio`` is earlier over now, above 1 when it is faster now. A case is ``slower`` when the
    medians part by more than half the spread (max - min) of both.
    """
    found = {}
    for name, result in now["cases"].items():
        before = earlier["cases"].get(name)
        if before is None or primary(before) != primary(result):
            continue
        new, old = primary_us(result), primary_us(before)
        noise = 0.5 * (new["max"] - new["min"] + old["max"] - old["min"])
        found[name] = {
            "earlier_us": old["median"],
            "now_us": new["median"],
            "ratio": old["median"] / new["median"],
            "noise": noise / old["median"],
            "slower": new["median"] - old["median"] > noise,
            "faster": old["median"] - new["median"] > noise,
        }
    return found


def ceiling_ratio(now: dict[str, Any], earlier: dict[str, Any]) -> dict[str, float]:
    """Speed of the machine now over that of the earlier result, by ceiling."""
    ratios = {}
    for name, value in now["ceilings"].items():
        before = earlier.get("ceilings", {}).get(name)
        if not isinstance(value, dict) or not isinstance(before, dict):
            continue
        for key in value:
            if before.get(key):
                ratios[f"{name} {key}"] = value[key] / before[key]
    return ratios
