"""Writing a mesh so that it is read back bit for bit."""

from __future__ import annotations

import os
from pathlib import Path

from ..errors import InputError
from ..files import replace_file
from .data import Mesh

_KINDS = {"line": 1, "triangle": 2, "quad": 3, "tetra": 4}
"""Our name of an element type -> gmsh's number."""


def write_msh(mesh: Mesh, path: str | os.PathLike[str]) -> None:
    """Write a mesh as MSH 2.2 text, which the original reads too.

    Numbers are written with all their digits: `peridem.mesh.read_mesh` gives the same bits.
    Given nodal volumes are not part of the format; they are computed from the elements again.

    Parameters
    ----------
    mesh : Mesh
        With elements.
    path : path-like
        File to write, ending in ``.msh``; it is whole or absent.

    Raises
    ------
    InputError
        If the mesh has no elements, the name ends in something else, or it cannot be written.
    """
    file = Path(path)
    if file.suffix.lower() != ".msh":
        raise InputError(f"{file}: ends in {file.suffix!r}: must be .msh; rename it")
    if mesh.cell_type not in _KINDS:
        raise InputError(
            f"{mesh.source}: has nodes only, and MSH files need elements; use write_nodes"
        )
    _write(file, msh_text(mesh))


def msh_text(mesh: Mesh) -> str:
    """Return the text that `write_msh` writes."""
    points = (f"{k} {x!r} {y!r} {z!r}" for k, (x, y, z) in enumerate(mesh.points.tolist(), 1))
    kind = f"{_KINDS[mesh.cell_type]} 2 0 1"
    cells = (
        f"{k} {kind} " + " ".join(map(str, cell))
        for k, cell in enumerate((mesh.cells + 1).tolist(), 1)
    )
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(mesh.points)), *points]
    lines += ["$EndNodes", "$Elements", str(len(mesh.cells)), *cells, "$EndElements", ""]
    return "\n".join(lines)


def write_nodes(mesh: Mesh, path: str | os.PathLike[str]) -> None:
    """Write nodes with their given volumes as csv, for meshes without elements.

    Parameters
    ----------
    mesh : Mesh
        With nodal volumes; elements are left out.
    path : path-like
        File to write, ending in ``.csv``; it is whole or absent.

    Raises
    ------
    InputError
        If the mesh has no volumes, the name ends in something else, or it cannot be written.
    """
    file = Path(path)
    if file.suffix.lower() != ".csv":
        raise InputError(f"{file}: ends in {file.suffix!r}: must be .csv; rename it")
    if mesh.volumes is None:
        raise InputError(f"{mesh.source}: has no given nodal volumes; use write_msh")
    _write(file, nodes_text(mesh))


def nodes_text(mesh: Mesh) -> str:
    """Return the text that `write_nodes` writes."""
    assert mesh.volumes is not None
    rows = (
        f"{k},{x!r},{y!r},{z!r},{volume!r}"
        for k, ((x, y, z), volume) in enumerate(
            zip(mesh.points.tolist(), mesh.volumes.tolist(), strict=True)
        )
    )
    return "\n".join(["id,x,y,z,volume", *rows, ""])


def _write(file: Path, text: str) -> None:
    with replace_file(file) as temporary:
        temporary.write_text(text, encoding="ascii")
