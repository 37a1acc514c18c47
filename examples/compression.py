"""A box of mixed grains is compressed by its lid: when does the lid feel them, when do they break?

Problem: discs and hexagons with radii of 0.9 to 1.1 mm lie on a grid in a box, each moved a little
along x and turned at random; the lid comes down. Section 4.4 of Jha et al. (2021) has 502 grains
too; here the lid is faster and starts at the grains, in place of a settling under gravity.

    python examples/compression.py [--cells COLUMNS ROWS] [--output DIR]

writes VTU files, series.csv, compression.png (broken bonds) and reaction.png. The whole test has
59 000 nodes and 186 000 steps; --cells 12 10 is a tenth of that work, --cells 4 3 takes seconds.
"""

import argparse
from pathlib import Path

import peridem as pd
from matplotlib.figure import Figure

MM = 1e-3
PITCH, MESH, WALL = 2.55 * MM, 0.2 * MM, 0.6 * MM
GRAINS = 502  # of the 23 x 22 points of the grid; the last four stay free
SPEED, COMPRESSION = 1.5, 0.52  # of the lid [m/s]; part of the height


def build(columns: int, rows: int) -> pd.DEMModel:
    """Put grains into a box and a lid on them."""
    rubber = pd.PDState(
        density=1200, bulk_modulus=2.16e7, shear_modulus=1.296e7, fracture_energy=50, horizon=WALL
    )
    grains = pd.packing.grid(
        [pd.Circle(radius=MM), pd.Hexagon(radius=MM)],
        cells=(columns, rows),
        count=min(GRAINS, columns * rows),
        sizes=pd.packing.Uniform(0.9 * MM, 1.1 * MM),
        spacing=PITCH,
        perturbation=(0.05 * MM, 0),
    )
    width, height = columns * PITCH, rows * PITCH
    box = pd.RectangleMinusRectangle(
        inner=pd.Rectangle.between((0, 0), (width, height + WALL)),
        outer=pd.Rectangle.between((-WALL, -WALL), (width + WALL, height + WALL)),
    )
    lid = pd.Rectangle.between((1.5 * MESH, height), (width - 1.5 * MESH, height + WALL))
    model = pd.DEMModel(dimension=2, gravity=(0, -10))
    model.add_particles(grains, material=rubber, mesh_size=MESH, name="grains")
    model.add_wall(box, material=rubber, mesh_size=MESH, name="box")
    model.add_wall(lid, material=rubber, mesh_size=MESH, velocity=(0, -SPEED), name="lid")
    model.set_contact(friction=0.2, damping_ratio=0.9)
    return model


def main() -> None:
    """Compress, compare the reaction of the lid with the damage, plot."""
    parser = argparse.ArgumentParser(description="Compressive test of mixed grains")
    parser.add_argument("--cells", type=int, nargs=2, default=(23, 22), help="of the grid")
    parser.add_argument("--output", type=Path, default=Path("compression"))
    args = parser.parse_args()
    model, (columns, rows) = build(*args.cells), args.cells
    until = COMPRESSION * rows * PITCH / SPEED
    record = [pd.recorders.reaction("lid"), "damage"]
    result = model.run(output=args.output, until=until, every=until / 35, record=record)

    strain = 100 * SPEED * result.damage.index / (rows * PITCH)
    stress = result.reaction_lid["y"] / (columns * PITCH * 1e3)
    broken = 100 * result.damage["fraction"]
    print(f"the lid feels up to {stress.max():.3g} kPa,", end=" ")
    print(f"{broken.iloc[-1]:.1f} % of the bonds are broken")
    figure = Figure(figsize=(6, 3.5))
    axes = figure.subplots()
    axes.plot(strain, stress, color="tab:blue")
    axes.set(xlabel="compression [%]", ylabel="stress on the lid [kPa]")
    axes.twinx().plot(strain, broken, color="tab:red")
    figure.axes[1].set_ylabel("broken bonds [%]", color="tab:red")
    figure.savefig(args.output / "reaction.png", dpi=110, bbox_inches="tight")
    picture, times = args.output / "compression.png", [until * k / 4 for k in (1, 2, 3, 4)]
    result.render("damage", picture, at=times, size=(1000, 800))


if __name__ == "__main__":
    main()
