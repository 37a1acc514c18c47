"""A disc falls onto another one: how high does it rebound, without and with damping?

Problem: the two-particle test of Jha et al. (2021), section 4.1, and of the original's deck
twop_circ: the lower disc is fixed, the upper one has fallen 0.4 mm of 1 mm and hits it. Material
M1 of Table 1, contact by eqs. 17, 18 and 36, damping between centres by eqs. 27 and 28. The
coefficient of restitution is the root of the heights, eq. 37, and is compared with Table 2.

    python examples/two_particles.py [--until SECONDS] [--output DIR]

writes series.csv (gap between the discs over time), two_particles.csv (restitution) and
two_particles.png.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import pandas
import peridem as pd
from matplotlib.figure import Figure

RADIUS, HEIGHT, FALLEN, GRAVITY = 1e-3, 1e-3, 0.4e-3, 10.0  # [m], [m], [m], [m/s^2]
PAPER = {1.0: 1.0, 0.95: 0.946, 0.9: 0.893, 0.85: 0.845, 0.8: 0.796}  # Table 2, by damping ratio
DT = 3e-7  # of the deck [s]


def build(damping_ratio: float) -> pd.DEMModel:
    """Put a disc on its way onto a fixed one."""
    rubber = pd.PDState(
        density=1200, bulk_modulus=2.16e7, shear_modulus=1.296e7, fracture_energy=50, horizon=6e-4
    )
    model = pd.DEMModel(dimension=2, gravity=(0, -GRAVITY), dt=DT, scheme="central_difference")
    disc, mesh = pd.Circle(radius=RADIUS), {"material": rubber, "mesh_size": 0.2e-3}
    model.add_particle(disc, at=(1e-3, 1e-3), fixed=True, name="lower", **mesh)
    model.add_particle(
        disc, at=(1e-3, 3.6e-3), angle=math.pi / 2, name="upper",
        velocity=(0, -math.sqrt(2 * GRAVITY * FALLEN)), **mesh,
    )  # fmt: skip
    model.set_contact(damping_ratio=damping_ratio, damping_factor=100)
    return model


def main() -> None:
    """Drop the disc for each damping ratio, compare, plot."""
    parser = argparse.ArgumentParser(description="A disc falls onto another one")
    parser.add_argument("--until", type=float, default=0.018, help="simulated time [s]")
    parser.add_argument("--output", type=Path, default=Path("two_particles"))
    args = parser.parse_args()
    args.output.mkdir(parents=True, exist_ok=True)

    gaps = pandas.DataFrame()
    for ratio in PAPER:
        center = pd.recorders.position("upper", name="center")
        result = build(ratio).run(until=args.until, record=[center], record_every=5e-5)
        gaps[f"{ratio:g}"] = result.center["y"] - 1e-3 - 2 * RADIUS
    gaps.to_csv(args.output / "series.csv")

    impact = gaps["1"].idxmin()
    rebound = (gaps[gaps.index > impact].max() / HEIGHT) ** 0.5
    table = pandas.DataFrame({"restitution": rebound, "paper": list(PAPER.values())})
    table.rename_axis("damping ratio").to_csv(args.output / "two_particles.csv")
    print(table.rename_axis("damping ratio").round(3).to_string())

    figure = Figure(figsize=(7, 4))
    axes = figure.subplots()
    for name, gap in gaps.items():
        label = "no damping" if name == "1" else f"damping ratio {name}"
        axes.plot(1e3 * gap.index, 1e3 * gap, label=label)
    axes.set(xlabel="t [ms]", ylabel="gap between the discs [mm]", ylim=(0, 1.05))
    axes.legend(loc="upper left")
    figure.savefig(args.output / "two_particles.png", dpi=150, bbox_inches="tight")


if __name__ == "__main__":
    main()
