"""Grains flow out of a hopper and break: when are they out, and how much breaks on the way?

Problem: a plane hopper is poured full of discs, hexagons and triangles, brittle and soft as dried
clay, and opened. They wedge each other in the funnel, pass the outlet, fall 0.3 m and break in a
tray: attrition in handling and transport, for which Jha et al. (2021) made the model (section 1).

    python examples/hopper.py [--grains N] [--until SECONDS] [--output DIR]

writes VTU files, series.csv, hopper.png (broken bonds) and discharge.png (grains out, damage).
"""

import argparse
from pathlib import Path

import peridem as pd
from matplotlib.figure import Figure

MM = 1e-3
MESH, WALL, DROP = 3 * MM, 6 * MM, 0.3
WIDTH, OUTLET, FUNNEL, HEIGHT = 0.2, 0.09, 0.08, 0.3


def build(count: int) -> tuple[pd.DEMModel, pd.Bodies]:
    """Pour grains into a hopper; make it of two walls, open below, with a tray under it."""
    clay = pd.PDState(
        density=2000, bulk_modulus=2e6, shear_modulus=1.2e6, fracture_energy=20, horizon=3 * MESH
    )
    shapes = [pd.Circle(radius=10 * MM), pd.Hexagon(radius=10 * MM), pd.Triangle(radius=10 * MM)]
    inside = pd.packing.Hopper(width=WIDTH, outlet=OUTLET, funnel_height=FUNNEL, height=HEIGHT)
    sizes = pd.packing.Uniform(9 * MM, 12 * MM)
    poured = pd.packing.poured(shapes, inside, count=count, sizes=sizes, gap=2 * MM)
    model = pd.DEMModel(dimension=2, gravity=(0, -10))
    grains = model.add_particles(poured, material=clay, mesh_size=MESH, name="grains")
    bends = [(OUTLET / 2, 0), (WIDTH / 2, FUNNEL), (WIDTH / 2, HEIGHT)]
    right = bends + [(x + WALL, y) for x, y in reversed(bends)]
    left = [(-x, y) for x, y in right]
    for points in (right, left):
        model.add_wall(pd.Polygon(points=points), material=clay, mesh_size=MESH)
    tray = pd.RectangleMinusRectangle(
        inner=pd.Rectangle.between((-WIDTH, -DROP), (WIDTH, -DROP / 2)),
        outer=pd.Rectangle.between((-WIDTH - WALL, -DROP - WALL), (WIDTH + WALL, -DROP / 2)),
    )
    model.add_wall(tray, material=clay, mesh_size=MESH, name="tray")
    model.set_contact(friction=0.3, damping_ratio=0.8, self_contact=True)
    return model, grains


def main() -> None:
    """Discharge, compare what is out with what is broken, plot."""
    parser = argparse.ArgumentParser(description="Hopper discharge with breaking grains")
    parser.add_argument("--grains", type=int, default=60)
    parser.add_argument("--until", type=float, default=0.8, help="simulated time [s]")
    parser.add_argument("--output", type=Path, default=Path("hopper"))
    args = parser.parse_args()
    model, grains = build(args.grains)

    def out(model: pd.DEMModel) -> int:
        return sum(model.state.x[grain.nodes, 1].mean() < 0 for grain in grains)

    every = args.until / 40
    result = model.run(until=args.until, output=args.output, every=every, record=[out, "damage"])

    gone, broken = result.out["out"], 100 * result.damage["fraction"]
    print(f"{gone.iloc[-1]:.0f} of {len(grains)} grains are out,", end=" ")
    print(f"{broken.iloc[-1]:.1f} % of the bonds are broken")

    figure = Figure(figsize=(6, 3.5))
    axes = figure.subplots()
    axes.plot(gone, color="tab:blue", drawstyle="steps-post")
    axes.set(xlabel="time [s]", ylabel="grains out")
    axes.twinx().plot(broken, color="tab:red")
    figure.axes[1].set_ylabel("broken bonds [%]", color="tab:red")
    figure.savefig(args.output / "discharge.png", dpi=110, bbox_inches="tight")
    times, box = [args.until * k / 4 for k in (1, 2, 3, 4)], (-0.22, -0.33, 0.22, 0.32)
    result.render("damage", args.output / "hopper.png", at=times, zoom=box, size=(1200, 480))


if __name__ == "__main__":
    main()
