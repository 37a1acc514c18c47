"""At which force does a grain between plates break, and into which pieces?

Problem: a disc of 2 mm is squeezed between two plates until it breaks. Its fracture energy is
not known, its crushing strength is: a nominal stress (force over diameter) of 2 MPa. The energy
is calibrated, on the mesh that is used later: strength depends on it. Pieces are the connected
components of its intact bonds. State-based solid of Jha et al. (2021), eqs. 9 to 11,
whose bonds break in tension only.

    python examples/crushing.py [--short] [--output DIR]

writes crushing.csv (squeeze, force, broken bonds), fragments.csv (masses and sizes), curves.png
(force, grading curve of the fragments) and crushing.png (the fragments, one colour each).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import peridem as pd
from matplotlib.figure import Figure

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
    table = pieces.to_frame()
    shares = ", ".join(f"{100 * one:.1f} %" for one in table["mass"].head() / table["mass"].sum())
    print(f"{len(pieces)} pieces; the largest: {shares} of the grain")

    crushed.table.to_csv(args.output / "crushing.csv")
    table.to_csv(args.output / "fragments.csv")
    figure = Figure(figsize=(9, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(100 * crushed.table["squeeze"], crushed.table["force"] / crushed.diameter / 1e6)
    left.axhline(STRENGTH / 1e6, color="gray", linestyle=":", label="wanted strength")
    left.set(xlabel="squeeze [%]", ylabel="force / diameter [MPa]")
    left.legend(loc="upper left")
    curve = pieces.size_distribution()
    right.semilogx(1e3 * curve.index, 100 * curve["passing"], ".-", drawstyle="steps-post")
    right.set(xlabel="diameter of the fragments [mm]", ylabel="mass in smaller ones [%]")
    figure.savefig(args.output / "curves.png", dpi=150)
    model.render(pieces, args.output / "crushing.png", size=(900, 560), style="nodes")


if __name__ == "__main__":
    main()
