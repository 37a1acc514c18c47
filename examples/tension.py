"""At which strain does a strip with a cut tear, and how fast does the crack run?

Problem: a strip of 40 mm x 10 mm, cut in from the left, is pulled at its long edges (single-body
tension). The crack grows when the energy stored ahead of it, over the height, pays for it:
C e^2 H / 2 = G (Rivlin, Thomas 1953). It runs slower than Rayleigh waves. State-based solid of
Jha et al. (2021), eqs. 9 to 11, whose constants are those of 3D: in 2D, for Poisson's ratio 1/4,
the same sums give C = 45/8 mu, shear modulus 15/8 mu and G = 10/(3 pi) Gc.

    python examples/tension.py [--short] [--output DIR]

writes tension.csv (strain, force, crack length over time), curves.png of them and tension.png (the
torn strip).
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import numpy as np
import peridem as pd
from matplotlib.figure import Figure

WIDTH, HEIGHT, CUT, PULL = 40e-3, 10e-3, 15e-3, 0.15  # [m], [m], [m], [m/s]
GLUE = {"density": 1200, "young_modulus": 3.24e7, "poisson_ratio": 0.25, "fracture_energy": 50}


def main() -> None:
    """Cut, pull, compare, plot."""
    parser = argparse.ArgumentParser(description="A cut strip in tension")
    parser.add_argument("--short", action="store_true", help="a coarse mesh")
    parser.add_argument("--output", type=Path, default=Path("tension"))
    args = parser.parse_args()
    args.output.mkdir(parents=True, exist_ok=True)
    h = 0.8e-3 if args.short else 0.4e-3
    material = pd.PDState(**GLUE, horizon=3.2 * h, bond_breaking="tension")
    model = pd.DEMModel(dimension=2, safety=0.6)
    model.add_particle(pd.Rectangle(width=WIDTH, height=HEIGHT), material=material, mesh_size=h)
    edge = HEIGHT / 2 - 1.5 * h
    model.prescribe(velocity=(0, PULL / 2), region=lambda x: x[:, 1] > edge)
    model.prescribe(velocity=(0, -PULL / 2), region=lambda x: x[:, 1] < -edge)
    model.init()  # the cut: bonds that cross y = 0 left of its tip are no more
    bonds, x, tip = model.bonds, model.state.x_ref, CUT - WIDTH / 2
    a, b = np.repeat(x, np.diff(bonds.offsets), axis=0), x[bonds.indices]
    crosses = (a[:, 1] > 0) != (b[:, 1] > 0)
    bonds.set_intact((~crosses | ((a + b)[:, 0] / 2 > tip)).astype(np.uint8))
    cut, upper = model.broken_fraction(), x[:, 1] > edge

    def tear(model: pd.DEMModel) -> dict[str, float]:
        torn = (model.broken_fraction() - cut > 0.25) & (x[:, 0] > tip)
        force = -float(model.state.f[upper, 1] @ model.state.volume[upper])
        length = CUT + h * len(np.unique(np.round(x[torn, 0] / h)))  # columns of nodes
        return {"strain": PULL * model.time / HEIGHT, "force": force, "length": length}

    table = model.run(until=1.25e-3, record=[tear], record_every=5).tear
    table.to_csv(args.output / "tension.csv")
    mu = material.constants.g
    expected = math.sqrt(2 * 10 / (3 * math.pi) * GLUE["fracture_energy"] / (45 / 8 * mu * HEIGHT))
    begun = table[table["length"] > CUT + 4 * h]
    print(f"tears at a strain of {begun['strain'].iloc[0]:.4f}; by its energy at {expected:.4f}")
    runs = begun[begun["length"] < WIDTH - 4 * h]["length"]
    speed = np.polyfit(runs.index, runs, 1)[0]
    print(f"the crack runs at {speed:.0f} m/s; Rayleigh waves: {0.92 * (mu / 640) ** 0.5:.0f} m/s")

    figure = Figure(figsize=(7, 3.5))
    left = figure.subplots()
    left.plot(table["strain"], table["force"] / 1e3, color="tab:blue")
    left.axvline(expected, color="gray", linestyle=":", label="strain at which its energy suffices")
    left.set(xlabel="strain", ylabel="force [kN/m]")
    left.legend(loc="upper left")
    right = left.twinx()
    right.plot(table["strain"], 1e3 * table["length"], color="tab:red")
    right.set_ylabel("crack [mm]", color="tab:red")
    figure.savefig(args.output / "curves.png", dpi=150, bbox_inches="tight")
    model.render("damage", args.output / "tension.png", size=(1000, 380))


if __name__ == "__main__":
    main()
