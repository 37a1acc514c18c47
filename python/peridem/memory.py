"""The memory that a model will take, predicted before its bonds are built."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _core
from .errors import InputError

if TYPE_CHECKING:
    from .model import DEMModel

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]

BODIES_OF_A_ZONE = 5
"""Bodies whose neighbours are counted, from the smallest to the largest of a zone."""

DISTANCES = 10_000_000
"""Distances that are computed for a body at most; they bound the number of sampled nodes."""

FEWEST_SAMPLES = 24

HALO_LANES = 1.5
"""Bonds with nodes outside their block fill so many times fewer lanes than those inside."""


@dataclass(frozen=True)
class ZoneMemory:
    """What the bodies of a zone will take.

    Attributes
    ----------
    zone : int
        Zone, counted from 0.
    bodies, nodes : int
        How many there are.
    bonds : float
        Directed bonds expected.
    bytes : float
        Bytes expected.
    """

    zone: int
    bodies: int
    nodes: int
    bonds: float
    bytes: float

    @property
    def neighbours(self) -> float:
        """Mean number of neighbours of a node."""
        return self.bonds / self.nodes


@dataclass(frozen=True)
class MemoryPrediction:
    """What a model will take, zone by zone (see `predict_memory`)."""

    zones: tuple[ZoneMemory, ...]

    @property
    def nodes(self) -> int:
        """Number of nodes."""
        return sum(zone.nodes for zone in self.zones)

    @property
    def bonds(self) -> float:
        """Directed bonds expected."""
        return sum(zone.bonds for zone in self.zones)

    @property
    def bytes(self) -> float:
        """Bytes expected, comparable with `DEMModel.memory_bytes`."""
        return sum(zone.bytes for zone in self.zones)


def predict_memory(model: DEMModel) -> MemoryPrediction:
    """Predict the memory of the arrays over nodes and bonds from the placed bodies.

    Neighbours are counted for a sample of the nodes of some bodies of each zone. The bytes of a
    node, a bond and a group of bonds are the core's (cpp/peridem/memory.h). Building the bonds
    takes about as much again for a while, and the program itself some 100 MB.

    Parameters
    ----------
    model : DEMModel
        A model whose bodies are placed; it need not be initialised, and stays as it is.

    Returns
    -------
    MemoryPrediction
        Expected within 15 % of `DEMModel.memory_bytes` after `DEMModel.init`.
    """
    by_zone: dict[int, list[Any]] = {}
    for body in model._bodies:
        by_zone.setdefault(body.zone, []).append(body)
    zones = [_of_zone(model, zone, bodies) for zone, bodies in sorted(by_zone.items())]
    tables = sum(zone.tables + zone.other_lengths for zone in zones)
    all_lengths = _core.lengths_pay(tables)
    return MemoryPrediction(
        tuple(
            replace(
                zone.memory,
                bytes=zone.memory.bytes + zone.tables + all_lengths * zone.other_lengths,
            )
            for zone in zones
        )
    )


def machine_memory() -> float:
    """Bytes of memory of this machine; infinite where the system does not say."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, ValueError, OSError):
        return float("inf")


def refuse_too_large(prediction: MemoryPrediction, memory: float, file: str) -> None:
    """Refuse a model that cannot fit into the machine.

    Parameters
    ----------
    prediction : MemoryPrediction
        What the model will take.
    memory : float
        Bytes that the machine has.
    file : str
        Name of the deck, for the message.

    Raises
    ------
    InputError
        If the model takes more.
    """
    if prediction.bytes <= memory:
        return
    largest = max(prediction.zones, key=lambda zone: zone.bytes)
    raise InputError(
        f"{file}: the model takes about {prediction.bytes / 1e9:.3g} GB, most of it "
        f"Zone_{largest.zone + 1} with {largest.nodes} nodes of about {largest.neighbours:.0f} "
        f"neighbours: must be below the {memory / 1e9:.3g} GB of this machine; use a coarser mesh, "
        "fewer bodies or a smaller horizon"
    )


@dataclass(frozen=True)
class _Zone:
    memory: ZoneMemory  # without tables
    tables: float  # bytes of weights, and of the lengths of patterns that bodies share
    other_lengths: float  # of patterns of single bodies


@dataclass(frozen=True)
class _Block:
    """Bytes of a body in the force loops."""

    pattern: float
    weights: float
    lengths: float
    flags: float


def _of_zone(model: DEMModel, zone: int, bodies: list[Any]) -> _Zone:
    # Bodies of a zone differ in scale alone. The horizon may not scale with them.
    ratio = np.array([body.horizon**model.dimension / body.volume for body in bodies])
    order = np.argsort(ratio, kind="stable")
    chosen = order[np.unique(np.linspace(0, len(bodies) - 1, BODIES_OF_A_ZONE).astype(int))]
    neighbours = [_neighbours(model, bodies[k]) for k in chosen]
    blocks = [
        _block(model.dimension, bodies[k], count)
        for k, count in zip(chosen, neighbours, strict=True)
    ]

    def of_each(values: list[float]) -> FloatArray:
        return np.asarray(np.interp(ratio, ratio[chosen], values))

    costs = _core.memory_costs()
    # Those that never move have no internal forces.
    moving = np.flatnonzero([not body.constrained for body in bodies])
    nodes = bodies[0].stop - bodies[0].start
    bonds = nodes * of_each(neighbours)
    patterns = of_each([block.pattern for block in blocks])
    weights = of_each([block.weights for block in blocks])
    lengths = of_each([block.lengths for block in blocks])
    flags = of_each([block.flags for block in blocks])
    one, several = _patterns(model, bodies, moving)
    total = len(bodies) * nodes * costs["node"] + bonds.sum() * costs["bond"]
    total += flags[moving].sum() + patterns[one].sum()
    memory = ZoneMemory(zone, len(bodies), nodes * len(bodies), float(bonds.sum()), float(total))
    shared, own = lengths[several].sum(), lengths[one].sum() - lengths[several].sum()
    return _Zone(memory, float(weights[one].sum() + shared), float(own))


