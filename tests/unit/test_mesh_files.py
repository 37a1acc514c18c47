"""Meshes of models made in Python, as files: read back bit for bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from helpers import box_mesh, disc_mesh
from modelling_parts import mesh_of
from peridem.mesh import Mesh, read_mesh
from peridem.modelling.mesh_files import mesh_content, suffix_of

DISC, BOX = mesh_of(disc_mesh(1e-3, 3, jiggle=0.2)), mesh_of(box_mesh((1, 2, 3), (1, 2, 2)))
VOLUMES = np.random.default_rng(1).uniform(1, 2, len(DISC.points))


@pytest.mark.parametrize(
    ("mesh", "suffix", "dimension"),
    [
        (DISC, ".msh", 2),
        (BOX, ".msh", 3),
        (Mesh(DISC.points, "none", np.empty((0, 0), np.int32), VOLUMES, "cloud"), ".csv", 2),
        (Mesh(DISC.points, DISC.cell_type, DISC.cells, VOLUMES, "both"), ".vtu", 2),
    ],
)
def test_meshes_are_read_back(mesh: Mesh, suffix: str, dimension: int, tmp_path: Path) -> None:
    assert suffix_of(mesh) == suffix
    path = tmp_path / f"mesh{suffix}"
    path.write_bytes(mesh_content(mesh))
    found = read_mesh(path, dimension)
    assert np.array_equal(found.points, mesh.points)
    assert found.cell_type == mesh.cell_type
    assert np.array_equal(found.cells, mesh.cells)
    assert (found.volumes is None) == (mesh.volumes is None)
    if mesh.volumes is not None:
        assert np.array_equal(found.volumes, mesh.volumes)
    assert mesh_content(mesh) == path.read_bytes()  # so that its hash tells
