"""Time series of a run as curves: one panel for each table that was recorded."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..files import make_folder, replace_file
from ..leftovers import SERIES
from ..modelling.arguments import checked, did_you_mean
from .fields import FIELDS
from .look import PIXELS_PER_INCH, Look, make_look
from .outputs import Outputs
from .scene import prefix

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["plot_series"]

# Distinct in hue and in lightness: told apart in grey, too (Okabe and Ito).
_CURVES = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#1b1b1b")
_DASHES = ("-", "--", "-.", ":")
_MOST_CURVES = 12
_UNLIKE = 100.0
_UNITS = {
    "energy": ("J", "J/m"),
    "kinetic_energy": ("J", "J/m"),
    "momentum": ("kg m/s; L: kg m²/s", "kg/s; L: kg m/s"),
    "position": ("m", "m"),
    "reaction": ("N", "N/m"),
    "stress": ("Pa", "Pa"),
    "velocity": ("m/s", "m/s"),
    "work": ("J", "J/m"),
}
"""Units of the package's recorders, in 3D and, where they are per metre of thickness, in 2D."""


@checked
def plot_series(
    source: Any,
    columns: str | Sequence[str] | None = None,
    path: str | Path | None = None,
    *,
    size: Sequence[int] | None = None,
    background: str = "white",
    title: str | None = None,
) -> Path | Figure:
    """Draw recorded numbers over time.

    Parameters
    ----------
    source : Result, DataFrame or path-like
        What a run handed back; a table with the time [s] as index or in a column ``time``; a
        csv or parquet file of it (``series.csv``), or the folder of outputs that has it.
    columns : str or sequence of str, optional
        Columns or tables to draw; all when left out. Columns of one table share a panel.
    path : path-like, optional
        File to write; without it the figure is handed back.
    size : (int, int), optional
        Width and height [pixels].
    background : str
        A colour.
    title : str, optional
        Title of the figure.

    Returns
    -------
    Path or Figure

    Raises
    ------
    InputError
        If there is nothing to draw, no such column, or the file cannot be written.
    """
    look = make_look(size=size, background=background, title=title)
    frame = _frame(source)
    groups = _groups(frame, columns)
    figure = _draw(frame, groups, look, _dimension(source))
    if path is None:
        return figure
    target = Path(path)
    kind = target.suffix.lstrip(".").lower() or "png"
    canvas: Any = figure.canvas
    if kind not in canvas.get_supported_filetypes():
        raise InputError(f"{target}: ending .{kind} is no picture format known here; use .png")
    if target.parent != Path():
        make_folder(target.parent)
    with replace_file(target) as temporary:
        figure.savefig(temporary, format=kind, dpi=figure.dpi)
    return target


def _frame(source: Any) -> pd.DataFrame:
    import pandas as pd

    if hasattr(source, "series") and hasattr(source, "summary"):
        frame = source.series
    elif isinstance(source, str | Path):
        frame = _read(Path(source))
    elif isinstance(source, pd.Series):
        frame = source.to_frame(source.name or "value")
    elif isinstance(source, pd.DataFrame):
        frame = source
    else:
        raise InputError(
            f"plot_series: source = {type(source).__name__}: must be a result, a DataFrame or a "
            "file; give one of them"
        )
    if "time" in frame.columns:
        frame = frame.set_index("time")
    frame = frame.drop(columns=[one for one in ("step",) if one in frame.columns])
    frame = frame.select_dtypes("number")
    if not len(frame.columns) or not len(frame):
        raise InputError(
            "plot_series: nothing was recorded; record something in run(record=[...]), for "
            'instance "kinetic_energy"'
        )
    return frame


def _read(path: Path) -> pd.DataFrame:
    import pandas as pd

    if path.is_dir():
        found = [path / name for name in SERIES]
        path = next((one for one in found if one.is_file()), found[0])
    if not path.is_file():
        raise InputError(
            f"{path}: no such file; give the folder or file that a run has recorded to"
        )
    try:
        return pd.read_parquet(path) if path.suffix == ".parquet" else pd.read_csv(path)
    except (OSError, ValueError, ImportError) as error:
        raise InputError(f"{path}: cannot be read as a table: {error}; give a csv file") from error


def _dimension(source: Any) -> int | None:
    """Dimension of the model that a series is of, where a result or a folder of outputs tells."""
    if hasattr(source, "summary"):
        known = source.summary.get("dimension")
        return None if known is None else int(known)
    if not isinstance(source, str | Path):
        return None
    path = Path(source)
    try:
        outputs = Outputs.open(path if path.is_dir() else path.parent)
        return 3 if outputs.snapshot(outputs.frames[0], FIELDS["Displacement"]).is_3d else 2
    except InputError:
        return None


