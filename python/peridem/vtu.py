"""VTU files through the VTK package: NumPy arrays in, NumPy arrays out.

The VTK modules are imported by the first call, not with this module.
"""

from __future__ import annotations

import errno
import os
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypedDict

import numpy as np
import numpy.typing as npt

from .errors import InputError

if TYPE_CHECKING:
    from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid

__all__ = ["Topology", "VtuContents", "read_vtu", "vtu_arrays", "write_vtu"]

Array = npt.NDArray[Any]
Cells = Sequence[tuple[str, Array]]
Compression = Literal["zlib", "ascii"] | None

# Names of the mesh module -> (VTK cell type, nodes per cell).
_CELL_TYPES = {
    "vertex": (1, 1),
    "line": (3, 2),
    "triangle": (5, 3),
    "quad": (9, 4),
    "tetra": (10, 4),
}
_CELL_NAMES = {number: name for name, (number, _) in _CELL_TYPES.items()}
_ZLIB_LEVEL = 1  # doubles of a simulation hardly shrink: higher levels only cost time


class VtuContents(TypedDict):
    """What `read_vtu` returns.

    Attributes
    ----------
    points : ndarray, shape (n_nodes, 3)
        Positions as stored [m].
    cells : list of (str, ndarray of shape (m, k))
        Runs of cells of one type, in file order, with global node numbers.
    arrays : dict of str to ndarray, shape (n_nodes,) or (n_nodes, 3)
        The point data under the names of the file.
    time : float or None
        Simulated time [s]; None when the file has no field ``TIME``.
    step : int or None
        Time step; None when the file has no field ``STEP``.
    """

    points: npt.NDArray[np.float64]
    cells: list[tuple[str, Array]]
    arrays: dict[str, Array]
    time: float | None
    step: int | None


class Topology:
    """Cells in VTK's layout, built once a run: offsets, connectivity and cell types.

    Nodes that belong to no cell get a vertex cell each, so that every viewer shows them.
    """

    def __init__(self, cells: Cells, n_nodes: int) -> None:
        self.n_nodes = n_nodes
        blocks = [(name, np.asarray(nodes)) for name, nodes in cells if len(nodes)]
        for name, nodes in blocks:
            _check_cells(name, nodes, n_nodes)
        alone = np.ones(n_nodes, dtype=bool)
        for _, nodes in blocks:
            alone[nodes.ravel()] = False
        if alone.any():
            blocks.append(("vertex", np.flatnonzero(alone)[:, None]))
        self.connectivity = np.concatenate(
            [nodes.ravel().astype(np.int64) for _, nodes in blocks] or [np.empty(0, np.int64)]
        )
        counts = [np.full(len(nodes), _CELL_TYPES[name][1]) for name, nodes in blocks]
        self.offsets = np.zeros(sum(map(len, counts)) + 1, dtype=np.int64)
        types = [np.full(len(nodes), _CELL_TYPES[name][0], np.uint8) for name, nodes in blocks]
        if blocks:
            self.offsets[1:] = np.cumsum(np.concatenate(counts))
        self.types = np.concatenate(types or [np.empty(0, np.uint8)])


def write_vtu(
    path: Path,
    *,
    topology: Topology,
    points: npt.NDArray[np.float64],
    arrays: Mapping[str, Array],
    fields: Mapping[str, Array],
    compress: Compression,
) -> None:
    """Write one VTU file with the VTK package, in place (see `replace_file`).

    Raises
    ------
    OSError
        If VTK reports that the file could not be written.
    """
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    grid, owners = _unstructured_grid(topology, points, arrays, fields)
    writer = vtkXMLUnstructuredGridWriter()
    writer.SetFileName(str(path))
    writer.SetInputData(grid)
    writer.SetByteOrderToLittleEndian()
    if compress == "ascii":
        writer.SetDataModeToAscii()
        writer.SetCompressorTypeToNone()
        # In memory: where text does not fit on the disk, VTK damages its memory and may abort.
        writer.WriteToOutputStringOn()
    else:
        writer.SetDataModeToAppended()
        writer.EncodeAppendedDataOff()
        if compress == "zlib":
            writer.SetCompressorTypeToZLib()
            writer.SetCompressionLevel(_ZLIB_LEVEL)
        else:
            writer.SetCompressorTypeToNone()
    with _silent_vtk():
        written = writer.Write()
    del owners  # VTK reads the NumPy memory until here
    if compress == "ascii" and written == 1:
        path.write_text(writer.GetOutputString(), encoding="ascii")
    if written != 1 or writer.GetErrorCode() != 0 or not path.exists():
        _raise_reason(path, points.nbytes + sum(array.nbytes for array in arrays.values()))
        raise OSError(0, _vtk_reason(writer.GetErrorCode()))


