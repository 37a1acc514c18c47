"""A rock of Voronoi grains is pressed together: how do the joints carry, and when do grains break?

Problem: a block of rock is cut into Voronoi cells, each a grain of state-based solid, without glue
between them. A plate presses it into a box, slowly against its waves. The joints close first, then
corners and whole grains break. Inside the grains eqs. 9 to 11, between them eqs. 17 to 20 of Jha et
al. (2021); bonds break in tension only.

    python examples/voronoi.py [--grains N] [--speed M/S] [--output DIR]

writes VTU files, series.csv, voronoi.png (broken bonds) and stress.png (stress and damage).
"""

import argparse
from pathlib import Path

import peridem as pd
from matplotlib.figure import Figure

MM = 1e-3
SIDE, MESH, WALL = 100 * MM, 2.5 * MM, 6 * MM
GAP = MESH  # above the contact radius, 0.95 of the smallest distance of two nodes
COMPRESSION = 0.15


def build(grains: int, speed: float) -> pd.DEMModel:
    """Cut the block, put it into a box with a lid."""
    rock = pd.PDState(
        density=2500,
        young_modulus=1.5e8,
        poisson_ratio=0.2,
        fracture_energy=40,
        horizon=3 * MESH,
        bond_breaking="tension",
    )
    domain = ((0.0, 0.0), (SIDE, SIDE))
    cells = pd.packing.voronoi(domain, count=grains, lloyd=3, gap=GAP, min_edge=2 * MESH)
    least, most = -GAP / 2, SIDE + GAP / 2
    box = pd.RectangleMinusRectangle(
        inner=pd.Rectangle.between((least, least), (most, most + WALL)),
        outer=pd.Rectangle.between((least - WALL, least - WALL), (most + WALL, most + WALL)),
    )
    lid = pd.Rectangle.between((least + MESH, most), (most - MESH, most + WALL))
    model = pd.DEMModel(dimension=2)
    model.add_particles(cells, material=rock, mesh_size=MESH, name="grains")
    model.add_wall(box, material=rock, mesh_size=MESH, name="box")
    model.add_wall(lid, material=rock, mesh_size=MESH, velocity=(0, -speed), name="lid")
    model.set_contact(friction=0.5, friction_model="history", self_contact=True)
    return model


def main() -> None:
    """Press, compare stress and damage, plot."""
    parser = argparse.ArgumentParser(description="Voronoi rock under compression")
    parser.add_argument("--grains", type=int, default=40)
    parser.add_argument("--speed", type=float, default=0.5, help="of the lid [m/s]")
    parser.add_argument("--output", type=Path, default=Path("voronoi"))
    args = parser.parse_args()
    model, until = build(args.grains, args.speed), COMPRESSION * SIDE / args.speed
    record = [pd.recorders.reaction("lid", every=until / 200), "damage"]
    result = model.run(output=args.output, until=until, every=until / 40, record=record)

    percent = 100 * args.speed / SIDE  # of compression in a second
    stress = result.reaction_lid["y"] / (SIDE * 1e6)
    broken = 100 * result.damage["fraction"]
    strain = percent * stress.rolling(9, min_periods=1).mean().ge(stress.max() / 4).idxmax()
    print(f"the joints bear from {strain:.1f} % on, at most {stress.max():.2f} MPa;")
    print(f"{broken.iloc[-1]:.1f} % of the bonds are broken")
    figure = Figure(figsize=(6, 3.5))
    axes = figure.subplots()
    axes.plot(percent * stress.index, stress, color="tab:blue")
    axes.set(xlabel="compression [%]", ylabel="stress on the lid [MPa]")
    axes.twinx().plot(percent * broken.index, broken, color="tab:red")
    figure.axes[1].set_ylabel("broken bonds [%]", color="tab:red")
    figure.savefig(args.output / "stress.png", dpi=110, bbox_inches="tight")
    times = [until * part for part in (0.6, 0.75, 1.0)]
    result.render("damage", args.output / "voronoi.png", at=times, size=(1200, 400))


if __name__ == "__main__":
    main()
