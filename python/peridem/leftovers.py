"""What an earlier run has left in an output folder: set aside, never removed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from .checkpoint import own_checkpoints
from .errors import InputError
from .files import cannot_write, make_folder
from .output import older_files, read_pvd, series_path

if TYPE_CHECKING:
    from .model import DEMModel

__all__ = ["SERIES", "left_files", "set_aside"]

SERIES = ("series.csv", "series.parquet")
"""Names under which what was recorded is looked for in an output folder."""


def set_aside(folder: Path, tag: str | None, series: Path | None) -> list[str]:
    """Rename what a new run would be mistaken for: checkpoints and series of an earlier one.

    ``checkpoint_40.h5`` becomes ``checkpoint_40.h5.old`` (``.old2``, ... if there is one), so that
    the new run is not gone on with from there, nor drawn with the numbers of another.

    Parameters
    ----------
    folder : Path
        Output folder of the new run; created when missing.
    tag : str or None
        Its ``Output.Tag_PP``.
    series : Path or None
        File that it records to and replaces.

    Returns
    -------
    list of str
        What was done, to be told; empty when there was nothing.

    Raises
    ------
    InputError
        If the folder cannot be written.
    """
    make_folder(folder)
    own = None if series is None else series.resolve()
    tables = [folder / name for name in SERIES]
    found = [path for path in tables if path.is_file() and path.resolve() != own]
    found += own_checkpoints(folder, str(tag) if tag else None)
    for path in found:
        try:
            path.rename(_free_name(path))
        except OSError as error:
            raise InputError(cannot_write(path, error.strerror or str(error))) from error
    if not found:
        return []
    names = ", ".join(path.name for path in found)
    return [
        f"files of an earlier run are in {folder}: {names}; renamed, they end in .old now; remove "
        "what is not needed, or give another folder (resume=True goes on with a run)"
    ]


def left_files(model: DEMModel, folder: Path) -> list[str]:
    """Say which vtu files of an earlier run a finished run has left in its folder, if any."""
    series = series_path(folder, model.deck.output.tag_pp or None)
    if not series.is_file():
        return []
    older = older_files(series, [path.name for _, path in read_pvd(series)])
    if not older:
        return []
    return [
        f"vtu files of an earlier run are left in {folder}: {len(older)} ({older[0].name}, ...); "
        f"{series.name} does not list them; remove them, or give another folder"
    ]


def _free_name(path: Path) -> Path:
    """Name that no file has yet."""
    name, k = path.with_name(f"{path.name}.old"), 2
    while name.exists():
        name, k = path.with_name(f"{path.name}.old{k}"), k + 1
    return name
