"""From a deck to the core's model: zones, bodies, contact, loads."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from . import _core
from .bodies import BodyPlan, check_places, check_test, place_bodies, shape_of, zone_shape
from .deck import Contact, Deck, Material
from .errors import InputError, InputErrors
from .loading import LoadBuilder
from .mesh import Mesh, read_mesh, uniform_rectangle_mesh
from .outside import NodeValues, Outside
from .placement import Placement

SMALLEST_VOLUME = 0.01
"""A mesh is refused when a nodal volume is below this times h^d, as in the original."""

_MATERIALS = {
    "PDState": _core.MaterialType.pd_state,
    "PMBBond": _core.MaterialType.pmb_bond,
    "RNPBond": _core.MaterialType.rnp_bond,
    "PDElasticBond": _core.MaterialType.pd_elastic_bond,
}
_INFLUENCES = (
    _core.InfluenceType.constant,
    _core.InfluenceType.linear,
    _core.InfluenceType.gaussian,
)


@dataclass(frozen=True)
class Held:
    """What a model made in Python holds itself, where a deck names files or has no words.

    Attributes
    ----------
    meshes : list of Mesh
        Reference mesh of each zone.
    placements : list of Placement
        Places of the bodies, zone by zone.
    outside : dict of (str, int) to Outside
        What a deck cannot say of its load sets, by kind (``displacement``, ``force``) and index.
    """

    meshes: list[Mesh]
    placements: list[Placement]
    outside: dict[tuple[str, int], Outside]


@dataclass(frozen=True)
class BuiltModel:
    """A core model with what the core does not keep.

    Attributes
    ----------
    core : _core.DEMModel
        The model, loads added, `init` not yet called.
    meshes : list of Mesh
        Reference mesh of each zone.
    bodies : list of BodyPlan
        In the order of the body ids.
    warnings : list of str
        What the user should know, with file and line.
    functions : list of NodeValues
        Functions of time that the core calls; it does not keep them alive.
    """

    core: Any
    meshes: list[Mesh]
    bodies: list[BodyPlan]
    warnings: list[str]
    functions: list[NodeValues]


def build_model(
    deck: Deck,
    *,
    threads: int,
    compatibility: str | None = None,
    held: Held | None = None,
) -> BuiltModel:
    """Build the core model of a deck.

    Parameters
    ----------
    deck : Deck
        The deck.
    threads : int
        Number of threads, at least 1.
    compatibility : {"original", "corrected"}, optional
        Overrides ``Model.Compatibility`` of the deck.
    held : Held, optional
        Meshes, places and loads of a model made in Python; read from the deck's files without.

    Returns
    -------
    BuiltModel

    Raises
    ------
    InputError
        If meshes, placement or loads break a rule: all that meshes and placement file break at
        once, then all that horizons, volumes, loads and ids do.
    """
    if held is None:
        meshes, bodies = _read_files(deck)
    else:
        meshes, bodies = held.meshes, place_bodies(deck, held.placements)
    core_deck = _core.ModelDeck()
    core_deck.dimension = deck.model.dimension
    core_deck.final_time = deck.model.final_time
    core_deck.time_steps = deck.model.time_steps
    core_deck.time_scheme = _core.TimeScheme[deck.model.discretization_type.time]
    core_deck.compatibility = _core.Compatibility[compatibility or deck.model.compatibility]
    core_deck.gravity = deck.gravity
    distinct = {id(mesh): mesh for mesh in meshes}
    core_deck.meshes = [_core_mesh(mesh) for mesh in distinct.values()]
    numbers = {key: number for number, key in enumerate(distinct)}
    core_deck.zones = [
        _core_zone(deck, zone, mesh, numbers[id(mesh)]) for zone, mesh in enumerate(meshes)
    ]
    core_deck.bodies = [_core_body(deck, k, body) for k, body in enumerate(bodies)]
    if len(bodies) > 1 or any(contact.self_contact for contact in deck.contacts.values()):
        core_deck.contacts = _core_contacts(deck)
    check_places(deck, bodies, meshes)
    try:
        core = _core.DEMModel(core_deck, threads)
    except InputError as error:
        raise InputError(f"{deck.path.name}: {error}") from error
    problems = InputErrors()
    with problems.collect():
        _check_bodies(deck, core, meshes)
    with problems.collect():
        check_test(deck, len(bodies))
    loads = LoadBuilder(deck, core, bodies, {} if held is None else held.outside)
    with problems.collect():
        loads.add_all()
    problems.raise_if_any()
    return BuiltModel(core, meshes, bodies, loads.warnings, loads.functions)


def _read_files(deck: Deck) -> tuple[list[Mesh], list[BodyPlan]]:
    """Meshes of the zones and bodies of the placement file."""
    problems = InputErrors()
    found: dict[Path, Mesh | None] = {}
    meshes: list[Mesh | None] = []
    for zone, entry in enumerate(deck.meshes):
        mesh = None
        with problems.collect():
            if entry.file is None or entry.creates:
                mesh = _created_mesh(deck, zone)
            elif entry.file in found:
                mesh = found[entry.file]
            else:
                found[entry.file] = None  # what is wrong with it is said once
                mesh = found[entry.file] = _mesh_of_file(deck, zone, entry.file)
        meshes.append(mesh)
    bodies: list[BodyPlan] = []
    with problems.collect():
        bodies = place_bodies(deck)
    problems.raise_if_any()
    return [mesh for mesh in meshes if mesh is not None], bodies


def _mesh_of_file(deck: Deck, zone: int, file: Path) -> Mesh:
    try:
        return read_mesh(file, deck.model.dimension)
    except InputError as error:
        key = f"Mesh.Zone_{zone + 1}.File"
        raise InputError(f"{error} ({deck.where(key)}: {key})") from error


def _created_mesh(deck: Deck, zone: int) -> Mesh:
    entry = deck.meshes[zone]
    assert entry.create_mesh is not None and entry.mesh_size is not None
    geometry = entry.create_mesh.geometry or deck.particles[zone]
    shape = shape_of(deck, geometry, f"Mesh.Zone_{zone + 1}.CreateMesh")
    assert shape is not None
    (x0, y0, z0), (x1, y1, z1) = shape.box
    where = f"{deck.where(f'Mesh.Zone_{zone + 1}')}: Mesh.Zone_{zone + 1}"
    return uniform_rectangle_mesh(x0, y0, z0, x1, y1, z1, entry.mesh_size, where=where)


def _core_mesh(mesh: Mesh) -> Any:
    volumes = [] if mesh.volumes is None else list(mesh.volumes)
    return _core.Mesh(mesh.points, _core.CellType[mesh.cell_type], mesh.cells.ravel(), volumes)


def _core_zone(deck: Deck, zone: int, mesh: Mesh, number: int) -> Any:
    result = _core.ZoneDeck()
    particle = deck.particles[zone]
    shape = zone_shape(deck, zone)
    result.name = f"Zone_{zone + 1}"
    result.is_wall = bool(deck.zones[zone].is_wall)
    result.all_dofs_constrained = particle is not None and particle.all_dofs_constrained
    result.mesh = number
    if shape is None:
        center = 0.5 * (mesh.points.min(axis=0) + mesh.points.max(axis=0))
        radius = float(np.linalg.norm(mesh.points - center, axis=1).max())
    else:
        center, radius = shape.center, shape.bounding_radius
    result.center = tuple(center)
    result.bounding_radius = radius
    result.material = _core_material(deck.materials[zone])
    return result


def _number(value: float | None) -> float:
    return float("nan") if value is None else value


def _core_material(material: Material) -> Any:
    result = _core.MaterialDeck()
    result.type = _MATERIALS[material.type]
    result.density = material.density
    result.horizon = _number(material.horizon)
    result.horizon_mesh_ratio = _number(material.horizon_mesh_ratio)
    result.youngs_modulus = _number(material.young_modulus)
    result.bulk_modulus = _number(material.bulk_modulus)
    result.shear_modulus = _number(material.shear_modulus)
    result.poisson_ratio = _number(material.poisson_ratio)
    result.fracture_energy = _number(material.fracture_energy)
    result.critical_stress_factor = _number(material.fracture_toughness)
    if not material.compute_from_classical:
        result.law_parameters = list(material.bond_potential.parameters)
    result.bond_breaking = _core.BondBreaking[material.bond_breaking]
    result.irreversible_fracture = material.bond_potential.irreversible_bond_fracture
    result.check_sc_factor = material.bond_potential.check_sc_factor
    influence = _core.InfluenceDeck()
    influence.type = _INFLUENCES[material.influence_function.type]
    influence.parameters = list(material.influence_function.parameters)
    result.influence = influence
    return result


def _core_body(deck: Deck, index: int, body: BodyPlan) -> Any:
    result = _core.BodyDeck()
    result.zone = body.zone
    result.site = body.site
    result.scale = body.scale
    result.angle = body.angle
    result.axis = body.axis
    # The lower body of the test stands still.
    result.constrained = deck.test_name == "two_particle" and index == 0
    return result


def _core_contacts(deck: Deck) -> list[Any]:
    n = deck.n_zones
    made: dict[int, Any] = {}  # many pairs of zones may share a law
    contacts = [deck.contacts.get((min(i, j), max(i, j))) for i in range(n) for j in range(n)]
    for contact in contacts:
        if id(contact) not in made:
            made[id(contact)] = _core_contact(contact)
    return [made[id(contact)] for contact in contacts]


def _core_contact(contact: Contact | None) -> Any:
    result = _core.ContactDeck()
    if contact is None:  # two walls
        result.kn = 0.0
        return result
    result.contact_radius = _number(contact.contact_radius)
    result.contact_radius_factor = _number(contact.contact_radius_factor)
    result.kn = _number(contact.kn)
    result.kn_factor = contact.kn_factor
    result.damping_on = contact.damping_on
    result.epsilon = 1.0 if contact.epsilon is None else contact.epsilon
    result.beta_n_factor = contact.beta_n_factor
    result.friction_on = contact.friction_on
    result.friction_coeff = contact.friction_coeff or 0.0
    result.center_damping_criterion = _core.DampingCriterion[contact.center_damping_criterion]
    result.node_damping = contact.node_damping
    result.friction_model = _core.FrictionModel[contact.friction_model]
    if contact.tangential_stiffness_ratio is not None:
        result.tangential_stiffness_ratio = contact.tangential_stiffness_ratio
    result.self_contact = contact.self_contact
    return result


def _check_bodies(deck: Deck, core: Any, meshes: list[Mesh]) -> None:
    """Nodal volumes and horizon of the bodies against their mesh size."""
    problems = []
    for body in core.particles:
        zone = f"Zone_{body.zone + 1}"
        h, horizon = body.mesh_size, body.horizon
        if not horizon > h:
            problems.append(
                f"{deck.where(f'Material.{zone}.Horizon')}: Material.{zone}.Horizon = {horizon:g}: "
                f"must exceed the mesh size {h:g} of body {body.id}, or its nodes have no "
                f"neighbours; use {3 * h:.3g} to {4 * h:.3g}"
            )
        volumes = core.state.volume[body.start : body.stop]
        limit = SMALLEST_VOLUME * h**deck.model.dimension
        smallest = int(np.argmin(volumes))
        if not volumes[smallest] >= limit:
            problems.append(
                f"{meshes[body.zone].source}: node {smallest} (counted from 0): volume = "
                f"{volumes[smallest]:g}: must be at least {SMALLEST_VOLUME} "
                f"h^{deck.model.dimension} = {limit:g} with the smallest node distance h = {h:g}; "
                "make the mesh more even"
            )
    if problems:
        raise InputError("\n".join(dict.fromkeys(problems)))
