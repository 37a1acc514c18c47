"""What a run hands back."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .modelling.arguments import did_you_mean
from .series import SeriesRecorder

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

__all__ = ["Result"]


@dataclass(frozen=True, eq=False)
class Result:
    """What `DEMModel.run` has recorded and written.

    The table of each recorder is an attribute too: ``result.momentum``, ``result.damage``, with
    the time [s] as index.

    Attributes
    ----------
    summary : dict
        Facts about the run: steps, time, time step and where it is from, bodies, bonds.
    folder : Path or None
        Folder of the files; None when nothing was written.
    """

    summary: dict[str, Any]
    folder: Path | None
    _series: SeriesRecorder = field(repr=False)

    @property
    def series(self) -> pd.DataFrame:
        """All recorded numbers: the time [s] as index, the step, a column for each number."""
        return self._series.frame()

    @property
    def tables(self) -> dict[str, pd.DataFrame]:
        """Table of each recorder, by its name."""
        return {table.name: table.frame() for table in self._series.tables}

    def render(
        self, field: Any = None, path: str | os.PathLike[str] | None = None, **options: Any
    ) -> Path | Figure:
        """Draw the outputs of the run: the last state, a grid or an animation.

        Parameters
        ----------
        field : str, ndarray or callable, optional
            What the colours show; damage when left out.
        path : path-like, optional
            File to write, .png, .pdf, .svg, .gif or .mp4; without it the figure is handed back.
        **options
            As in `peridem.plot.render`.

        Returns
        -------
        Path or Figure

        Raises
        ------
        InputError
            As `peridem.plot.render` says, or if the run has written no outputs.
        """
        from .plot import render

        return render(self, field, None if path is None else Path(path), **options)

    def _repr_html_(self) -> str:
        """Summary, last state and recorded numbers, for notebooks."""
        from .plot.notebook import result_html

        return result_html(self)

    def __getitem__(self, name: str) -> pd.DataFrame:
        """Return the table of a recorder, whatever characters its name has."""
        for table in self._series.tables:
            if table.name == name:
                return table.frame()
        names = [table.name for table in self._series.tables]
        remedy = did_you_mean(name, names) if names else "record something in run(record=[...])"
        raise KeyError(f"{name}: nothing of this name was recorded; {remedy}")

    def __getattr__(self, name: str) -> pd.DataFrame:
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self[name]
        except KeyError as error:
            raise AttributeError(error.args[0]) from None

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *(table.name for table in self._series.tables)]

    def __repr__(self) -> str:
        known = self.summary
        names = ", ".join(table.name for table in self._series.tables) or "nothing"
        where = "no folder" if self.folder is None else str(self.folder)
        count = len(known.get("warnings", ()))
        warned = f"; {count} warning{'s' if count > 1 else ''}, see summary" if count else ""
        return (
            f"<Result after step {known['steps']}, t = {known['time']:g} s: "
            f"{known['broken_bonds']} of {known['bonds']} bonds broken; recorded: {names}; {where}"
            f"{warned}>"
        )
