"""Run the benchmarks: time steps, compare with an earlier result, write a page.

    python benchmarks/run.py [CASE or GROUP ...] [--deck FILE ...] [--report FOLDER]
                             [--output result.json] [--compare earlier.json] [--quick]

Every case is measured in fresh processes, in rounds over all cases (A B A B), so that noise of the
machine reaches all that are compared. README.md says what the figures mean.
"""

from __future__ import annotations

import argparse
import datetime
import fnmatch
import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import machine
from cases import GROUPS, NEIGHBOURS, QUICK, Case, all_cases, deck_case, thread_counts
from report import time_text, write_report
from results import FORMAT, add_rooflines, compare, merge, primary_us
from rich.console import Console
from rich.table import Table

WORKER = Path(__file__).resolve().parent / "worker.py"
BUILD_BYTES_PER_BOND = 80
"""Memory that building a large model takes at its peak; larger ones than fit are left out."""


def parse(arguments: list[str] | None = None) -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(
        description="Time peridem.", epilog=f"Groups: {', '.join(GROUPS)}."
    )
    parser.add_argument(
        "cases", nargs="*", metavar="CASE", help="cases, groups or patterns such as 'pd3d_*'; all"
    )
    parser.add_argument("--list", action="store_true", help="name the cases and stop")
    parser.add_argument("--deck", type=Path, action="append", default=[], help="a deck to time")
    parser.add_argument(
        "--skip", type=int, default=0, metavar="N", help="steps of a deck before the measurement"
    )
    parser.add_argument("--quick", action="store_true", help="a short run that shows it works")
    parser.add_argument("--rounds", type=int, help="processes a case (3)")
    parser.add_argument("--repeats", type=int, help="repeats in a process (3)")
    parser.add_argument("--seconds", type=float, help="length of a repeat [s] (0.2)")
    parser.add_argument("--minutes", type=float, default=25.0, help="no second round after (25)")
    parser.add_argument("--timeout", type=float, default=180.0, help="seconds for one process")
    parser.add_argument("--report", type=Path, metavar="FOLDER", help="write page and charts")
    parser.add_argument("--output", type=Path, help="result file (json)")
    parser.add_argument("--compare", type=Path, help="earlier result file")
    args = parser.parse_args(arguments)
    defaults = (1, 2, 0.02) if args.quick else (3, 3, 0.2)
    for name, value in zip(("rounds", "repeats", "seconds"), defaults, strict=True):
        if getattr(args, name) is None:
            setattr(args, name, value)
        if getattr(args, name) <= 0:
            parser.error(f"--{name} = {getattr(args, name)}: must be positive")
    for path in (*args.deck, *([args.compare] if args.compare else [])):
        if not path.is_file():
            parser.error(f"{path}: there is no such file")
    try:
        args.chosen = choose(args)
    except ValueError as error:
        parser.error(str(error))
    return args


def choose(args: argparse.Namespace) -> list[Case]:
    """Cases that the command line asks for; a ValueError when a name fits none."""
    cores = len(os.sched_getaffinity(0))
    known = all_cases(cores)
    decks = [deck_case(path, t, args.skip) for path in args.deck for t in thread_counts(cores)]
    wanted = args.cases or ([] if decks else QUICK if args.quick else ["*"])
    chosen = []
    for pattern in wanted:
        fits = [c for c in known if c.group == pattern or fnmatch.fnmatch(c.name, pattern)]
        if not fits:
            raise ValueError(f"no case or group {pattern!r}; --list names them")
        chosen += [case for case in fits if case not in chosen]
    return chosen + decks


def too_large(case: Case) -> str | None:
    """Why a case cannot be built here, or None."""
    options = case.options
    if case.scene != "grains":
        return None
    neighbours = options.get("neighbours", NEIGHBOURS[2])
    needed = options["count"] * options["nodes"] * neighbours * BUILD_BYTES_PER_BOND
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    if needed < 0.7 * memory:
        return None
    return f"needs about {needed / 1e9:.0f} GB, the machine has {memory / 1e9:.0f}"


def run_case(case: Case, args: argparse.Namespace) -> dict[str, Any]:
    """Measure a case once, in a process of its own."""
    environment = dict(os.environ)
    if case.simd:
        environment["PERIDEM_SIMD"] = case.simd
    numbers = [str(args.seconds), str(args.repeats)]
    command = [sys.executable, str(WORKER), json.dumps(case.as_dict()), *numbers]
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            text=True,
            env=environment,
            check=False,
            timeout=args.timeout,
        )
    except subprocess.TimeoutExpired:
        return {"skipped": f"took longer than {args.timeout:g} s; see --timeout"}
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        return {"skipped": f"failed with exit code {done.returncode}: {last}"}
    result: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return result


