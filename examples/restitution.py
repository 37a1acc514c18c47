"""Which damping gives two grains the coefficient of restitution that was measured?

Problem: discs of rubber and of a material ten times as stiff hit each other at 0.5 m/s. How much
speed is left depends on materials, sizes, mesh and speed, so that the damping ratio of the model
(Epsilon of a deck) is not the coefficient of restitution: a short run tells which ratio gives it.
Contact and damping: Jha et al. (2021), eqs. 17 to 19 and 28; restitution: section 4.1.

    python examples/restitution.py [--short] [--output DIR]

writes study.csv (restitution for damping ratios of three pairs) and restitution.png.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib as mpl
import numpy as np
import peridem as pd

mpl.use("Agg")
import matplotlib.pyplot as plt

WANTED = 0.8
LOSS = {"damping_factor": 30.0, "mesh_size": 0.2e-3, "speed": 0.5}


def solid(stiffness: float) -> pd.PDState:
    """Rubber, or the same but stiffer; nothing breaks."""
    moduli = {"bulk_modulus": 2.16e7 * stiffness, "shear_modulus": 1.296e7 * stiffness}
    return pd.PDState(density=1200, **moduli, fracture_energy=1e5, horizon=0.6e-3)


PAIRS = {
    "soft on soft": {"material": solid(1), "radius": 1e-3},
    "soft on stiff": {"material": (solid(10), solid(1)), "radius": 1e-3},
    "small on large": {"material": solid(1), "radius": (2e-3, 1e-3)},
}


def rebound(pair: str, damping_ratio: float) -> dict[str, float]:
    """Restitution of a pair, for the study."""
    arguments = {**PAIRS[pair], **LOSS, "damping_ratio": damping_ratio}
    return {"restitution": pd.calibrate.measure_restitution(**arguments).value}


def main() -> None:
    """Study, calibrate, compare, plot."""
    parser = argparse.ArgumentParser(description="Calibrate the damping of two grains")
    parser.add_argument("--short", action="store_true", help="fewer ratios, one pair calibrated")
    parser.add_argument("--output", type=Path, default=Path("restitution"))
    args = parser.parse_args()

    ratios = np.linspace(0.1, 1, 3 if args.short else 10)
    workers = 0 if args.short else None  # 0: here, without processes
    grid = {"pair": list(PAIRS), "damping_ratio": ratios}
    table = pd.study(rebound, grid=grid, folder=args.output, workers=workers)

    axes = plt.figure(figsize=(6, 4)).add_subplot()
    axes.axhline(WANTED, color="gray", linestyle=":")
    for pair, rows in table.groupby("pair", sort=False):
        (line,) = axes.plot(rows["damping_ratio"], rows["restitution"], ".-", label=pair)
        if args.short and pair != "soft on soft":
            continue
        found = pd.calibrate.restitution(WANTED, **PAIRS[pair], **LOSS)
        again = rebound(pair, found.value)["restitution"]
        print(f"{pair}: {found}")
        print(f"  measured again: {again:.4f}")
        axes.plot(found.value, found.achieved, "o", color=line.get_color(), markersize=9)

    axes.set(xlabel="damping ratio", ylabel="coefficient of restitution", ylim=(0.65, 1.02))
    axes.legend()
    axes.grid(alpha=0.4)
    plt.savefig(args.output / "restitution.png", dpi=150, bbox_inches="tight")


if __name__ == "__main__":
    main()
