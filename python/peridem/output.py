"""Result files: one VTU file per output, a PVD time series, csv files of body centres.

Every file is written under a temporary name, synced and renamed: under its own name a
file is whole or absent, also after a crash or on a full disk. The VTK package is
imported when the first file is written or read.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

import numpy as np
import numpy.typing as npt

from .errors import InputError
from .files import make_folder, replace_file
from .vtu import Array, Cells, Compression, Topology, VtuContents, read_vtu, write_vtu

if TYPE_CHECKING:
    from types import TracebackType


__all__ = [
    "NODE_TAGS",
    "OutputWriter",
    "VtuContents",
    "older_files",
    "read_pvd",
    "read_vtu",
    "replace_file",
    "series_path",
    "write_particle_locations",
]

NODE_TAGS: Mapping[str, int] = {
    "Displacement": 3,
    "Velocity": 3,
    "Force_Density": 3,
    "Force": 3,
    "Fixity": 1,
    "Force_Fixity": 1,
    "Particle_ID": 1,
    "Zone_ID": 1,
    "Nodal_Volume": 1,
    "Damage_Z": 1,
    "Damage": 1,
    "Theta": 1,
    "Fragment_ID": 1,
}
"""Deck tags that become an array on the nodes, with their number of components."""


class OutputWriter:
    """Write the outputs of one run as VTU files and keep their time series in a PVD file.

    Parameters
    ----------
    folder : Path or str
        Output folder; created when missing.
    tags : sequence of str
        Tags of the deck, ``Output.Tags``. Each that names a nodal array must be in the
        arrays given to `write`; arrays are stored in this order.
    interval : int
        Steps between outputs, ``Output.Output_Interval``.
    cells : sequence of (str, ndarray of shape (m, k))
        Elements of the bodies, one entry per body, with global node numbers; types
        ``line``, ``triangle``, ``quad``, ``tetra`` or ``none``.
    tag_pp : str, optional
        ``Output.Tag_PP``: files are ``output_<tag_pp>_<k>.vtu`` instead of
        ``output_<k>.vtu``.
    fe_output : bool
        Write the elements (``Output.Perform_FE_Out``), otherwise points only.
    compress : {"zlib", "ascii", None}
        ``Output.Compress_Type``: compressed binary, text, or plain binary.
    keep_until : float, optional
        For a resumed run: entries of the existing time series up to this time [s], whose
        files are still there, stay in the series. Without it the series starts anew.
    name : str
        First part of the file names.

    Attributes
    ----------
    series : Path
        The PVD file.
    files : list of Path
        Files in the series so far, in order of time.
    older_files : list of Path
        Files of this series that were in the folder already and that this run has not
        written. They are never deleted, nor listed in the series.

    Raises
    ------
    InputError
        If the folder cannot be created or written, or an option breaks its rule.
    """

    def __init__(
        self,
        folder: Path | str,
        *,
        tags: Sequence[str],
        interval: int,
        cells: Cells,
        tag_pp: str | None = None,
        fe_output: bool = True,
        compress: Compression = "zlib",
        keep_until: float | None = None,
        name: str = "output",
    ) -> None:
        self.folder = Path(folder)
        self.tags = tuple(tags)
        self.interval = _checked_interval(interval)
        self.compress = _checked_compression(compress)
        self.fe_output = fe_output
        self._cells = cells
        self.series = series_path(self.folder, tag_pp, name=name)
        self._stem = self.series.stem
        self._topology: Topology | None = None
        make_folder(self.folder)
        self._entries: dict[str, float] = {}
        if keep_until is not None and self.series.exists():
            self._entries = {
                path.name: time
                for time, path in read_pvd(self.series)
                if time <= keep_until and path.exists()
            }

    @property
    def files(self) -> list[Path]:
        """Files in the series so far, in order of time."""
        return [self.folder / name for name in self._in_order()]

    @property
    def older_files(self) -> list[Path]:
        """Files of this series found in the folder that this run has not written."""
        return older_files(self.series, self._entries)

    def path(self, k: int) -> Path:
        """Name of output file number `k`."""
        return self.folder / f"{self._stem}_{k}.vtu"

    def write(
        self,
        k: int,
        step: int,
        time: float,
        arrays: Mapping[str, Array],
        *,
        points: npt.NDArray[np.float64],
    ) -> Path:
        """Write output file number `k` and add it to the time series.

        Parameters
        ----------
        k : int
            Number of the file, ``step // interval``.
        step : int
            Time step; stored as field data ``STEP``.
        time : float
            Simulated time [s]; stored as field data ``TIME``.
        arrays : mapping of str to ndarray, shape (n_nodes,) or (n_nodes, 3)
            Nodal values by tag. Floating point is stored in double precision, whole
            numbers as 32-bit integers. Contiguous arrays are not copied.
        points : ndarray, shape (n_nodes, 3)
            Current positions [m].

        Returns
        -------
        Path
            The file.

        Raises
        ------
        InputError
            If the file cannot be written.
        ValueError
            If a tag of the deck is missing or an array does not fit the nodes.
        """
        path = self.path(k)
        self._write_file(path, step, time, arrays, points)
        self._entries[path.name] = float(time)
        self._write_series()
        return path

    def write_last(
        self,
        step: int,
        time: float,
        arrays: Mapping[str, Array],
        *,
        points: npt.NDArray[np.float64],
    ) -> Path:
        """Write a state that is not part of the series, ``output_last.vtu``; as `write`."""
        path = self.folder / f"{self._stem}_last.vtu"
        self._write_file(path, step, time, arrays, points)
        return path

    def _write_file(
        self,
        path: Path,
        step: int,
        time: float,
        arrays: Mapping[str, Array],
        points: npt.NDArray[np.float64],
    ) -> None:
        _check_arrays(arrays, self.tags, points)
        if self._topology is None or self._topology.n_nodes != len(points):
            self._topology = Topology(self._cells if self.fe_output else (), len(points))
        order = [tag for tag in self.tags if tag in arrays]
        order += [tag for tag in arrays if tag not in order]
        with replace_file(path) as temporary:
            write_vtu(
                temporary,
                topology=self._topology,
                points=points,
                arrays={tag: arrays[tag] for tag in order},
                fields={"TIME": np.array([time]), "STEP": np.array([step], dtype=np.int64)},
                compress=self.compress,
            )

    def close(self) -> None:
        """Finish the time series (it is complete after every `write` already)."""
        self._topology = None
        if self._entries and not self.series.exists():
            self._write_series()

    def __enter__(self) -> OutputWriter:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def _in_order(self) -> list[str]:
        return sorted(self._entries, key=lambda name: (self._entries[name], len(name), name))

    def _write_series(self) -> None:
        lines = [
            '<?xml version="1.0"?>',
            '<VTKFile type="Collection" version="1.0" byte_order="LittleEndian">',
            "  <Collection>",
        ]
        lines += [
            f'    <DataSet timestep="{self._entries[name]!r}" part="0" file={quoteattr(name)}/>'
            for name in self._in_order()
        ]
        lines += ["  </Collection>", "</VTKFile>", ""]
        with replace_file(self.series) as temporary:
            temporary.write_text("\n".join(lines), encoding="utf-8")


def series_path(folder: Path | str, tag_pp: str | None = None, *, name: str = "output") -> Path:
    """Name of the PVD file of a run.

    Parameters
    ----------
    folder : Path or str
        Output folder.
    tag_pp : str, optional
        ``Output.Tag_PP`` of the deck.
    name : str
        First part of the file names.

    Returns
    -------
    Path
        ``output.pvd`` or ``output_<tag_pp>.pvd`` in the folder.

    Raises
    ------
    InputError
        If the tag does not fit into a file name.
    """
    stem = name if tag_pp in (None, "") else f"{name}_{_checked_tag_pp(tag_pp)}"
    return Path(folder) / f"{stem}.pvd"


def older_files(series: Path, listed: Iterable[str]) -> list[Path]:
    """Files that are named like the outputs of a series without being listed in it.

    Parameters
    ----------
    series : Path
        The PVD file.
    listed : iterable of str
        Names of the files in the series.

    Returns
    -------
    list of Path
        Left over from an earlier run into the same folder.
    """
    pattern = re.compile(re.escape(series.stem) + r"_\d+\.vtu")
    known = set(listed)
    return sorted(
        path
        for path in series.parent.iterdir()
        if pattern.fullmatch(path.name) and path.name not in known
    )


def read_pvd(path: Path | str) -> list[tuple[float, Path]]:
    """Read the list of a PVD time series.

    Parameters
    ----------
    path : Path or str
        The ``.pvd`` file.

    Returns
    -------
    list of (float, Path)
        Time [s] and file of every entry, in the order of the file.

    Raises
    ------
    InputError
        If the file is missing or is not a PVD file.
    """
    path = Path(path)
    try:
        root = ElementTree.parse(path).getroot()
        return [
            (float(entry.attrib["timestep"]), path.parent / entry.attrib["file"])
            for entry in root.iter("DataSet")
        ]
    except OSError as error:
        remedy = "rename or remove the folder" if path.is_dir() else "check the name"
        raise InputError(f"{path}: cannot be read: {error.strerror}; {remedy}") from error
    except (ElementTree.ParseError, KeyError, ValueError) as error:
        raise InputError(f"{path}: not a PVD time series ({error}); remove it") from error


def write_particle_locations(
    path: Path | str,
    *,
    zone: Sequence[int] | Array,
    centre: Array,
    radius: Sequence[float] | Array,
) -> Path:
    """Write the centres of the bodies as csv (tag ``Particle_Locations``).

    The columns ``i,x,y,z,r`` are those of a placement file, so the result can start
    another deck; ``id`` is the number of the body.

    Parameters
    ----------
    path : Path or str
        File to write.
    zone : sequence of int, length n_bodies
        Zone of each body, counted from 0.
    centre : array_like, shape (n_bodies, 3)
        Centres [m].
    radius : sequence of float, length n_bodies
        Bounding radii [m].

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    path = Path(path)
    rows: Iterable[tuple[Any, ...]] = (
        (int(i), *(repr(float(value)) for value in (*site, r)), body)
        for body, (i, site, r) in enumerate(zip(zone, np.asarray(centre), radius, strict=True))
    )
    with replace_file(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as out:
        table = csv.writer(out, lineterminator="\n")
        table.writerow(("i", "x", "y", "z", "r", "id"))
        table.writerows(rows)
    return path


def _check_arrays(arrays: Mapping[str, Array], tags: Sequence[str], points: Array) -> None:
    if points.ndim != 2 or points.shape[1] != 3:
        raise ValueError(f"OutputWriter: points have shape {points.shape}; (n_nodes, 3) is needed")
    missing = [tag for tag in tags if tag in NODE_TAGS and tag not in arrays]
    if missing:
        raise ValueError(f"OutputWriter: no array for the tags {', '.join(missing)}")
    for tag, values in arrays.items():
        width = NODE_TAGS.get(tag, np.shape(values)[1] if np.ndim(values) == 2 else 1)
        shape = (len(points),) if width == 1 else (len(points), width)
        if np.shape(values) != shape:
            raise ValueError(f"OutputWriter: {tag} has shape {np.shape(values)}; {shape} is needed")


def _checked_interval(interval: int) -> int:
    if interval < 1:
        raise InputError(f"Output.Output_Interval = {interval}: must be at least 1; give 1 or more")
    return interval


def _checked_compression(compress: Compression) -> Compression:
    if compress not in ("zlib", "ascii", None):
        raise InputError(
            f"Output.Compress_Type = {compress}: is not one of zlib, ascii; "
            "use zlib, or leave the key out"
        )
    return compress


def _checked_tag_pp(tag_pp: str | None) -> str:
    text = str(tag_pp)
    if not re.fullmatch(r"[A-Za-z0-9._+-]+", text):
        raise InputError(
            f"Output.Tag_PP = {text!r}: becomes part of file names; "
            "use letters, digits, '.', '_', '+' and '-' only"
        )
    return text
