"""Measure one case in this process and print what came out as one line of JSON.

    python benchmarks/worker.py CASE_AS_JSON SECONDS REPEATS

Started by run.py, once per case and round, so that memory, caches and threads of one case do not
reach into the next.
"""

from __future__ import annotations

import contextlib
import json
import resource
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import scenes
from peridem import DEMModel, InputError

FOREVER = 1e6  # [s]
FEWEST_STEPS = 8
"""In a repeat: a damage field follows them, whose time is taken off."""

CONTACT_SWING = 1.0
"""Grains of a contact case swing by so many node distances, and back."""


def _status_bytes(key: str) -> int | None:
    """A line of /proc/self/status; None where there is none."""
    try:
        text = Path("/proc/self/status").read_text()
    except OSError:
        return None
    return next((int(s.split()[1]) * 1024 for s in text.splitlines() if s.startswith(key)), None)


def peak_bytes() -> int:
    """Most memory that this process has held since `memory_before`."""
    # Not ru_maxrss first: a process takes over that of the one that started it.
    known = _status_bytes("VmHWM:")
    unit = 1 if sys.platform == "darwin" else 1024
    return known or resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit


def memory_before() -> int:
    """Memory that the process holds now; the peak is counted from here where it can be."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")  # sets the peak back to what is held now
    return _status_bytes("VmRSS:") or peak_bytes()


@dataclass
class Samples:
    """Times of repeats, in microseconds a step; `cpu` is the processor time of all threads."""

    wall: list[float] = field(default_factory=list)
    cpu: list[float] = field(default_factory=list)
    stages: list[dict[str, float]] = field(default_factory=list)

    def as_dict(self, name: str) -> dict[str, Any]:
        return {f"{name}_us": self.wall, f"{name}_cpu_us": self.cpu}


class Laps:
    """Seconds of one stage of the set-up after the other."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        now = time.perf_counter()
        self.seconds[name] = now - self._last
        self._last = now


def seconds_of(call: Callable[[], object]) -> float:
    begin = time.perf_counter()
    call()
    return time.perf_counter() - begin


def stage_seconds(model: Any) -> dict[str, float]:
    return dict(model.timings())


def step_samples(model: Any, seconds: float, repeats: int) -> tuple[Samples, int]:
    """Time whole steps, less the damage field that every call of `advance` ends with."""
    model.advance(2, FOREVER)  # warm
    damage = min(seconds_of(model.compute_damage) for _ in range(3))
    one = max(seconds_of(lambda: model.advance(3, FOREVER)) - damage, 1e-7) / 3
    steps = max(FEWEST_STEPS, int(seconds / one))
    samples = Samples()
    for _ in range(repeats):
        before, cpu, begin = stage_seconds(model), time.process_time(), time.perf_counter()
        model.advance(steps, FOREVER)
        wall, cpu = time.perf_counter() - begin, time.process_time() - cpu
        after = stage_seconds(model)
        stages = {key: (after[key] - before[key]) / steps * 1e6 for key in after}
        # advance() ends with one damage field, which the core counts as peridynamic.
        damage = seconds_of(model.compute_damage)
        stages["peridynamic"] -= damage / steps * 1e6
        samples.wall.append((wall - damage) / steps * 1e6)
        samples.cpu.append((cpu - damage) / steps * 1e6)
        samples.stages.append({k: v for k, v in stages.items() if k != "setup"})
    return samples, steps


def call_samples(call: Callable[[], object], seconds: float, repeats: int) -> Samples:
    """Time calls of a function."""
    call()
    calls = max(1, int(seconds / max(seconds_of(call), 1e-7)))
    samples = Samples()
    for _ in range(repeats):
        cpu, begin = time.process_time(), time.perf_counter()
        for _ in range(calls):
            call()
        samples.wall.append((time.perf_counter() - begin) / calls * 1e6)
        samples.cpu.append((time.process_time() - cpu) / calls * 1e6)
    return samples


class Swing:
    """Moves every grain to and fro, `rate` node distances a step, each in its own direction."""

    def __init__(self, scene: scenes.Scene, model: Any, rate: float) -> None:
        h = scene.zones[0].mesh.h
        directions = np.random.default_rng(6).normal(size=(len(scene.bodies), 3))
        directions[:, scene.dimension :] = 0
        directions /= np.linalg.norm(directions, axis=1)[:, None]
        self._way = directions[model.state.particle_id] * h
        self._start = model.state.x.copy()
        self._x, self._rate, self._gone = model.state.x, rate, 0.0

    def move(self) -> None:
        self._gone += self._rate
        phase = self._gone % (2 * CONTACT_SWING)
        self._x[:] = self._start + min(phase, 2 * CONTACT_SWING - phase) * self._way


