"""What a model is allowed to be but hardly ever is: units mixed up, a stray body, few bonds.

Each rule is a warning that says the number, what is usual and what to look at. The limits lie well
outside of what materials, meshes and drums have, so that a warning is worth reading.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from .model import DEMModel, Particle

__all__ = ["long_run_warnings", "plausibility_warnings"]

DENSITIES = (10.0, 25_000.0)
"""Densities [kg/m^3] of solids: an aerogel, and a little above osmium."""

MODULI = (1e3, 5e12)
"""Young's moduli [Pa] of solids: a soft gel, and a little above diamond."""

LEAST_STRETCH = 1e-6
"""Critical stretch, about sqrt(Gc/(K horizon)), below which a grain breaks when it is looked at."""

MOST_FRICTION = 2.0
"""Coefficient of friction: that of rubber on rubber is 1 to 1.5."""

SIZES = (1e-6, 100.0)
"""Radii [m] of grains."""

MEAN_BONDS = {2: 8.0, 3: 16.0}
"""Bonds of a node, on the average of a body, by dimension: half of those of a horizon of 2 h."""

_ENOUGH_NODES = 50  # of a body, so that its edge does not decide the average

FAR = 100.0
"""A body is far from all others at this many diameters of the largest grain."""

MOST_STEPS = 5_000_000
"""Steps of a run: the drum of the examples takes 50 000, the decks of the original a million."""


def plausibility_warnings(model: DEMModel) -> list[str]:
    """Return warnings about numbers that are allowed but hardly ever meant.

    Parameters
    ----------
    model : DEMModel
        A model with its bonds.
    """
    bodies = model.particles
    first: dict[int, Particle] = {}
    for body in bodies:
        first.setdefault(body.zone, body)
    return [
        *_materials(model, first),
        *_friction(model),
        *_sizes(model, bodies),
        *_few_bonds(model, first),
        *_stray_bodies(model, bodies),
    ]


def long_run_warnings(model: DEMModel, last: int) -> list[str]:
    """Return a warning when a run is longer than any is meant to be.

    Parameters
    ----------
    model : DEMModel
        The model.
    last : int
        Step to stop after.
    """
    if last - model.n <= MOST_STEPS:
        return []
    return [
        f"run of {last - model.n:.3g} steps of {model.dt:.3g} s: more than {MOST_STEPS:.0e} are "
        "rarely meant: check the time to stop at (in s), stiffnesses (Pa) and mesh sizes (m): the "
        "time step is about a mesh size over the speed of sound"
    ]


def _key(model: DEMModel, key: str) -> str:
    return f"{model.deck.where(key)}: {key}"


def _materials(model: DEMModel, first: dict[int, Particle]) -> Iterator[str]:
    for zone, body in first.items():
        material, name = model.deck.materials[zone], f"Material.Zone_{zone + 1}"
        if not DENSITIES[0] <= material.density <= DENSITIES[1]:
            yield (
                f"{_key(model, f'{name}.Density')} = {material.density:g}: that of solids is "
                f"between {DENSITIES[0]:g} and {DENSITIES[1]:g} kg/m^3: check the unit"
            )
        try:
            constants = material.constants()
        except ValueError:  # a bond-based law whose constants are given directly
            continue
        if not MODULI[0] <= constants.e <= MODULI[1]:
            yield (
                f"{_key(model, f'{name}.E')} = {constants.e:g}: Young's modulus of solids is "
                f"between {MODULI[0]:.0e} and {MODULI[1]:.0e} Pa: check the unit"
            )
        stretch = None
        if constants.gc is not None:
            stretch = np.sqrt(constants.gc / (constants.k * body.horizon))
        if stretch is not None and stretch < LEAST_STRETCH:
            yield (
                f"{_key(model, f'{name}.Gc')} = {constants.gc:g}: bonds break at a stretch of "
                f"about {stretch:.1g}, usual is {1e2 * LEAST_STRETCH:g} and more: check the unit "
                "(J/m^2)"
            )


def _friction(model: DEMModel) -> Iterator[str]:
    said = set()
    for (i, j), contact in sorted(model.deck.contacts.items()):
        value = contact.friction_coeff or 0.0
        if contact.friction_on and value > MOST_FRICTION and value not in said:
            said.add(value)
            yield (
                f"{_key(model, f'Contact.Zone_{i + 1}{j + 1}.Friction_Coeff')} = {value:g}: "
                f"coefficients of friction are hardly above {MOST_FRICTION:g}: check it"
            )


def _sizes(model: DEMModel, bodies: Sequence[Particle]) -> Iterator[str]:
    said = set()
    for body in bodies:
        odd = not SIZES[0] <= body.bounding_radius <= SIZES[1]
        if body.type == "wall" or not odd or body.zone in said:
            continue
        said.add(body.zone)
        yield (
            f"{_key(model, f'Particle.Zone_{body.zone + 1}')}: the radius of body {body.id} is "
            f"{body.bounding_radius:.3g} m: grains have {SIZES[0]:g} to {SIZES[1]:g} m: check the "
            "unit"
        )


def _few_bonds(model: DEMModel, first: dict[int, Particle]) -> Iterator[str]:
    least = MEAN_BONDS[model.dimension]
    for zone, body in first.items():
        nodes = body.stop - body.start
        mean = body.n_bonds / nodes
        if body.constrained or nodes < _ENOUGH_NODES or mean >= least:
            continue
        material = model.deck.materials[zone]
        by = "Horizon" if material.horizon_mesh_ratio is None else "Horizon_Mesh_Ratio"
        yield (
            f"{_key(model, f'Material.Zone_{zone + 1}.{by}')}: the horizon {body.horizon:.3g} m "
            f"gives a node of body {body.id} {mean:.1f} bonds on average: below {least:g} "
            "stiffness and cracks follow the lines of the mesh; usual is a horizon of 3 to 4 mesh "
            "sizes"
        )


def _stray_bodies(model: DEMModel, bodies: Sequence[Particle]) -> Iterator[str]:
    grains = [body for body in bodies if body.type == "particle"]
    if len(bodies) < 2 or not grains:
        return
    reach = FAR * 2 * max(body.bounding_radius for body in grains)
    x = model.state.x_ref
    starts = [body.start for body in bodies]
    lower, upper = np.minimum.reduceat(x, starts), np.maximum.reduceat(x, starts)
    if np.all(np.ptp(x, axis=0) <= reach):
        return
    for body, low, high in list(zip(bodies, lower, upper, strict=True))[::-1]:
        if body.id == 0 and len(bodies) == 2:  # the other one has been told of
            return
        gaps = np.linalg.norm(np.maximum(np.maximum(lower - high, low - upper), 0.0), axis=1)
        gaps[body.id] = np.inf
        if gaps.min() > reach:
            yield (
                f"{model.bodies[body.id].where}: body {body.id} is {gaps.min():.3g} m from every "
                f"other body, more than {FAR:g} diameters of the largest grain: check the unit of "
                "its place"
            )
