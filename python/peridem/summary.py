"""What the command line says about a model: its parts, its plan, where the time went."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.table import Table
from rich.text import Text

from .memory import MemoryPrediction
from .output import NODE_TAGS

__all__ = [
    "bytes_text",
    "facts",
    "output_plan",
    "prediction_text",
    "time_text",
    "timing_rows",
    "timing_table",
    "zone_table",
]


def time_text(seconds: float) -> str:
    """Write a simulated time with a unit, in plain ASCII: ``80 us``, ``1.25 ms``."""
    for factor, unit in ((1.0, "s"), (1e3, "ms"), (1e6, "us")):
        if abs(seconds) * factor >= 0.1:
            return f"{seconds * factor:.4g} {unit}"
    return f"{seconds * 1e9:.4g} ns" if seconds else "0 s"


def bytes_text(count: float) -> str:
    """Write a number of bytes with a unit: ``1.5 MB``."""
    for unit in ("bytes", "kB", "MB"):
        if count < 1000:
            return f"{count:.3g} {unit}"
        count /= 1000
    return f"{count:.3g} GB"


def facts(model: Any) -> Iterator[tuple[str, str]]:
    """Yield what a model is made of, as pairs of a name and a text.

    Parameters
    ----------
    model : DEMModel
        An initialised model.
    """
    deck, known = model.deck, model.summary()
    walls = sum(body.type == "wall" for body in model.particles)
    count = len(model.particles)
    yield (
        "model",
        (
            f"{model.dimension}D, {deck.model.discretization_type.time}, "
            f"compatibility {known['compatibility']}"
        ),
    )
    yield "bodies", f"{count} ({_counted(count - walls, 'particle')}, {_counted(walls, 'wall')})"
    yield "nodes", f"{model.n_nodes}"
    yield "bonds", f"{known['bonds']}"
    yield "memory", bytes_text(model.memory_bytes)
    yield (
        "time",
        (f"{model.n_steps} steps of {model.dt:.4g} s, up to {time_text(model.dt * model.n_steps)}"),
    )
    stable = model.stable_time_step()
    broken = f", of broken bonds: {stable.self_contact:.3g} s" if stable.self_contact < inf else ""
    yield (
        "stable time step",
        (
            f"about {stable.bonds:.3g} s; the deck's is {model.dt / stable.bonds:.3g} times that"
            f" (of a full contact: {stable.contact:.3g} s{broken})"
        ),
    )


def _counted(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"


def prediction_text(prediction: MemoryPrediction) -> str:
    """Say what a model was expected to take: all of it, and by zone where there are several."""
    text = (
        f"about {bytes_text(prediction.bytes)}, {prediction.nodes} nodes and "
        f"{prediction.bonds / 2:.3g} bonds"
    )
    if len(prediction.zones) == 1:
        return text
    parts = (f"Zone_{part.zone + 1} {bytes_text(part.bytes)}" for part in prediction.zones)
    return f"{text} ({', '.join(parts)})"


def output_plan(model: Any) -> str:
    """Say which files a run writes, how many and how large.

    Parameters
    ----------
    model : DEMModel
        The model.

    Returns
    -------
    str
        One line; sizes are those without compression.
    """
    output = model.deck.output
    if not output.perform_out:
        return "none (Perform_Out is false)"
    tags = [tag for tag in output.tags if tag in NODE_TAGS]
    numbers = 3 + sum(NODE_TAGS[tag] for tag in tags)
    files = model.n_steps // output.output_interval + 1
    size = bytes_text(8.0 * numbers * model.n_nodes * files)
    return (
        f"{files} vtu files, one every {output.output_interval} steps, "
        f"at most about {size} in all; {', '.join(output.tags) or 'no tags'}"
    )


def zone_table(model: Any) -> Table:
    """Make the table of zones: bodies, shape, material, nodes, bonds, lengths."""
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    for title in ("zone", "kind", "shape", "material"):
        table.add_column(title)
    for title in ("bodies", "nodes", "bonds", "h [m]", "horizon [m]", "horizon/h"):
        table.add_column(Text(title), justify="right")  # as text: [m] is no markup
    deck = model.deck
    for zone, shape in enumerate(deck.particles):
        bodies = [body for body in model.particles if body.zone == zone]
        table.add_row(
            f"Zone_{zone + 1}",
            "wall" if deck.zones[zone].is_wall else "particle",
            str(shape.type) if shape is not None else "-",
            deck.materials[zone].type,
            str(len(bodies)),
            str(sum(body.stop - body.start for body in bodies)),
            str(sum(body.n_bonds for body in bodies) // 2),
            _range([body.mesh_size for body in bodies]),
            _range([body.horizon for body in bodies]),
            _range([body.horizon / body.mesh_size for body in bodies]),
        )
    return table


def timing_rows(
    timings: dict[str, float], wall_seconds: float, steps: int
) -> list[tuple[str, float, float, float]]:
    """Where the time went.

    Parameters
    ----------
    timings : dict of str to float
        Seconds per stage.
    wall_seconds : float
        Time of the whole run [s]; what the stages leave becomes the row "other".
    steps : int
        Number of steps taken.

    Returns
    -------
    list of (stage, seconds, share, microseconds per step)
        Longest first, stages that took no time left out; the last row is the total.
    """
    stages = {name.replace("_", " "): value for name, value in timings.items() if value > 0}
    rest = wall_seconds - sum(stages.values())
    if rest > 0:
        stages["other"] = rest
    total = max(wall_seconds, sum(stages.values()))
    ordered = sorted(stages.items(), key=lambda item: -item[1])
    return [
        (name, seconds, seconds / total if total else 0.0, 1e6 * seconds / max(steps, 1))
        for name, seconds in [*ordered, ("total", total)]
    ]


def timing_table(rows: Sequence[tuple[str, float, float, float]]) -> Table:
    """Make the table of `timing_rows`."""
    table = Table(box=SIMPLE_HEAD, pad_edge=False)
    table.add_column("stage")
    for title in ("seconds", "share", "us/step"):
        table.add_column(title, justify="right")
    for name, seconds, share, per_step in rows:
        if name == "total":
            table.add_section()
        table.add_row(name, f"{seconds:.3f}", f"{100 * share:.1f} %", f"{per_step:.1f}")
    return table


def _range(values: Sequence[float]) -> str:
    if not values:
        return "-"
    low, high = f"{min(values):.3g}", f"{max(values):.3g}"
    return low if low == high else f"{low} to {high}"