def _unit(table: str, dimension: int | None) -> str:
    """Return the unit of a recorder's table; both where the dimension is not known."""
    name = next((one for one in _UNITS if table == one or table.startswith(f"{one}_")), None)
    if name is None:
        return ""
    solid, plane = _UNITS[name]
    if dimension is None and solid != plane:
        return f"{solid}, in 2D {plane}"
    return plane if dimension == 2 else solid


def _groups(frame: pd.DataFrame, columns: Any) -> dict[str, list[str]]:
    """Columns of each panel, by the name of their table."""
    names = [str(one) for one in frame.columns]
    tables = dict.fromkeys(name.split(".")[0] for name in names)
    wanted: Iterable[str] = names
    if columns is not None:
        wanted = []
        for one in [columns] if isinstance(columns, str) else columns:
            found = [name for name in names if name == one or name.startswith(f"{one}.")]
            if not found:
                raise InputError(
                    f"plot_series: columns = {one}: there is none; "
                    f"{did_you_mean(one, [*names, *tables])}"
                )
            wanted = [*wanted, *found]
    groups: dict[str, list[str]] = {}
    for name in dict.fromkeys(wanted):
        groups.setdefault(name.split(".")[0], []).append(name)
    return {
        heading: part
        for table, members in groups.items()
        for heading, part in _by_size(frame, table, members)
    }


def _by_size(frame: pd.DataFrame, table: str, members: list[str]) -> list[tuple[str, list[str]]]:
    """Split columns too unlike in size for one panel: a fraction beside a number of bonds."""
    sizes = [float(np.nanmax(np.abs(frame[one].to_numpy(dtype=float)))) for one in members]
    real = [size for size in sizes if size > 1e-9 * max(sizes)]  # others are round-off
    if len(members) > _MOST_CURVES or not real or max(real) <= _UNLIKE * min(real):
        return [(table, members)]
    middle = float(np.sqrt(max(real) * min(real)))
    small = [one for one, size in zip(members, sizes, strict=True) if size <= middle]
    return [
        (_heading(table, part), part) for part in ([m for m in members if m not in small], small)
    ]


def _heading(table: str, members: list[str]) -> str:
    return f"{table}: {', '.join(one.removeprefix(f'{table}.') for one in members)}"


def _draw(
    frame: pd.DataFrame, groups: Mapping[str, list[str]], look: Look, dimension: int | None
) -> Figure:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    count = len(groups)
    columns = 1 if count <= 2 else 2
    rows = -(-count // columns)
    size = (5.6 * columns, 2.5 * rows + 0.5)
    if look.size is not None:
        size = (look.size[0] / PIXELS_PER_INCH, look.size[1] / PIXELS_PER_INCH)
    figure = Figure(
        figsize=size, dpi=PIXELS_PER_INCH, layout="constrained", facecolor=look.background
    )
    FigureCanvasAgg(figure)
    grid: Any = figure.subplots(rows, columns, squeeze=False, sharex=True)
    panels = list(grid.ravel())
    for unused in panels[count:]:
        unused.remove()
    times = frame.index.to_numpy(dtype=float)
    factor, unit = prefix(times[np.isfinite(times)].tolist(), "s")
    for k, (name, members) in enumerate(groups.items()):
        unit_of = _unit(members[0].split(".")[0], dimension)
        heading = f"{name} [{unit_of}]" if unit_of else name
        _panel(panels[k], frame, times / factor, name=heading, members=members, look=look)
        if k + columns >= count:
            panels[k].tick_params(labelbottom=True)
            panels[k].set_xlabel(f"t [{unit}]", color=look.ink)
    if look.title:
        figure.suptitle(look.title, color=look.ink, fontsize=11)
    return figure


def _panel(
    axes: Axes, frame: pd.DataFrame, times: Any, *, name: str, members: list[str], look: Look
) -> None:
    """Draw the columns of one table."""
    ink = look.ink
    axes.set_facecolor(look.background)
    shown = members[:_MOST_CURVES]
    for k, member in enumerate(shown):
        values = frame[member].to_numpy(dtype=float)
        there = np.isfinite(values)  # recorders with longer intervals leave gaps
        axes.plot(
            times[there], values[there], color=_CURVES[k % len(_CURVES)], linewidth=1.5,
            linestyle=_DASHES[k // len(_CURVES) % len(_DASHES)] if k >= len(_CURVES) else "-",
            label=member.split(".", 1)[-1],
        )  # fmt: skip
    rest = len(members) - len(shown)
    heading = f"{name}, the first {len(shown)} of {len(members)} columns" if rest else name
    axes.set_title(heading.replace("_", " "), loc="left", fontsize=10, color=ink)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(ink)
    axes.tick_params(colors=ink, labelsize=9)
    axes.yaxis.get_offset_text().set_color(ink)
    axes.ticklabel_format(axis="y", scilimits=(-3, 4), useMathText=True)
    if len(shown) > 1:
        axes.legend(
            loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=9, labelcolor=ink
        )
