"""Which nodes belong to which body: a small csv file beside the vtu files of a run."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from .files import replace_file

if TYPE_CHECKING:
    from .model import DEMModel

__all__ = ["BodyRow", "bodies_path", "read_bodies", "write_bodies"]

COLUMNS = ("id", "name", "kind", "zone", "start", "stop", "constrained")


@dataclass(frozen=True)
class BodyRow:
    """One body: its id, name, kind ("particle", "wall"), zone and nodes [start, stop)."""

    id: int
    name: str
    kind: str
    zone: int
    start: int
    stop: int
    constrained: bool

    @property
    def is_wall(self) -> bool:
        """Whether pictures draw it as a wall: one, or a body whose motion is prescribed."""
        return self.kind == "wall" or self.constrained


def bodies_path(series: Path) -> Path:
    """Name of the file that goes with a time series: ``output_bodies.csv``."""
    return series.with_name(f"{series.stem}_bodies.csv")


def body_rows(model: DEMModel) -> list[BodyRow]:
    """List the bodies of a model by their ids."""
    names = model.body_names()
    return [
        BodyRow(
            one.id, names.get(one.id, ""), one.type, one.zone, one.start, one.stop, one.constrained
        )
        for one in model.particles
    ]


def write_bodies(path: Path, model: DEMModel) -> None:
    """Write the bodies of a model, whole or not at all.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    with replace_file(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as out:
        table = csv.writer(out, lineterminator="\n")
        table.writerow(COLUMNS)
        for row in body_rows(model):
            values = [getattr(row, column) for column in COLUMNS]
            table.writerow([int(value) if isinstance(value, bool) else value for value in values])


def read_bodies(path: Path) -> list[BodyRow]:
    """Read the bodies of a run; none where there is no such file, or it is not readable."""
    try:
        with path.open(newline="", encoding="utf-8") as stream:
            return [
                BodyRow(
                    int(row["id"]),
                    row["name"],
                    row["kind"],
                    int(row["zone"]),
                    int(row["start"]),
                    int(row["stop"]),
                    row["constrained"] == "1",
                )
                for row in csv.DictReader(stream)
            ]
    except (OSError, ValueError, KeyError, TypeError, csv.Error):
        return []
