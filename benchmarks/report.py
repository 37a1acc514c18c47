"""The page of a result: tables in Markdown, charts beside it."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import charts
from cases import GROUPS
from peridem import _core
from results import QUIET, ceiling_ratio, primary, primary_us

Results = dict[str, dict[str, Any]]


def table(titles: Iterable[str], rows: Iterable[Iterable[object]]) -> list[str]:
    """A Markdown table; the first column to the left, the others to the right."""
    titles = list(titles)
    lines = ["| " + " | ".join(titles) + " |", "|" + "---|" + "---:|" * (len(titles) - 1)]
    return [*lines, *("| " + " | ".join(map(str, row)) + " |" for row in rows), ""]


def time_text(us: float) -> str:
    """Microseconds, milliseconds or seconds."""
    for limit, unit in ((1e3, "us"), (1e6, "ms")):
        if us < limit:
            return f"{us / limit * 1e3:.3g} {unit}"
    return f"{us / 1e6:.3g} s"


def number(value: float, digits: int = 2) -> str:
    return f"{value:.{digits}f}"


def range_text(times: dict[str, float]) -> str:
    return f"{time_text(times['min'])} .. {time_text(times['max'])}"


def cases_table(results: Results) -> list[str]:
    """Sizes, times and costs of the cases of a group."""
    rows = []
    for name, r in results.items():
        times = primary_us(r)
        share = r.get("roofline")
        rows.append(
            (
                name,
                r["threads"],
                f"{r['nodes']:,}",
                f"{r['bonds']:,}",
                number(r["neighbours"], 1),
                time_text(times["median"]),
                range_text(times),
                number(r["ns_per_bond"]["median"]) if "ns_per_bond" in r else "",
                number(r["force_ns_per_bond"]["median"]) if "force_ns_per_bond" in r else "",
                number(r["ns_per_node"]["median"], 1) if "ns_per_node" in r else "",
                f"{100 * share['share']:.0f} % ({share['bound']})" if share else "",
                f"{100 * share['share_of_flops']:.0f} %" if share else "",
                f"{100 * r['busy']:.0f} %" if "busy" in r else "",
            )
        )
    titles = (
        "case", "threads", "nodes", "bonds", "neighbours", "time", "min .. max", "ns/bond",
        "of it forces", "ns/node", "of the roofline", "of the flops",
        "busy",
    )  # fmt: skip
    return table(titles, rows)


def stages_table(results: Results) -> list[str]:
    """Where a step goes, in percent of its wall time."""
    names = ("peridynamic", "contact_search", "contact", "external", "integration")
    rows = []
    for name, r in results.items():
        if primary(r) != "step":
            continue
        total = primary_us(r)["median"]
        parts = [r["stages_us"].get(key, 0.0) for key in names]
        others = max(0.0, total - sum(parts))
        shares = [f"{100 * part / total:.1f}" for part in (*parts, others)]
        rows.append((name, r["threads"], *shares, f"{100 * r['rebuilds']:.2f}", r["candidates"]))
    titles = ("case", "threads", *(n.replace("_", " ") for n in names), "other")
    return table((*titles, "rebuilds per 100 steps", "candidates"), rows)


def threads_table(results: Results) -> list[str]:
    """Speed-up over one thread of the same model."""
    rows = []
    for base, by_threads in charts.thread_families(results).items():
        one = primary_us(by_threads[1])["median"]
        for threads, r in sorted(by_threads.items()):
            now = primary_us(r)["median"]
            rows.append(
                (base, threads, time_text(now), number(one / now), f"{one / now / threads:.0%}")
            )
    return table(("case", "threads", "time", "speed-up", "efficiency"), rows)


def memory_table(results: Results) -> list[str]:
    """Memory per node and per directed bond, and the most that the process held."""
    costs = _core.memory_costs()
    per_node = costs["node"] + costs["place"]
    rows = []
    for name, r in results.items():
        if r["threads"] > 1 or r["simd"] or r["group"] == "contact" or not r["bonds"]:
            continue
        rest = (r["memory_bytes"] - per_node * r["nodes"]) / r["bonds"]
        peak = r["peak_bytes_of_model"]
        rows.append(
            (
                name,
                f"{r['memory_bytes'] / 1e6:.1f}",
                per_node,
                number(rest, 1),
                number(r["memory_bytes"] / r["bonds"], 1),
                f"{peak / 1e6:.0f}",
                number(peak / r["bonds"], 1),
            )
        )
    titles = (
        "case", "arrays [MB]", "B/node", "B/bond", "all B/bond",
        "peak of the process [MB]", "peak B/bond",
    )  # fmt: skip
    return table(titles, rows)


def setup_table(results: Results) -> list[str]:
    """Seconds from mesh or files to the first forces, by stage."""
    names = ("read_and_place", "bonds_and_contact", "checks", "first_forces")
    rows = []
    for name, r in results.items():
        if r["threads"] > 1 or r["simd"] or r["group"] == "contact":
            continue
        parts = [r["setup_s"].get(key, {}).get("median") for key in names]
        total = sum(part for part in parts if part is not None)
        cells = ["" if part is None else f"{part:.3f}" for part in parts]
        rows.append(
            (name, f"{r['nodes']:,}", *cells, f"{total:.3f}", f"{total / r['nodes'] * 1e6:.2f}")
        )
    return table(
        ("case", "nodes", *(n.replace("_", " ") for n in names), "all [s]", "us/node"), rows
    )


def ceilings_lines(run: dict[str, Any]) -> list[str]:
    """The machine's ceilings."""
    ceilings = run["ceilings"]
    if not ceilings:
        return ["Not measured: there is no C++ compiler here.", ""]
    rows = [
        (f"multiply and add, {name}, one core", f"{rate:.1f} GFLOP/s", "")
        for name, rate in ceilings["fma_gflop_s"].items()
    ]
    places = (
        ("l2_gb_s", "second-level cache, one core"),
        ("l3_gb_s", "third-level cache, one core"),
        ("memory_gb_s", "memory, one core"),
        ("memory_all_gb_s", f"memory, {ceilings['threads']} cores together"),
    )
    for key, what in places:
        rates = ceilings[key]
        rows.append((what, f"{rates['read']:.1f} GB/s", f"{rates['triad']:.1f} GB/s"))
    return table(("ceiling", "read", "triad"), rows)


