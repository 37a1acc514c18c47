"""What is checked before the first step: time step, overlapping bodies, ids, container."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .diagnostics import StopCriterion
from .errors import InputError, InputErrors
from .geometry import make_shape
from .plausibility import plausibility_warnings

if TYPE_CHECKING:
    from .model import DEMModel, Particle

FloatArray = NDArray[np.float64]

CLOSEST = 0.5
"""Nodes of two bodies overlap when they are closer than this times their contact radius.

Bodies at rest on each other are a little below the contact radius; nodes of the decks of the
original start at 1.03 times it or farther. At half of it the repulsion is that of a crash.
"""

CONTACT_MARGIN = 1.5
"""From this multiple on, a time step above the limit of a full contact is a warning."""

_MOST_REPORTED = 5
_MOST_DISTANCES = 4_000_000  # at once, to bound the memory
_INSIDE = 1e-6  # least barycentric coordinate of a node inside an element
_HOLLOW = (
    "complex",
    "rectangle_minus_rectangle",
    "cuboid_minus_cuboid",
    "annulus_circle",
    "annulus_rectangle",
)
_SIMPLICES = {
    "triangle": ((0, 1, 2),),
    "quad": ((0, 1, 2), (0, 2, 3)),
    "tetra": ((0, 1, 2, 3),),
}


def check_model(model: DEMModel, *, strict: bool = False, allow_overlap: bool = False) -> list[str]:
    """Check a model before its first step.

    Parameters
    ----------
    model : DEMModel
        The model.
    strict : bool
        Refuse a time step above the estimated stable one instead of warning.
    allow_overlap : bool
        Accept bodies that overlap at the start.

    Returns
    -------
    list of str
        Warnings: nodes without neighbours, a horizon wider than a body, a time step above
        the estimated stable one, particles outside the container, outputs without content.

    Raises
    ------
    InputError
        If bodies overlap, more than half of a body's nodes have no neighbour or, with
        `strict`, if the time step is too large; all of it at once.
    """
    problems = InputErrors()
    warnings = []
    with problems.collect():
        warnings += unbonded_warnings(model)
    warnings += wide_horizon_warnings(model)
    if not allow_overlap:
        with problems.collect():
            _refuse_overlaps(model)
    unstable = time_step_warnings(model)
    if strict and unstable:
        with problems.collect():
            raise InputError("\n".join(unstable))
    problems.raise_if_any()
    warnings += unstable
    outside = container_warning(model)
    if outside is not None:
        warnings.append(outside)
    return warnings + effect_warnings(model) + plausibility_warnings(model)


def effect_warnings(model: DEMModel) -> list[str]:
    """Return warnings about outputs that this model cannot give."""
    deck, warnings = model.deck, []
    if deck.output.output_criteria is not None and not StopCriterion.serves(model):
        warnings.append(
            f"{deck.where('Output.Output_Criteria')}: Output.Output_Criteria.Type = "
            "max_particle_dist: is about Test_Name: two_particle and never met without it; "
            "use max_node_dist"
        )
    if "Strain_Stress" not in deck.output.tags:
        return warnings
    where = f"{deck.where('Output.Tags')}: Output.Tags: Strain_Stress"
    if all(cell_type in ("none", "line") for cell_type, _ in model.cells):
        warnings.append(f"{where}: no body has elements, so none is written; give a .msh mesh")
    for zone, material in enumerate(deck.materials):
        try:
            material.constants()
        except ValueError:
            warnings.append(
                f"{where}: the stress of Zone_{zone + 1} is not known and written as NaN; give E "
                f"or K in Material.Zone_{zone + 1}"
            )
    return warnings


def time_step_warnings(model: DEMModel) -> list[str]:
    """Return warnings about a time step above the estimated limits, of bonds or of contact.

    The contact limit is on the safe side: up to `CONTACT_MARGIN` times it is a matter of
    `contact_time_step_note`.
    """
    limit = model.stable_time_step()
    warnings = []
    if model.dt > limit.bonds:
        warnings.append(_time_step_text(model, limit.bonds, "the estimated stable one"))
    if limit.contact < limit.bonds and model.dt > CONTACT_MARGIN * limit.contact:
        text = _time_step_text(
            model, limit.contact, "the estimated stable one of two nodes in full contact"
        )
        warnings.append(f"{text}, or a smaller Kn")
    return warnings


def contact_time_step_note(model: DEMModel) -> str | None:
    """Return a note when the time step is a little above the limit of contact, else None."""
    limit = model.stable_time_step()
    if not limit.contact < model.dt <= min(limit.bonds, CONTACT_MARGIN * limit.contact):
        return None
    what = "the estimated stable one of two nodes in full contact"
    return (
        f"{_time_step_text(model, limit.contact, what)} if bodies rebound too fast (the estimate "
        f"is on the safe side: from {CONTACT_MARGIN:g} times it on this is a warning)"
    )


def _time_step_text(model: DEMModel, limit: float, what: str) -> str:
    if model.scripted:
        return (
            f"dt = {model.dt:.4g} s: is above {what}, {limit:.3g} s; give a smaller one, or leave "
            "it out"
        )
    needed = model.deck.model.final_time / limit if limit > 0 else np.inf
    remedy = f"use at least {int(np.ceil(needed))}" if needed < 1e15 else "check the material"
    return (
        f"{model.deck.where('Model.Time_Steps')}: Model.Time_Steps = {model.n_steps}: the time "
        f"step {model.dt:.4g} s is above {what}, {limit:.3g} s; {remedy}"
    )


def unbonded_warnings(model: DEMModel) -> list[str]:
    """Return warnings about nodes without neighbours in bodies that can move.

    Raises
    ------
    InputError
        If more than half of a body's nodes have none.
    """
    unbonded = np.diff(model.bonds.offsets) == 0
    counts: dict[int, int] = {}  # by zone
    refused: dict[int, str] = {}
    for body in model.particles:
        lone = int(unbonded[body.start : body.stop].sum())
        if body.constrained or not lone:
            continue
        counts[body.zone] = counts.get(body.zone, 0) + lone
        if 2 * lone > body.stop - body.start:
            text = f"{lone} of the {body.stop - body.start} nodes of body {body.id}"
            refused.setdefault(body.zone, _unbonded_text(model, body, text))
    if refused:
        raise InputError("\n".join(refused.values()))
    first = {zone: next(b for b in model.particles if b.zone == zone) for zone in counts}
    return [
        _unbonded_text(model, first[zone], f"{count} node{'s' if count > 1 else ''} of the zone")
        for zone, count in counts.items()
    ]


def wide_horizon_warnings(model: DEMModel) -> list[str]:
    """Return a warning for each zone whose horizon reaches across a whole body that can move."""
    wide: dict[int, str] = {}
    for body in model.particles:
        if body.constrained or body.horizon <= 2 * body.bounding_radius:
            continue
        key = f"Material.Zone_{body.zone + 1}.Horizon"
        wide.setdefault(
            body.zone,
            f"{model.deck.where(key)}: {key}: the horizon {body.horizon:.3g} m is wider than body "
            f"{body.id}, of radius {body.bounding_radius:.3g} m: every node is bonded to every "
            f"other; usual is 3 to 4 mesh sizes, {3 * body.mesh_size:.3g} to "
            f"{4 * body.mesh_size:.3g} m: check the unit",
        )
    return list(wide.values())


def _unbonded_text(model: DEMModel, body: Particle, nodes: str) -> str:
    zone = f"Material.Zone_{body.zone + 1}"
    by_ratio = model.deck.materials[body.zone].horizon_mesh_ratio is not None
    key = f"{zone}.Horizon_Mesh_Ratio" if by_ratio else f"{zone}.Horizon"
    have = "has" if nodes.startswith("1 node ") else "have"
    return (
        f"{model.deck.where(key)}: {key}: {nodes} {have} no neighbour within the horizon "
        f"{body.horizon:.3g} m and no forces hold them (smallest node distance h = "
        f"{body.mesh_size:.3g} m); use a larger horizon, or make the mesh more even"
    )


def container_warning(model: DEMModel) -> str | None:
    """Return a warning when centres of particles lie outside the container, else None.

    Walls may lie outside. A container with a hole, which draws a wall, is taken as its box.
    """
    container = model.deck.container
    if container is None or container.geometry.parameters is None:
        return None
    keys = container.geometry
    shape = make_shape(
        keys.type, container.geometry.parameters, keys.vec_type, keys.vec_flag, model.dimension
    )
    particles = [body for body in model.particles if body.type == "particle"]
    centers = np.array([body.center for body in particles]).reshape(-1, 3)
    if keys.type in _HOLLOW:
        lower, upper = shape.box
        inside = np.all((centers >= lower) & (centers <= upper), axis=1)
    else:
        inside = shape.inside(centers)
    outside = [body.id for body, within in zip(particles, inside, strict=True) if not within]
    if not outside:
        return None
    names = ", ".join(str(k) for k in outside[:_MOST_REPORTED])
    if len(outside) > _MOST_REPORTED:
        names += f" and {len(outside) - _MOST_REPORTED} more"
    return (
        f"{model.deck.where('Container.Geometry')}: Container.Geometry: the centre of body "
        f"{names} is outside; correct the container or the places"
    )


@dataclass(frozen=True)
class Overlap:
    """Two bodies that overlap at the start.

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
    bodies = model.particles
    if len(bodies) < 2:
        return []
    x = model.state.x_ref
    starts = [body.start for body in bodies]
    boxes = np.stack([np.minimum.reduceat(x, starts), np.maximum.reduceat(x, starts)], axis=1)
    finder = _Finder(model, bodies, x, boxes)
    found = (finder.overlap(p, q) for p, q in finder.near_pairs())
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
        self.margin = CLOSEST * max(self._radius.values(), default=0.0)

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

    def overlap(self, p: int, q: int) -> Overlap | None:
        """How two bodies overlap; None when they do not."""
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
        if not inside and not distance < CLOSEST * radius:
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


