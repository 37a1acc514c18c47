"""A ball hits a plate, in 3D: does the plate take up the momentum that the ball loses?

Problem: the original's deck sphere_wall_impact. A ball of 2 mm falls at 2 m/s onto a plate of a
hundredth of its stiffness, held along two strips; gravity, without friction and damping. Solids by
eqs. 9 to 11 of Jha et al. (2021), contact by eqs. 18 and 36. Heights are z here, y there.

    python examples/sphere.py [--short] [--output DIR]

writes series.csv (velocity, force, broken bonds over time), VTU files, curves.png and sphere.png
(the ball on the plate, coloured by damage).
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import peridem as pd
from matplotlib.figure import Figure

MM = 1e-3
SPEED = 2.0  # [m/s]
COMMON = {"density": 1200, "fracture_energy": 50, "horizon": 0.6 * MM}
BALL = pd.PDState(bulk_modulus=2.16e9, shear_modulus=1.296e9, **COMMON)
PLATE = pd.PDState(bulk_modulus=2.16e7, shear_modulus=1.296e7, **COMMON)


def build(mesh_size: float = 0.2 * MM) -> pd.DEMModel:
    """Put the ball over the plate, whose nodes 1.4 to 2 mm from its middle are held."""
    model = pd.DEMModel(dimension=3, gravity=(0, 0, -10), scheme="central_difference")
    sphere, slab = pd.Sphere(radius=MM), pd.Cuboid(width=6 * MM, depth=4 * MM, height=1.2 * MM)
    start = {"at": (0, 0, 1.2 * MM), "velocity": (0, 0, -SPEED), "name": "ball"}
    model.add_particle(sphere, material=BALL, mesh_size=mesh_size, **start)
    at = {"at": (0, 0, -0.6 * MM), "name": "plate"}
    model.add_particle(slab, material=PLATE, mesh_size=mesh_size, **at)
    for x in (-2.0 * MM, 1.4 * MM):
        strip = ((x, -2 * MM, -1.2 * MM), (x + 0.6 * MM, 2 * MM, 0))
        model.prescribe("plate", displacement=0.0, region=strip)
    model.set_contact(radius=0.126 * MM)  # as in the deck, whose mesh has no nodes nearer than that
    return model


def main() -> None:
    """Throw, record, compare, plot."""
    parser = argparse.ArgumentParser(description="A ball on a plate, in 3D")
    parser.add_argument("--short", action="store_true", help="a coarse mesh, half the time")
    parser.add_argument("--output", type=Path, default=Path("sphere"))
    args = parser.parse_args()
    model = build(0.35 * MM if args.short else 0.2 * MM)
    until = 4e-4 if args.short else 8e-4
    record = [pd.recorders.velocity("ball"), pd.recorders.reaction("ball"), "momentum", "damage"]
    model.start()
    nodes = model.nodes_of("ball")
    mass = float(model.state.volume[nodes] @ model.state.density[nodes])
    result = model.run(until=until, record=record, record_every=5, output=args.output, every=1e-5)

    # Compare: what the force of the plate adds up to, and the change of the ball's momentum.
    force, velocity = result.reaction_ball["z"], result.velocity_ball["z"]
    impulse = np.trapezoid(force, force.index) - 10 * mass * until
    change = mass * (velocity.iloc[-1] - velocity.iloc[0])
    print(f"{model.n_nodes} nodes; impulse {impulse:.3e} N s, change of momentum {change:.3e} N s")
    broken = result.damage["broken"]
    print(f"rebound at {velocity.iloc[-1]:.2f} m/s, {broken.iloc[-1]:.0f} bonds broken")

    figure = Figure(figsize=(7, 4))
    left = figure.subplots()
    left.plot(1e3 * force.index, force, color="tab:blue")
    left.set(xlabel="t [ms]", ylabel="force on the ball [N]")
    right = left.twinx()
    right.plot(1e3 * velocity.index, velocity, color="tab:red")
    right.set_ylabel("velocity of the ball [m/s]", color="tab:red")
    figure.savefig(args.output / "curves.png", dpi=110, bbox_inches="tight")
    at = float(velocity.index[np.abs(velocity).argmin()])  # deepest in the plate
    result.render("damage_z", args.output / "sphere.png", at=at, limits=(0, 0.4), colours="YlGnBu")


if __name__ == "__main__":
    main()
