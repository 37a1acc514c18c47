"""The table of a study: rows in a csv file that is whole whatever happens, and its reading."""

from __future__ import annotations

import csv
import fcntl
import io
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..errors import InputError
from ..files import cannot_write, make_folder, replace_file
from .parameters import OWN_COLUMNS

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["StudyTable", "StudyWarning"]

Row = dict[str, str]
_TRUTH = {"True": True, "False": False}


class StudyWarning(UserWarning):
    """Sets of a study have failed, or are from another version of its function or of peridem."""


class StudyTable:
    """Rows by their ids, kept in a file when there is a folder.

    A finished row is appended and synced; a row that is cut off by a power cut has no end of
    line and is dropped when the file is read again. A new column, or a row that takes the place
    of an older one, replaces the file as a whole.

    Parameters
    ----------
    folder : Path or None
        Folder of ``study.csv``; nothing is written without.
    parameters : sequence of str
        Names of the parameters, the first columns.

    Raises
    ------
    InputError
        If the file cannot be read or written, or is no table of a study.
    """

    def __init__(self, folder: Path | None, parameters: Sequence[str]) -> None:
        self.path = None if folder is None else folder / "study.csv"
        self._parameters = list(dict.fromkeys(parameters))
        self._results: list[str] = []
        self.rows: dict[str, Row] = {}
        self._written: list[str] | None = None
        if folder is not None:
            make_folder(folder)
            self._read()

    @property
    def columns(self) -> list[str]:
        """Names of the columns: id, parameters, results, and what is known of the run."""
        return ["id", *self._parameters, *self._results, *OWN_COLUMNS[1:]]

    def add(self, row: Row) -> None:
        """Add a row, or put it in place of the one of the same id."""
        known = set(self.columns)
        self._results += [name for name in row if name not in known]
        replaces = row["id"] in self.rows
        self.rows.pop(row["id"], None)
        self.rows[row["id"]] = row
        if self.path is None:
            return
        if replaces or self._written != self.columns:
            self._replace(self.path)
        else:
            self._append(self.path, row)

    def frame(self, ids: Sequence[str]) -> pd.DataFrame:
        """Rows of these ids, in their order, as a table of numbers and text.

        Parameters and results come first; source and version are in the file alone.
        """
        import pandas as pd

        rows = [self.rows[one] for one in ids if one in self.rows]
        text = set(OWN_COLUMNS) - {"seconds"}
        return pd.DataFrame(
            {
                name: [row.get(name, "") for row in rows] if name in text else _column(rows, name)
                for name in [*self._parameters, *self._results, "status", "error", "seconds", "id"]
            }
        )

    def _text(self, rows: Sequence[Row], *, header: bool = True) -> str:
        stream = io.StringIO()
        writer = csv.DictWriter(stream, self.columns, restval="", lineterminator="\n")
        if header:
            writer.writeheader()
        writer.writerows(rows)
        return stream.getvalue()

    def _replace(self, path: Path) -> None:
        with replace_file(path) as temporary:
            temporary.write_text(self._text(list(self.rows.values())), encoding="utf-8")
        self._written = self.columns

    def _append(self, path: Path, row: Row) -> None:
        try:
            with path.open("a", encoding="utf-8", newline="") as stream:
                stream.write(self._text([row], header=False))
                stream.flush()
                os.fsync(stream.fileno())
        except OSError as error:
            raise InputError(cannot_write(path, error.strerror or str(error))) from error

    def _read(self) -> None:
        assert self.path is not None
        if not self.path.exists():
            return
        try:
            text = self.path.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"{self.path}: cannot be read: {error}; move it away") from error
        whole = text[: text.rfind("\n") + 1]
        reader = csv.DictReader(io.StringIO(whole))
        columns = list(reader.fieldnames or [])
        if columns and (columns[0] != "id" or not set(OWN_COLUMNS) <= set(columns)):
            raise InputError(
                f"{self.path}: is no table of a study (its columns are {', '.join(columns)}); "
                "choose another folder"
            )
        for row in reader:
            if None not in row and None not in row.values():
                self.rows[row["id"]] = {key: value for key, value in row.items() if value != ""}
        own = {*OWN_COLUMNS, *self._parameters}
        self._results = [name for name in columns if name not in own]
        self._written = columns if whole == text and columns == self.columns else None


def _column(rows: Sequence[Row], name: str) -> list[Any]:
    """Numbers, truth values or text of a column; None where there is nothing."""
    cells = [row.get(name) for row in rows]
    given = [one for one in cells if one is not None]
    if given and all(one in _TRUTH for one in given):
        return [None if one is None else _TRUTH[one] for one in cells]
    for kind in (int, float):
        try:
            for one in given:
                kind(one)
        except ValueError:
            continue
        return [None if one is None else kind(one) for one in cells]
    return cells


@contextmanager
def locked(folder: Path | None) -> Iterator[None]:
    """Keep a second study out of a folder.

    Raises
    ------
    InputError
        If another one is running there.
    """
    if folder is None:
        yield
        return
    make_folder(folder)
    with (folder / ".lock").open("w") as stream:
        try:
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(
                f"study: folder = {folder}: another study is running there; wait, or choose "
                "another folder"
            ) from None
        yield