def read_vtu(path: Path | str, only: Collection[str] | None = None) -> VtuContents:
    """Read a VTU file, ours or the original program's.

    Parameters
    ----------
    path : Path or str
        The file.
    only : collection of str, optional
        Point data to read, as far as the file has it; all when left out.

    Returns
    -------
    VtuContents
        A dict with ``points``, ``cells``, ``arrays``, ``time`` and ``step``; the arrays
        are copies and have the types of the file.

    Raises
    ------
    InputError
        If the file is missing, damaged or holds no nodes.
    """
    path = Path(path)
    reader = _opened(path)
    with _silent_vtk():
        if only is not None:
            reader.UpdateInformation()
            chosen = reader.GetPointDataArraySelection()
            for k in range(chosen.GetNumberOfArrays()):
                if chosen.GetArrayName(k) not in only:
                    chosen.DisableArray(chosen.GetArrayName(k))
        reader.Update()
    grid = reader.GetOutput()
    if reader.GetErrorCode() != 0 or grid.GetNumberOfPoints() == 0:
        raise InputError(_damaged(path))

    def copy(array: Any) -> Array:
        return np.array(_numpy_support().vtk_to_numpy(array))

    data, fields = grid.GetPointData(), grid.GetFieldData()
    time, step = fields.GetArray("TIME"), fields.GetArray("STEP")
    return VtuContents(
        points=copy(grid.GetPoints().GetData()).astype(np.float64),
        cells=_cell_runs(grid),
        arrays={
            data.GetArrayName(i): copy(data.GetArray(i))
            for i in range(data.GetNumberOfArrays())
            if data.GetArray(i) is not None
        },
        time=None if time is None else float(time.GetTuple1(0)),
        step=None if step is None else int(step.GetTuple1(0)),
    )


def vtu_arrays(path: Path | str) -> list[str]:
    """Names of the point data of a VTU file, without reading it; errors as in `read_vtu`."""
    path = Path(path)
    reader = _opened(path)
    with _silent_vtk():
        reader.UpdateInformation()
    if reader.GetErrorCode() != 0:
        raise InputError(_damaged(path))
    count = reader.GetNumberOfPointArrays()
    return [str(reader.GetPointArrayName(k)) for k in range(count)]


def _opened(path: Path) -> Any:
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    if not path.is_file():
        raise InputError(f"{path}: no such file; check the name and the folder")
    if not _is_complete(path):
        raise InputError(_damaged(path))
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    return reader


def _damaged(path: Path) -> str:
    return (
        f"{path}: not a readable VTU file with nodes (damaged or cut short?); "
        "use another file of the series"
    )


def _numpy_support() -> Any:
    """VTK's bridge to NumPy, which carries no types."""
    from vtkmodules.util import numpy_support

    return numpy_support


