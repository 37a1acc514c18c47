"""Reading a mesh: .msh (2.2 and 4.1), .vtu, or nodes with volumes in a .csv."""

from __future__ import annotations

import contextlib
import importlib
import io
import os
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import InputError
from .checks import checked_mesh
from .data import Mesh, RawMesh
from .msh2 import read_msh2
from .msh4 import read_msh2_binary, read_msh41

VOLUME_NAME = "Nodal_Volume"
"""Point array of a .vtu that holds nodal volumes, as in the program's own output."""


def read_mesh(path: str | os.PathLike[str], dimension: int) -> Mesh:
    """Read the mesh of a body.

    Parameters
    ----------
    path : path-like
        A ``.msh`` (Gmsh, 2.x or 4.x, text or binary), ``.vtu`` or ``.csv`` file (header
        ``id,x,y,volume`` or ``id,x,y,z,volume``).
    dimension : int
        Dimension of the model: 1 keeps lines, 2 triangles or quads, 3 tetrahedra;
        other elements are skipped.

    Returns
    -------
    Mesh

    Raises
    ------
    InputError
        If the file is missing, damaged or not a mesh; if it has no element of the
        dimension, or both triangles and quads; if positions are not finite or coincide,
        nodes belong to no element, or elements have no volume.
    """
    file = Path(path)
    reader = _READERS.get(file.suffix.lower())
    if reader is None:
        raise InputError(
            f"{file}: mesh file ends in {file.suffix!r}: only .msh, .vtu and .csv can be read; "
            "convert it"
        )
    content = _content(file)
    return checked_mesh(reader(file, content), dimension, str(file))


def read_raw_mesh(path: str | os.PathLike[str]) -> RawMesh:
    """Read all elements of a mesh file, in the formats of `read_mesh` or any of meshio's.

    Parameters
    ----------
    path : path-like
        The file; its ending says the format.

    Returns
    -------
    RawMesh
        Unchecked; see `peridem.mesh.checks.checked_mesh`.

    Raises
    ------
    InputError
        If it cannot be read.
    """
    file = Path(path)
    reader = _READERS.get(file.suffix.lower())
    content = _content(file)
    if reader is not None:
        return reader(file, content)
    found = read_with_meshio(file)
    return _collected(file, found.points, found.cells, found.point_data.get(VOLUME_NAME))


def _content(file: Path) -> bytes:
    try:
        content = file.read_bytes()
    except FileNotFoundError:
        raise InputError(
            f"{file}: mesh file does not exist; correct the path (relative paths start at the "
            "deck's folder)"
        ) from None
    except OSError as error:
        raise InputError(
            f"{file}: mesh file cannot be read ({error.strerror}); give a readable file"
        ) from None
    if not content.strip():
        raise InputError(f"{file}: mesh file is empty; write the mesh again")
    return content


def _read_msh(file: Path, content: bytes) -> RawMesh:
    head = content[:4096].split(b"\n")
    header = next(
        (head[i + 1].split() for i, s in enumerate(head[:-1]) if s.strip() == b"$MeshFormat"), []
    )
    if len(header) < 2:
        raise InputError(
            f"{file}: the file has no $MeshFormat header: it is not a Gmsh mesh; write it as "
            "MSH 2.2 or 4.1"
        )
    version, binary = header[0], header[1] == b"1"
    if version.startswith(b"2"):
        if binary:
            return read_msh2_binary(content, str(file))
        return read_msh2(content, str(file))
    if version in (b"4", b"4.1"):
        return read_msh41(content, str(file), binary=binary)
    raise InputError(
        f"{file}: MSH version = {version.decode(errors='replace')}: only 2.x and 4.1 can be read; "
        "write the mesh as MSH 2.2 or 4.1"
    )


def _read_vtu(file: Path, content: bytes) -> RawMesh:
    if b"UnstructuredGrid" not in content:
        raise InputError(
            f"{file}: the file holds no UnstructuredGrid: it is not a VTU mesh; write it again"
        )
    found = read_with_meshio(file, "vtu")
    return _collected(file, found.points, found.cells, found.point_data.get(VOLUME_NAME))


