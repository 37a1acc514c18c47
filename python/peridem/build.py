"""From a deck to the core's model: zones, bodies, contact, loads."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from . import _core
from .deck import Contact, Deck, Material, ParticleZone
from .errors import InputError
from .geometry import Shape, make_shape
from .loads import amplitude, empty_selection_warning, select_nodes
from .mesh import Mesh, read_mesh, uniform_rectangle_mesh
from .placement import Placement, read_particle_locations

SMALLEST_VOLUME = 0.01
"""A mesh is refused when a nodal volume is below this times h^d, as in the original."""

SMALLEST_SIZE, LARGEST_SIZE = 1e-20, 1e20
"""Bounds [m] on the size of a body: fifth powers of lengths must be numbers."""

FARTHEST = 1e8
"""Largest distance of a body from the origin, by its size."""

MOST_REPORTED = 20

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
class BodyPlan:
    """Where a body comes from.

    Attributes
    ----------
    zone : int
        Zone, counted from 0.
    shape : Shape or None
        Shape on the reference mesh.
    site : tuple of float
        Translation [m].
    scale, angle : float
        Scale and rotation [rad] about `axis` of the reference mesh.
    where : str
        File and line the body is from.
    axis : tuple of float
        Axis of the rotation, of any length.
    """

    zone: int
    shape: Shape | None
    site: tuple[float, float, float]
    scale: float
    angle: float
    where: str
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)

    @property
    def box(self) -> NDArray[np.float64]:
        """Corners, shape (2, 3) [m], of the box of the body's shape; infinite without shape."""
        if self.shape is None:
            return np.array([[-np.inf] * 3, [np.inf] * 3])
        return np.asarray(self.site) + self.scale * np.array(self.shape.box)


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
    """

    core: Any
    meshes: list[Mesh]
    bodies: list[BodyPlan]
    warnings: list[str]


def build_model(deck: Deck, *, threads: int, compatibility: str | None = None) -> BuiltModel:
    """Build the core model of a deck.

    Parameters
    ----------
    deck : Deck
        The deck.
    threads : int
        Number of threads, at least 1.
    compatibility : {"original", "corrected"}, optional
        Overrides ``Model.Compatibility`` of the deck.

    Returns
    -------
    BuiltModel

    Raises
    ------
    InputError
        If meshes, placement or loads break a rule.
    """
    meshes = _read_meshes(deck)
    bodies = _place_bodies(deck)
    core_deck = _core.ModelDeck()
    core_deck.dimension = deck.model.dimension
    core_deck.final_time = deck.model.final_time
    core_deck.time_steps = deck.model.time_steps
    core_deck.time_scheme = _core.TimeScheme[deck.model.discretization_type.time]
    core_deck.compatibility = _core.Compatibility[compatibility or deck.model.compatibility]
    core_deck.gravity = deck.gravity
    core_deck.meshes = [_core_mesh(mesh) for mesh in meshes]
    core_deck.zones = [_core_zone(deck, zone, meshes[zone]) for zone in range(deck.n_zones)]
    core_deck.bodies = [_core_body(deck, k, body) for k, body in enumerate(bodies)]
    if len(bodies) > 1 or any(contact.self_contact for contact in deck.contacts.values()):
        core_deck.contacts = _core_contacts(deck)
    _check_places(deck, bodies, meshes)
    try:
        core = _core.DEMModel(core_deck, threads)
    except InputError as error:
        raise InputError(f"{deck.path.name}: {error}") from error
    _check_bodies(deck, core, meshes)
    warnings: list[str] = []
    _add_loads(deck, core, bodies, warnings)
    return BuiltModel(core=core, meshes=meshes, bodies=bodies, warnings=warnings)


def _read_meshes(deck: Deck) -> list[Mesh]:
    found: dict[Path, Mesh] = {}
    meshes = []
    for zone, entry in enumerate(deck.meshes):
        key = f"Mesh.Zone_{zone + 1}"
        if entry.creates:
            meshes.append(_created_mesh(deck, zone))
            continue
        assert entry.file is not None
        if entry.file not in found:
            try:
                found[entry.file] = read_mesh(entry.file, deck.model.dimension)
            except InputError as error:
                raise InputError(f"{error} ({deck.where(f'{key}.File')}: {key}.File)") from error
        meshes.append(found[entry.file])
    return meshes


def _created_mesh(deck: Deck, zone: int) -> Mesh:
    entry = deck.meshes[zone]
    assert entry.create_mesh is not None and entry.mesh_size is not None
    geometry = entry.create_mesh.geometry or deck.particles[zone]
    shape = _shape(deck, geometry, f"Mesh.Zone_{zone + 1}.CreateMesh")
    assert shape is not None
    (x0, y0, z0), (x1, y1, z1) = shape.box
    where = f"{deck.where(f'Mesh.Zone_{zone + 1}')}: Mesh.Zone_{zone + 1}"
    return uniform_rectangle_mesh(x0, y0, z0, x1, y1, z1, entry.mesh_size, where=where)


def _shape(deck: Deck, keys: Any, path: str) -> Shape | None:
    if keys is None or keys.type is None or keys.parameters is None:
        return None
    where = f"{deck.where(path)}: {path}"
    dimension = deck.model.dimension
    return make_shape(
        keys.type, keys.parameters, keys.vec_type, keys.vec_flag, dimension, where=where
    )


def _zone_shape(deck: Deck, zone: int) -> Shape | None:
    """Shape of a zone's reference mesh."""
    reference = deck.meshes[zone].reference_particle
    if reference is not None:
        return _shape(deck, reference, f"Mesh.Zone_{zone + 1}.Reference_Particle")
    return _shape(deck, deck.particles[zone], f"Particle.Zone_{zone + 1}")


