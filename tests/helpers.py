"""Small meshes and decks for tests of the engine.

Meshes are made here, not by gmsh: discs of rings, boxes of bricks, and clouds of nodes whose
volumes are given. Decks are dictionaries with the keys of a deck file.
"""

from __future__ import annotations

import copy
import itertools
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from peridem import DEMModel

FloatArray = NDArray[np.float64]
_MSH_TYPE = {3: 2, 4: 4}  # nodes of a cell -> gmsh's number of the triangle, the tetrahedron


@dataclass(frozen=True)
class SmallMesh:
    """Points (n, 3) and cells: (m, 3) triangles or (m, 4) tetrahedra."""

    points: FloatArray
    cells: NDArray[np.int64]


def disc_mesh(radius: float, rings: int = 6, *, jiggle: float = 0.0, seed: int = 1) -> SmallMesh:
    """A disc about the origin: ring k has 6 k nodes, 1 + 3 rings (rings + 1) in all (127 for 6).

    `jiggle` moves the inner nodes by up to this part of the ring spacing, so that no symmetry
    hides an error.
    """
    points = [(0.0, 0.0, 0.0)]
    first = [0]
    for k in range(1, rings + 1):
        first.append(len(points))
        angles = 2 * np.pi * np.arange(6 * k) / (6 * k)
        r = radius * k / rings
        points += [(r * np.cos(a), r * np.sin(a), 0.0) for a in angles]
    cells = []
    for k in range(1, rings + 1):
        for side, step in itertools.product(range(6), range(k)):
            outer = [first[k] + (side * k + step + n) % (6 * k) for n in (0, 1)]
            if k == 1:
                cells.append([0, *outer])
                continue
            n_inner = 6 * (k - 1)
            inner = [first[k - 1] + (side * (k - 1) + step + n) % n_inner for n in (0, 1)]
            cells.append([inner[0], *outer])
            if step < k - 1:
                cells.append([inner[0], outer[1], inner[1]])
    mesh = np.array(points)
    shift = np.random.default_rng(seed).uniform(-1, 1, (first[-1], 2)) * jiggle * radius / rings
    mesh[1 : first[-1], :2] += shift[1:]  # the centre and the outline stay
    return SmallMesh(mesh, np.array(cells))


def box_mesh(
    sides: Sequence[float], bricks: Sequence[int], *, jiggle: float = 0.0, seed: int = 1
) -> SmallMesh:
    """A rectangle (two sides) or box (three) about the origin, of bricks cut into simplices."""
    dimension = len(sides)
    axes = [np.linspace(-s / 2, s / 2, n + 1) for s, n in zip(sides, bricks, strict=True)]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, dimension)
    number = np.arange(len(grid)).reshape([n + 1 for n in bricks])
    cells = []
    for corner in itertools.product(*(range(n) for n in bricks)):
        # Kuhn's simplices: from the lower corner to the upper one, one axis after the other.
        for order in itertools.permutations(range(dimension)):
            path = [np.array(corner)]
            for axis in order:
                path.append(path[-1] + np.eye(dimension, dtype=int)[axis])
            cells.append([number[tuple(node)] for node in path])
    spacing = np.array(sides) / np.array(bricks)
    inside = np.all(np.abs(grid) < (0.5 - 1e-9) * np.array(sides), axis=1)
    shift = np.random.default_rng(seed).uniform(-1, 1, grid.shape) * jiggle * spacing
    points = np.zeros((len(grid), 3))
    points[:, :dimension] = grid + shift * inside[:, None]
    return SmallMesh(points, np.array(cells))


def write_msh(path: Path, mesh: SmallMesh) -> None:
    """Write a mesh as MSH 2.2 text, every digit kept."""
    kind = _MSH_TYPE[mesh.cells.shape[1]]
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(mesh.points))]
    lines += [f"{i + 1} {x!r} {y!r} {z!r}" for i, (x, y, z) in enumerate(mesh.points.tolist())]
    lines += ["$EndNodes", "$Elements", str(len(mesh.cells))]
    for number, cell in enumerate(mesh.cells.tolist(), 1):
        lines.append(f"{number} {kind} 2 0 1 " + " ".join(str(node + 1) for node in cell))
    path.write_text("\n".join([*lines, "$EndElements", ""]), encoding="ascii")