def comparison_lines(run: dict[str, Any], earlier: dict[str, Any]) -> list[str]:
    """Ratios to an earlier result."""
    found = run["comparison"]
    before = earlier["machine"]
    lines = [
        f"Earlier: commit {before['commit'][:10]}, {before['processor']}, load "
        f"{earlier['load']['start'][0]}. A ratio above 1 is faster now; a case is marked when its "
        "medians part by more than half the spread of both.",
        "",
    ]
    rows = [
        (
            name,
            time_text(c["earlier_us"]),
            time_text(c["now_us"]),
            number(c["ratio"]),
            f"{100 * c['noise']:.0f} %",
            "**slower**" if c["slower"] else "faster" if c["faster"] else "",
        )
        for name, c in found.items()
    ]
    lines += table(("case", "earlier", "now", "earlier/now", "noise", ""), rows)
    ratios = ceiling_ratio(run, earlier)
    if ratios:
        text = ", ".join(f"{name} {ratio:.2f}" for name, ratio in ratios.items())
        lines += [f"The machine itself, now over earlier: {text}.", ""]
    return lines


def page(run: dict[str, Any], pictures: dict[str, Path], earlier: dict[str, Any] | None) -> str:
    """The whole page."""
    m, cases = run["machine"], run["cases"]

    def picture(name: str) -> list[str]:
        return [f"![{name}]({pictures[name].name})", ""] if name in pictures else []

    lines = [
        f"# Benchmarks of peridem {m['peridem']}, commit {m['commit'][:10] or 'unknown'}",
        "",
        f"{run['date']}; {m['processor']}, {m['cores']} cores, {m['memory_bytes'] / 1e9:.0f} GB, "
        f"{m['system']}; core built by {m['core_compiler'] or 'an unknown compiler'}.",
        "",
        f"Load of the machine at the start {run['load']['start'][0]}, at the end "
        f"{run['load']['end'][0]}. Settings: {run['settings']}.",
        "",
        *disturbed_lines(cases),
        "`ns/bond` is the wall time of a whole step times the threads, per directed bond; times "
        "are medians of all repeats. `busy` is processor time over wall time of the threads.",
        "",
        "## Ceilings",
        "",
        *ceilings_lines(run),
    ]
    if earlier is not None:
        lines += ["## Compared with an earlier result", "", *comparison_lines(run, earlier)]
    for group, title in GROUPS.items():
        chosen = {k: r for k, r in cases.items() if r["group"] == group and group != "setup"}
        if chosen:
            lines += [f"## {title}", "", *cases_table(chosen)]
    sections: tuple[tuple[str, str, Callable[[Results], list[str]]], ...] = (
        ("Cost of a bond", "bonds", lambda _: []),
        ("Roofline", "roofline", lambda _: []),
        ("Growth with size", "growth", lambda _: []),
        ("Threads", "threads", threads_table),
        ("Where a step goes", "profile", stages_table),
        ("Memory", "", memory_table),
        ("Set-up", "", setup_table),
    )
    for title, name, make in sections:
        body = [*picture(name), *make(cases)]
        if body:
            lines += [f"## {title}", "", *body]
    if run["skipped"]:
        lines += ["## Not measured", "", *(f"- {k}: {v}" for k, v in run["skipped"].items()), ""]
    return "\n".join(lines)


def disturbed_lines(cases: Results) -> list[str]:
    """A warning when other programs took time from the measurements."""
    names = [k for k, r in cases.items() if r["threads"] == 1 and r.get("busy", 1) < QUIET]
    if not names:
        return []
    return [
        f"**{len(names)} of {len(cases)} cases were disturbed by other programs** (less than "
        f"{100 * QUIET:.0f} % of the wall time on the processor): {', '.join(names)}.",
        "",
    ]


def write_report(run: dict[str, Any], folder: Path, earlier: dict[str, Any] | None) -> Path:
    """Write report.md and its charts into a folder; returns the page."""
    folder.mkdir(parents=True, exist_ok=True)
    pictures = charts.draw_all(run, folder)
    path = folder / "report.md"
    path.write_text(page(run, pictures, earlier), encoding="utf-8")
    return path
