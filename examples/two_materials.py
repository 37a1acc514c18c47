"""How high does a grain rebound from another, by material and damping?

Problem: a disc of 2 mm falls 0.5 mm onto another one, which is fixed (the two-particle test of
Jha et al. (2021), section 4.1), in a centrifuge of 100 times the gravity of the earth, which
makes it short. The materials are soft (M1 of Table 1 there) and ten times as stiff, the damping
ratio of the contact (eq. 28) is 1, none, or 0.5.

    python examples/two_materials.py [--short] [--output DIR]

writes two_materials.csv (heights over time) and two_materials.png.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas
import peridem as pd

mpl.use("Agg")
import matplotlib.pyplot as plt

RADIUS, HEIGHT, GRAVITY = 1e-3, 0.5e-3, 1000.0  # [m], [m], [m/s^2]
CASES = {
    "soft on soft": (1, 1, 1.0),
    "soft on soft, damped": (1, 1, 0.5),
    "soft on stiff, damped": (10, 1, 0.5),
    "stiff on stiff, damped": (10, 10, 0.5),
}


def solid(stiffness: float) -> pd.PDState:
    """M1 of the paper, or the same but stiffer; nothing breaks."""
    moduli = {"bulk_modulus": 2.16e7 * stiffness, "shear_modulus": 1.296e7 * stiffness}
    return pd.PDState(density=1200, **moduli, fracture_energy=1e5, horizon=0.6e-3)


def height(below: float, above: float, damping_ratio: float, until: float) -> pandas.Series:
    """Gap between the surfaces [m] over time [s]."""
    model = pd.DEMModel(dimension=2, gravity=(0, -GRAVITY), threads=1)
    disc = pd.Circle(radius=RADIUS)
    mesh = {"mesh_size": 0.2e-3, "angle": math.pi / 2}  # a node of the lower rim is on top,
    model.add_particle(disc, material=solid(below), fixed=True, **mesh)
    at = {"at": (0, 2 * RADIUS + HEIGHT), "name": "upper"}
    model.add_particle(disc, material=solid(above), **{**mesh, "angle": -math.pi / 2}, **at)
    model.set_contact(damping_ratio=damping_ratio, damping_factor=50, damping_criterion="nodes")
    center = pd.recorders.position("upper", name="center")
    result = model.run(until=until, record=[center], record_every=5e-6)
    times = np.arange(0, until, 1e-5)  # [s], the same for all time steps
    gap = np.interp(times, result.center.index, result.center["y"] - 2 * RADIUS)
    return pandas.Series(gap, index=times)


def main() -> None:
    """Run all cases, compare, plot."""
    parser = argparse.ArgumentParser(description="Rebound of grains of different materials")
    parser.add_argument("--short", action="store_true", help="two cases, to the first rebound")
    parser.add_argument("--output", type=Path, default=Path("two_materials"))
    args = parser.parse_args()
    args.output.mkdir(parents=True, exist_ok=True)
    cases = dict(list(CASES.items())[: 2 if args.short else 4])
    until = 2.4e-3 if args.short else 6e-3

    heights = pandas.DataFrame({name: height(*case, until) for name, case in cases.items()})
    fall = math.sqrt(2 * HEIGHT / GRAVITY)
    for name, gap in heights.items():
        first = gap[1.1 * fall : 2.9 * fall].max()
        print(f"{name}: rises to {first * 1e3:.3f} mm, restitution {(first / HEIGHT) ** 0.5:.3f}")
    heights.to_csv(args.output / "two_materials.csv")
    axes = (heights * 1e3).set_axis(heights.index * 1e3).plot(grid=True, figsize=(7, 4))
    axes.set(xlabel="t [ms]", ylabel="height [mm]")
    plt.savefig(args.output / "two_materials.png", dpi=150, bbox_inches="tight")


if __name__ == "__main__":
    main()
