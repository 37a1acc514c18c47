"""At which force does a grain between plates break, and into which pieces?

Problem: a disc of 2 mm is squeezed between two plates until it breaks. Its fracture energy is
not known, its crushing strength is: a nominal stress (force over diameter) of 2 MPa. The energy
is calibrated, on the mesh that is used later: strength depends on it. Pieces are the connected
components of its intact bonds. State-based solid of Jha et al. (2021), eqs. 9 to 11,
whose bonds break in tension only.

    python examples/crushing.py [--short] [--output DIR]

writes crushing.csv (squeeze, force, broken bonds), fragments.csv (areas) and crushing.png.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas
import peridem as pd

mpl.use("Agg")
import matplotlib.pyplot as plt

STRENGTH = 2e6  # [Pa]
MODULI = {"bulk_modulus": 2.16e7, "shear_modulus": 1.296e7, "fracture_energy": 20}
ROCK = pd.PDState(density=1200, **MODULI, bond_breaking="tension", horizon_mesh_ratio=4)


def main() -> None:
    """Calibrate, crush, compare, plot."""
    parser = argparse.ArgumentParser(description="A grain between plates")
    parser.add_argument("--short", action="store_true", help="a coarse mesh")
    parser.add_argument("--output", type=Path, default=Path("crushing"))
    args = parser.parse_args()
    args.output.mkdir(parents=True, exist_ok=True)
    press = {"radius": 1e-3, "speed": 0.7, "mesh_size": 0.25e-3 if args.short else 0.12e-3}

    found = pd.calibrate.crushing(ROCK, stress=STRENGTH, **press)
    print(found)
    crushed = pd.calibrate.measure_crushing(ROCK.with_fracture_energy(found.value), **press)
    print(f"measured again: {crushed.stress:.4g} Pa at a squeeze of {crushed.squeeze:.3f}")

    # Fragments: nodes that intact bonds connect.
    model = crushed.model
    model.step(model.n // 20)  # for the pieces to part
    pieces = pd.diagnostics.fragments(model, "grain")
    grain = model.nodes_of("grain")
    label, areas = pieces.labels[grain], pieces.volumes
    order = np.argsort(-areas)
    rank, areas = np.argsort(order), areas[order]
    shares = ", ".join(f"{100 * one:.1f} %" for one in areas[:5] / areas.sum())
    print(f"{len(areas)} pieces; the largest: {shares} of the grain")

    crushed.table.to_csv(args.output / "crushing.csv")
    pandas.Series(areas, name="area [m^2]").to_csv(args.output / "fragments.csv")
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.5))
    left.plot(100 * crushed.table["squeeze"], crushed.table["force"] / crushed.diameter / 1e6)
    left.axhline(STRENGTH / 1e6, color="gray", linestyle=":")
    left.set(xlabel="squeeze [%]", ylabel="force / diameter [MPa]")
    x = 1e3 * model.state.x[grain]
    colour = np.where(rank[label] < 9, rank[label], 9)  # small pieces share the last colour
    right.scatter(x[:, 0], x[:, 1], 1e5 * press["mesh_size"], colour, cmap="tab10", vmin=0, vmax=9)
    right.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal", title=f"{len(areas)} pieces")
    right.axis((-1.8, 1.8, -1.4, 1.2))
    figure.savefig(args.output / "crushing.png", dpi=150, bbox_inches="tight")


if __name__ == "__main__":
    main()
