"""A disc breaks a grain: how much kinetic energy is lost, and when do the bonds break?

Problem: a tough disc falls at 17 m/s onto the waist of a drum-shaped grain at rest (the deck
that `peridem demo` runs). Inside the grains the state-based solid of Jha et al. (2021), eqs. 9
to 11; between them contact with friction, eqs. 17 to 20.

    python examples/impact.py [--steps N] [--output DIR]

writes VTU files for ParaView, impact.csv (time, kinetic energy, broken bonds) and impact.png.
"""

from __future__ import annotations

import argparse
import csv
from importlib.resources import files
from pathlib import Path

import matplotlib as mpl
import peridem

mpl.use("Agg")
import matplotlib.pyplot as plt


def kinetic_energy(model: peridem.DEMModel) -> float:
    """Sum of rho V v^2 / 2 over the nodes [J/m], per unit thickness."""
    s = model.state
    return float(0.5 * (s.density * s.volume * (s.v**2).sum(axis=1)).sum())


def main() -> None:
    """Run, record, compare start and end, plot."""
    parser = argparse.ArgumentParser(description="A disc breaks a grain")
    parser.add_argument("--steps", type=int, help="default: all of the deck")
    parser.add_argument("--output", type=Path, default=Path("impact"))
    args = parser.parse_args()

    # Setup: the deck bundled with the package.
    deck = files("peridem") / "demo" / "input.yaml"
    model = peridem.DEMModel.from_deck(str(deck))

    # Run, looking every 50 steps.
    rows: list[tuple[float, float, int]] = []

    def record(model: peridem.DEMModel) -> None:
        broken = int((model.bonds.intact == 0).sum()) // 2
        rows.append((model.time, kinetic_energy(model), broken))

    model.run(output=args.output, steps=args.steps, callback=record, callback_every=50)

    # Compare: what is lost is in deformation, broken bonds and damping.
    (_, start, _), (time, end, broken) = rows[0], rows[-1]
    print(f"t = {time * 1e6:.1f} us: {broken} bonds broken, {100 * (1 - end / start):.1f} % of the")
    print(f"kinetic energy of {start:.3g} J/m is gone")

    # Plot.
    with (args.output / "impact.csv").open("w", newline="") as stream:
        csv.writer(stream).writerows([("t [s]", "kinetic energy [J/m]", "broken bonds"), *rows])
    t = [1e6 * row[0] for row in rows]
    figure, axes = plt.subplots()
    axes.plot(t, [row[1] for row in rows], color="tab:blue")
    axes.set(xlabel="t [µs]", ylabel="kinetic energy [J/m]")
    right = axes.twinx()
    right.plot(t, [row[2] for row in rows], color="tab:red")
    right.set_ylabel("broken bonds", color="tab:red")
    figure.savefig(args.output / "impact.png", dpi=150, bbox_inches="tight")


if __name__ == "__main__":
    main()
