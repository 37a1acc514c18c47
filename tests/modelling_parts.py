"""Shapes, materials and comparisons for tests of models made in Python."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import peridem as pd
from helpers import MATERIAL, SmallMesh, box_mesh, disc_mesh
from peridem.geometry import Shape, make_shape
from peridem.mesh import Mesh

ARRAYS = ("x_ref", "x", "u", "v", "f", "theta", "damage_z")


def mesh_of(small: SmallMesh) -> Mesh:
    """A mesh of the package from one of `helpers`."""
    kind: Any = {3: "triangle", 4: "tetra"}[small.cells.shape[1]]
    return Mesh(small.points, kind, small.cells.astype(np.int32), None, "made by the tests")


@dataclass(frozen=True)
class Disc:
    """A disc with a mesh of rings, as the shapes of the package are; `known`: to decks."""

    radius: float = 1.0e-3
    known: bool = True
    jiggle: float = 0.15

    dimension = 2

    @property
    def geometry(self) -> Shape:
        return make_shape("circle", [self.radius])

    @property
    def deck_keys(self) -> dict[str, Any] | None:
        return {"Type": "circle", "Parameters": [self.radius]} if self.known else None

    def mesh(self, mesh_size: float) -> Mesh:
        rings = max(2, round(self.radius / mesh_size))
        return mesh_of(disc_mesh(self.radius, rings, jiggle=self.jiggle))


@dataclass(frozen=True)
class Block:
    """A rectangle or cuboid about the origin."""

    sides: tuple[float, ...]

    @property
    def dimension(self) -> int:
        return len(self.sides)

    @property
    def geometry(self) -> Shape:
        keys = self.deck_keys
        return make_shape(keys["Type"], keys["Parameters"], dimension=self.dimension)

    @property
    def deck_keys(self) -> dict[str, Any]:
        kind = {2: "rectangle", 3: "cuboid"}[self.dimension]
        return {"Type": kind, "Parameters": list(self.sides)}

    def mesh(self, mesh_size: float) -> Mesh:
        bricks = [max(1, round(side / mesh_size)) for side in self.sides]
        return mesh_of(box_mesh(self.sides, bricks, jiggle=0.15))


SIZE = 1.0e-3 / 6
"""Mesh size [m] of a disc of six rings."""


def glass(**changes: Any) -> pd.PDState:
    """Material M1 of the paper."""
    values: dict[str, Any] = {
        "density": MATERIAL["Density"],
        "horizon": MATERIAL["Horizon"],
        "bulk_modulus": MATERIAL["K"],
        "shear_modulus": MATERIAL["G"],
        "fracture_energy": MATERIAL["Gc"],
    }
    return pd.PDState(**{**values, **changes})


def two_discs(
    *, velocity: Sequence[float] = (0.2, -5.0), name: str | None = None, **options: Any
) -> pd.DEMModel:
    """A disc that falls on another one."""
    model = pd.DEMModel(dimension=2, gravity=(0, -10), threads=1, **{"dt": 1.0e-7, **options})
    model.add_particle(Disc(), material=glass(), mesh_size=SIZE, angle=0.3, name="lower")
    model.add_particle(
        Disc(),
        material=glass(),
        mesh_size=SIZE,
        at=(1.5e-4, 2.13e-3),
        angle=1.1,
        velocity=velocity,
        name=name or "upper",
    )
    model.set_contact(friction=0.2, damping_ratio=0.9)
    return model


def same(one: pd.DEMModel, other: pd.DEMModel) -> None:
    """Assert that two models have the same bits."""
    assert one.n == other.n
    assert one.time == other.time
    for name in ARRAYS:
        a, b = getattr(one.state, name), getattr(other.state, name)
        assert np.array_equal(a, b), name
    assert np.array_equal(one.bonds.intact, other.bonds.intact)
