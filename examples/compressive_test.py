"""Mixed grains in a box under a slow lid: the compressive_test decks of the original program.

Problem: discs, triangles, concave grains and hexagons of 0.9 to 1.1 mm lie in rows in a box of
12 mm x 8 mm (deck compression_small_set) or 50 mm x 40 mm (compression_large_set, 350 grains) and
fall, while the lid comes down at 60 mm/s. Materials, constants of contact, gravity, walls and times
are the decks'; the grains are drawn anew. compression.py is the test as in the paper.

    python examples/compressive_test.py [--large] [--until SECONDS] [--output DIR]

writes VTU files, series.csv (forces on the walls, broken bonds) and compressive_test.png (speeds).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import peridem as pd

MM = 1e-3
DT = 2.5e-6  # of the decks [s]
HORIZON = {"density": 600, "fracture_energy": 100, "horizon": 0.4 * MM}
GRAIN = pd.PDState(bulk_modulus=5e3, shear_modulus=3e3, **HORIZON)
WALL = pd.PDState(bulk_modulus=1e4, shear_modulus=6e3, **HORIZON)


def build(*, large: bool = False) -> pd.DEMModel:
    """Put grains into a box under a lid; contact is the default, as in the decks by eq. 36."""
    x, y = (25 * MM, 20 * MM) if large else (6 * MM, 4 * MM)  # half the inside of the box
    thick, lid = 0.3 * MM, y - 0.6 * MM
    shapes = [pd.Circle(radius=MM), pd.Triangle(radius=MM), pd.Hexagon(radius=MM)]
    shapes.append(pd.ConcaveHexagon(radius=MM, neck=0.4 * MM))
    grains = pd.packing.grid(
        shapes,
        domain=pd.Rectangle.between((-x, -y), (x, lid)),
        count=350 if large else 15,
        sizes=pd.packing.Uniform(0.9 * MM, 1.1 * MM),
        layout="rows",
        gap=0.15 * MM,
        perturbation=0.03 * MM,
    )
    box = pd.RectangleMinusRectangle(
        inner=pd.Rectangle.between((-x, -y), (x, y + thick)),
        outer=pd.Rectangle.between((-x - thick, -y - thick), (x + thick, y + thick)),
    )
    model = pd.DEMModel(dimension=2, gravity=(0, -10), dt=DT, scheme="central_difference")
    model.add_particles(grains, material=GRAIN, mesh_size=0.2 * MM, name="grains")
    model.add_wall(box, material=WALL, mesh_size=0.2 * MM, name="box")
    plate = pd.Rectangle.between((-x, lid), (x, y))
    model.add_wall(plate, material=WALL, mesh_size=0.2 * MM, velocity=(0, -0.06), name="lid")
    return model


def main() -> None:
    """Compress, compare the force on the floor with the weight, draw."""
    parser = argparse.ArgumentParser(description="The compressive tests of the original")
    parser.add_argument("--large", action="store_true", help="350 grains instead of 15")
    parser.add_argument("--until", type=float, help="simulated time [s]; that of the deck")
    parser.add_argument("--output", type=Path, default=Path("compressive_test"))
    args = parser.parse_args()
    until = args.until or (0.01 if args.large else 0.05)
    model = build(large=args.large)
    record = [pd.recorders.reaction("box"), pd.recorders.reaction("lid"), "damage"]
    result = model.run(until=until, output=args.output, every=until / 100, record=record)

    for wall in ("box", "lid"):
        force = result[f"reaction_{wall}"]["y"].tail(10).mean()
        print(f"force on the {wall}: {force:.3f} N/m, mean of the last tenth")
    print(f"{result.damage['broken'].iloc[-1]:.0f} bonds are broken")
    times = [until * k / 4 for k in (1, 2, 3, 4)]
    result.render("velocity", args.output / "compressive_test.png", at=times, size=(1000, 700))


if __name__ == "__main__":
    main()
