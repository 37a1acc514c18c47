"""Ways to place grains: what they look like and which porosity they reach.

    python examples/packings.py [--output DIR] [--short]

writes packings.png (lattices, random, poured), tessellations.png and solids.png.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib as mpl
from peridem import packing as pk
from peridem.shapes import Circle, ConcaveHexagon, Hexagon, Sphere, Triangle

mpl.use("Agg")
import matplotlib.pyplot as plt

MM = 1e-3
MIXED = [Circle(radius=MM), Hexagon(radius=MM), Triangle(radius=MM)]
MIXED.append(ConcaveHexagon(radius=MM, neck=0.4 * MM))
SIZES = pk.Uniform(0.9 * MM, 1.1 * MM)


def save(packings: dict[str, pk.Packing], path: Path) -> None:
    """Draw packings side by side, with their porosities."""
    solid = next(iter(packings.values())).dimension == 3
    rows, columns = -(-len(packings) // 3), min(3, len(packings))
    figure = plt.figure(figsize=(4.2 * columns, 4.4 * rows))
    for k, (name, packing) in enumerate(packings.items(), 1):
        axes = figure.add_subplot(rows, columns, k, projection="3d" if solid else None)
        packing.plot(axes)
        axes.set_title(f"{name}\n{len(packing)} grains, porosity {packing.porosity:.3f}")
        axes.set_axis_off()
        print(f"{path.stem}: {name}: {packing}")
    figure.savefig(path, dpi=110, bbox_inches="tight")
    plt.close(figure)


def main() -> None:
    """Pack, compare porosities, plot."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--output", type=Path, default=Path("packings"))
    parser.add_argument("--short", action="store_true")
    args = parser.parse_args()
    args.output.mkdir(parents=True, exist_ok=True)
    side = (15 if args.short else 40) * MM
    box = ((0.0, 0.0), (side, side))
    hopper = pk.Hopper(width=side, outlet=side / 6, funnel_height=side / 2, height=side)
    graded = pk.Grading(sieves=[1 * MM, 2 * MM, 6 * MM], passing=[0, 0.4, 1])
    few = round(0.42 * side**2 / (2.4 * MM**2))
    shaken = {"perturbation": (0.1 * MM, 0.0)}
    plane = {
        "grid, as in the paper": pk.grid(MIXED[:2], domain=box, sizes=SIZES, **shaken),
        "hexagonal": pk.hexagonal(MIXED[:1], domain=box),
        "random, mixed": pk.random(MIXED, box, porosity=0.25, sizes=SIZES),
        "random, graded": pk.random(MIXED[:2], box, porosity=0.25, sizes=graded),
        "poured": pk.poured(MIXED, hopper, count=few, sizes=SIZES),
        "random in a drum": pk.random(MIXED, Circle(radius=side / 2), porosity=0.3, sizes=SIZES),
    }
    save(plane, args.output / "packings.png")
    cells = {
        "random points": pk.voronoi(box, count=120),
        "lloyd=10": pk.voronoi(box, count=120, lloyd=10),
        "gap and min_edge": pk.voronoi(box, count=120, lloyd=5, gap=side / 150, min_edge=side / 70),
    }
    save(cells, args.output / "tessellations.png")
    bin3d = pk.Hopper(width=0.016, outlet=0.005, funnel_height=0.007, height=0.02, dimension=3)
    cube = ((0.0, 0.0, 0.0), (12 * MM, 12 * MM, 12 * MM))
    solids = {
        "random": pk.random(Sphere(radius=MM), cube, porosity=0.5, sizes=SIZES),
        "poured in a hopper": pk.poured(Sphere(radius=MM), bin3d, count=250, sizes=SIZES),
        "voronoi": pk.voronoi(cube, count=40, lloyd=3, gap=0.3 * MM),
    }
    save(solids, args.output / "solids.png")


if __name__ == "__main__":
    main()