def _place_bodies(deck: Deck) -> list[BodyPlan]:
    """Bodies zone by zone, in the order of the placement file inside a zone."""
    shapes = [_zone_shape(deck, zone) for zone in range(deck.n_zones)]
    if deck.single_particle:
        return [BodyPlan(0, shapes[0], (0.0, 0.0, 0.0), 1.0, 0.0, deck.where("Mesh.Zone_1"))]
    placements = _read_placements(deck)
    bodies = []
    for zone in range(deck.n_zones):
        if _is_created(deck.particles[zone]):
            where = deck.where(f"Particle.Zone_{zone + 1}")
            bodies.append(BodyPlan(zone, shapes[zone], (0.0, 0.0, 0.0), 1.0, 0.0, where))
        else:
            own = [placement for placement in placements if placement.zone == zone]
            bodies += _bodies_of_zone(deck, zone, shapes[zone], own)
    return bodies


def _is_created(particle: ParticleZone | None) -> bool:
    return particle is not None and particle.create_from_geometry


def _read_placements(deck: Deck) -> list[Placement]:
    generation = deck.particle_generation
    if generation is None:
        return []
    placements = read_particle_locations(
        generation.file, generation.data_type, deck.n_zones, dimension=deck.model.dimension
    )
    for placement in placements:
        if _is_created(deck.particles[placement.zone]):
            raise InputError(
                f"{generation.file}:{placement.line}: i = {placement.zone}: Zone_"
                f"{placement.zone + 1} is one body made from its mesh "
                "(Create_Particle_Using_ParticleZone_GeomObject); remove the line or the key"
            )
    return placements


def _bodies_of_zone(
    deck: Deck, zone: int, shape: Shape | None, placements: list[Placement]
) -> list[BodyPlan]:
    if not placements:
        raise deck.error(
            f"Particle.Zone_{zone + 1}",
            "no line of the placement file belongs to the zone; add one, or remove the zone",
        )
    if shape is None or shape.scale_length is None:
        raise deck.error(
            f"Particle.Zone_{zone + 1}",
            "bodies of this shape cannot be scaled to a radius; use "
            "Create_Particle_Using_ParticleZone_GeomObject: true",
        )
    assert deck.particle_generation is not None
    angles = _orientations(deck, placements)
    return [
        BodyPlan(
            zone=zone,
            shape=shape,
            site=placement.site,
            scale=placement.radius / shape.scale_length,
            angle=angle,
            axis=placement.axis,
            where=f"{deck.particle_generation.file}:{placement.line}",
        )
        for placement, angle in zip(placements, angles, strict=True)
    ]


def _orientations(deck: Deck, placements: list[Placement]) -> list[float]:
    """Angles [rad] of a zone's bodies: given, or drawn as the original draws them."""
    if all(placement.orientation is not None for placement in placements):
        return [float(placement.orientation or 0.0) for placement in placements]
    if deck.test_name == "two_particle":
        return [i * np.pi for i in range(len(placements))]
    return random_orientations(deck.model.seed, len(placements))


def random_orientations(seed: int, n: int) -> list[float]:
    """Angles in [0, 2 pi) as drawn by std::mt19937 and std::uniform_real_distribution.

    Parameters
    ----------
    seed : int
        Seed of the generator.
    n : int
        Number of angles [rad].
    """
    # 53 random bits from two draws of 32, the first one low: generate_canonical of libstdc++.
    draws = np.random.RandomState(seed).randint(0, 2**32, size=(n, 2), dtype=np.uint32)
    canonical = (draws[:, 0] + draws[:, 1] * 2.0**32) / 2.0**64
    return [float(value) for value in canonical * (2 * np.pi)]


def _core_mesh(mesh: Mesh) -> Any:
    volumes = [] if mesh.volumes is None else list(mesh.volumes)
    return _core.Mesh(mesh.points, _core.CellType[mesh.cell_type], mesh.cells.ravel(), volumes)


