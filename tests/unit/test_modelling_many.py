"""Models in Python: turns and spins of many solids, and warnings of what has no effect."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas
import peridem as pd
import pytest
from helpers import box_mesh
from modelling_parts import SIZE, Block, glass, mesh_of, same, two_discs


@pytest.mark.parametrize("as_table", [True, False])
def test_many_solids_turn_about_axes_and_spin_about_vectors(as_table: bool) -> None:
    # A cube turned by pi/2 about x lies as before; nodes (x, y, z) go to (x, -z, y).
    cube, quarter = Block((2e-3, 2e-3, 2e-3)), np.pi / 2
    at = np.array([(0, 0, 0), (5e-3, 0, 0)])
    spins = np.array([(10.0, 20.0, 30.0), (0.0, -5.0, 0.0)])
    model = pd.DEMModel(3, threads=1)
    common: dict[str, Any] = {"shape": cube, "material": glass(), "mesh_size": 5e-4}
    if as_table:
        columns = {"x": at[:, 0], "y": 0.0, "z": 0.0, "angle": quarter, "ax": 1.0}
        columns |= dict(zip(("wx", "wy", "wz"), spins.T, strict=True))
        model.add_particles(pandas.DataFrame(columns), **common)
    else:
        model.add_particles(at=at, angle=quarter, axis=(1, 0, 0), spin=spins, **common)
    model.start()
    reference = cube.mesh(5e-4).points
    turned = np.column_stack([reference[:, 0], -reference[:, 2], reference[:, 1]])
    s = model.state
    for body, spin in zip(model.particles, spins, strict=True):
        own = slice(body.start, body.stop)
        np.testing.assert_allclose(s.x[own], at[body.id] + turned, atol=1e-17)  # round-off of 1 mm
        mass = s.density[own] * s.volume[own]
        arms = s.x[own] - mass @ s.x[own] / mass.sum()
        np.testing.assert_allclose(s.v[own], np.cross(spin, arms), atol=1e-14)  # of 0.05 m/s


def test_one_spin_vector_holds_for_all_solids() -> None:
    model = pd.DEMModel(3, threads=1)
    cube, at = Block((2e-3, 2e-3, 2e-3)), [(0, 0, 0), (5e-3, 0, 0)]
    model.add_particles(shape=cube, at=at, spin=(10, 20, 30), material=glass(), mesh_size=5e-4)
    model.start()
    halves = model.state.v.reshape(2, -1, 3)
    assert halves[0].any()
    np.testing.assert_allclose(halves[1], halves[0], atol=1e-14)  # round-off of 0.05 m/s


def test_contact_between_no_bodies_is_warned_of() -> None:
    model = two_discs()
    floor = model.add_wall(
        Block((4e-3, 4e-4)), material=glass(), mesh_size=2e-4, at=(0, -2e-3), name="floor"
    )
    model.set_contact("lower", "upper", friction=0.1)
    model.set_contact(glass(bulk_modulus=2e6), friction=0.2)
    model.set_contact(floor, "floor", friction=0.3, damping_ratio=0.5)
    model.set_contact(floor, friction=0.4)
    model.init()
    rest = "has no effect, as there are no two such bodies that can touch; correct a and b, or "
    assert model.warnings == [
        f"set_contact: friction = 0.2: {rest}leave it out",
        f"set_contact: friction = 0.3, damping_ratio = 0.5: {rest}leave it out",
    ]


def test_nodes_moved_twice_in_one_direction_are_warned_of() -> None:
    model = two_discs()
    model.prescribe("lower", velocity=(0, 1), name="up")
    model.prescribe("upper", displacement=("sin", 1e-4, 10), directions="x", name="shake")
    model.prescribe("upper", velocity=(None, -1), name="down")  # another direction
    model.prescribe("lower", velocity=(2, 2), nodes=[0, 1, 5], name="corner")
    model.init()
    assert model.warnings == [
        "prescribe 'corner': moves 3 nodes that prescribe 'up' moves in the same direction: the "
        "later one decides; take them out of one of the two"
    ]
    model.step(2)
    lower = model.state.v[model.body("lower").nodes]
    assert set(lower[[0, 1, 5], 1]) == {2.0}
    assert lower[2, 1] == 1.0


def test_an_empty_region_is_warned_of_once() -> None:
    model = two_discs()
    model.prescribe("lower", velocity=(1, 2), region=((5, 5), (6, 6)))  # two sets of the deck
    model.init()
    assert len(model.warnings) == 1
    assert "no node lies in the set's region" in model.warnings[0]


def test_a_deck_of_many_zones_gives_the_bits_of_its_model(tmp_path: Path) -> None:
    # More than 110 zones, where Zone_1111 would mean the pairs (1, 111) and (11, 11). The horizons
    # differ, and with them Kn; pairs of zones have four contact laws in all.
    model = pd.DEMModel(threads=1, dt=1e-9)
    for k in range(112):
        mesh = mesh_of(box_mesh((1e-3, 1e-3), (3, 3), jiggle=0.1, seed=k))
        material = glass(horizon=(1.1 + 0.001 * k) * 1e-3)
        at = (1.2e-3 * (k % 16), 1.2e-3 * (k // 16))
        model.add_particle(mesh=mesh, material=material, at=at, velocity=(k, -k))
    for y in (-0.8e-3, 9e-3):
        model.add_wall(Block((30e-3, 2e-4)), material=glass(), at=(9e-3, y), mesh_size=2e-4)
    model.set_contact(friction=0.1)
    model.set_contact("mesh", "mesh-112", friction=0.4)
    model.set_contact("mesh-11", self_contact=True)
    model.set_contact("wall", friction=0.5)
    model.run(steps=20)
    path = model.to_deck(tmp_path)
    deck = pd.DEMModel.from_deck(path, threads=1)
    deck.run()
    same(deck, model)
    for i, j, friction in ((0, 1, 0.1), (10, 10, 0.1), (0, 110, 0.1), (0, 111, 0.4), (3, 112, 0.5)):
        law = deck._core.contact_law(i, j)
        assert law["friction"] == -friction
        assert law == model._core.contact_law(i, j)
    assert path.read_text().count("Copy_Contact_Data") == 111  # of the wall with the other bodies


def test_a_deck_of_too_many_zones_is_not_written(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setattr("peridem.modelling.export.MOST_ZONES", 1)
    model = two_discs()
    model.add_wall(Block((4e-3, 4e-4)), material=glass(), mesh_size=2e-4, at=(0, -2e-3))
    with pytest.raises(pd.InputError, match="2 combinations of shape, mesh size, material"):
        model.to_deck(tmp_path, steps=1)


def test_a_disc_is_centred_where_it_is_placed_at_any_angle() -> None:
    # At this node its damping acts. Placed by the node nearest to the centre it was up to half a
    # mesh size away, along with the angle.
    model = pd.DEMModel(threads=1)
    disc, at = pd.Circle(radius=1e-3), [(2.5e-3 * k, 1e-3 * k) for k in range(4)]
    model.add_particles(
        shape=disc,
        at=at,
        angle=[0, 1, 2, 3],
        scale=[1, 1.1, 0.9, 1],
        material=glass(),
        mesh_size=SIZE,
    )
    model.init()
    centers = [body.center[:2] for body in model.particles]
    np.testing.assert_allclose(centers, at, rtol=0, atol=1e-15)  # round-off of 1e-2 m, 1e-18