def _unstructured_grid(
    topology: Topology,
    points: npt.NDArray[np.float64],
    arrays: Mapping[str, Array],
    fields: Mapping[str, Array],
) -> tuple[vtkUnstructuredGrid, list[Array]]:
    """Wrap NumPy memory as a VTK grid; the second item must outlive the grid's use."""
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkUnstructuredGrid

    owners: list[Array] = []

    def wrap(array: Array, name: str | None = None) -> Any:
        owners.append(array)
        wrapped = _numpy_support().numpy_to_vtk(array, deep=False)
        if name is not None:
            wrapped.SetName(name)
        return wrapped

    grid = vtkUnstructuredGrid()
    nodes = vtkPoints()
    nodes.SetData(wrap(np.ascontiguousarray(points, dtype=np.float64)))
    grid.SetPoints(nodes)
    cells = vtkCellArray()
    cells.SetData(wrap(topology.offsets), wrap(topology.connectivity))
    grid.SetCells(wrap(topology.types), cells)
    for name, values in arrays.items():
        grid.GetPointData().AddArray(wrap(_stored_type(values), name))
    for name, values in fields.items():
        grid.GetFieldData().AddArray(wrap(values, name))
    return grid, owners


def _is_complete(path: Path) -> bool:
    """Check the closing tag: VTK may abort the process on a file cut short."""
    with path.open("rb") as stream:
        stream.seek(max(path.stat().st_size - 64, 0))
        return b"</VTKFile>" in stream.read()


def _cell_runs(grid: Any) -> list[tuple[str, Array]]:
    """Cells of a grid as runs of one type with a rectangular connectivity each."""
    if grid.GetNumberOfCells() == 0:
        return []
    types = _numpy_support().vtk_to_numpy(grid.GetCellTypes()).astype(np.int64)
    offsets = _numpy_support().vtk_to_numpy(grid.GetCells().GetOffsetsArray())
    connectivity = _numpy_support().vtk_to_numpy(grid.GetCells().GetConnectivityArray())
    starts = np.flatnonzero(np.diff(types, prepend=-1))
    runs = []
    for first, last in zip(starts, np.append(starts[1:], len(types)), strict=True):
        name = _CELL_NAMES.get(int(types[first]))
        if name is None:
            continue
        nodes = connectivity[offsets[first] : offsets[last]]
        runs.append((name, nodes.reshape(last - first, -1).astype(np.int32)))
    return runs


@contextmanager
def _silent_vtk() -> Iterator[None]:
    """Keep VTK's error messages off the terminal: its error codes become ours."""
    from vtkmodules.vtkCommonCore import vtkObject

    before = vtkObject.GetGlobalWarningDisplay()
    vtkObject.GlobalWarningDisplayOff()
    try:
        yield
    finally:
        vtkObject.SetGlobalWarningDisplay(before)


def _stored_type(values: Array) -> Array:
    kind = np.float64 if np.asarray(values).dtype.kind == "f" else np.int32
    return np.ascontiguousarray(values, dtype=kind)


def _check_cells(name: str, nodes: Array, n_nodes: int) -> None:
    if name not in _CELL_TYPES or nodes.ndim != 2 or nodes.shape[1] != _CELL_TYPES[name][1]:
        raise ValueError(f"VTU: cells {name} with connectivity of shape {nodes.shape}")
    if nodes.min() < 0 or nodes.max() >= n_nodes:
        raise ValueError(f"VTU: cells {name} name a node outside 0..{n_nodes - 1}")


def _raise_reason(path: Path, n_bytes: int) -> None:
    """Raise the system's own error by writing as much as VTK wanted to.

    VTK keeps the last error of the system, which need not be that of its write.
    """
    chunk = bytes(1 << 20)
    with path.open("wb") as stream:
        for _ in range(n_bytes // len(chunk) + 1):
            stream.write(chunk)
            stream.flush()


def _vtk_reason(code: int) -> str:
    """Say why VTK could not write, in plain words."""
    from vtkmodules.vtkCommonMisc import vtkErrorCode

    if not code:
        return "VTK reports an error"
    plain: dict[int, str] = {
        vtkErrorCode.OutOfDiskSpaceError: os.strerror(errno.ENOSPC),
        vtkErrorCode.CannotOpenFileError: "the file cannot be opened",
    }
    return plain.get(code) or str(vtkErrorCode.GetStringFromErrorCode(code))