def _refuse_overlaps(model: DEMModel) -> None:
    overlaps = find_overlaps(model)
    if not overlaps:
        return
    lines = [_overlap_text(model, one) for one in overlaps[:_MOST_REPORTED]]
    rest = len(overlaps) - _MOST_REPORTED
    if rest > 0:
        lines.append(f"{model.deck.path.name}: and {rest} more pairs of bodies overlap")
    raise InputError("\n".join(lines))


def _overlap_text(model: DEMModel, one: Overlap) -> str:
    p, q = one.bodies
    if one.inside:
        rule = (
            "a node of one lies inside an element of the other (distance = "
            f"{one.distance:.3g} m between their nodes {one.nodes[0]} and {one.nodes[1]})"
        )
    else:
        rule = (
            f"distance = {one.distance:.3g} m between their nodes {one.nodes[0]} and "
            f"{one.nodes[1]}: must be at least {CLOSEST:g} of the contact radius {one.radius:.3g} m"
        )
    who = f"{model.bodies[p].where}: bodies {p} and {q} (from {model.bodies[q].where})"
    if model.scripted:
        who = " and ".join(f"{model.bodies[k].where} at {_place(model, k)}" for k in one.bodies)
    return (
        f"{who} overlap at the start: {rule}; move or shrink one of them, or go on with "
        "--allow-overlap (allow_overlap=True)"
    )


def _place(model: DEMModel, k: int) -> str:
    """Where the origin of a body's shape was placed, as text."""
    site = model.bodies[k].site[: model.dimension]
    return f"({', '.join(f'{value:.4g}' for value in site)})"
