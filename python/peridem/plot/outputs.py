"""The outputs of a run on disk: which states there are, which of them are asked for."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..body_table import bodies_path, read_bodies
from ..diagnostics.network import contacts_path
from ..errors import InputError
from ..modelling.arguments import plain, show_value
from ..output import read_pvd, series_path
from ..vtu import read_vtu, vtu_arrays
from .fields import Field, find_field
from .snapshot import Snapshot

__all__ = ["Frame", "Outputs"]

_STRAIN = ("Stress", "Strain")
_NEEDED = ("Displacement", "Particle_ID", "Zone_ID", "Fixity", "Nodal_Volume")
_NUMBERED = re.compile(r"(.+)_(\d+)\.vtu")


@dataclass(frozen=True)
class Frame:
    """One output: its time [s], its vtu file, and that of the stresses, if there is one."""

    time: float
    path: Path
    strain: Path | None = None


@dataclass(frozen=True)
class Outputs:
    """The outputs of a run.

    Attributes
    ----------
    folder : Path
        Where they are.
    series : Path
        Their PVD file, whether or not it is there.
    frames : list of Frame
        In order of time.
    notes : list of str
        What was left out, and why.
    """

    folder: Path
    series: Path
    frames: list[Frame]
    notes: list[str] = field(default_factory=list)

    @classmethod
    def open(cls, path: Path | str, tag: str | None = None) -> Outputs:
        """Find the outputs in a folder, of a PVD file, or of a single VTU file.

        Parameters
        ----------
        path : Path or str
            The folder or file.
        tag : str, optional
            ``Output.Tag_PP`` of the run, when the folder has several.

        Raises
        ------
        InputError
            If there are none.
        """
        path = Path(path)
        if path.is_file() and path.suffix == ".vtu":
            return cls._of_file(path)
        if path.is_file() and path.suffix == ".pvd":
            series = path
        elif not path.is_dir():
            what = "is no folder of outputs" if path.exists() else "no such folder"
            raise InputError(f"{path}: {what}; give the folder that a run has written to")
        else:
            series = _series_in(path, tag)
        notes: list[str] = []
        pairs = _listed(series, notes)
        strains = _strain_files(series)
        frames = [
            Frame(time, file, strains.get(file.stem.rsplit("_", 1)[-1])) for time, file in pairs
        ]
        return cls(series.parent, series, sorted(frames, key=lambda one: one.time), notes)

    @classmethod
    def _of_file(cls, path: Path) -> Outputs:
        found = _NUMBERED.fullmatch(path.name)
        series = path.with_name(f"{found[1] if found else path.stem}.pvd")
        time = read_vtu(path, only=())["time"]
        strain = _strain_files(series).get(found[2]) if found else None
        frame = Frame(float("nan") if time is None else time, path, strain)
        return cls(path.parent, series, [frame])

    @property
    def names(self) -> list[str]:
        """Names of the arrays in the first output that can be read."""
        problem: InputError | None = None
        for frame in self.frames:
            try:
                names = vtu_arrays(frame.path)
            except InputError as error:
                problem = problem or error
                continue
            if frame.strain is not None:
                names += [tag for tag in _STRAIN if tag not in names]
            return names
        raise problem or InputError(f"{self.folder}: there are no outputs; run the model first")

    def find_field(self, name: str | Field | None) -> Field:
        """Find what is to be drawn: by default damage, else displacement, else the first array."""
        if isinstance(name, Field):
            return name
        names = self.names
        if name is None:
            usual = ("Damage_Z", "Damage", "Displacement", "Velocity", *names)
            name = next((one for one in usual if one in names), "")
        return find_field(name, names)

    def snapshot(self, frame: Frame, wanted: Field | None = None) -> Snapshot:
        """Read a state, or as much of it as a picture of a field needs.

        Raises
        ------
        InputError
            If a file cannot be read.
        """
        only = None if wanted is None else {*_NEEDED, wanted.tag}
        bodies = read_bodies(bodies_path(self.series))
        snapshot = Snapshot.from_vtu(frame.path, bodies=bodies, only=only)
        if snapshot.time is None and np.isfinite(frame.time):
            object.__setattr__(snapshot, "time", frame.time)
        contacts = contacts_path(frame.path)
        if contacts.is_file():
            object.__setattr__(snapshot, "contacts", contacts)
        if frame.strain is None or (wanted is not None and wanted.tag not in _STRAIN):
            return snapshot
        stress = read_vtu(frame.strain)
        return snapshot.with_elements(stress["arrays"], stress["points"])

    def select(self, at: Any = None, every: Any = None) -> list[Frame]:
        """Choose outputs.

        Parameters
        ----------
        at : "first", "last", int, float or sequence of them, optional
            By number (negative: from the end) or by time [s] (the output nearest to it).
        every : int or float, optional
            Every so many outputs, or seconds.

        Returns
        -------
        list of Frame
            In order of time; all when nothing is asked for.

        Raises
        ------
        InputError
            If there is no such output.
        """
        if at is not None and every is not None:
            raise InputError(f"render: every = {every!r}: is given besides at; keep one of them")
        if at is not None:
            wanted = at if isinstance(at, Sequence) and not isinstance(at, str) else plain(at)
            several = wanted if isinstance(wanted, list | tuple) else [wanted]
            if not several:
                raise InputError("render: at = []: names no output; give a time in s, or 'last'")
            chosen = sorted({self._find(plain(one)) for one in several})
            return [self.frames[k] for k in chosen]
        return self.frames if every is None else self._each(plain(every))

    def _find(self, one: Any) -> int:
        count = len(self.frames)
        if one in ("first", "last"):
            return 0 if one == "first" else count - 1
        if isinstance(one, int) and not isinstance(one, bool):
            if not -count <= one < count:
                raise InputError(
                    f"render: at = {one}: there are {count} outputs; give a number from 0 to "
                    f"{count - 1}, or a time in s such as 1e-4"
                )
            return one % count
        if not isinstance(one, float) or not np.isfinite(one):
            raise InputError(
                f"render: at = {show_value(one)}: must be first, last, the number of an output or "
                "a time in s; correct it"
            )
        times = np.array([frame.time for frame in self.frames])
        gap = float(np.diff(times).max()) if count > 1 else abs(float(times[0])) or np.inf
        if not times[0] - 0.51 * gap <= one <= times[-1] + 0.51 * gap:
            raise InputError(
                f"render: at = {one:g} s: is outside the outputs, which are from {times[0]:g} to "
                f"{times[-1]:g} s; give a time between"
            )
        return int(np.abs(times - one).argmin())

    def _each(self, every: Any) -> list[Frame]:
        valid = isinstance(every, int | float) and not isinstance(every, bool)
        if not valid or not np.isfinite(every) or not every > 0:
            raise InputError(
                f"render: every = {show_value(every)}: must be positive; give a number of outputs "
                "(2) or seconds (1e-4)"
            )
        if isinstance(every, int):
            return self.frames[::every]
        times = np.array([frame.time for frame in self.frames])
        targets = np.arange(times[0], times[-1] + 0.5 * every, every)
        nearest = np.abs(times[:, None] - targets[None, :100_000]).argmin(axis=0)
        return [self.frames[k] for k in np.unique(nearest)]


def _series_in(folder: Path, tag: str | None) -> Path:
    """Find the series of a folder, which may have no PVD file."""
    if tag is not None:
        return series_path(folder, tag)
    stems = {path.stem for path in folder.glob("*.pvd")}
    matches = (_NUMBERED.fullmatch(path.name) for path in folder.glob("*.vtu"))
    stems |= {found[1] for found in matches if found}
    stems = {stem for stem in stems if not stem.startswith("output_strain")}
    if not stems:
        last = folder / "output_last.vtu"
        if last.is_file():
            return last.with_suffix(".pvd")
        raise InputError(
            f"{folder}: there are no outputs (.vtu files) in it; give the folder that a run has "
            "written to"
        )
    if len(stems) > 1 and "output" not in stems:
        tags = ", ".join(sorted(stem.removeprefix("output_") for stem in stems))
        raise InputError(
            f"{folder}: has the outputs of several runs: {tags}; choose one with tag (--tag)"
        )
    stem = "output" if "output" in stems else next(iter(stems))
    return folder / f"{stem}.pvd"


def _listed(series: Path, notes: list[str]) -> list[tuple[float, Path]]:
    """Return times and files of a series, from its PVD file or, without one, from the files."""
    if series.is_file():
        try:
            pairs = read_pvd(series)
        except InputError as error:
            notes.append(f"{error}; its files were looked for instead")
        else:
            there = [(time, path) for time, path in pairs if path.is_file()]
            if len(there) < len(pairs):
                notes.append(f"{series}: {len(pairs) - len(there)} of its files are missing")
            if there:
                return there
    pattern = re.compile(re.escape(series.stem) + r"_(\d+|last)\.vtu")
    found: list[tuple[float, Path]] = []
    for path in sorted(series.parent.glob("*.vtu"), key=lambda one: (len(one.name), one.name)):
        if pattern.fullmatch(path.name):
            try:
                time = read_vtu(path, only=())["time"]
            except InputError as error:
                notes.append(str(error))
                continue
            found.append((float(len(found)) if time is None else time, path))
    if not found:
        why = f" ({notes[0]})" if notes else ""
        raise InputError(f"{series}: none of its outputs can be read{why}; run the model again")
    return found


def _strain_files(series: Path) -> dict[str, Path]:
    """Files of the stresses, by the number in their names."""
    tag = series.stem.removeprefix("output")
    stem = re.escape(f"output_strain{tag}")
    matches = (
        (re.fullmatch(rf"{stem}_(\d+)\.vtu", path.name), path)
        for path in series.parent.glob("output_strain*.vtu")
    )
    return {found[1]: path for found, path in matches if found}
