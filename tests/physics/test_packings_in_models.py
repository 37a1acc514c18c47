"""Packings become models: each grain where the packing has it, and free to move."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import peridem as pd
import pytest
from modelling_parts import glass
from peridem.packing import Packing
from scipy.spatial.transform import Rotation

MM = 1.0e-3
STEPS = 20
GRAVITY = 10.0
MESH_SIZE = 0.3 * MM
GAP = 0.154 * MM  # somewhat below the contact radius: grains touch at once


def mixed() -> Packing:
    shapes = [
        pd.Circle(radius=MM),
        pd.Hexagon(radius=MM),
        pd.Triangle(radius=MM),
        pd.ConcaveHexagon(radius=MM, neck=0.5 * MM),
    ]
    sizes = pd.packing.Uniform(0.9 * MM, 1.1 * MM)
    box = ((0, 0), (9 * MM, 9 * MM))
    return pd.packing.random(shapes, box, count=12, sizes=sizes, gap=GAP, seed=3)


def cells() -> Packing:
    box = ((0, 0), (6 * MM, 4 * MM))
    return pd.packing.voronoi(box, count=8, gap=GAP, lloyd=5, min_edge=0.3 * MM, seed=1)


def solids() -> Packing:
    shapes = [pd.Sphere(radius=MM), pd.Cuboid(width=MM, depth=1.2 * MM, height=1.5 * MM)]
    box = ((0, 0, 0), (5 * MM, 5 * MM, 5 * MM))
    sizes = pd.packing.Uniform(0.9 * MM, 1.1 * MM)
    return pd.packing.random(shapes, box, count=6, sizes=sizes, gap=GAP, seed=5)


def model_of(packing: Packing) -> tuple[pd.DEMModel, pd.Bodies]:
    solid = packing.dimension == 3
    gravity = (0, 0, -GRAVITY) if solid else (0, -GRAVITY)
    model = pd.DEMModel(dimension=packing.dimension, gravity=gravity, threads=1)
    size = MESH_SIZE * (1.5 if solid else 1)
    grains = model.add_particles(
        packing, material=glass(horizon=2.5 * size), mesh_size=size, name="grains"
    )
    model.set_contact(friction=0.3)
    return model, grains


@pytest.mark.filterwarnings("ignore:.*start in contact:peridem.PeridemWarning")  # on purpose
@pytest.mark.parametrize(("make", "n"), [(mixed, 12), (cells, 8), (solids, 6)])
def test_packing_becomes_bodies_that_fall_together(make: Callable[[], Packing], n: int) -> None:
    packing = make()
    assert len(packing) == n
    model, grains = model_of(packing)
    model.init()
    state = model.state
    assert len(grains) == n
    for k, body in enumerate(grains):
        nodes = model.nodes_of(body)
        # Each node lies in its shape, turned, scaled and moved back: x = p + s R X.
        turn = Rotation.from_rotvec(packing.angles[k] * packing.axes[k])
        back = turn.inv().apply(state.x_ref[nodes] - packing.positions[k]) / packing.scales[k]
        geometry = packing.shapes[packing.shape_index[k]].geometry
        assert geometry.contains(back * (1 - 1e-6)).all()
        # and they fill it: chords of circles lose up to sin(a)/a, a = h/r, spheres twice as much.
        loss = 0.02 if packing.dimension == 2 else 0.12
        filled = state.volume[nodes].sum() / packing.volumes[k]
        assert 1 - loss < filled < 1 + 1e-9

    model.run(steps=STEPS)

    # Forces inside of grains and between them add to nothing: P = M g t. Round-off of 20 sums over
    # 1000 nodes, each of at most half a last place, is below 1e-12 of all momenta together.
    momenta = (state.density * state.volume)[:, None] * state.v
    expected = np.zeros(3)
    expected[packing.dimension - 1] = -(state.density @ state.volume) * GRAVITY * model.time
    assert momenta.sum(axis=0) == pytest.approx(expected, rel=0, abs=1e-12 * abs(momenta).sum())
    assert model.n == STEPS
