"""Two discs collide: how much of the speed does damping take away?

Problem: a disc falls at 1 m/s onto another one, at rest and free to move (the two-particle test
of Jha et al. (2021), section 4.1). Momentum passes from one to the other; without damping what
is missing of the relative speed is in waves inside the discs, with it also dissipated.

    python examples/two_particles.py [--until SECONDS] [--output DIR]

writes two_particles.csv (relative velocities over time) and two_particles.png.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib as mpl
import pandas
import peridem as pd

mpl.use("Agg")
import matplotlib.pyplot as plt

SPEED = 1.0  # [m/s]
TOUGH = 1.0e4  # fracture energy [J/m^2]: nothing breaks here


def collision(damping_ratio: float | None, until: float) -> pandas.Series:
    """Velocity of the upper disc relative to the lower one [m/s], over time [s]."""
    rubber = pd.PDState(
        density=1200,
        bulk_modulus=2.16e7,
        shear_modulus=1.296e7,
        fracture_energy=TOUGH,
        horizon=0.6e-3,
    )
    model = pd.DEMModel(dimension=2, dt=1e-7)
    disc = pd.Circle(radius=1e-3)
    lower = model.add_particle(disc, material=rubber, mesh_size=0.2e-3, name="lower")
    upper = model.add_particle(
        disc, material=rubber, mesh_size=0.2e-3, at=(0, 2.2e-3), velocity=(0, -SPEED), name="upper"
    )
    if damping_ratio is not None:
        model.set_contact(damping_ratio=damping_ratio, damping_factor=100)
    record = [pd.recorders.velocity(lower), pd.recorders.velocity(upper)]
    result = model.run(until=until, record=record, record_every=2e-6)
    return result.velocity_upper["y"] - result.velocity_lower["y"]


def main() -> None:
    """Run without and with damping, compare, plot."""
    parser = argparse.ArgumentParser(description="Two discs collide")
    parser.add_argument("--until", type=float, default=3e-4, help="simulated time [s]")
    parser.add_argument("--output", type=Path, default=Path("two_particles"))
    args = parser.parse_args()
    args.output.mkdir(parents=True, exist_ok=True)

    cases = {"no damping": None, "damping ratio 0.95": 0.95, "damping ratio 0.8": 0.8}
    velocities = pandas.DataFrame({name: collision(e, args.until) for name, e in cases.items()})

    for name in cases:
        print(f"{name}: rebound at {velocities[name].iloc[-1] / SPEED:.2f} of the speed")

    velocities.to_csv(args.output / "two_particles.csv")
    velocities.index *= 1e6
    axes = velocities.plot(xlabel="t [us]", ylabel="relative velocity [m/s]", grid=True)
    axes.axhline(0, color="black", linewidth=0.8)
    plt.savefig(args.output / "two_particles.png", dpi=150, bbox_inches="tight")


if __name__ == "__main__":
    main()
