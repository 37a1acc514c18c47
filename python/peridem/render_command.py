"""The command `peridem render`: pictures and animations of the outputs of a run."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import click

from .command import with_exit_codes
from .errors import InputError

__all__ = ["render"]


def _when(value: Any) -> Any:
    """Read first, last, a whole number as the number of an output, others as a time."""
    if not isinstance(value, str) or value in ("first", "last"):
        return value
    for kind in (int, float):
        try:
            return kind(value)
        except ValueError:
            continue
    raise click.BadParameter(f"{value!r} is not first, last, a number of an output or a time in s")


def _zoom(value: Any) -> Any:
    """Read a factor, or a box x0,y0,x1,y1."""
    try:
        numbers = [float(part) for part in str(value).split(",")]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 4):
        raise click.BadParameter(f"{value!r} is not a factor or a box x0,y0,x1,y1 in m")
    return numbers[0] if len(numbers) == 1 else tuple(numbers)


@click.command()
@click.argument("output_dir", type=click.Path(path_type=Path))
@click.option(
    "--field",
    metavar="NAME",
    help="Array to colour by: damage_z, damage, displacement, velocity_y, stress, particle_id, "
    "... or any array in the outputs; damage if left out.",
)
@click.option(
    "-o",
    "--picture",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="File to write: .png, .pdf, .svg, .gif, .mp4; FIELD.png in OUTPUT_DIR if left out.",
)
@click.option(
    "--at",
    type=_when,
    multiple=True,
    metavar="WHEN",
    help="Output to draw: first, last, its number, or a time in s (1e-4); several make a grid.",
)
@click.option(
    "--every",
    type=_when,
    metavar="N",
    help="Draw every Nth output, or every so many seconds (1e-5), as a grid or an animation.",
)
@click.option("--range", "limits", type=float, nargs=2, metavar="LOW HIGH", help="Ends of colours.")
@click.option("--colours", metavar="NAME", help="A colour map of matplotlib, such as cividis.")
@click.option("--size", type=int, nargs=2, metavar="W H", help="Width and height in pixels.")
@click.option(
    "--zoom", type=_zoom, default=1.0, metavar="Z", help="Factor, or a box x0,y0,x1,y1 in m."
)
@click.option("--background", default="white", metavar="COLOUR", help="White if left out.")
@click.option(
    "--walls",
    default="filled",
    metavar="HOW",
    help="Walls are filled (in grey, the default), outline, hidden or coloured.",
)
@click.option("--scale", type=float, default=1.0, metavar="F", help="Factor on displacements.")
@click.option("--title", metavar="TEXT", help="Put before the time.")
@click.option("--style", metavar="HOW", help="Draw cells (the default) or nodes.")
@click.option("--engine", default="auto", metavar="E", help="For 3D: auto, pyvista or matplotlib.")
@click.option(
    "--view", type=float, nargs=2, default=(-60.0, 25.0), metavar="AZ EL",
    help="For 3D: azimuth and elevation in degrees.",
)  # fmt: skip
@click.option("--fps", type=float, default=12.0, metavar="N", help="Frames per second.")
@click.option("--workers", type=int, metavar="N", help="Processes that draw an animation.")
@click.option("--tag", metavar="TAG", help="Tag_PP of the run, if OUTPUT_DIR has several.")
@click.option(
    "--chains",
    type=click.Path(dir_okay=False, path_type=Path),
    is_flag=False,
    flag_value="",
    metavar="[CSV]",
    help="Draw forces between bodies: those of the outputs (tag Contact_Network), or of a file "
    "with the columns i, j, force.",
)
@click.option("--series", is_flag=True, help="Draw what was recorded over time instead.")
@with_exit_codes
def render(
    *, output_dir: Path, picture: Path | None, series: bool, chains: Path | None, **options: Any
) -> None:
    """Draw the outputs in OUTPUT_DIR, or a .pvd or .vtu file: a picture, a grid, an animation."""
    from .plot import Outputs, plot_series
    from .plot import render as draw

    folder = output_dir if output_dir.is_dir() else output_dir.parent
    if series:
        written = plot_series(output_dir, path=picture or folder / "series.png")
        click.echo(f"Look at {written}")
        return
    field = options.pop("field")
    options["at"] = list(options["at"]) or None
    if picture is None:
        found = Outputs.open(output_dir, options["tag"]).find_field(field)
        picture = folder / f"{found.name}.png"
    if chains is not None:
        options["chains"] = True if chains == Path() else _table(chains)
    with warnings.catch_warnings(record=True) as notes:
        warnings.simplefilter("always")
        written = draw(output_dir, field, picture, **options)
    for note in notes:
        click.echo(f"note: {note.message}", err=True)
    click.echo(f"Look at {written}")


def _table(path: Path) -> Any:
    import pandas as pd

    try:
        return pd.read_csv(path)
    except (OSError, ValueError) as error:
        raise InputError(f"--chains {path}: cannot be read: {error}; give a csv file") from error
