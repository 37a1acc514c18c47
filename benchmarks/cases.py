"""Models to measure, written as decks into a folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.tri import Triangulation
from ruamel.yaml import YAML

HORIZON_BY_SPACING = 3.8
"""Horizon over node distance: about 45 neighbours in 2D, as in the paper's meshes."""

RADIUS = 1e-3  # [m]


@dataclass(frozen=True)
class Case:
    """A benchmark: `grains` discs of about `nodes` nodes each, side by side, falling together."""

    name: str
    grains: int
    nodes: int
    what: str


CASES = (
    Case("two_circles", 2, 120, "two discs meeting, the smallest model of the papers"),
    Case("grains_25", 25, 200, "25 grains, as in Figure 24 of the paper"),
    Case("grains_100", 100, 200, "100 grains"),
    Case("grains_400", 400, 200, "400 grains: 80,000 nodes, beyond the second-level cache"),
    Case("body_1e4", 1, 10_000, "one body of 10,000 nodes, cut into blocks"),
    Case("body_1e5", 1, 100_000, "one body of 100,000 nodes"),
)


def disc(n_nodes: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Triangular lattice in a disc of radius `RADIUS`: points (n, 2), triangles (m, 3), spacing."""
    h = RADIUS * np.sqrt(2 * np.pi / (np.sqrt(3) * n_nodes))
    rows = int(RADIUS / (h * np.sqrt(3) / 2)) + 1
    points = [
        (h * (i + 0.5 * (j % 2)), j * h * np.sqrt(3) / 2)
        for j in range(-rows, rows + 1)
        for i in range(-int(RADIUS / h) - 2, int(RADIUS / h) + 3)
    ]
    lattice = np.array(points)
    # A little disorder, as in real meshes; reproducible.
    lattice = lattice + np.random.default_rng(1).uniform(-0.05 * h, 0.05 * h, lattice.shape)
    lattice = lattice[np.hypot(*lattice.T) < RADIUS]
    lattice = lattice[np.argsort(np.hypot(*lattice.T), kind="stable")]
    mesh = Triangulation(*lattice.T)
    a, b, c = (lattice[mesh.triangles[:, k]] for k in range(3))
    area = 0.5 * np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    return lattice, mesh.triangles[area > 0.05 * h * h], float(h)


def write_msh(path: Path, points: np.ndarray, triangles: np.ndarray) -> None:
    """Write a MSH 2.2 file."""
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(points))]
    lines += [f"{k} {x:.17g} {y:.17g} 0" for k, (x, y) in enumerate(points, 1)]
    lines += ["$EndNodes", "$Elements", str(len(triangles))]
    lines += [f"{k} 2 2 1 1 {a + 1} {b + 1} {c + 1}" for k, (a, b, c) in enumerate(triangles, 1)]
    lines += ["$EndElements", ""]
    path.write_text("\n".join(lines))


def write_deck(case: Case, folder: Path, law: str = "PDState") -> Path:
    """Write the deck of a case; returns its YAML file."""
    folder.mkdir(parents=True, exist_ok=True)
    points, triangles, h = disc(case.nodes)
    write_msh(folder / "disc.msh", points, triangles)
    horizon = HORIZON_BY_SPACING * h
    columns = int(np.ceil(np.sqrt(case.grains)))
    step = 2 * RADIUS + 0.9 * h
    rows = [
        f"0, {(k % columns) * step:.9g}, {(k // columns) * step:.9g}, 0, {RADIUS}, "
        f"{0.37 * k % 6.28:.6f}"
        for k in range(case.grains)
    ]
    (folder / "places.csv").write_text("i, x, y, z, r, o\n" + "\n".join(rows) + "\n")
    bulk, density = 2.16e7, 1200.0
    dt = 0.2 * h / np.sqrt(bulk / density)
    deck = {
        "Model": {
            "Dimension": 2,
            "Discretization_Type": {"Time": "central_difference"},
            "Final_Time": float(dt * 1_000_000),
            "Time_Steps": 1_000_000,
        },
        "Zone": {"Zones": 1, "Zone_1": {"Is_Wall": False}},
        "Particle": {"Zone_1": {"Type": "circle", "Parameters": [RADIUS, 0.0, 0.0, 0.0]}},
        "Particle_Generation": {"From_File": "places.csv", "File_Data_Type": "loc_rad_orient"},
        "Mesh": {"Zone_1": {"File": "disc.msh"}},
        "Contact": {
            "Zone_11": {
                "Contact_Radius_Factor": 0.95,
                "Kn": float(18 * bulk / (np.pi * (6e-4) ** 5)),
                "Epsilon": 0.95,
                "Friction_Coeff": 0.2,
            }
        },
        "Material": {
            "Zone_1": {
                "Type": law,
                "Horizon": float(horizon),
                "Density": density,
                "K": bulk,
                **({"G": 1.296e7} if law == "PDState" else {}),
                "Gc": 50.0,
                "Influence_Function": {"Type": 1},
            }
        },
        "Force_BC": {"Gravity": [0.0, -10.0, 0.0]},
        "IC": {
            "Constant_Velocity": {
                "Velocity_Vector": [0.1, -1.0, 0.0],
                "Particle_List": list(range(1, case.grains)) or [0],
            }
        },
        "Output": {"Path": "out", "Tags": ["Displacement"], "Output_Interval": 1_000_000},
    }
    path = folder / "input.yaml"
    with path.open("w") as stream:
        YAML().dump(deck, stream)
    return path