def measure_all(args: argparse.Namespace, console: Console) -> tuple[dict[str, Any], ...]:
    """Rounds over all cases; returns results and what was skipped, by case."""
    rounds: dict[str, list[dict[str, Any]]] = {case.name: [] for case in args.chosen}
    skipped: dict[str, str] = {}
    began = time.monotonic()
    for number in range(args.rounds):
        due = [c for c in args.chosen if number < c.rounds and c.name not in skipped]
        for k, case in enumerate(due, 1):
            begin = time.monotonic()
            if number and begin - began > 60 * args.minutes:
                console.print(f"{args.minutes:g} minutes are over in round {number + 1}")
                break
            reason = too_large(case)
            one = {"skipped": reason} if reason else run_case(case, args)
            if "skipped" in one:
                # Not again; what an earlier round gave stays.
                skipped[case.name] = one["skipped"]
                text = f"skipped: {one['skipped']}"
            else:
                rounds[case.name].append(one)
                text = time_text(primary_us(merge(case.as_dict(), [one]))["median"])
            now = time.monotonic()
            console.print(
                f"[{now - began:5.0f} s] round {number + 1}/{args.rounds}, {k}/{len(due)}: "
                f"{case.name}: {text} ({now - begin:.1f} s)",
                markup=False,
                highlight=False,
            )
        else:
            continue
        break
    done = [case for case in args.chosen if rounds[case.name]]
    return {case.name: merge(case.as_dict(), rounds[case.name]) for case in done}, skipped


def run_all(args: argparse.Namespace, console: Console) -> dict[str, Any]:
    """Measure everything; the content of the result file."""
    start = machine.load()
    result: dict[str, Any] = {
        "format": FORMAT,
        "date": datetime.datetime.now(datetime.timezone.utc).isoformat(timespec="seconds"),
        "machine": machine.machine(),
        "settings": {k: getattr(args, k) for k in ("rounds", "repeats", "seconds", "quick")},
    }
    cores = result["machine"]["cores"]
    console.print(f"load {start[0]} on {cores} cores; measuring the ceilings", highlight=False)
    if start[0] > 0.3:
        console.print("[bold]warning: the machine is not quiet[/bold]; quote ratios, not times")
    result["ceilings"] = machine.ceilings(0.02 if args.quick else 0.1)
    result["cases"], result["skipped"] = measure_all(args, console)
    result["load"] = {"start": start, "end": machine.load()}
    add_rooflines(result)
    return result


def show(run: dict[str, Any], console: Console) -> None:
    """Print the results as a table, with the ratio to an earlier result."""
    found = run.get("comparison")
    table = Table("case", "threads", "nodes", "bonds", "time", "min .. max", "ns/bond", "roofline")
    if found is not None:
        table.add_column("earlier/now")
    for name, r in run["cases"].items():
        times, share = primary_us(r), r.get("roofline")
        row = [
            name,
            str(r["threads"]),
            f"{r['nodes']:,}",
            f"{r['bonds']:,}",
            time_text(times["median"]),
            f"{time_text(times['min'])} .. {time_text(times['max'])}",
            f"{r['ns_per_bond']['median']:.2f}" if "ns_per_bond" in r else "",
            f"{100 * share['share']:.0f} %" if share else "",
        ]
        if found is not None:
            c = found.get(name)
            mark = " SLOWER" if c and c["slower"] else ""
            row.append(f"{c['ratio']:.2f}{mark}" if c else "-")
        table.add_row(*row)
    console.print(table)
    for name, reason in run["skipped"].items():
        console.print(f"not measured: {name}: {reason}", markup=False, highlight=False)


def main(arguments: list[str] | None = None) -> int:
    """Run what is asked for; the exit code is 1 when a case failed."""
    args = parse(arguments)
    console = Console() if sys.stdout.isatty() else Console(width=130)
    if args.list:
        for case in args.chosen:
            console.print(f"{case.group:13} {case.name}", highlight=False)
        return 0
    run = run_all(args, console)
    earlier = json.loads(args.compare.read_text()) if args.compare else None
    if earlier is not None:
        run["comparison"] = compare(run, earlier)
    show(run, console)
    if args.output:
        args.output.write_text(json.dumps(run, indent=1))
    if args.report:
        page = write_report(run, args.report, earlier)
        (args.report / "result.json").write_text(json.dumps(run, indent=1))
        console.print(f"report: {page}", highlight=False)
    return int(any(text.startswith("failed") for text in run["skipped"].values()))


if __name__ == "__main__":
    raise SystemExit(main())
