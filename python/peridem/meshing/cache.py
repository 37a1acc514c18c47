"""Meshes kept in memory and on disk, so that equal shapes are meshed once."""

from __future__ import annotations

import contextlib
import hashlib
import io
import os
import tempfile
import threading
import zipfile
from collections import OrderedDict
from collections.abc import Hashable
from pathlib import Path
from typing import Any

import numpy as np

from ..mesh import Mesh

_FORMAT = 2  # goes up when the mesher makes other meshes of the same shapes
_MOST_IN_MEMORY = 256
_SUFFIX = ".mesh.npz"

Key = tuple[Hashable, float, str]

_memory: OrderedDict[Key, Mesh] = OrderedDict()
_lock = threading.Lock()


def cache_folder() -> Path | None:
    """Return the folder of the cache, None when it is switched off.

    It is ``$PERIDEM_CACHE``, else ``$XDG_CACHE_HOME/peridem``, else ``~/.cache/peridem``; with
    ``PERIDEM_CACHE`` set to ``off``, ``0`` or nothing, meshes are kept in memory only.
    """
    given = os.environ.get("PERIDEM_CACHE")
    if given is not None:
        return None if given.strip().lower() in ("", "0", "off", "no", "none") else Path(given)
    home = os.environ.get("XDG_CACHE_HOME")
    return (Path(home) if home else Path("~/.cache").expanduser()) / "peridem"


def clear_cache(*, disk: bool = True) -> int:
    """Forget all meshes.

    Parameters
    ----------
    disk : bool
        Remove the files too, not only what is in memory.

    Returns
    -------
    int
        Number of files removed.
    """
    with _lock:
        _memory.clear()
    folder = cache_folder()
    removed = 0
    if disk and folder is not None and folder.is_dir():
        for file in sorted(folder.glob(f"*{_SUFFIX}")):
            with contextlib.suppress(OSError):
                file.unlink()
                removed += 1
    return removed


def mesh_key(shape: Hashable, size: float, version: str) -> Key:
    """Return what tells a mesh from all others: shape, size, settings, version of gmsh."""
    return shape, size, f"{_FORMAT} {version}"


def find_in_memory(key: Key | None) -> Mesh | None:
    """Return a mesh that was made or read before, None if there is none."""
    if key is None:
        return None
    with _lock:
        found = _memory.get(key)
        if found is not None:
            _memory.move_to_end(key)
    return found


def remember(key: Key | None, mesh: Mesh) -> None:
    """Keep a mesh in memory."""
    if key is None:
        return
    with _lock:
        _memory[key] = mesh
        while len(_memory) > _MOST_IN_MEMORY:
            _memory.popitem(last=False)


def find_on_disk(key: Key | None) -> Mesh | None:
    """Return a mesh from its file, None if there is none or the file is damaged."""
    file = None if key is None else _file(key)
    return None if file is None else _read(file)


def write_to_disk(key: Key | None, mesh: Mesh) -> None:
    """Write a mesh to its file, if it has one; a full or read-only disk costs time, no result."""
    file = None if key is None else _file(key)
    if file is not None:
        with contextlib.suppress(OSError):
            _write(file, mesh)


def _file(key: Key) -> Path | None:
    """File of a mesh; None without a folder or when the shape is known to this process only."""
    folder = cache_folder()
    if folder is None or not isinstance(key[0], str):
        return None
    text = "\n".join([key[0], key[1].hex(), key[2]])
    return folder / f"{hashlib.sha256(text.encode()).hexdigest()[:40]}{_SUFFIX}"


def _read(file: Path) -> Mesh | None:
    """Read a mesh; None if there is none or the file is damaged, which a checksum tells."""
    try:
        content = io.BytesIO(file.read_bytes())
        with np.load(content, allow_pickle=False) as stored:
            points, cells = stored["points"], stored["cells"]
            cell_type, source = str(stored["cell_type"]), str(stored["source"])
            if str(stored["checksum"]) != _checksum(points, cells, cell_type):
                return None
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, NotImplementedError):
        return None
    return read_only(Mesh(points, cell_type, cells, None, source))  # type: ignore[arg-type]


def _write(file: Path, mesh: Mesh) -> None:
    """Write under a name of its own, then rename: other processes see whole files only."""
    file.parent.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=".", suffix=".tmp", dir=file.parent)
    try:
        with os.fdopen(handle, "wb") as stream:
            np.savez(
                stream,
                points=mesh.points,
                cells=mesh.cells,
                cell_type=mesh.cell_type,
                source=mesh.source,
                checksum=_checksum(mesh.points, mesh.cells, mesh.cell_type),
            )
        Path(name).replace(file)
    except BaseException:
        with contextlib.suppress(OSError):
            Path(name).unlink()
        raise


def _checksum(points: Any, cells: Any, cell_type: str) -> str:
    content = points.tobytes() + cells.tobytes() + cell_type.encode()
    return hashlib.sha256(content).hexdigest()


def read_only(mesh: Mesh) -> Mesh:
    """Lock the arrays of a mesh that several bodies share."""
    for array in (mesh.points, mesh.cells, mesh.volumes):
        if array is not None:
            array.flags.writeable = False
    return mesh
