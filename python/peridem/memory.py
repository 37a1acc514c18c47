"""The memory that a model will take, predicted before its bonds are built."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _core
from .errors import InputError

if TYPE_CHECKING:
    from .model import DEMModel

FloatArray = NDArray[np.float64]

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
    return MemoryPrediction(
        tuple(_of_zone(model, zone, bodies) for zone, bodies in sorted(by_zone.items()))
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


def _of_zone(model: DEMModel, zone: int, bodies: list[Any]) -> ZoneMemory:
    # Bodies of a zone differ in scale alone. The horizon may not scale with them.
    ratio = np.array([body.horizon**model.dimension / body.volume for body in bodies])
    order = np.argsort(ratio, kind="stable")
    chosen = np.unique(np.linspace(0, len(bodies) - 1, BODIES_OF_A_ZONE).astype(int))
    sample = [bodies[k] for k in order[chosen]]
    neighbours = [_neighbours(model, body) for body in sample]
    sizes = [_kernel_bytes(model.dimension, b, k) for b, k in zip(sample, neighbours, strict=True)]
    at = ratio[order[chosen]]
    costs = _core.memory_costs()
    nodes = bodies[0].stop - bodies[0].start
    bonds = nodes * np.interp(ratio, at, neighbours)
    total = len(bodies) * nodes * costs["node"] + bonds.sum() * costs["bond"]
    total += np.interp(ratio, at, sizes).sum()
    return ZoneMemory(zone, len(bodies), nodes * len(bodies), float(bonds.sum()), float(total))


def _neighbours(model: DEMModel, body: Any) -> float:
    """Mean number of neighbours of a sample of a body's nodes."""
    x = model.state.x_ref[body.start : body.stop]
    count = min(len(x), max(FEWEST_SAMPLES, DISTANCES // len(x)))
    chosen = np.random.default_rng(0).choice(len(x), count, replace=False)
    squared = body.horizon**2
    found = sum(int(np.count_nonzero(((x - x[i]) ** 2).sum(axis=1) < squared)) - 1 for i in chosen)
    return found / count


def _kernel_bytes(dimension: int, body: Any, neighbours: float) -> float:
    """Bytes of the blocks and groups of a body of the force loops (bond_block.h).

    A group is one node against one tile of neighbouring nodes. Lengths are in units of the node
    distance. A ball of the horizon meets as many tiles as fit into it, grown by the tile's extent.
    """
    if body.constrained:  # never moves: no internal forces
        return 0.0
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
    groups, places = 0.5 * (tiles + 1), 1.0
    if not whole:
        side = costs["piece"] ** (1 / dimension)
        places += surface * (_grown(dimension, horizon, side) / costs["piece"] - 1)
        mean_reach = {1: 0.5, 2: 4 / (3 * np.pi), 3: 3 / 8}[dimension] * horizon
        outside = surface * min(1.0, dimension * mean_reach / side)
        groups = (1 - outside) * groups + outside * HALO_LANES * tiles
    padded = nodes * places + (0.5 * tile if whole else 0.0)
    return float(padded * costs["place"] + nodes * groups * costs["group"])


def _grown(dimension: int, radius: float, side: float) -> float:
    """Volume of a cube of this side grown by a radius all around (Steiner's formula)."""
    if dimension == 1:
        return side + 2 * radius
    if dimension == 2:
        return side**2 + 4 * side * radius + float(np.pi) * radius**2
    ball = 4 / 3 * float(np.pi) * radius**3
    return side**3 + 6 * side**2 * radius + 3 * float(np.pi) * side * radius**2 + ball
