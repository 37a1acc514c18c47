"""Writing a mesh so that reading it gives the same mesh, bit for bit."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from .data import Mesh
from .sections import KINDS

_NUMBERS = {name: number for number, (name, _) in KINDS.items()}


def mesh_file(mesh: Mesh) -> tuple[str, bytes]:
    """Contents of a file that holds a mesh.

    Parameters
    ----------
    mesh : Mesh
        The mesh.

    Returns
    -------
    suffix : {".msh", ".csv", ".vtu"}
        Kind of file: MSH 2.2 text for nodes and elements, csv for nodes with volumes, VTU for
        elements and nodal volumes together.
    content : bytes
        The file.
    """
    if mesh.volumes is None:
        return ".msh", _msh(mesh).encode("ascii")
    if mesh.cell_type == "none":
        return ".csv", _csv(mesh).encode("ascii")
    return ".vtu", _vtu(mesh)


def _msh(mesh: Mesh) -> str:
    kind = _NUMBERS[mesh.cell_type]
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(mesh.points))]
    lines += [f"{i} {x!r} {y!r} {z!r}" for i, (x, y, z) in enumerate(mesh.points.tolist(), 1)]
    lines += ["$EndNodes", "$Elements", str(len(mesh.cells))]
    lines += [
        f"{number} {kind} 2 0 1 {' '.join(map(str, cell))}"
        for number, cell in enumerate((mesh.cells + 1).tolist(), 1)
    ]
    return "\n".join([*lines, "$EndElements", ""])


def _csv(mesh: Mesh) -> str:
    assert mesh.volumes is not None
    rows = [
        f"{i},{x!r},{y!r},{z!r},{v!r}"
        for i, ((x, y, z), v) in enumerate(
            zip(mesh.points.tolist(), mesh.volumes.tolist(), strict=True)
        )
    ]
    return "\n".join(["id,x,y,z,volume", *rows, ""])


def _vtu(mesh: Mesh) -> bytes:
    from ..vtu import Topology, write_vtu
    from .reader import VOLUME_NAME

    assert mesh.volumes is not None
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "mesh.vtu"
        write_vtu(
            path,
            topology=Topology([(mesh.cell_type, mesh.cells)], len(mesh.points)),
            points=np.asarray(mesh.points),
            arrays={VOLUME_NAME: mesh.volumes},
            fields={},
            compress=None,
        )
        return path.read_bytes()
