"""Models and results in a notebook: a table, a picture, curves, as HTML."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterable, Sequence
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from ..body_table import body_rows
from ..errors import InputError
from ..summary import time_text
from .preview import preview
from .render import render
from .timelines import plot_series

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from ..result import Result

__all__ = ["model_html", "result_html"]

_PICTURE = (880, 640)
_CURVES = (1200, 640)
_MOST_ROWS = 12


def model_html(model: Any) -> str:
    """HTML of a model: its bodies and a picture of them; the model is not built for it."""
    if model._built is None:
        plan = model._plan
        title = f"DEMModel, {plan.dimension}D, not built yet"
        rows = _plan_rows(plan)
        figure = preview(plan)
    else:
        title = (
            f"DEMModel, {model.dimension}D: {model.n_nodes} nodes, step {model.n}, "
            f"t = {time_text(model.time)}"
        )
        rows = _built_rows(model)
        figure = _drawn(model, title=None)
    table = _table(("bodies", "kind", "what", "nodes or mesh size"), rows)
    return _page(title, [table], [figure])


def result_html(result: Result) -> str:
    """HTML of a result: its summary, the last state and what was recorded."""
    known = result.summary
    rows = [
        ("reached", f"step {known['steps']}, t = {time_text(known['time'])}"),
        ("time step", f"{known['dt']:.4g} s ({known['dt_from']})"),
        ("bodies", f"{known['bodies']}"),
        ("nodes", f"{known['nodes']}"),
        ("broken bonds", f"{known['broken_bonds']} of {known['bonds']}"),
        ("recorded", ", ".join(result.tables) or "nothing"),
        ("files", "none" if result.folder is None else str(result.folder)),
    ]
    if known["stop_reason"]:
        rows.append(("stopped", str(known["stop_reason"])))
    figures = []
    if result.folder is not None:
        figures.append(_drawn(result))
    if len(result.series.columns) > 1:
        curves: Any = plot_series(result, size=_CURVES)
        figures.append(curves)
    return _page("Result", [_table((), rows)], figures)


def _drawn(source: Any, **options: Any) -> Figure | None:
    """Picture of a state; none where it has run away or nothing was written."""
    try:
        figure: Any = render(source, size=_PICTURE, **options)
    except InputError:
        return None
    return figure  # type: ignore[no-any-return]


def _plan_rows(plan: Any) -> list[tuple[str, ...]]:
    counts: dict[tuple[str, ...], int] = {}
    for body in plan.bodies:
        size = "own mesh" if body.form.mesh_size is None else f"h = {body.form.mesh_size:g} m"
        kind = "wall" if body.is_wall else "fixed particle" if body.fixed else "particle"
        key = (kind, f"{body.form.label} of {body.material.label}", size)
        counts[key] = counts.get(key, 0) + 1
    return [(str(count), *key) for key, count in counts.items()]


def _built_rows(model: Any) -> list[tuple[str, ...]]:
    groups: dict[tuple[int, str], list[Any]] = {}
    for row in body_rows(model):
        kind = "fixed particle" if row.constrained and row.kind == "particle" else row.kind
        groups.setdefault((row.zone, kind), []).append(row)
    return [
        (
            str(len(rows)),
            kind,
            f"zone {zone + 1}: {model.deck.materials[zone].type}",
            str(sum(row.stop - row.start for row in rows)),
        )
        for (zone, kind), rows in groups.items()
    ]


def _table(titles: Iterable[str], rows: Sequence[tuple[str, ...]]) -> str:
    shown = rows[:_MOST_ROWS]
    head = "".join(f"<th style='text-align:left'>{escape(one)}</th>" for one in titles)
    body = "".join(
        "<tr>" + "".join(f"<td style='text-align:left'>{escape(one)}</td>" for one in row) + "</tr>"
        for row in shown
    )
    if len(rows) > len(shown):
        body += f"<tr><td colspan='9'>and {len(rows) - len(shown)} more</td></tr>"
    return f"<table>{f'<tr>{head}</tr>' if head else ''}{body}</table>"


def _page(title: str, parts: list[str], figures: list[Figure | None]) -> str:
    images = [_image(figure) for figure in figures if figure is not None]
    inner = "".join([f"<p><b>{escape(title)}</b></p>", *parts, *images])
    return f"<div class='peridem'>{inner}</div>"


def _image(figure: Figure) -> str:
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=figure.dpi, facecolor=figure.get_facecolor())
    text = base64.b64encode(stream.getvalue()).decode("ascii")
    width = int(np.ceil(figure.get_size_inches()[0] * figure.dpi / 1.6))
    return f"<img style='max-width:100%;width:{width}px' src='data:image/png;base64,{text}'/>"