def _patterns(
    model: DEMModel, bodies: list[Any], moving: IndexArray
) -> tuple[IndexArray, IndexArray]:
    """Give one of the moving bodies for each pattern, and those whose pattern others share.

    Bodies share a pattern that are equal in units of the horizon, unless they are cut into pieces.
    """
    if bodies[0].stop - bodies[0].start > _core.memory_costs()["whole"]:
        return moving, moving[:0]
    alike: dict[float, list[int]] = {}
    for k in moving:
        alike.setdefault(round(bodies[k].mesh_size / bodies[k].horizon, 11), []).append(int(k))
    one, several = [], []
    for members in alike.values():
        # Bonds at the very edge of the horizon are decided by round-off.
        edge = _pairs_at_edge(model, bodies[members[0]]) if len(members) > 1 else None
        found: dict[bytes, list[int]] = {}
        for k in members:
            bonded = b"" if edge is None else _bonded(model, bodies[k], edge).tobytes()
            found.setdefault(bonded, []).append(k)
        one += [same[0] for same in found.values()]
        several += [same[0] for same in found.values() if len(same) > 1]
    return np.array(one, dtype=np.int64), np.array(several, dtype=np.int64)


def _pairs_at_edge(model: DEMModel, body: Any) -> IndexArray:
    """Pairs of nodes of a body whose distance is the horizon up to round-off, (2, n)."""
    x = model.state.x_ref[body.start : body.stop]
    squared = body.horizon**2
    pairs = []
    for i in range(len(x) - 1):
        distance = ((x[i + 1 :] - x[i]) ** 2).sum(axis=1)
        j = i + 1 + np.flatnonzero(np.abs(distance - squared) < 1e-9 * squared)
        pairs.append(np.stack([np.full_like(j, i), j]))
    return np.concatenate(pairs, axis=1) if pairs else np.empty((2, 0), dtype=np.int64)


def _bonded(model: DEMModel, body: Any, pairs: IndexArray) -> NDArray[np.bool_]:
    """Which of the pairs of nodes of a body are bonded."""
    x = model.state.x_ref[body.start : body.stop]
    distance = ((x[pairs[1]] - x[pairs[0]]) ** 2).sum(axis=1)
    return np.asarray(distance < body.horizon**2)


def _neighbours(model: DEMModel, body: Any) -> float:
    """Mean number of neighbours of a sample of a body's nodes."""
    x = model.state.x_ref[body.start : body.stop]
    count = min(len(x), max(FEWEST_SAMPLES, DISTANCES // len(x)))
    chosen = np.random.default_rng(0).choice(len(x), count, replace=False)
    squared = body.horizon**2
    found = sum(int(np.count_nonzero(((x - x[i]) ** 2).sum(axis=1) < squared)) - 1 for i in chosen)
    return found / count


def _block(dimension: int, body: Any, neighbours: float) -> _Block:
    """Bytes of the blocks and groups of a body in the force loops (bond_block.h).

    A group is one node against one tile of neighbouring nodes. Lengths are in units of the node
    distance. A ball of the horizon meets as many tiles as fit into it, grown by the tile's extent.
    """
    costs = _core.memory_costs()
    nodes, tile = body.stop - body.start, costs["tile"]
    horizon = body.horizon / (body.volume / nodes) ** (1 / dimension)
    extent = tile ** (1 / dimension) - 1
    inside = _grown(dimension, horizon, 0.0)
    tiles = _grown(dimension, horizon, extent) / tile
    surface = min(1.0, neighbours / inside)  # at the surface of a body there are fewer
    tiles *= surface
    whole = nodes <= costs["whole"]
    # A bond is stored once where both ends are in the block: later tiles, and a node's own one.
    groups, halo = 0.5 * (tiles + 1), 0.0
    if not whole:
        parts = -(-nodes // _core.nodes_of_piece(nodes))
        part = nodes / parts
        side = part ** (1 / dimension)
        inner = 1 - parts ** (-1 / dimension)  # of the faces of pieces: the others are the body's
        halo = inner * (_grown(dimension, horizon, side) / part - 1)
        mean_reach = {1: 0.5, 2: 4 / (3 * np.pi), 3: 3 / 8}[dimension] * horizon
        outside = inner * min(1.0, dimension * mean_reach / side)
        groups = (1 - outside) * groups + outside * HALO_LANES * tiles
    own = nodes + 0.5 * tile
    places = own * (costs["place"] + costs["tile_bonds"] / tile)
    places += nodes * halo * (costs["place"] + costs["halo"])
    if not whole:
        places += own * costs["exchange"]
    groups *= nodes
    return _Block(
        pattern=float(places + groups * costs["group"]),
        weights=float(groups * costs["weights"]),
        lengths=float(groups * costs["lengths"]),
        flags=float(groups * costs["flags"]),
    )


def _grown(dimension: int, radius: float, side: float) -> float:
    """Volume of a cube of this side grown by a radius all around (Steiner's formula)."""
    if dimension == 1:
        return side + 2 * radius
    if dimension == 2:
        return side**2 + 4 * side * radius + float(np.pi) * radius**2
    ball = 4 / 3 * float(np.pi) * radius**3
    return side**3 + 6 * side**2 * radius + 3 * float(np.pi) * side * radius**2 + ball