def _core_zone(deck: Deck, zone: int, mesh: Mesh) -> Any:
    result = _core.ZoneDeck()
    particle = deck.particles[zone]
    shape = _zone_shape(deck, zone)
    result.name = f"Zone_{zone + 1}"
    result.is_wall = bool(deck.zones[zone].is_wall)
    result.all_dofs_constrained = particle is not None and particle.all_dofs_constrained
    result.mesh = zone
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
    return [
        _core_contact(deck.contacts.get((min(i, j), max(i, j)))) for i in range(n) for j in range(n)
    ]


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


def _check_places(deck: Deck, bodies: list[BodyPlan], meshes: list[Mesh]) -> None:
    """Positions of a body's nodes must differ, and their distances have squares."""
    problems = []
    for k, body in enumerate(bodies):
        size = body.scale * float(np.ptp(meshes[body.zone].points, axis=0).max())
        if not SMALLEST_SIZE < size < LARGEST_SIZE:
            problems.append(
                f"{body.where}: body {k} of Zone_{body.zone + 1}: size = {size:g} m after scaling "
                f"by {body.scale:g}: must be between {SMALLEST_SIZE:g} and {LARGEST_SIZE:g} m; "
                f"correct its radius, or Parameters in {deck.path.name}"
            )
        elif not np.abs(body.site).max() < FARTHEST * size:
            problems.append(
                f"{body.where}: body {k}: place = {body.site}: must be within {FARTHEST:g} times "
                f"its size {size:g} m of the origin, or its nodes cannot be told apart; correct it"
            )
    if problems:
        raise InputError("\n".join(problems[:MOST_REPORTED]))


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


def _add_loads(deck: Deck, core: Any, bodies: list[BodyPlan], warnings: list[str]) -> None:
    for k, load in enumerate(deck.displacement_sets):
        loaded = _core.DisplacementSet()
        _fill_set(deck, core, bodies, warnings, load, loaded, f"Displacement_BC.Set_{k + 1}")
        loaded.zero_displacement = load.zero_displacement
        loaded.rotation_axis = load.time_function.rotation_axis or (0.0, 0.0, 1.0)
        _named(deck, f"Displacement_BC.Set_{k + 1}", core.add_displacement_set, loaded)
    for k, force in enumerate(deck.force_sets):
        pushed = _core.ForceSet()
        _fill_set(deck, core, bodies, warnings, force, pushed, f"Force_BC.Set_{k + 1}")
        _named(deck, f"Force_BC.Set_{k + 1}", core.add_force_set, pushed)
    velocity = deck.initial_velocity
    if velocity is not None:
        initial = _core.InitialVelocity()
        for body in velocity.particle_list or ():
            if body >= len(bodies):
                raise deck.error(
                    "IC.Constant_Velocity.Particle_List",
                    f"no body {body}: the deck has bodies 0 to {len(bodies) - 1}; correct the list",
                )
        initial.bodies = list(velocity.particle_list or ())
        initial.velocity = tuple(velocity.velocity_vector)
        core.add_initial_velocity(initial)


def _named(deck: Deck, path: str, call: Callable[[Any], None], argument: Any) -> None:
    try:
        call(argument)
    except InputError as error:
        raise InputError(f"{deck.where(path)}: {path}: {error}") from error


def _fill_set(
    deck: Deck,
    core: Any,
    bodies: list[BodyPlan],
    warnings: list[str],
    load: Any,
    result: Any,
    path: str,
) -> None:
    """Nodes, amplitudes, directions and time function of a load set."""
    where = f"{deck.where(path)}: {path}"
    region = load.region
    shape = None if region is None else _shape(deck, region.geometry, f"{path}.Region.Geometry")
    x_ref, ids = core.state.x_ref, core.state.particle_id
    nodes = select_nodes(load, x_ref, ids, shape, where=where)
    warning = empty_selection_warning(load, nodes, shape, where=where)
    if warning is not None:
        warnings.append(warning)
    time = load.time_function
    rotates = time.type == "rotation"
    if rotates:
        values = np.ones(len(nodes))
    else:
        if shape is None:
            boxes = np.array([bodies[k].box for k in ids[nodes]]).reshape(-1, 2, 3)
        else:
            boxes = np.broadcast_to(np.array(shape.box), (len(nodes), 2, 3))
        kind: Literal["displacement", "force"] = (
            "displacement" if path.startswith("Displacement") else "force"
        )
        values = amplitude(load, kind, x_ref[nodes], boxes, where=where)
    result.nodes = [int(node) for node in nodes]
    result.amplitude = [float(value) for value in values]
    result.directions = sum(1 << (d - 1) for d in load.direction)
    result.time_function = _core.TimeFunction(
        _core.TimeFunctionType[time.type], list(time.parameters)
    )
