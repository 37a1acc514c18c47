"""Which algorithm of gmsh gives the most even nodes? Prints the table of docs/shapes.md.

python benchmarks/mesh_evenness.py
"""

import warnings

import numpy as np
import peridem as pd
from peridem.meshing import generate, mesh_quality, session
from peridem.meshing.thin import outer_faces

PLANE = {"MeshAdapt": 1, "Delaunay": 5, "Frontal-Delaunay": 6, "for quads": 8, "parallelograms": 9}
SOLID = {"Delaunay": 1, "Frontal": 4, "HXT": 10}
CASES = [
    ("Mesh.Algorithm", PLANE, pd.Circle(radius=1), 0.05),
    ("Mesh.Algorithm", PLANE, pd.Rectangle(width=2, height=1), 0.05),
    ("Mesh.Algorithm", PLANE, pd.ConcaveHexagon(radius=1, neck=0.6), 0.05),
    ("Mesh.Algorithm3D", SOLID, pd.Sphere(radius=1), 0.1),
    ("Mesh.Algorithm3D", SOLID, pd.Cube(side=1), 0.1),
]


def row(shape: pd.shapes.BodyShape, size: float) -> str:
    """Nodes, distances to the nearest node by the size, inner nodal volumes by their mean."""
    mesh = generate.generate(shape, size)
    quality = mesh_quality(mesh)
    inner = np.ones(len(mesh.points), dtype=bool)
    inner[outer_faces(mesh.points, mesh.cells.astype(np.int64))[0].ravel()] = False
    volumes = quality.volumes[inner] / quality.volumes[inner].mean()
    smallest, median = quality.smallest_distance / size, quality.median_distance / size
    return (
        f"{len(mesh.points)} | {smallest:.2f} | {median:.2f} | {volumes.std():.3f} | "
        f"{volumes.min():.2f} to {volumes.max():.2f}"
    )


def main() -> None:
    """Print a row for each shape and algorithm."""
    print("| shape | algorithm | nodes | smallest | median distance | spread | volumes |")
    print("|---|---|---|---|---|---|---|")
    for option, algorithms, shape, size in CASES:
        for name, number in algorithms.items():
            session._OPTIONS[option] = number
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                print(f"| {type(shape).__name__} | {name} | {row(shape, size)} |")
        session._OPTIONS.update({"Mesh.Algorithm": 6, "Mesh.Algorithm3D": 1})


if __name__ == "__main__":
    main()
