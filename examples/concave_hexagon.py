"""A hexagon hits a concave grain at rest: does it break it, and what is left of its speed?

Problem: the two-particle test of Jha et al. (2021), section 4.3, as in the original's deck
twop_concave_and_hex: the lower grain is fixed, the upper one comes down at 1 m/s under gravity,
without friction and damping. The deck's neck is as wide as the grain: it is a rectangle; --neck
draws it in. Inside the grains eqs. 9 to 11, between them eqs. 17, 18 and 36.

    python examples/concave_hexagon.py [--neck MM] [--speed M/S] [--until SECONDS] [--output DIR]

writes VTU files, series.csv (velocity of the hexagon, energies, broken bonds) and
concave_hexagon.png (damage at four times).
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import peridem as pd

GLASS = {"density": 1200, "bulk_modulus": 2.16e7, "shear_modulus": 1.296e7, "fracture_energy": 50}


def build(neck: float = 1.5e-3, speed: float = 1.0) -> pd.DEMModel:
    """Put the hexagon over the concave grain, with the deck's places and constants."""
    glass = pd.PDState(**GLASS, horizon=6e-4)
    model = pd.DEMModel(dimension=2, gravity=(0, -10), scheme="central_difference")
    concave = pd.ConcaveHexagon(radius=1.5e-3, neck=neck)
    hexagon = pd.Hexagon(radius=1e-3)
    common = {"material": glass, "mesh_size": 0.2e-3}
    model.add_particle(
        concave, at=(1.5e-3, 1.5e-3), angle=math.pi / 2, fixed=True, name="concave", **common
    )
    model.add_particle(hexagon, at=(1.5e-3, 4.6e-3), velocity=(0, -speed), name="hexagon", **common)
    return model


def main() -> None:
    """Hit, compare the speeds before and after, draw."""
    parser = argparse.ArgumentParser(description="A hexagon hits a concave grain")
    parser.add_argument("--neck", type=float, default=1.5, help="width of the neck [mm]")
    parser.add_argument("--speed", type=float, default=1.0, help="of the hexagon [m/s]")
    parser.add_argument("--until", type=float, default=4e-3, help="simulated time [s]")
    parser.add_argument("--output", type=Path, default=Path("concave_hexagon"))
    args = parser.parse_args()
    model = build(1e-3 * args.neck, args.speed)
    record = [pd.recorders.velocity("hexagon"), "kinetic_energy", "damage"]
    every = args.until / 100
    result = model.run(until=args.until, output=args.output, every=every, record=record)

    speed = result.velocity_hexagon["y"]
    print(f"{speed.iloc[0]:.3f} m/s before, {speed.iloc[-1]:.3f} m/s after the impact;", end=" ")
    broken = int(result.damage["broken"].iloc[-1])
    print(f"{broken} bonds are broken")
    impact = float(result.kinetic_energy.iloc[:, 0].idxmin())
    times = [0.0, impact, impact + 0.05 * args.until, args.until]
    picture = args.output / "concave_hexagon.png"
    unbroken = {"limits": (0, 0.3), "colours": "YlGnBu"}  # stretches far below the critical one
    result.render("damage_z", picture, at=times, **({} if broken else unbroken))


if __name__ == "__main__":
    main()
