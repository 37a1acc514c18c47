"""Time series of a run: tables of what its recorders give, in memory and in a file."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import nullcontext, suppress
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import InputError
from .files import make_folder, path_of, replace_file
from .modelling.arguments import show_value
from .recorders import by_name

if TYPE_CHECKING:
    import pandas as pd

    from .model import DEMModel

SUFFIXES = (".csv", ".parquet")
Interval = Callable[[str, Any], int]


class Table:
    """What one recorder has given so far.

    Parameters
    ----------
    name : str
        Name of the table.
    recorder : callable
        The recorder.
    every : int
        Steps between its calls.
    """

    def __init__(self, name: str, recorder: Callable[[DEMModel], Any], every: int) -> None:
        self.name = name
        self.recorder = recorder
        self.every = every
        columns = getattr(recorder, "columns", None)
        self.columns: list[str] | None = None if columns is None else [str(one) for one in columns]
        self.steps: list[int] = []
        self.times: list[float] = []
        self.rows: list[list[float]] = []

    def sample(self, model: DEMModel, *, at_end: bool = False) -> None:
        """Call the recorder when its interval is due or the run ends, once for each step."""
        if (model.n % self.every and not at_end) or (self.steps and self.steps[-1] >= model.n):
            return
        names, values = self._numbers(self.recorder(model))
        if self.columns is None:
            self.columns = names
        if len(values) != len(self.columns):
            raise InputError(
                f"record: {self.name}: gives {len(values)} numbers at step {model.n}: must be "
                f"{len(self.columns)} ({', '.join(self.columns)}) every time; correct the recorder"
            )
        self.steps.append(model.n)
        self.times.append(model.time)
        self.rows.append(values)

    def _numbers(self, given: Any) -> tuple[list[str], list[float]]:
        """Names and numbers of what a recorder gives."""
        try:
            if isinstance(given, Mapping):
                return [str(key) for key in given], [float(value) for value in given.values()]
            values = np.asarray(given, dtype=float)
        except (TypeError, ValueError):
            values = np.empty((0, 0))
        if values.ndim == 0:
            return [self.name], [float(values)]
        if values.ndim == 1:
            return [str(k) for k in range(len(values))], values.tolist()
        raise InputError(
            f"record: {self.name}: gives {show_value(given)}: must be a number, a sequence of "
            "numbers or a dict of numbers; correct the recorder"
        )

    def frame(self) -> pd.DataFrame:
        """Table with the time [s] as index and a column for each number."""
        import pandas as pd

        index = pd.Index(self.times, name="time", dtype=float)
        columns = self.columns or []
        return pd.DataFrame(np.array(self.rows).reshape(-1, len(columns)), index, columns)

    @property
    def headings(self) -> list[str]:
        """Names of its columns among those of other tables."""
        columns = self.columns or []
        return [self.name if one == self.name else f"{self.name}.{one}" for one in columns]


class SeriesRecorder:
    """Calls the recorders of a run and keeps what they give.

    Parameters
    ----------
    tables : sequence of Table
        One for each recorder.
    path : Path or None
        File that gets all of it, ``.csv`` or ``.parquet``.
    goes_on_from : int or None
        For a run that goes on: the rows of the file up to this step stay.

    Raises
    ------
    InputError
        If the file is of another kind or cannot be read.
    """

    def __init__(
        self, tables: Sequence[Table], path: Path | None, goes_on_from: int | None = None
    ) -> None:
        self.tables = list(tables)
        self.path = path
        if path is not None:
            _check_path(path)
            if goes_on_from is not None and path.exists():
                self._load(path, goes_on_from)

    @property
    def intervals(self) -> list[int]:
        """Numbers of steps at whose multiples `sample` has to be called."""
        return [table.every for table in self.tables]

    def begin(self, model: DEMModel) -> None:
        """Let recorders that have a ``begin(model)`` prepare the model, before the first step."""
        for table in self.tables:
            prepare = getattr(table.recorder, "begin", None)
            if callable(prepare):
                prepare(model)

    def warnings(self, model: DEMModel) -> list[str]:
        """Collect what recorders that have a ``warnings(model)`` say after the last step."""
        checks = (getattr(table.recorder, "warnings", None) for table in self.tables)
        return [text for check in checks if callable(check) for text in check(model)]

    def sample(self, model: DEMModel, *, at_end: bool = False) -> None:
        """Call the recorders that are due; all of them at the end of a run."""
        for table in self.tables:
            table.sample(model, at_end=at_end)

    def frame(self) -> pd.DataFrame:
        """All tables side by side: time [s] as index, the step, then the columns."""
        import pandas as pd

        whole: dict[int, dict[str, float]] = {}
        for table in self.tables:
            for step, time, row in zip(table.steps, table.times, table.rows, strict=True):
                line = whole.setdefault(step, {"time": time, "step": step})
                line.update(zip(table.headings, row, strict=True))
        headings = [one for table in self.tables for one in table.headings]
        frame = pd.DataFrame(
            [whole[step] for step in sorted(whole)], columns=["time", "step", *headings]
        )
        return frame.set_index("time")

    def save(self) -> None:
        """Write the file, if there is to be one.

        Raises
        ------
        InputError
            If it cannot be written.
        """
        if self.path is None or not self.tables:
            return
        make_folder(self.path.parent)
        frame = self.frame().reset_index()
        with replace_file(self.path) as temporary:
            if self.path.suffix == ".csv":
                frame.to_csv(temporary, index=False)
            else:
                frame.to_parquet(temporary, index=False)

    def _load(self, path: Path, last_step: int) -> None:
        import pandas as pd

        try:
            if path.suffix == ".csv":
                frame = pd.read_csv(path, dtype=str).astype(float)  # exact, unlike its own
            else:
                frame = pd.read_parquet(path)
            frame = frame[frame["step"] <= last_step]
            for table in self.tables:
                self._fill(table, frame)
        except (OSError, ValueError, KeyError) as error:
            raise InputError(
                f"record_to = {path}: cannot be gone on with: {error}; remove or rename it"
            ) from error

    @staticmethod
    def _fill(table: Table, frame: pd.DataFrame) -> None:
        own = [name for name in frame.columns if name == table.name or _belongs(name, table.name)]
        part = frame[["step", "time", *own]].dropna()
        if not own or part.empty:
            return
        table.columns = [name.removeprefix(f"{table.name}.") for name in own]
        table.steps = [int(step) for step in part["step"]]
        table.times = [float(time) for time in part["time"]]
        table.rows = part[own].to_numpy(dtype=float).tolist()

    def __enter__(self) -> SeriesRecorder:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        # That the file cannot be written must not hide the error that ends the run.
        with suppress(InputError) if error is not None else nullcontext():
            self.save()


def _belongs(heading: str, table: str) -> bool:
    return heading.startswith(f"{table}.")


def series_file(
    record_to: str | os.PathLike[str] | None, folder: Path | None, record: Any
) -> Path | None:
    """Return the file of what is recorded; a bare name is one in the output folder."""
    if record_to is None:
        return folder / "series.csv" if folder is not None and record else None
    path = path_of(record_to, "record_to")
    return folder / path if folder is not None and path.name == str(path) else path


def make_tables(record: Any, every: int, interval: Interval) -> list[Table]:
    """Tables for the recorders that a run was given.

    Parameters
    ----------
    record : str, recorder, dict, or sequence of names and recorders
        What to record; a dict gives the tables their names.
    every : int
        Steps between calls of recorders without an interval of their own.
    interval : callable
        Turns the interval of a recorder, in steps or seconds, into steps.

    Raises
    ------
    InputError
        If a name is unknown, something is no recorder, or a name is given twice.
    """
    if isinstance(record, str) or callable(record):
        record = [record]
    named = isinstance(record, Mapping)
    if not isinstance(record, Iterable):
        raise InputError(
            f"record = {show_value(record)}: must be a list of recorders; give names or functions"
        )
    items = record.items() if isinstance(record, Mapping) else ((None, one) for one in record)
    tables: list[Table] = []
    for given, one in items:
        recorder = by_name(one) if isinstance(one, str) else one
        if not callable(recorder):
            raise InputError(
                f"record = {show_value(one)}: must be the name of a recorder or a function of the "
                "model; correct it"
            )
        name = given if named else _name_of(recorder, len(tables))
        if any(table.name == name for table in tables):
            raise InputError(
                f"record = {name!r}: is given twice; give one of them another name=, or a dict of "
                "recorders by name"
            )
        own = getattr(recorder, "every", None)
        steps = every if own is None else interval(f"record: {name}: every", own)
        tables.append(Table(str(name), recorder, steps))
    return tables


def _name_of(recorder: Any, position: int) -> str:
    name = getattr(recorder, "name", None) or getattr(recorder, "__name__", "")
    return str(name) if name and name != "<lambda>" else f"recorder_{position + 1}"


def _check_path(path: Path) -> None:
    if path.suffix not in SUFFIXES:
        raise InputError(f"record_to = {path}: must end in .csv or .parquet; change the name")
    if path.suffix == ".parquet":
        try:
            import pyarrow  # noqa: F401
        except ImportError:
            raise InputError(
                f"record_to = {path}: parquet files need the package pyarrow; install it by "
                'pip install "peridem[parquet]", or write .csv'
            ) from None