def read_with_meshio(file: Path, file_format: str | None = None) -> Any:
    """Read a file through meshio, which may print, raise anything or leave through sys.exit.

    Parameters
    ----------
    file : Path
        The file.
    file_format : str, optional
        Name that meshio has for the format, by the ending of the file unless given.

    Returns
    -------
    meshio.Mesh

    Raises
    ------
    InputError
        If it cannot be read.
    """
    # loaded late, as most meshes do not need it; by name, as it has no type information
    meshio = importlib.import_module("meshio")
    said = io.StringIO()
    try:
        with (
            contextlib.redirect_stdout(said),
            contextlib.redirect_stderr(said),
            warnings.catch_warnings(),
        ):
            warnings.simplefilter("ignore")
            return meshio.read(file, file_format=file_format)
    except (Exception, SystemExit) as error:
        reason = " ".join((str(error) or type(error).__name__).split())
        kind = (file_format or file.suffix.lstrip(".")).upper()
        raise InputError(
            f"{file}: the file cannot be read as a {kind} mesh ({reason}): it is damaged "
            "or cut off; write it again"
        ) from None


def _collected(file: Path, points: object, cells: object, volumes: object) -> RawMesh:
    """Gather meshio's blocks by type, in the order of the file."""
    try:
        blocks: dict[str, list[np.ndarray]] = {}
        for block in cells:  # type: ignore[attr-defined]
            if len(block.data):
                blocks.setdefault(str(block.type), []).append(np.asarray(block.data))
        xyz = np.asarray(points, dtype=float).reshape(len(points), -1)  # type: ignore[arg-type]
        if xyz.shape[1] < 3:
            xyz = np.column_stack([xyz, np.zeros((len(xyz), 3 - xyz.shape[1]))])
        stacked = {
            kind: np.vstack(parts).astype(np.int64)
            for kind, parts in blocks.items()
            if parts[0].ndim == 2
        }
        given = None if volumes is None else np.asarray(volumes, dtype=float).reshape(-1)
    except (TypeError, ValueError, AttributeError):
        raise InputError(
            f"{file}: points and elements of the mesh do not fit together; write the mesh again"
        ) from None
    return RawMesh(np.ascontiguousarray(xyz[:, :3]), stacked, given)


def _read_csv(file: Path, content: bytes) -> RawMesh:
    lines = content.decode("utf-8-sig", errors="replace").splitlines()
    names = [name.strip() for name in lines[0].split(",")]
    if names not in (["id", "x", "y", "volume"], ["id", "x", "y", "z", "volume"]):
        raise InputError(
            f"{file}:1: header = {lines[0].strip()!r}: must be id,x,y,volume or "
            "id,x,y,z,volume; correct the first line"
        )
    rows = [_csv_row(file, k, line, names) for k, line in enumerate(lines[1:], 2) if line.strip()]
    if not rows:
        raise InputError(f"{file}: only a header: a mesh needs nodes; add a line for each")
    table = np.array(rows)
    ids = np.sort(table[:, 0])
    if np.any(ids[1:] == ids[:-1]):
        twice = ids[1:][ids[1:] == ids[:-1]][0]
        raise InputError(f"{file}: id = {twice:g} is given twice: ids must differ; number anew")
    points = np.zeros((len(table), 3))
    points[:, : len(names) - 2] = table[:, 1:-1]
    return RawMesh(points, {}, table[:, -1].copy())


def _csv_row(file: Path, number: int, line: str, names: list[str]) -> list[float]:
    values = line.split(",")
    if len(values) != len(names):
        raise InputError(
            f"{file}:{number}: {len(values)} values where the header names {len(names)}; "
            f"give {','.join(names)}"
        )
    try:
        row = [float(value) for value in values]
    except ValueError:
        raise InputError(
            f"{file}:{number}: line = {line.strip()!r}: holds something that is not a number; "
            f"give {','.join(names)}"
        ) from None
    if not row[0].is_integer():
        raise InputError(
            f"{file}:{number}: id = {values[0].strip()}: must be an integer; number anew"
        )
    return row


_READERS: dict[str, Callable[[Path, bytes], RawMesh]] = {
    ".msh": _read_msh,
    ".vtu": _read_vtu,
    ".csv": _read_csv,
}
