"""What is checked before the first step: time step, overlapping bodies, ids, container."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .diagnostics import StopCriterion
from .errors import InputError, InputErrors
from .geometry import make_shape
from .overlaps import Overlap, find_touching, overlap_lines, touching_warnings
from .plausibility import plausibility_warnings

if TYPE_CHECKING:
    from .model import DEMModel, Particle

CONTACT_MARGIN = 1.5
"""From this multiple on, a time step above the limit of a full contact is a warning."""

_MOST_REPORTED = 5
_HOLLOW = (
    "complex",
    "rectangle_minus_rectangle",
    "cuboid_minus_cuboid",
    "annulus_circle",
    "annulus_rectangle",
)


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
        the estimated stable one, bodies that start in contact, particles outside the container,
        outputs without content.

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
    touching: list[Overlap] = []
    if not allow_overlap:
        with problems.collect():
            touching = find_touching(model)
            if overlaps := [one for one in touching if one.refused]:
                raise InputError("\n".join(overlap_lines(model, overlaps)))
    unstable = time_step_warnings(model)
    if strict and unstable:
        with problems.collect():
            raise InputError("\n".join(unstable))
    problems.raise_if_any()
    warnings += unstable + touching_warnings(model, touching)
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
    `time_step_notes`.
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


def time_step_notes(model: DEMModel) -> list[str]:
    """Return notes about a time step above limits that only matter if something happens.

    A little above that of contact, and above that of the springs between the ends of broken bonds.
    """
    limit = model.stable_time_step()
    notes = []
    if limit.contact < model.dt <= min(limit.bonds, CONTACT_MARGIN * limit.contact):
        what = "the estimated stable one of two nodes in full contact"
        notes.append(
            f"{_time_step_text(model, limit.contact, what)} if bodies rebound too fast (the "
            f"estimate is on the safe side: from {CONTACT_MARGIN:g} times it on this is a warning)"
        )
    if limit.self_contact < 0.99 * min(limit.bonds, limit.contact, model.dt):
        what = "the estimated stable one of the springs between the ends of broken bonds"
        notes.append(
            f"{_time_step_text(model, limit.self_contact, what)} if bonds break and their ends "
            "are pressed together"
        )
    return notes


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
