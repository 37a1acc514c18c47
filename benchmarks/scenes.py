"""Models to measure: equal grains, one body, and a box of mixed grains under a moving wall.

A scene becomes a core model at once (`core_model`), or a deck in a folder (`write_deck`) when
reading it is part of what is measured.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import meshes
import numpy as np
from meshes import FloatArray, LatticeMesh
from peridem import _core
from ruamel.yaml import YAML

RADIUS = 1e-3
"""Radius [m] of a grain, as in the paper's examples."""

CONTACT_RADIUS_FACTOR = 0.95

RUN_IN_FACTOR = 5.0

TOUCHING = 0.8
"""Distance of touching grains, in node distances: the contact radius is about 0.85 of them."""


@dataclass(frozen=True)
class Solid:
    """Constants of a material: K, G [Pa], rho [kg/m^3], Gc [J/m^2]."""

    bulk: float = 2.16e7
    shear: float = 1.296e7
    density: float = 1200.0
    fracture_energy: float = 50.0


PAPER = Solid()
COMPRESSION = Solid(5e3, 3e3, 600.0, 100.0)


@dataclass(frozen=True)
class Zone:
    """Bodies of one mesh and material; `shape` holds the keys of the deck."""

    mesh: LatticeMesh
    shape: dict[str, Any]
    horizon: float
    solid: Solid = PAPER
    is_wall: bool = False


@dataclass(frozen=True)
class Scene:
    """Zones, and bodies: rows (zone, x, y, z, scale, angle) with a velocity each."""

    dimension: int
    zones: Sequence[Zone]
    bodies: FloatArray
    velocities: FloatArray
    dt: float
    law: str = "PDState"
    damping: bool = True
    gravity: float = -10.0
    wall_speed: float = 0.0
    jiggle: float = 0.0
    """Speed [m/s] of the grains, of which a tenth is added to each node's."""
    run_in: int = 0
    """Steps at `RUN_IN_FACTOR` times the speed before anything is measured: grains meet."""
    steps: int = 1_000_000
    broken: float = 0.0
    """Fraction of the bonds that `break_bonds` takes out."""


def time_step(h: float, solid: Solid) -> float:
    """A stable time step [s] for this spacing."""
    return 0.15 * h / float(np.sqrt(solid.bulk / solid.density))


def lattice_places(count: int, dimension: int, step: FloatArray) -> FloatArray:
    """Sites of bodies side by side in a square or cube, `step` (3,) apart; (count, 3) [m]."""
    side = int(np.ceil(count ** (1 / dimension) - 1e-9))
    k = np.arange(count)
    sites = np.zeros((count, 3))
    for d in range(dimension):
        sites[:, d] = step[d] * (k % side)
        k = k // side
    return sites


def grains(
    *,
    count: int,
    nodes: int,
    neighbours: float,
    dimension: int = 2,
    law: str = "PDState",
    gap: float = TOUCHING,
    speed: float = 0.1,
    broken: float = 0.0,
    order: str = "rows",
) -> Scene:
    """Equal grains side by side, or one body.

    Parameters
    ----------
    count, nodes : int
        Grains and nodes of each.
    neighbours : float
        Mean number of neighbours of a node.
    gap : float
        Distance between grains, in node distances: at `TOUCHING` some nodes are a little closer
        than the contact radius; 10 is out of reach.
    speed : float
        Velocities [m/s] of the grains, in random directions.
    order : {"rows", "random"}
        Order of the nodes of a grain.
    """
    mesh = (meshes.disc if dimension == 2 else meshes.sphere)(RADIUS, nodes)
    if order == "random":
        mesh = meshes.shuffled(mesh)
    reach = 2 * np.abs(mesh.points).max(axis=0)
    rng = np.random.default_rng(2)
    bodies = np.zeros((count, 6))
    bodies[:, 1:4] = lattice_places(count, dimension, reach + gap * mesh.h)
    bodies[:, 4] = 1.0
    # Turns that leave the lattice, and so the outline that faces the next grain, as it is.
    turns = 6 if dimension == 2 else 4
    bodies[:, 5] = rng.integers(0, turns, count) * 2 * np.pi / turns
    velocities = np.zeros((count, 3))
    velocities[:, :dimension] = rng.uniform(-speed, speed, (count, dimension))
    zone = Zone(
        mesh,
        {"Type": "circle" if dimension == 2 else "sphere", "Parameters": [RADIUS, 0.0, 0.0, 0.0]},
        meshes.horizon_for(mesh, neighbours),
    )
    dt = time_step(mesh.h, PAPER)
    return Scene(dimension, [zone], bodies, velocities, dt, law, broken=broken, jiggle=speed)


