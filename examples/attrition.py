"""Twelve grains in a drum that turns about a point off its centre: the attrition deck in Python.

Problem: discs, triangles, concave grains and hexagons of 1 and 2 mm in a drum with a protrusion,
which turns at 20 revolutions a second: the original's deck attrition_mix_particles_small_set with
its places, materials, contact, gravity and motion. The grains are soft (waves run at 4 m/s) and
tough: what is seen is how they are thrown about; drum.py has grains that break.

    python examples/attrition.py [--until SECONDS] [--output DIR]

writes VTU files, series.csv (broken bonds, momentum, contacts) and attrition.png (speeds).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import pandas
import peridem as pd

MM = 1e-3
DT = 2.5e-6  # of the deck [s]
COMMON = {"density": 600, "fracture_energy": 100, "horizon": 0.4 * MM}
GRAIN = pd.PDState(bulk_modulus=5e3, shear_modulus=3e3, **COMMON)
WALL = pd.PDState(bulk_modulus=1e4, shear_modulus=6e3, **COMMON)
SHAPES = [
    pd.Circle(radius=MM),
    pd.Triangle(radius=MM),
    pd.ConcaveHexagon(radius=MM, neck=0.4 * MM),
    pd.Hexagon(radius=MM),
]
SHAPES += [shape.scaled(2.0) for shape in SHAPES]
PLACES = pandas.DataFrame(  # shape, x, y and radius [mm], angle [rad]
    [
        (4, -3.051, -1.796, 2.058, 2.906204),
        (5, -9.306, -3.768, 1.963, 5.150249),
        (6, 6.827, 2.694, 2.007, 4.300784),
        (7, -7.783, 3.695, 1.836, 2.035965),
        (0, 2.632, -7.917, 0.967, 3.624217),
        (1, -7.038, -0.822, 0.969, 3.975057),
        (2, -6.419, -6.843, 0.942, 3.747679),
        (3, 11.512, 1.427, 1.015, 0.865992),
        (0, -13.125, 0.789, 0.933, 3.883015),
        (1, -4.431, 1.342, 0.953, 3.100524),
        (2, -0.178, 1.917, 1.061, 0.902342),
        (3, 5.333, -7.967, 0.993, 0.193660),
    ],
    columns=["shape", "x", "y", "radius", "angle"],
)


def build() -> pd.DEMModel:
    """Put the grains into the drum; contact is the default, as in the deck by eq. 36."""
    places = PLACES.assign(**{name: MM * PLACES[name] for name in ("x", "y", "radius")})
    drum = pd.Circle(radius=15.3 * MM) - pd.Circle(radius=15 * MM)
    drum += pd.Rectangle.between((11 * MM, -0.15 * MM), (15 * MM, 0.15 * MM))
    model = pd.DEMModel(dimension=2, gravity=(0, -10), dt=DT, scheme="central_difference")
    model.add_particles(places, shape=SHAPES, material=GRAIN, mesh_size=0.2 * MM, name="grains")
    model.add_wall(drum, material=WALL, mesh_size=0.2 * MM, name="drum", fixed=False)
    model.prescribe("drum", rotation=-125.6637, about=(-3 * MM, 3 * MM))
    return model


def main() -> None:
    """Turn, draw."""
    parser = argparse.ArgumentParser(description="The attrition deck of the original")
    parser.add_argument("--until", type=float, default=0.05, help="simulated time [s]")
    parser.add_argument("--output", type=Path, default=Path("attrition"))
    args = parser.parse_args()
    record = ["damage", "momentum", "coordination"]
    every = args.until / 50
    result = build().run(until=args.until, output=args.output, every=every, record=record)
    print(f"{result.damage['broken'].iloc[-1]:.0f} bonds are broken")
    times = [args.until * k / 6 for k in range(6)]
    result.render("velocity", args.output / "attrition.png", at=times, size=(1200, 800))


if __name__ == "__main__":
    main()