def write_nodes(path: Path, points: Sequence[Sequence[float]], volumes: Sequence[float]) -> None:
    """Write a csv mesh: nodes with given volumes, no cells."""
    rows = [
        f"{i},{x!r},{y!r},{z!r},{v!r}"
        for i, ((x, y, z), v) in enumerate(zip(points, volumes, strict=True))
    ]
    path.write_text("\n".join(["id,x,y,z,volume", *rows, ""]), encoding="ascii")


MATERIAL: dict[str, Any] = {
    "Type": "PDState",
    "Horizon": 6.0e-4,
    "Density": 1200.0,
    "K": 2.16e7,
    "G": 1.296e7,
    "Gc": 50.0,
    "Influence_Function": {"Type": 1},
}
"""Material M1 of the paper (table 1), a soft solid: wave speed about 180 m/s."""

CONTACT: dict[str, Any] = {
    "Contact_Radius_Factor": 0.95,
    "Damping_On": False,
    "Friction_On": False,
    "Kn": 18 * 2.16e7 / (np.pi * 6.0e-4**5),  # eq. 36 of the paper for this material
}

GRAIN_RADIUS = 1.0e-3


def changed(deck: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """A copy of a deck with values set by key path, such as ``Material.Zone_1.Gc``."""
    result = copy.deepcopy(dict(deck))
    for path, value in changes.items():
        *blocks, key = path.split(".")
        block = result
        for name in blocks:
            block = block.setdefault(name, {})
        block[key] = value
    return result


def single_deck(mesh: str, shape: Mapping[str, Any], **model: Any) -> dict[str, Any]:
    """The deck of one body, taken as its mesh is."""
    return {
        "Model": _model_block({"Particle_Sim_Type": "Single_Particle", **model}),
        "Zone": {"Zones": 1},
        "Particle": {"Zone_1": dict(shape)},
        "Mesh": {"Zone_1": {"File": mesh}},
        "Material": {"Zone_1": MATERIAL},
        "Output": {"Output_Interval": 100},
    }


def pair_deck(
    meshes: Sequence[str], shape: Mapping[str, Any], *, walls: Sequence[int] = (), **model: Any
) -> dict[str, Any]:
    """The deck of bodies of one zone each, placed by ``places.csv``; `walls` are held walls."""
    zones = range(1, len(meshes) + 1)
    contact = {
        f"Zone_{i}{j}": dict(CONTACT)
        for i, j in itertools.combinations_with_replacement(zones, 2)
        if not (i in walls and j in walls)
    }
    particle = {
        f"Zone_{k}": {**shape, **({"All_Dofs_Constrained": True} if k in walls else {})}
        for k in zones
    }
    return {
        "Model": _model_block(model),
        "Zone": {
            "Zones": len(meshes),
            **{f"Zone_{k}": {"Is_Wall": k in walls} for k in zones},
        },
        "Particle": particle,
        "Particle_Generation": {"From_File": "places.csv", "File_Data_Type": "loc_rad_orient"},
        "Mesh": {f"Zone_{k}": {"File": mesh} for k, mesh in zip(zones, meshes, strict=True)},
        "Contact": contact,
        "Material": {f"Zone_{k}": dict(MATERIAL) for k in zones},
        "Output": {"Output_Interval": 100},
    }


def _model_block(model: Mapping[str, Any]) -> dict[str, Any]:
    settings = {"dt": 1.0e-7, "steps": 1000, "scheme": "central_difference", **model}
    steps = settings.pop("steps")
    dt = settings.pop("dt")
    scheme = settings.pop("scheme")
    return {
        "Dimension": 2,
        "Discretization_Type": {"Spatial": "finite_difference", "Time": scheme},
        "Final_Time": dt * steps,
        "Time_Steps": steps,
        **settings,
    }


class DeckFolder:
    """A folder that takes meshes, places and decks, and builds models from them."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._count = 0

    def mesh(self, name: str, mesh: SmallMesh) -> str:
        """Write a mesh and return its file name."""
        write_msh(self.folder / f"{name}.msh", mesh)
        return f"{name}.msh"

    def nodes(self, name: str, points: Sequence[Sequence[float]], volumes: Sequence[float]) -> str:
        """Write a cloud of nodes with their volumes and return its file name."""
        write_nodes(self.folder / f"{name}.csv", points, volumes)
        return f"{name}.csv"

    def places(self, *rows: Sequence[float]) -> None:
        """Write ``places.csv``, a row (zone, x, y, z, r, orientation) for each body."""
        lines = [", ".join(repr(value) for value in row) for row in rows]
        text = "\n".join(["i, x, y, z, r, o", *lines, ""])
        (self.folder / "places.csv").write_text(text, encoding="ascii")

    def write(self, deck: Mapping[str, Any]) -> Path:
        """Write a deck: JSON is YAML."""
        self._count += 1
        path = self.folder / f"deck_{self._count}.yaml"
        path.write_text(json.dumps(deck, indent=1), encoding="utf-8")
        return path

    def model(
        self,
        deck: Mapping[str, Any],
        changes: Mapping[str, Any] | None = None,
        *,
        threads: int = 1,
        compatibility: str | None = None,
        allow_overlap: bool = False,
    ) -> DEMModel:
        """Build and initialise the model of a deck, with keys changed."""
        path = self.write(changed(deck, changes or {}))
        model = DEMModel.from_deck(
            path, threads=threads, compatibility=compatibility, allow_overlap=allow_overlap
        )
        model.init()
        return model

    def grains(
        self,
        *,
        rings: int = 6,
        offset: Sequence[float] = (1.5e-4, 2.13e-3),
        walls: Sequence[int] = (),
        **model: Any,
    ) -> dict[str, Any]:
        """The deck of two jiggled discs, the second at `offset` from the first."""
        names = [
            self.mesh(f"disc_{rings}_{k}", disc_mesh(GRAIN_RADIUS, rings, jiggle=0.15, seed=k))
            for k in (1, 2)
        ]
        self.places((0, 0, 0, 0, GRAIN_RADIUS, 0.3), (1, *offset, 0, GRAIN_RADIUS, 1.1))
        circle = {"Type": "circle", "Parameters": [GRAIN_RADIUS]}
        return pair_deck(names, circle, walls=walls, **model)

    def cubes(self, *, offset: Sequence[float] = (1.0e-4, 0.5e-4, 1.1e-3), **model: Any) -> Any:
        """The deck of two jiggled cubes of 5^3 nodes and 1 mm side in 3D."""
        side = GRAIN_RADIUS
        names = [
            self.mesh(f"cube_{k}", box_mesh((side,) * 3, (4,) * 3, jiggle=0.15, seed=k))
            for k in (1, 2)
        ]
        self.places((0, 0, 0, 0, side, 0.3), (1, *offset, side, 0.2))
        return pair_deck(names, {"Type": "cube", "Parameters": [side]}, Dimension=3, **model)


def relative_error(found: FloatArray, expected: FloatArray) -> float:
    """Largest difference, relative to the largest expected value."""
    scale = float(np.abs(expected).max()) or 1.0
    return float(np.abs(np.asarray(found) - expected).max()) / scale


def random_displacement(
    model: DEMModel, rng: np.random.Generator, strain: float, turn: float = 0.5
) -> FloatArray:
    """A displacement (n, 3) of random strain, on top of a rigid turn [rad] of each body about z."""
    state, d = model.state, model.dimension
    u = np.zeros((model.n_nodes, 3))
    for body in model.particles:
        nodes = slice(body.start, body.stop)
        dx = state.x_ref[nodes] - state.x_ref[nodes].mean(axis=0)
        c, s = np.cos(turn), np.sin(turn)
        rotation = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        u[nodes] = dx @ rotation.T - dx
        size = 0.5 * strain * body.mesh_size
        u[nodes, :d] += rng.uniform(-size, size, (body.stop - body.start, d))
    return u


def displace(model: DEMModel, u: FloatArray) -> None:
    """Set the displacement of all nodes and move them there."""
    model.state.u[:] = u
    model.state.x[:] = model.state.x_ref + u


def break_some(model: DEMModel, rng: np.random.Generator, fraction: float) -> None:
    """Break a random fraction of the bonds, both directions of each."""
    bonds = model.bonds
    i = np.repeat(np.arange(model.n_nodes), np.diff(bonds.offsets))
    low, high = np.minimum(i, bonds.indices), np.maximum(i, bonds.indices)
    pair = low.astype(np.int64) * model.n_nodes + high
    names, which = np.unique(pair, return_inverse=True)
    broken = (rng.random(len(names)) < fraction)[which]
    model.set_intact(bonds.intact.astype(bool) & ~broken)
