"""The memory of a model, predicted before its bonds are built, against what it then holds."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from helpers import DeckFolder, box_mesh, changed, disc_mesh, pair_deck, single_deck
from peridem import DEMModel, InputError
from peridem.memory import MemoryPrediction, ZoneMemory, predict_memory, refuse_too_large

CIRCLE = {"Type": "circle", "Parameters": [1e-3]}
RECTANGLE = {"Type": "rectangle", "Parameters": [0, 0, 0, 1e-3, 1e-3, 0]}


def two_grains(folder: DeckFolder) -> dict[str, Any]:
    return folder.grains()


def mixed_sizes_and_a_wall(folder: DeckFolder) -> dict[str, Any]:
    names = [folder.mesh(f"disc_{n}", disc_mesh(1e-3, n, jiggle=0.1)) for n in (5, 9)]
    names.append(folder.mesh("plate", box_mesh((20e-3, 1e-3), (80, 4))))
    rows = [(k % 2, 2.5e-3 * k - 9e-3, 0, 0, (0.6 + 0.1 * k) * 1e-3, 0.1 * k) for k in range(6)]
    folder.places(*rows, (2, 0, -4e-3, 0, 1e-3, 0))
    return pair_deck(names, CIRCLE, walls=[3])


def grains_of_one_mesh(folder: DeckFolder) -> dict[str, Any]:
    # Equal in units of their horizons: they share a pattern of bonds.
    mesh = folder.mesh("disc", disc_mesh(1e-3, 7, jiggle=0.1))
    folder.places(*[(0, 2.5e-3 * k, 0, 0, (0.6 + 0.1 * k) * 1e-3, 0.7 * k) for k in range(8)])
    return in_units_of_the_mesh(pair_deck([mesh], CIRCLE), 3.2)


def turned_lattices(folder: DeckFolder) -> dict[str, Any]:
    # Lattice points at a distance of 3 h exactly: round-off decides, and grains differ.
    mesh = folder.mesh("square", box_mesh((1e-3, 1e-3), (16, 16)))
    folder.places(*[(0, 2.5e-3 * k, 0, 0, 1e-3, 0.7 * k) for k in range(4)])
    return in_units_of_the_mesh(pair_deck([mesh], RECTANGLE), 3.0)


def in_units_of_the_mesh(deck: dict[str, Any], ratio: float) -> dict[str, Any]:
    del deck["Material"]["Zone_1"]["Horizon"]
    return changed(deck, {"Material.Zone_1.Horizon_Mesh_Ratio": ratio})


def cubes(folder: DeckFolder) -> dict[str, Any]:
    names = [folder.mesh(f"cube_{k}", box_mesh((1e-3,) * 3, (7,) * 3)) for k in (1, 2)]
    folder.places((0, 0, 0, 0, 1e-3, 0), (1, 1e-3, 0, 2e-3, 1e-3, 0))
    cube = {"Type": "cube", "Parameters": [1e-3]}
    return changed(
        pair_deck(names, cube, Dimension=3),
        {"Material.Zone_1.Horizon": 3.6e-4, "Material.Zone_2.Horizon": 4e-4},
    )


def body_in_blocks(folder: DeckFolder) -> dict[str, Any]:
    # 6,561 nodes are more than a block takes.
    mesh = folder.mesh("square", box_mesh((1e-3, 1e-3), (80, 80), jiggle=0.1))
    return changed(single_deck(mesh, RECTANGLE), {"Material.Zone_1.Horizon": 4.7e-5})


def solid_in_blocks(folder: DeckFolder) -> dict[str, Any]:
    mesh = folder.mesh("block", box_mesh((1e-3,) * 3, (14,) * 3))
    cuboid = {"Type": "cuboid", "Parameters": [0, 0, 0, 1e-3, 1e-3, 1e-3]}
    deck = single_deck(mesh, cuboid, Dimension=3)
    return changed(deck, {"Material.Zone_1.Horizon": 2.2e-4})


@pytest.mark.parametrize(
    "make",
    [
        two_grains,
        mixed_sizes_and_a_wall,
        grains_of_one_mesh,
        turned_lattices,
        cubes,
        body_in_blocks,
        solid_in_blocks,
    ],
)
def test_memory_predicted_is_near_what_is_taken(
    deck_folder: DeckFolder, make: Callable[[DeckFolder], dict[str, Any]]
) -> None:
    path = deck_folder.write(make(deck_folder))
    model = DEMModel.from_deck(path, threads=1, allow_overlap=True)
    prediction = predict_memory(model)
    assert len(model.bonds) == 0  # none are built for it
    model.init()
    assert prediction.nodes == model.n_nodes
    # Nodes of small bodies are all counted; scales in between are interpolated.
    assert prediction.bonds == pytest.approx(len(model.bonds), rel=0.03)
    assert prediction.bytes == pytest.approx(model.memory_bytes, rel=0.15)


def test_memory_predicted_sums_over_the_zones(deck_folder: DeckFolder) -> None:
    path = deck_folder.write(mixed_sizes_and_a_wall(deck_folder))
    prediction = predict_memory(DEMModel.from_deck(path, threads=1))
    assert [zone.bodies for zone in prediction.zones] == [3, 3, 1]
    assert [zone.nodes for zone in prediction.zones] == [3 * 91, 3 * 271, 81 * 5]
    assert prediction.bytes == pytest.approx(np.sum([zone.bytes for zone in prediction.zones]))


def test_memory_predicted_has_no_lengths_of_single_bodies_where_they_do_not_pay(
    deck_folder: DeckFolder, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = deck_folder.write(mixed_sizes_and_a_wall(deck_folder))
    model = DEMModel.from_deck(path, threads=1)
    with_lengths = predict_memory(model).bytes  # few: they stay in the cache
    monkeypatch.setattr("peridem.memory._core.lengths_pay", lambda size: size < 0)
    # Half of the tables, which are most of what the kernels take.
    assert 0.5 * with_lengths < predict_memory(model).bytes < 0.8 * with_lengths


def test_model_larger_than_the_machine_is_refused_by_its_largest_zone() -> None:
    prediction = MemoryPrediction(
        (ZoneMemory(0, 10, 1000, 3e4, 1e9), ZoneMemory(1, 1, 100_000, 4.5e6, 15e9))
    )
    refuse_too_large(prediction, 16e9, "input.yaml")
    with pytest.raises(InputError) as error:
        refuse_too_large(prediction, 15.9e9, "input.yaml")
    assert str(error.value) == (
        "input.yaml: the model takes about 16 GB, most of it Zone_2 with 100000 nodes of about 45 "
        "neighbours: must be below the 15.9 GB of this machine; use a coarser mesh, fewer bodies "
        "or a smaller horizon"
    )
