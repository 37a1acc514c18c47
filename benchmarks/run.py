"""Measure how long steps take, and compare with an earlier result.

    python benchmarks/run.py [CASE ...] [--deck FILE ...] [--threads 1 2] [--repeats 7]
                             [--output result.json] [--compare earlier.json]

Every figure is the median over repeats of the same number of steps; the smallest and largest are
kept in the result. Quote ratios of figures from one run of this program, not times.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import statistics
import tempfile
import time
from pathlib import Path

import numpy as np
from cases import CASES, write_deck
from peridem import DEMModel, __version__
from rich.console import Console
from rich.table import Table

SECONDS_PER_REPEAT = 0.4


def measure(path: Path, threads: int, repeats: int) -> dict[str, object]:
    """Time the steps of a deck: microseconds a step, by stage and as a whole."""
    begin = time.perf_counter()
    model = DEMModel.from_deck(path, threads=threads)
    model.start()
    setup = time.perf_counter() - begin
    model.step(2)  # warm
    begin = time.perf_counter()
    model.step(3)
    steps = max(2, int(SECONDS_PER_REPEAT / (time.perf_counter() - begin) * 3))
    walls: list[float] = []
    stages: list[dict[str, float]] = []
    for _ in range(repeats):
        before, begin = model.timings, time.perf_counter()
        model.step(steps)
        walls.append((time.perf_counter() - begin) / steps * 1e6)
        after = model.timings
        stages.append({key: (after[key] - before[key]) / steps * 1e6 for key in after})
    bonds = len(model.bonds)
    wall = statistics.median(walls)
    return {
        "threads": threads,
        "nodes": model.n_nodes,
        "bonds": bonds,
        "neighbours": round(bonds / model.n_nodes, 1),
        "steps": steps,
        "us_per_step": wall,
        "us_per_step_min": min(walls),
        "us_per_step_max": max(walls),
        "ns_per_bond": wall * 1e3 * threads / bonds,
        "stages_us": {key: statistics.median(s[key] for s in stages) for key in stages[0]},
        "setup_s": setup,
        "bytes_per_bond": model.memory_bytes / bonds,
        "instruction_set": model.instruction_set,
    }


def memory_bandwidth() -> float:
    """Bytes a second of a copy that does not fit into the caches, read and write counted."""
    source = np.zeros(30_000_000)
    target = np.empty_like(source)
    best = 0.0
    for _ in range(5):
        begin = time.perf_counter()
        np.copyto(target, source)
        best = max(best, 2 * source.nbytes / (time.perf_counter() - begin))
    return best


def machine() -> dict[str, object]:
    """What the figures depend on."""
    return {
        "processor": platform.processor() or platform.machine(),
        "cores": len(os.sched_getaffinity(0)),
        "memory_copy_GB_s": memory_bandwidth() / 1e9,
        "peridem": __version__,
    }


def show(result: dict[str, dict[str, dict[str, float]]], earlier: dict[str, object] | None) -> None:
    """Print the results as a table, with the ratio to an earlier result."""
    table = Table("case", "threads", "nodes", "bonds", "us/step", "min..max", "ns/bond/core")
    if earlier:
        table.add_column("earlier/now")
    for name, by_threads in result.items():
        for threads, r in by_threads.items():
            row = [
                name,
                threads,
                f"{r['nodes']:,}",
                f"{r['bonds']:,}",
                f"{r['us_per_step']:.1f}",
                f"{r['us_per_step_min']:.1f}..{r['us_per_step_max']:.1f}",
                f"{r['ns_per_bond']:.2f}",
            ]
            if earlier:
                before = earlier["cases"].get(name, {}).get(threads)  # type: ignore[attr-defined]
                row.append(f"{before['us_per_step'] / r['us_per_step']:.2f}" if before else "-")
            table.add_row(*row)
    Console(width=110).print(table)


def main() -> None:
    """Run the benchmarks asked for."""
    names = [case.name for case in CASES]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("cases", nargs="*", metavar="CASE", help=f"default: all of {names}")
    parser.add_argument("--deck", type=Path, action="append", default=[], help="a deck to time")
    parser.add_argument("--threads", type=int, nargs="+", default=[1])
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--output", type=Path, help="result file (json)")
    parser.add_argument("--compare", type=Path, help="earlier result file")
    args = parser.parse_args()
    for name in args.cases:
        if name not in names:
            parser.error(f"no case {name!r}; choose from {', '.join(names)}")
    wanted = args.cases or ([] if args.deck else names)
    result: dict[str, dict[str, dict[str, object]]] = {}
    with tempfile.TemporaryDirectory() as folder:
        decks = {c.name: write_deck(c, Path(folder) / c.name) for c in CASES if c.name in wanted}
        decks |= {deck.resolve().parent.name: deck for deck in args.deck}
        for name, deck in decks.items():
            result[name] = {str(t): measure(deck, t, args.repeats) for t in args.threads}
    earlier = json.loads(args.compare.read_text()) if args.compare else None
    show(result, earlier)  # type: ignore[arg-type]
    if args.output:
        args.output.write_text(json.dumps({"machine": machine(), "cases": result}, indent=1))


if __name__ == "__main__":
    main()
