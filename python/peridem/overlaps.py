"""Bodies that overlap at the start, or lie so near each other that they push from the start."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .bodies import BodyPlan
    from .model import DEMModel, Particle

FloatArray = NDArray[np.float64]

CLOSEST = 0.5
"""Nodes of two bodies overlap when they are closer than this times their contact radius.

Bodies at rest on each other are a little below the contact radius; nodes of the decks of the
original start at 1.03 times it or farther. At half of it the repulsion is that of a crash.
"""

_TOUCHING = 0.99
"""Bodies start in contact below this times their contact radius; above, it hardly matters.

The energy of the spring goes with the square of the overlap, 1e-4 of that at no distance.
"""

_MOST_REPORTED = 5
_MOST_WARNED = 3
_MOST_DISTANCES = 4_000_000  # at once, to bound the memory
_INSIDE = 1e-6  # least barycentric coordinate of a node inside an element
_SIMPLICES = {
    "triangle": ((0, 1, 2),),
    "quad": ((0, 1, 2), (0, 2, 3)),
    "tetra": ((0, 1, 2, 3),),
}


@dataclass(frozen=True)
class Overlap:
    """Two bodies that overlap at the start, or are within their contact radius.

    Attributes
    ----------
    bodies : tuple of int
        Their ids.
    nodes : tuple of int
        The two closest nodes, counted in each body from 0.
    distance : float
        Distance [m] of the nodes.
    radius : float
        Contact radius [m] of the bodies.
    inside : bool
        Whether a node of one lies inside an element of the other.
    """

    bodies: tuple[int, int]
    nodes: tuple[int, int]
    distance: float
    radius: float
    inside: bool

    @property
    def refused(self) -> bool:
        """Whether they overlap, rather than only touch."""
        return self.inside or self.distance < CLOSEST * self.radius


def find_overlaps(model: DEMModel) -> list[Overlap]:
    """Find bodies that overlap in the reference configuration.

    Two bodies overlap when two of their nodes are closer than `CLOSEST` times their contact
    radius, or a node of one lies inside an element of the other. Pairs of walls, and of bodies
    that never move, may overlap: they do not act on each other.

    Parameters
    ----------
    model : DEMModel
        An initialised model.

    Returns
    -------
    list of Overlap
        Ordered by the bodies' ids.
    """
    return [one for one in find_touching(model) if one.refused]


def find_touching(model: DEMModel) -> list[Overlap]:
    """Find bodies that are within their contact radius in the reference configuration.

    Parameters
    ----------
    model : DEMModel
        An initialised model.

    Returns
    -------
    list of Overlap
        Those that overlap and those that only push each other, ordered by the bodies' ids.
    """
    bodies = model.particles
    if len(bodies) < 2:
        return []
    x = model.state.x_ref
    starts = [body.start for body in bodies]
    boxes = np.stack([np.minimum.reduceat(x, starts), np.maximum.reduceat(x, starts)], axis=1)
    finder = _Finder(model, bodies, x, boxes)
    found = (finder.meeting(p, q) for p, q in finder.near_pairs())
    return sorted((one for one in found if one is not None), key=lambda one: one.bodies)


class _Finder:
    """Bodies, their boxes (n, 2, 3) and the contact radius of each pair of zones."""

    def __init__(
        self, model: DEMModel, bodies: list[Particle], x: FloatArray, boxes: FloatArray
    ) -> None:
        self.bodies, self.x, self.boxes = bodies, x, boxes
        self.cells = model.cells
        first: dict[int, int] = {}
        for body in bodies:
            first.setdefault(body.zone, body.id)
        self._radius = {
            (i, j): model.contact_radius(first[i], first[j])
            for i in sorted(first)
            for j in sorted(first)
        }
        self.margin = max(self._radius.values(), default=0.0)

    def near_pairs(self) -> Iterator[tuple[int, int]]:
        """Pairs of bodies that act on each other and whose boxes nearly touch."""
        wall = np.array([body.type == "wall" for body in self.bodies])
        held = np.array([body.constrained for body in self.bodies])
        order = np.argsort(self.boxes[:, 0, 0], kind="stable")
        lower = self.boxes[order, 0, 0]
        for position, p in enumerate(order):
            end = np.searchsorted(lower, self.boxes[p, 1, 0] + self.margin, side="right")
            others = order[position + 1 : end]
            near = np.all(
                (self.boxes[others, 0] <= self.boxes[p, 1] + self.margin)
                & (self.boxes[others, 1] >= self.boxes[p, 0] - self.margin),
                axis=1,
            )
            acts = ~(wall[p] & wall[others]) & ~(held[p] & held[others])
            for q in others[near & acts]:
                yield min(int(p), int(q)), max(int(p), int(q))

    def meeting(self, p: int, q: int) -> Overlap | None:
        """How two bodies overlap or touch; None when they are apart."""
        lower = np.maximum(self.boxes[p, 0], self.boxes[q, 0]) - self.margin
        upper = np.minimum(self.boxes[p, 1], self.boxes[q, 1]) + self.margin
        nodes = [self._nodes_within(k, lower, upper) for k in (p, q)]
        if not len(nodes[0]) or not len(nodes[1]):
            return None
        i, j, distance = _closest(self.x, *nodes)
        radius = self._radius[self.bodies[p].zone, self.bodies[q].zone]
        inside = self._any_inside(nodes[0], q, lower, upper) or self._any_inside(
            nodes[1], p, lower, upper
        )
        if not inside and not distance < _TOUCHING * radius:
            return None
        local = (i - self.bodies[p].start, j - self.bodies[q].start)
        return Overlap((p, q), local, distance, radius, inside)

    def _nodes_within(self, body: int, lower: FloatArray, upper: FloatArray) -> NDArray[np.intp]:
        start, stop = self.bodies[body].start, self.bodies[body].stop
        x = self.x[start:stop]
        return start + np.flatnonzero(np.all((x >= lower) & (x <= upper), axis=1))

    def _any_inside(
        self, nodes: NDArray[np.intp], body: int, lower: FloatArray, upper: FloatArray
    ) -> bool:
        """Whether a node lies inside an element of a body."""
        cell_type, cells = self.cells[body]
        for corners in _SIMPLICES.get(cell_type, ()):
            simplices = self.x[cells[:, corners]]
            low, high = simplices.min(axis=1), simplices.max(axis=1)
            near = np.all((low <= upper) & (high >= lower), axis=1)
            if near.any() and _inside_simplices(self.x[nodes], simplices[near]):
                return True
        return False


def _closest(
    x: FloatArray, nodes: NDArray[np.intp], others: NDArray[np.intp]
) -> tuple[int, int, float]:
    """Closest two nodes of two sets and their distance."""
    best = (int(nodes[0]), int(others[0]), np.inf)
    rows = max(1, _MOST_DISTANCES // len(others))
    for start in range(0, len(nodes), rows):
        part = nodes[start : start + rows]
        squared = ((x[part, None, :] - x[None, others, :]) ** 2).sum(axis=2)
        i, j = np.unravel_index(int(squared.argmin()), squared.shape)
        distance = float(np.sqrt(squared[i, j]))
        if distance < best[2]:
            best = (int(part[i]), int(others[j]), distance)
    return best


def _inside_simplices(points: FloatArray, simplices: FloatArray) -> bool:
    """Whether a point (n, 3) lies inside a triangle (m, 3, 3) or tetrahedron (m, 4, 3)."""
    d = simplices.shape[1] - 1
    points, simplices = points[:, :d], simplices[:, :, :d]
    low, high = simplices.min(axis=1), simplices.max(axis=1)
    rows = max(1, _MOST_DISTANCES // len(simplices))
    for start in range(0, len(points), rows):
        part = points[start : start + rows]
        boxed = np.all((part[:, None] >= low) & (part[:, None] <= high), axis=2)
        point, cell = np.nonzero(boxed)
        if not len(point):
            continue
        origin = simplices[cell, 0]
        edges = np.swapaxes(simplices[cell, 1:] - origin[:, None], 1, 2)
        inner = np.linalg.solve(edges, (part[point] - origin)[:, :, None])[:, :, 0]
        coordinates = np.column_stack([inner, 1 - inner.sum(axis=1)])
        if np.any(coordinates.min(axis=1) > _INSIDE):
            return True
    return False


def overlap_lines(model: DEMModel, overlaps: list[Overlap]) -> list[str]:
    """Say which bodies overlap and what to do, the first ones in full."""
    lines = [_overlap_text(model, one) for one in overlaps[:_MOST_REPORTED]]
    rest = len(overlaps) - _MOST_REPORTED
    if rest > 0:
        lines.append(f"{model.deck.path.name}: and {rest} more pairs of bodies overlap")
    return lines


def _overlap_text(model: DEMModel, one: Overlap) -> str:
    rule = f"a node of one lies inside an element of the other ({_distance_text(one)})"
    remedy = "move or shrink one of them"
    if not one.inside:
        rule = (
            f"{_distance_text(one)}: must be at least {CLOSEST:g} of the contact radius "
            f"{one.radius:.3g} m"
        )
        remedy += f" (a packing: gap = {one.radius:.3g} or more)"
    return (
        f"{_pair_text(model, one)} overlap at the start: {rule}; {remedy}, or go on with "
        "--allow-overlap (allow_overlap=True)"
    )


def touching_warnings(model: DEMModel, touching: list[Overlap]) -> list[str]:
    """Return warnings about bodies that push each other from the first step, nearest first."""
    pushing = [one for one in touching if model.contact_stiffness(*one.bodies) > 0]
    nearest = sorted(pushing, key=lambda one: one.distance / one.radius)
    lines = [
        f"{_pair_text(model, one)} start in contact: {_distance_text(one)}: is below the contact "
        f"radius {one.radius:.3g} m, so that they push each other apart at once; move them "
        f"{one.radius - one.distance:.2g} m apart (a packing: gap = {one.radius:.3g} or more), or "
        "give a smaller contact radius"
        for one in nearest[:_MOST_WARNED]
    ]
    rest = len(pushing) - _MOST_WARNED
    if rest > 0:
        more = "1 more pair of bodies starts" if rest == 1 else f"{rest} more pairs of bodies start"
        lines.append(f"{model.deck.path.name}: and {more} in contact")
    return lines


def _pair_text(model: DEMModel, one: Overlap) -> str:
    p, q = (model.bodies[k] for k in one.bodies)
    if model.scripted:
        return " and ".join(f"{body.where} at {_place(body, model.dimension)}" for body in (p, q))
    return f"{p.where}: bodies {one.bodies[0]} and {one.bodies[1]} (from {q.where})"


def _place(body: BodyPlan, dimension: int) -> str:
    """Where the origin of a body's shape was placed, as text."""
    return f"({', '.join(f'{value:.4g}' for value in body.site[:dimension])})"


def _distance_text(one: Overlap) -> str:
    i, j = one.nodes
    return f"distance = {one.distance:.3g} m between their nodes {i} and {j}"
