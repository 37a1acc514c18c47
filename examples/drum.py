"""Fifty grains break in a rotating drum with a protrusion, as in the attrition tests of PeriDEM.

    python examples/drum.py [--until SECONDS] [--output DIR]

writes VTU files for ParaView, series.csv and drum.png.
"""

import argparse
from pathlib import Path

import peridem as pd

parser = argparse.ArgumentParser(description="Attrition in a rotating drum")
parser.add_argument("--until", type=float, default=1.0, help="simulated time [s]")
parser.add_argument("--output", type=Path, default=Path("drum"))
args = parser.parse_args()

clay = pd.PDState(  # soft, so that time steps are long: waves run at 42 m/s
    density=2000, bulk_modulus=2e6, shear_modulus=1.2e6, fracture_energy=20, horizon=9e-3
)
shapes = [pd.Circle(radius=0.01), pd.Hexagon(radius=0.01), pd.Triangle(radius=0.01)]
shapes.append(pd.ConcaveHexagon(radius=0.01, neck=5e-3))
place = pd.Rectangle.between((-0.08, -0.1), (0.115, 0.08))
sizes = pd.packing.Uniform(0.01, 0.014)
packing = pd.packing.random(shapes, place, count=50, sizes=sizes, gap=2e-3)
drum = pd.Circle(radius=0.156) - pd.Circle(radius=0.15)
drum += pd.Rectangle.between((-0.152, -5e-3), (-0.1, 5e-3))

model = pd.DEMModel(dimension=2, gravity=(0, -10))
model.add_particles(packing, material=clay, mesh_size=3e-3, name="grains")
model.add_wall(drum, material=clay, mesh_size=3e-3, fixed=False, name="drum")
model.prescribe("drum", rotation=-8.0)  # [rad/s], clockwise
model.set_contact(friction=0.3, damping_ratio=0.8, self_contact=True)
every = args.until / 50
result = model.run(until=args.until, output=args.output, every=every, record=["damage"])

print(f"{100 * result.damage['fraction'].iloc[-1]:.1f} % of the bonds are broken")
times = [args.until * k / 6 for k in range(1, 7)]
result.render("damage", args.output / "drum.png", at=times, size=(1200, 800))
