"""Meshes as files that are read back bit for bit."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from ..mesh import Mesh
from ..mesh.reader import VOLUME_NAME
from ..mesh.writer import msh_text, nodes_text
from ..vtu import Topology, write_vtu


def suffix_of(mesh: Mesh) -> str:
    """Return the kind of file that holds all of a mesh.

    ``.msh`` for nodes and elements, ``.csv`` for nodes with volumes, ``.vtu`` for elements and
    nodal volumes together.
    """
    if mesh.volumes is None:
        return ".msh"
    return ".csv" if mesh.cell_type == "none" else ".vtu"


def mesh_content(mesh: Mesh) -> bytes:
    """Return the contents of the file of a mesh."""
    suffix = suffix_of(mesh)
    if suffix != ".vtu":
        text = msh_text(mesh) if suffix == ".msh" else nodes_text(mesh)
        return text.encode("ascii")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "mesh.vtu"
        _write_vtu(mesh, path)
        return path.read_bytes()


def _write_vtu(mesh: Mesh, path: Path) -> None:
    assert mesh.volumes is not None
    write_vtu(
        path,
        topology=Topology([(mesh.cell_type, mesh.cells)], len(mesh.points)),
        points=np.asarray(mesh.points),
        arrays={VOLUME_NAME: mesh.volumes},
        fields={},
        compress=None,
    )