def contact_samples(
    scene: scenes.Scene, model: Any, rate: float, seconds: float, repeats: int
) -> tuple[Samples, int, float]:
    """Time contact search and forces while grains move; the motion itself is not timed."""
    swing = Swing(scene, model, rate)
    model.compute_contact_forces()
    one = max(seconds_of(model.compute_contact_forces), 1e-6)
    # As many steps at least as a swing takes, so that rebuilt lists are part of every sample.
    steps = max(int(seconds / one), int(0.25 * CONTACT_SWING / rate))
    samples = Samples()
    before_all = model.contact_rebuilds()
    for _ in range(repeats):
        before, wall, cpu = stage_seconds(model), 0.0, 0.0
        for _ in range(steps):
            swing.move()
            cpu -= time.process_time()
            wall += seconds_of(model.compute_contact_forces)
            cpu += time.process_time()
        after = stage_seconds(model)
        samples.wall.append(wall / steps * 1e6)
        samples.cpu.append(cpu / steps * 1e6)
        samples.stages.append(
            {key: (after[key] - before[key]) / steps * 1e6 for key in ("contact_search", "contact")}
        )
    return samples, steps, (model.contact_rebuilds() - before_all) / (repeats * steps)


def facts(model: Any, before: int, peak: int) -> dict[str, Any]:
    """Size, memory (`before` and at the `peak` of its building) and instructions of a model."""
    bonds = len(model.bonds.indices)
    return {
        "nodes": len(model.state),
        "bonds": bonds,
        "bodies": len(model.particles),
        "neighbours": bonds / len(model.state),
        "broken": 1 - float(np.mean(model.bonds.intact)) if bonds else 0.0,
        "memory_bytes": model.memory_bytes,
        "peak_bytes": peak,
        "peak_bytes_of_model": peak - before,
        "instruction_set": model.instruction_set,
    }


def measure_setup(scene: scenes.Scene, threads: int) -> dict[str, Any]:
    """Time the way from a deck's files to the first forces."""
    with tempfile.TemporaryDirectory() as folder:
        path = scenes.write_deck(scene, Path(folder))
        before, laps = memory_before(), Laps()
        model = DEMModel.from_deck(path, threads=threads, allow_overlap=True)
        laps.lap("read_and_place")
        model._core.init()
        laps.lap("bonds_and_contact")
        model.init()
        laps.lap("checks")
        model.start()
        laps.lap("first_forces")
    result = facts(model._core, before, peak_bytes())
    total = sum(laps.seconds.values())
    return {**result, "setup_s": laps.seconds, "samples": {"setup_total_us": [total * 1e6]}}


def build(case: dict[str, Any]) -> tuple[scenes.Scene | None, Any, dict[str, Any]]:
    """The core model of a case, its forces computed, with the time and memory that it took."""
    if case["deck"]:
        before, laps = memory_before(), Laps()
        model = DEMModel.from_deck(case["deck"], threads=case["threads"], allow_overlap=True)
        laps.lap("read_and_place")
        model.init()
        laps.lap("bonds_and_contact")
        model.start()
        laps.lap("first_forces")
        peak = peak_bytes()
        if case["skip"]:
            model.step(case["skip"])
        return None, model._core, {**facts(model._core, before, peak), "setup_s": laps.seconds}
    scene = getattr(scenes, case["scene"])(**case["options"])
    before, laps = memory_before(), Laps()
    core = scenes.core_model(scene, case["threads"])
    laps.lap("read_and_place")
    core.init()
    laps.lap("bonds_and_contact")
    peak = peak_bytes()  # before the benchmark's own arrays
    scenes.set_in_motion(scene, core)
    scenes.break_bonds(core, scene.broken)
    laps.lap("motion")  # the benchmark's own
    core.start()
    laps.lap("first_forces")
    del laps.seconds["motion"]
    return scene, core, {**facts(core, before, peak), "setup_s": laps.seconds}


def measure(case: dict[str, Any], seconds: float, repeats: int) -> dict[str, Any]:
    """Measure a case; see the module."""
    if case["kind"] == "setup":
        return measure_setup(getattr(scenes, case["scene"])(**case["options"]), case["threads"])
    scene, model, result = build(case)
    if case["kind"] == "contact":
        assert scene is not None
        samples, steps, rate = contact_samples(scene, model, case["rate"], seconds, repeats)
        result |= {"steps": steps, "candidates": model.contact_candidates(), "rebuilds": rate}
        return {**result, "samples": samples.as_dict("contact"), "stages_us": samples.stages}
    if scene is not None:
        scenes.run_in(scene, model)
    before = model.contact_rebuilds()
    first = model.n
    samples, result["steps"] = step_samples(model, seconds, repeats)
    result["candidates"] = model.contact_candidates()
    result["rebuilds"] = (model.contact_rebuilds() - before) / (model.n - first)
    times = samples.as_dict("step")
    if case["kind"] == "force":
        times |= call_samples(model.compute_peridynamic_forces, seconds, repeats).as_dict("force")
    return {**result, "samples": times, "stages_us": samples.stages}


def main() -> None:
    """Measure the case that the arguments describe."""
    case, seconds, repeats = json.loads(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3])
    try:
        result = measure(case, seconds, repeats)
    except InputError as error:
        result = {"skipped": str(error)}
    print(json.dumps(result))


if __name__ == "__main__":
    main()