def compression(*, columns: int, rows: int, count: int) -> Scene:
    """Look-alike of the original's compression decks, at the time when grains touch.

    Circles, triangles, drums and hexagons of 61 to 121 nodes with 12.6 neighbours, in a box whose
    lid comes down. `count` grains in columns and rows.
    """
    radius = RADIUS
    shapes = [
        ("circle", [radius], meshes.ball(radius), 123),
        ("triangle", [radius], meshes.regular_polygon(radius, 3), 55),
        ("drum2d", [radius, 2e-4], meshes.drum(radius, 4e-4), 57),
        ("hexagon", [radius], meshes.regular_polygon(radius, 6), 91),
    ]
    zones = []
    for kind, parameters, inside, nodes in shapes:
        mesh = meshes.plane_shape(inside, radius, nodes)
        keys = {"Type": kind, "Parameters": [*parameters, 0.0, 0.0, 0.0]}
        zones.append(Zone(mesh, keys, meshes.horizon_for(mesh, 12.6), COMPRESSION))
    h = max(zone.mesh.h for zone in zones)
    rng = np.random.default_rng(3)
    largest = 1.01
    step = 2 * largest * radius + h  # just out of contact; the run-in brings them together
    width, height = columns * step + 0.5 * h, rows * step + 0.5 * h
    bodies = np.zeros((count, 6))
    k = np.arange(count)
    bodies[:, 0] = rng.integers(0, len(zones), count)
    bodies[:, 1] = (k % columns + 0.5) * step - width / 2
    bodies[:, 2] = (k // columns + 0.5) * step - height / 2
    bodies[:, 4] = rng.uniform(0.97, largest, count)
    bodies[:, 5] = rng.uniform(0, 2 * np.pi, count)
    velocities = np.zeros((count + 2, 3))
    velocities[:count, :2] = rng.uniform(-0.06, 0.06, (count, 2))
    for wall in _box_walls(width, height, h):
        bodies = np.vstack([bodies, [len(zones), 0, 0, 0, 1, 0]])
        zones.append(wall)
    return Scene(
        2, zones, bodies, velocities, 2.5e-6, damping=False, wall_speed=-0.06, jiggle=0.06,
        run_in=600,
    )  # fmt: skip


def _box_walls(width: float, height: float, h: float) -> list[Zone]:
    """A U-shaped container and its lid, as in the original's decks."""
    thick, x, y = 3e-4, width / 2, height / 2
    outer = meshes.box(np.array([-x - thick, -y - thick]), np.array([x + thick, y + 2 * thick]))
    hollow = meshes.box(np.array([-x, -y]), np.array([x, y + 3 * thick]))
    bounds = (-x - thick, -y - thick), (x + thick, y + 2 * thick)
    container = meshes.triangular_lattice(
        lambda points: outer(points) & ~hollow(points), 0.8 * h, *bounds
    )
    lid_bounds = np.array([-x, y]), np.array([x, y + 2 * thick])
    lid = meshes.triangular_lattice(meshes.box(*lid_bounds), 0.8 * h, *map(tuple, lid_bounds))
    hard = Solid(1e4, 6e3, 600.0, 100.0)
    zones = []
    for mesh, lower, upper in ((container, *map(np.array, bounds)), (lid, *lid_bounds)):
        corners = [lower[0], lower[1], 0.0, upper[0], upper[1], 0.0]
        keys = {"Type": "rectangle", "Parameters": [float(c) for c in corners]}
        zones.append(Zone(mesh, keys, 4e-4, hard, is_wall=True))
    return zones


_MATERIALS = {
    "PDState": _core.MaterialType.pd_state,
    "PMBBond": _core.MaterialType.pmb_bond,
    "RNPBond": _core.MaterialType.rnp_bond,
    "PDElasticBond": _core.MaterialType.pd_elastic_bond,
}


def core_model(scene: Scene, threads: int) -> Any:
    """The core model of a scene, `init` not yet called."""
    deck = _core.ModelDeck()
    deck.dimension = scene.dimension
    deck.time_steps = scene.steps
    deck.final_time = scene.dt * scene.steps
    deck.gravity = (0.0, scene.gravity, 0.0)
    deck.meshes = [
        _core.Mesh(zone.mesh.points, _core.CellType[zone.mesh.cell_type], zone.mesh.cells.ravel())
        for zone in scene.zones
    ]
    deck.zones = [_core_zone(scene, k) for k in range(len(scene.zones))]
    deck.bodies = [_core_body(row) for row in scene.bodies]
    contact = _core.ContactDeck()
    contact.contact_radius_factor = CONTACT_RADIUS_FACTOR
    contact.kn = _contact_stiffness(scene)
    contact.epsilon = 0.95
    contact.friction_coeff = 0.2
    contact.damping_on = contact.friction_on = scene.damping
    deck.contacts = [contact] * len(scene.zones) ** 2
    model = _core.DEMModel(deck, threads)
    walls = [body for body in model.particles if body.is_wall]
    if walls:
        lid = _core.DisplacementSet()
        lid.nodes = list(range(walls[-1].start, walls[-1].stop))
        lid.directions = 2  # bit 1: along y
        linear = _core.TimeFunctionType.linear
        lid.time_function = _core.TimeFunction(linear, [scene.wall_speed])
        lid.amplitude = [scene.wall_speed] * len(lid.nodes)
        model.add_displacement_set(lid)
    return model


def _core_zone(scene: Scene, index: int) -> Any:
    zone = scene.zones[index]
    result = _core.ZoneDeck()
    result.name = f"Zone_{index + 1}"
    result.mesh = index
    result.is_wall = result.all_dofs_constrained = zone.is_wall
    low, high = zone.mesh.points.min(axis=0), zone.mesh.points.max(axis=0)
    result.center = (0.0, 0.0, 0.0) if not zone.is_wall else tuple(0.5 * (low + high))
    result.bounding_radius = 0.5 * float(np.linalg.norm(high - low)) if zone.is_wall else RADIUS
    material = _core.MaterialDeck()
    material.type = _MATERIALS[scene.law]
    material.horizon = zone.horizon
    material.density = zone.solid.density
    material.bulk_modulus = zone.solid.bulk
    material.shear_modulus = zone.solid.shear if scene.law == "PDState" else float("nan")
    material.youngs_modulus = material.poisson_ratio = float("nan")
    material.fracture_energy = zone.solid.fracture_energy
    material.critical_stress_factor = material.horizon_mesh_ratio = float("nan")
    influence = _core.InfluenceDeck()
    influence.type = _core.InfluenceType.linear
    material.influence = influence
    result.material = material
    return result


def _core_body(row: FloatArray) -> Any:
    body = _core.BodyDeck()
    body.zone = int(row[0])
    body.site = tuple(row[1:4])
    body.scale = float(row[4])
    body.angle = float(row[5])
    body.axis = (0.0, 0.0, 1.0)
    return body


def _contact_stiffness(scene: Scene) -> float:
    """Kn = 18 K / (pi eps^5), eq. 36 of the paper."""
    zone = scene.zones[0]
    return float(18 * zone.solid.bulk / (np.pi * zone.horizon**5))


def set_in_motion(scene: Scene, model: Any) -> None:
    """Give nodes the velocity of their body and a little of their own, so that bonds stretch."""
    state, d = model.state, scene.dimension
    rng = np.random.default_rng(4)
    own = rng.uniform(-0.1, 0.1, (len(state), d)) * scene.jiggle
    velocities = scene.velocities[state.particle_id]
    velocities[:, :d] += own
    for body in model.particles:
        if body.is_wall:
            velocities[body.start : body.stop] = 0
    state.v[:] = velocities


def run_in(scene: Scene, model: Any) -> None:
    """Take the steps before the measurement."""
    if not scene.run_in:
        return
    v = model.state.v
    v *= RUN_IN_FACTOR
    model.advance(scene.run_in, np.inf)
    v /= RUN_IN_FACTOR


def break_bonds(model: Any, fraction: float, seed: int = 5) -> int:
    """Break a random fraction of the bonds, both directions of each; returns how many."""
    if not fraction:
        return 0
    offsets, j = model.bonds.offsets, model.bonds.indices.astype(np.uint64)
    n = np.uint64(len(offsets) - 1)
    i = np.repeat(np.arange(n, dtype=np.uint64), np.diff(offsets))
    # A number for each pair that does not depend on the direction: a hash (splitmix64) of it.
    start = np.uint64(seed * 0x9E3779B97F4A7C15 % 2**64)
    key = np.minimum(i, j) * n + np.maximum(i, j) + start
    key = (key ^ (key >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    key = (key ^ (key >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    draw = (key ^ (key >> np.uint64(31))).astype(np.float64) / 2.0**64
    intact = (draw >= fraction).astype(np.uint8)
    model.set_intact(intact)
    return int(len(intact) - intact.sum())


def write_deck(scene: Scene, folder: Path) -> Path:
    """Write a scene as the deck and the files that a user would have; returns the YAML file."""
    folder.mkdir(parents=True, exist_ok=True)
    for k, zone in enumerate(scene.zones, 1):
        meshes.write_msh(folder / f"zone_{k}.msh", zone.mesh)
    radius = [1.0 if zone.is_wall else RADIUS for zone in scene.zones]
    rows = [
        f"{int(zone)}, {x:.9g}, {y:.9g}, {z:.9g}, {scale * radius[int(zone)]:.9g}, {angle:.9g}"
        for zone, x, y, z, scale, angle in scene.bodies
        if not scene.zones[int(zone)].is_wall
    ]
    (folder / "places.csv").write_text("\n".join(["i, x, y, z, r, o", *rows, ""]))
    path = folder / "input.yaml"
    with path.open("w") as stream:
        YAML().dump(_deck(scene, len(rows)), stream)
    return path


def _deck(scene: Scene, grains: int) -> dict[str, Any]:
    zones = list(enumerate(scene.zones, 1))
    names = [f"Zone_{k}" for k, _ in zones]
    walls = {f"Zone_{k}" for k, zone in zones if zone.is_wall}
    wall_keys = {
        "Is_Wall": True,
        "All_Dofs_Constrained": True,
        "Create_Particle_Using_ParticleZone_GeomObject": True,
    }
    deck: dict[str, Any] = {
        "Model": {
            "Dimension": scene.dimension,
            "Discretization_Type": {"Time": "central_difference"},
            "Final_Time": float(scene.dt * scene.steps),
            "Time_Steps": scene.steps,
        },
        "Zone": {"Zones": len(names), **{name: {"Is_Wall": name in walls} for name in names}},
        "Particle": {
            f"Zone_{k}": {**zone.shape, **(wall_keys if zone.is_wall else {})} for k, zone in zones
        },
        "Particle_Generation": {"From_File": "places.csv", "File_Data_Type": "loc_rad_orient"},
        "Mesh": {name: {"File": f"zone_{k}.msh"} for k, name in enumerate(names, 1)},
        "Contact": _contact_keys(scene, names, walls),
        "Material": {f"Zone_{k}": _material_keys(scene, zone) for k, zone in zones},
        "Force_BC": {"Gravity": [0.0, scene.gravity, 0.0]},
        "Output": {"Path": "out", "Tags": ["Displacement"], "Output_Interval": scene.steps},
    }
    if walls:
        deck["Displacement_BC"] = {
            "Sets": 1,
            "Set_1": {
                "Particle_List": [grains + len(walls) - 1],
                "Direction": [2],
                "Time_Function": {"Type": "linear", "Parameters": [scene.wall_speed]},
                "Spatial_Function": {"Type": "constant"},
            },
        }
    return deck


def _contact_keys(scene: Scene, names: list[str], walls: set[str]) -> dict[str, Any]:
    keys = {
        "Contact_Radius_Factor": CONTACT_RADIUS_FACTOR,
        "Damping_On": scene.damping,
        "Friction_On": scene.damping,
        "Kn": _contact_stiffness(scene),
        "Epsilon": 0.95,
        "Friction_Coeff": 0.2,
    }
    return {
        f"Zone_{i}{j}": dict(keys, **({"Kn": 0.0} if {a, b} <= walls else {}))
        for i, a in enumerate(names, 1)
        for j, b in enumerate(names, 1)
        if i <= j
    }


def _material_keys(scene: Scene, zone: Zone) -> dict[str, Any]:
    return {
        "Type": scene.law,
        "Horizon": float(zone.horizon),
        "Density": zone.solid.density,
        "K": zone.solid.bulk,
        **({"G": zone.solid.shear} if scene.law == "PDState" else {}),
        "Gc": zone.solid.fracture_energy,
        "Influence_Function": {"Type": 1},
    }
