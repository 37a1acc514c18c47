"""A concave grain falls onto a wall: where does it break, from which speed on?

Problem: a hexagon with a neck hits a rigid wall with one foot, at 4 to 16 m/s (the concave
particle of Jha et al. (2021), section 4.3, on a wall). State-based solid, eqs. 9 to 11, contact
by eqs. 18 and 36 without friction.

    python examples/concave.py [--short] [--output DIR]

writes study.csv (momentum, impulse of the wall and broken bonds for each speed) and concave.png.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib as mpl
import numpy as np
import peridem as pd

mpl.use("Agg")
import matplotlib.pyplot as plt

STONE = {"density": 1200, "bulk_modulus": 2.16e7, "shear_modulus": 1.296e7, "fracture_energy": 20}


def throw(speed: float, mesh_size: float, output: Path) -> dict[str, float]:
    """Let the grain hit the wall; keep its nodes in `output`."""
    material = pd.PDState(**STONE, horizon=4 * mesh_size, bond_breaking="tension")
    model = pd.DEMModel(dimension=2)
    shape = pd.ConcaveHexagon(radius=1e-3, neck=0.6e-3)
    drop = shape.geometry.bounding_radius + mesh_size
    grain = model.add_particle(
        shape, material=material, mesh_size=mesh_size, at=(0, drop), velocity=(0, -speed), angle=0.4
    )
    block = pd.Rectangle(width=4e-3, height=4 * mesh_size)
    wall = model.add_wall(block, material=material, mesh_size=mesh_size, at=(0, -2 * mesh_size))
    record = ["momentum", "damage", pd.recorders.reaction(wall, name="wall")]
    result = model.run(until=1.6e-4, record=record, record_every=2)
    nodes = model.nodes_of(grain)
    np.save(output / "x.npy", model.state.x[nodes])
    np.save(output / "broken.npy", model.broken_fraction()[nodes])
    py, push = result.momentum["py"], result.wall["y"]
    return {
        "momentum": py.iloc[-1] - py.iloc[0],
        "impulse": -np.trapezoid(push, push.index),
        "broken": result.damage["broken"].iloc[-1],
    }


def main() -> None:
    """Throw at several speeds, compare, plot."""
    parser = argparse.ArgumentParser(description="A concave grain on a wall")
    parser.add_argument("--short", action="store_true", help="two speeds, a coarse mesh")
    parser.add_argument("--output", type=Path, default=Path("concave"))
    args = parser.parse_args()
    speeds, mesh_size = ([4, 16], 0.14e-3) if args.short else ([4, 8, 12, 16], 0.08e-3)

    workers = 0 if args.short else None  # 0: here, without processes
    grid = {"speed": speeds, "mesh_size": mesh_size}
    table = pd.study(throw, grid=grid, folder=args.output, workers=workers)
    print(table[["speed", "momentum", "impulse", "broken"]].to_string(index=False))

    figure, axes = plt.subplots(1, len(table), figsize=(4 * len(table), 4), sharey=True)
    for panel, (_, row) in zip(axes, table.iterrows(), strict=True):
        x, part = (np.load(args.output / row["id"] / f"{one}.npy") for one in ("x", "broken"))
        drawn = panel.scatter(*(1e3 * x[:, :2].T), 1e5 * mesh_size, part, vmin=0, vmax=1)
        panel.axhline(0, color="black")
        panel.set(title=f"{row['speed']} m/s: {row['broken']:.0f} broken", xlabel="x [mm]")
        panel.set(aspect="equal", xlim=(-1.4, 2.4), ylim=(-0.2, 3.2))
    axes[0].set_ylabel("y [mm]")
    figure.colorbar(drawn, ax=axes, label="fraction of broken bonds", pad=0.01, shrink=0.7)
    plt.savefig(args.output / "concave.png", dpi=150, bbox_inches="tight")


if __name__ == "__main__":
    main()
