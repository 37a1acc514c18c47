"""All shapes, and the meshes they get: how even are the nodes?

Problem: peridynamics wants evenly spaced nodes. Every shape is meshed with one node distance, the
smallest distance and the spread of the nodal volumes are printed, and the meshes are drawn.

    python examples/shapes.py [--output FILE]

writes shapes.png, or FILE.
"""

import argparse
from typing import Any

import numpy as np
import peridem as pd
from matplotlib.figure import Figure
from peridem.shapes.outlines import region_of_mesh

box = pd.Cuboid.between
SHAPES = [
    pd.Circle(radius=1),
    pd.Ellipse(a=1, b=0.6, angle=0.4),
    pd.Square(side=1.6),
    pd.Rectangle(width=1.8, height=1),
    pd.Triangle(radius=1),
    pd.Hexagon(radius=1),
    pd.ConcaveHexagon(radius=1, neck=0.3),
    pd.Annulus(inner_radius=0.5, outer_radius=1),
    pd.AnnulusRectangle(inner_width=1, inner_height=0.6, outer_width=1.8, outer_height=1.4),
    pd.RectangleMinusRectangle(
        inner=pd.Rectangle.between((-0.7, -0.7), (0.7, 0.9)),
        outer=pd.Rectangle.between((-0.9, -0.9), (0.9, 0.9)),
    ),
    pd.Polygon(points=[(-1, -0.7), (0.9, -0.9), (0.2, 0), (0.8, 0.8), (-0.6, 0.9)]),
    pd.Circle(radius=1) - pd.Circle(radius=0.7) + pd.Rectangle.between((-0.8, -0.1), (0.1, 0.1)),
    pd.Sphere(radius=1),
    pd.Cube(side=1.4),
    pd.Cuboid(width=1.8, depth=1, height=0.8),
    pd.Cylinder(radius=0.7, height=1.4),
    pd.CuboidMinusCuboid(
        inner=box((-0.5,) * 3, (0.5, 0.5, 0.8)), outer=box((-0.8,) * 3, (0.8,) * 3)
    ),
    pd.Polyhedron.convex_hull(np.random.default_rng(3).normal(size=(14, 3)) * 0.4),
]


def draw(figure: Figure, place: int, shape: pd.shapes.BodyShape, mesh: Any) -> Any:
    """Draw a mesh into a place of the figure: its edges, or the outer triangles of a solid."""
    if shape.dimension == 2:
        axes = figure.add_subplot(3, 6, place, aspect="equal")
        axes.triplot(*mesh.points[:, :2].T, mesh.cells, ".-", lw=0.4, ms=2.5, mfc="k", mec="k")
    else:
        axes = figure.add_subplot(3, 6, place, projection="3d", box_aspect=(1, 1, 1))
        skin = region_of_mesh(mesh, 3)
        how = {"color": "lightblue", "lw": 0.3, "ec": "navy"}
        axes.plot_trisurf(*skin.points.T, triangles=skin.triangles, **how)
        axes.set(**dict.fromkeys(("xlim", "ylim", "zlim"), (-0.8, 0.8)))
    axes.set_axis_off()
    return axes


def main() -> None:
    """Mesh, measure, draw."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--output", default="shapes.png")
    output = parser.parse_args().output
    figure = Figure(figsize=(13, 7), layout="tight")
    for place, shape in enumerate(SHAPES, 1):
        size = 0.12 if shape.dimension == 2 else 0.22
        mesh, name = shape.mesh(size), type(shape).__name__
        quality = pd.mesh_quality(mesh)
        near, spread = quality.smallest_distance / size, quality.volume_spread
        print(f"{name:24} {len(mesh.points):5} nodes {near:.2f} apart, volumes +- {spread:.2f}")
        draw(figure, place, shape, mesh).set_title(name, fontsize=8)
    figure.savefig(output, dpi=130)


if __name__ == "__main__":
    main()
