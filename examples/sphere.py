"""A ball hits a plate: does the plate take up the momentum that the ball loses?

Problem: a ball of 2 mm flies at 2 m/s onto a plate of the same material, clamped at its rim (in
3D; the sphere on a plate of the original program, without gravity). State-based solid of Jha et
al. (2021), eqs. 9 to 11, contact by eqs. 18 and 36, 20 times as stiff: in 3D, eq. 36 is soft.

    python examples/sphere.py [--short] [--output DIR]

writes sphere.csv (velocity, force, broken bonds over time), VTU files and sphere.png.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas
import peridem as pd

mpl.use("Agg")
import matplotlib.pyplot as plt

GLASS = {"density": 1200, "bulk_modulus": 2.16e7, "shear_modulus": 1.296e7, "fracture_energy": 5}
RADIUS, SPEED = 1e-3, 2.0  # [m], [m/s]


def main() -> None:
    """Throw, record, compare, plot."""
    parser = argparse.ArgumentParser(description="A ball on a plate, in 3D")
    parser.add_argument("--short", action="store_true", help="a coarse mesh")
    parser.add_argument("--output", type=Path, default=Path("sphere"))
    args = parser.parse_args()
    h = 0.45e-3 if args.short else 0.26e-3

    glass = pd.PDState(**GLASS, horizon=3 * h)
    model = pd.DEMModel(dimension=3)
    start = {"at": (0, 0, 1.6 * RADIUS + h), "velocity": (0, 0, -SPEED), "name": "ball"}
    ball = model.add_particle(pd.Sphere(radius=RADIUS), material=glass, mesh_size=h, **start)
    slab = pd.Cuboid(width=4e-3, depth=4e-3, height=1.2e-3)
    plate = model.add_particle(slab, material=glass, mesh_size=h, name="plate")
    model.prescribe(plate, velocity=0.0, region=lambda x: abs(x[:, :2]).max(axis=1) > 2e-3 - h)
    model.set_contact(stiffness_factor=20)

    record = [pd.recorders.velocity(ball), pd.recorders.reaction(ball), "damage"]
    until = 4e-4 if args.short else 8e-4
    result = model.run(until=until, record=record, record_every=5, output=args.output, every=1e-4)

    # Compare: what the force of the plate adds up to, and the change of the ball's momentum.
    nodes = model.nodes_of(ball)
    mass = float(model.state.volume[nodes] @ model.state.density[nodes])
    force, velocity = result.reaction_ball["z"], result.velocity_ball["z"]
    impulse = np.trapezoid(force, force.index)
    change = mass * (velocity.iloc[-1] - velocity.iloc[0])
    print(f"{model.n_nodes} nodes; impulse {impulse:.3e} N s, change of momentum {change:.3e} N s")
    broken = result.damage["broken"]
    print(f"rebound at {velocity.iloc[-1]:.2f} m/s, {broken.iloc[-1]:.0f} bonds broken")

    columns = {"velocity": velocity, "force": force, "broken": broken}
    pandas.DataFrame(columns).to_csv(args.output / "sphere.csv")
    _, (left, right) = plt.subplots(1, 2, figsize=(11, 4.5))
    left.plot(1e3 * force.index, 1e3 * force, label="force on the ball [mN]")
    left.plot(1e3 * velocity.index, 10 * velocity, label="velocity of the ball [0.1 m/s]")
    left.set_xlabel("t [ms]")
    left.legend()
    near = abs(model.state.x[:, 1]) < 0.6 * h
    x, part = 1e3 * model.state.x[near], model.broken_fraction()[near]
    shown = right.scatter(x[:, 0], x[:, 2], 6e4 * h, part, vmin=0, vmax=max(part.max(), 0.1))
    plt.colorbar(shown, label="part of bonds broken")
    right.set(xlabel="x [mm]", ylabel="z [mm]", aspect="equal", title="section y = 0")
    right.axis((-2.2, 2.2, -0.9, 3))
    plt.savefig(args.output / "sphere.png", dpi=150, bbox_inches="tight")


if __name__ == "__main__":
    main()
