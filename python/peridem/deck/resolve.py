"""From the blocks of a deck to a `Deck`: rules between blocks, copies, paths."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from peridem.errors import InputError
from peridem.geometry import make_shape

from .blocks import Parsed
from .fields import Block, join
from .loads import InitialVelocity, LoadSet
from .materials import Material, MaterialCopy
from .messages import Problems
from .schema import MeshZone, Model, ParticleGeneration, Particles, ParticleZone, Zone, Zones
from .shapes import ShapeKeys

Pair = tuple[int, int]
B = TypeVar("B", bound=Block)
L = TypeVar("L", bound=LoadSet)


@dataclass(frozen=True)
class Scope:
    """What the rules between blocks need to know.

    Attributes
    ----------
    parsed : Parsed
        The blocks.
    problems : Problems
        Receives what is wrong.
    single : bool
        Whether there is one body (Single_Particle).
    dimension : int or None
        Dimension of the model; None when it is wrong.
    n_zones : int or None
        Number of zones; None when it is wrong.
    """

    parsed: Parsed
    problems: Problems
    single: bool
    dimension: int | None
    n_zones: int | None

    def zone_names(self) -> list[str]:
        """Names ``Zone_1`` to the last zone."""
        return [f"Zone_{k}" for k in range(1, (self.n_zones or 0) + 1)]

    def item(self, block: str, name: str, kind: type[B]) -> B | None:
        """Find a numbered block of a kind; None when it is absent, wrong or a copy."""
        found = self.parsed.items(block).get(name)
        return found if isinstance(found, kind) else None


def make_scope(parsed: Parsed, problems: Problems) -> Scope:
    """Find out what the rules between blocks need to know."""
    data = problems.source.data.get("Model")
    raw = data if isinstance(data, dict) else {}
    single = raw.get("Particle_Sim_Type") == "Single_Particle"
    model = parsed.value("Model")
    dimension = model.dimension if isinstance(model, Model) else None
    zones = parsed.value("Zone")
    n_zones = zones.zones if isinstance(zones, Zones) else None
    if single:
        if n_zones is not None and n_zones != 1:
            problems.add("Zone.Zones", "must be 1 for Single_Particle; give one zone")
        n_zones = 1
    elif "Zone" not in parsed.blocks:
        problems.add("Zone", "missing; give Zones, the number of zones, and Is_Wall of each")
    return Scope(parsed, problems, single, dimension, n_zones)


def check_zones(scope: Scope) -> None:
    """Check that every zone is described, and none that does not exist."""
    if scope.n_zones is None:
        return
    names = scope.zone_names()
    required = {"Mesh": "its mesh", "Material": "its material"}
    if not scope.single:
        required["Particle"] = "the shape of its bodies (Type, Parameters)"
        if "Particle" not in scope.parsed.blocks:
            scope.problems.add("Particle", "missing; give Zone_k with the shape of each zone")
    for block in ("Zone", "Particle", "Mesh", "Material"):
        items = scope.parsed.items(block)
        for name in items:
            if name not in names:
                last = f"Zone_1 to {names[-1]}" if len(names) > 1 else "Zone_1 only"
                scope.problems.add(
                    f"{block}.{name}", f"no such zone: there is {last}; correct it or Zone.Zones"
                )
        for name in names:
            described = name in items or block not in scope.parsed.blocks
            if block in required and not described:
                scope.problems.add(f"{block}.{name}", f"missing; give {required[block]}")


def resolve_walls(scope: Scope) -> tuple[Zone, ...]:
    """Zones with `is_wall` from Zone.Zone_k or Particle.Zone_k."""
    zones = []
    for name in scope.zone_names():
        zone = scope.item("Zone", name, Zone) or Zone()
        particle = scope.item("Particle", name, ParticleZone)
        flags = {zone.is_wall, particle.is_wall if particle else None} - {None}
        if len(flags) == 2:
            scope.problems.add(
                f"Particle.{name}.Is_Wall", f"contradicts Zone.{name}.Is_Wall; make them equal"
            )
        zones.append(zone.model_copy(update={"is_wall": True in flags}))
    return tuple(zones)


def check_shapes(scope: Scope) -> None:
    """Try every shape of the deck."""
    if scope.dimension is None:
        return
    for name, block in scope.parsed.blocks.items():
        blocks = [(name, block.value)]
        if name != "Zone":
            blocks += [(f"{name}.{item}", value) for item, value in block.items.items()]
        for path, value in blocks:
            for where, shape in _shapes(value, path):
                _check_shape(scope, where, shape)


def _shapes(value: object, path: str) -> Iterator[tuple[str, ShapeKeys]]:
    if isinstance(value, ShapeKeys) and value.type is not None:
        yield path, value
    if isinstance(value, Block):
        for name, info in type(value).model_fields.items():
            yield from _shapes(getattr(value, name), join(path, str(info.alias)))


def _check_shape(scope: Scope, path: str, shape: ShapeKeys) -> None:
    if shape.type is None or shape.parameters is None or scope.dimension is None:
        return
    place = join(path, "Parameters")
    where = f"{scope.problems.source.where(place)}: {path}"
    try:
        make_shape(
            shape.type,
            shape.parameters,
            shape.vec_type,
            shape.vec_flag,
            scope.dimension,
            where=where,
        )
    except InputError as error:
        scope.problems.add_formatted(place, str(error))


def check_files(scope: Scope) -> None:
    """Check that the files the run needs exist."""
    for name in scope.zone_names():
        mesh = scope.item("Mesh", name, MeshZone)
        if mesh is not None and mesh.file is not None:
            _check_file(scope, f"Mesh.{name}.File", mesh.file)
    generation = scope.parsed.value("Particle_Generation")
    if isinstance(generation, ParticleGeneration) and not scope.single:
        _check_file(scope, "Particle_Generation.From_File", generation.file)
    restart = scope.parsed.value("Restart")
    file = getattr(restart, "file", None)
    if isinstance(file, Path):
        _check_file(scope, "Restart.File", file)
    output = getattr(scope.parsed.value("Output"), "path", None)
    if isinstance(output, Path) and _exists(absolute(scope, output), Path.is_file):
        scope.problems.add("Output.Path", "is a file; give the name of a folder")


def absolute(scope: Scope, file: Path) -> Path:
    """Take a path of the deck from the deck's folder."""
    return (scope.problems.source.path.parent / file).absolute()


def _exists(file: Path, test: Callable[[Path], bool]) -> bool:
    try:
        return test(file)
    except OSError:  # for example a name that is too long
        return False


def _check_file(scope: Scope, path: str, file: Path) -> None:
    if not _exists(absolute(scope, file), Path.is_file):
        folder = scope.problems.source.path.parent
        scope.problems.add(path, f"no such file; check the name (it is looked for in {folder})")


def check_bodies(scope: Scope) -> None:
    """Check where bodies come from and what their meshes are made from."""
    placed = False
    for name in scope.zone_names():
        particle = scope.item("Particle", name, ParticleZone)
        mesh = scope.item("Mesh", name, MeshZone)
        placed |= particle is not None and not particle.create_from_geometry
        if mesh is not None and mesh.create_mesh is not None and mesh.creates:
            path = f"Mesh.{name}.CreateMesh"
            geometry: ShapeKeys | None = mesh.create_mesh.geometry or particle
            if geometry is None:
                if name not in scope.parsed.items("Particle"):
                    scope.problems.add(
                        join(path, "Geometry"),
                        f"missing; give the rectangle here or in Particle.{name}",
                    )
            elif geometry.type != "rectangle":
                scope.problems.add(
                    path, f"meshes rectangles only, the shape is {geometry.type}; give File"
                )
    if placed and not scope.single and "Particle_Generation" not in scope.parsed.blocks:
        scope.problems.add(
            "Particle_Generation", "missing; give From_File, the csv with the places of the bodies"
        )


def check_test(scope: Scope) -> None:
    """Check the direction of a compressive test."""
    particle = scope.parsed.value("Particle")
    test = particle.compressive_test if isinstance(particle, Particles) else None
    if test is None or scope.dimension is None:
        return
    if test.particle_force_direction > scope.dimension:
        scope.problems.add(
            "Particle.Compressive_Test.Particle_Force_Direction",
            f"must be at most {scope.dimension}, the dimension; correct it",
        )


def resolve_materials(scope: Scope) -> list[Material | None]:
    """Material of each zone, copies followed; None where it is wrong."""
    found: list[Material | None] = []
    for name in scope.zone_names():
        value = follow(scope, "Material", name, _copied_zone, scope.zone_names())
        material = value if isinstance(value, Material) else None
        if material is not None and value is scope.parsed.items("Material").get(name):
            _check_bulk_modulus(scope, name, material)
        found.append(material)
    return found


def _copied_zone(block: Block | None) -> str | None:
    return f"Zone_{block.copy_material_data}" if isinstance(block, MaterialCopy) else None


def follow(
    scope: Scope,
    block: str,
    name: str,
    copied: Callable[[Block | None], str | None],
    required: Collection[str],
) -> Block | None:
    """Follow copies from a numbered block to the one that holds values.

    What is wrong on the way is reported once: at the copy of something absent (unless it is
    `required`: then its absence is reported anyway), and at the first member of a circle.
    """
    items = scope.parsed.items(block)
    seen = [name]
    while (source := copied(items.get(seen[-1]))) is not None:
        path = f"{block}.{seen[-1]}.Copy_{block}_Data"
        if source in seen:
            if source == name == min(seen):
                chain = " -> ".join([*seen, source])
                text = f"copies in a circle ({chain}); give one of them its values"
                scope.problems.add(path, text)
            return None
        if source not in items:
            if len(seen) == 1 and source not in required:
                text = f"there is no {block}.{source}; copy a block that is given"
                scope.problems.add(path, text)
            return None
        seen.append(source)
    return items.get(seen[-1])


def _check_bulk_modulus(scope: Scope, name: str, material: Material) -> None:
    # The original wants K itself in runs with several bodies, for the damping's kappa. Here the
    # K that follows from the constants given will do; only constants given directly to a
    # bond-based law leave it open.
    if scope.single or material.state_based:
        return
    if material.young_modulus is None and material.bulk_modulus is None:
        scope.problems.add(
            f"Material.{name}.K", "missing; contact between bodies needs the bulk modulus in Pa"
        )


def resolve_sets(scope: Scope, block: str, kind: type[L]) -> tuple[L, ...]:
    """Load sets Set_1 to Set_n of Force_BC or Displacement_BC."""
    value = scope.parsed.value(block)
    items = scope.parsed.items(block)
    if value is None:
        return ()
    n = int(getattr(value, "sets", 0))
    names = _announced(scope, block, n)
    found = []
    for name in names:
        if name not in items:
            scope.problems.add(f"{block}.{name}", f"missing; {block}.Sets = {n} announces it")
        load = scope.item(block, name, kind)
        if load is not None:
            found.append(_resolve_direction(scope, f"{block}.{name}", load))
    return tuple(found)


def _resolve_direction(scope: Scope, path: str, load: L) -> L:
    for position, direction in enumerate(load.direction):
        if scope.dimension is not None and direction > scope.dimension:
            scope.problems.add(
                f"{path}.Direction[{position}]",
                f"must be at most {scope.dimension}, the dimension; remove it",
            )
    axis = load.time_function.rotation_axis
    if scope.dimension == 2 and axis is not None and any(axis[:2]):
        scope.problems.add(
            f"{path}.Time_Function.Parameters",
            "must have the axis (0, 0, 1) in 2D; give [T0, cx, cy, cz] alone",
        )
    if load.direction:
        return load
    return load.model_copy(update={"direction": (1, 2) if axis is None else (1, 2, 3)})


def resolve_initial_velocities(scope: Scope) -> tuple[InitialVelocity, ...]:
    """Complete the initial velocities: three components, body 0 in Single_Particle runs."""
    value = scope.parsed.value("IC")
    first = getattr(value, "constant_velocity", None)
    items = scope.parsed.items("IC")
    if isinstance(first, InitialVelocity):
        items = {"Constant_Velocity": first, **items}
    n = int(getattr(value, "sets", 0))
    for name in _announced(scope, "IC", n):
        if name not in items:
            scope.problems.add(f"IC.{name}", f"missing; IC.Sets = {n} announces it")
    return tuple(
        _complete_velocity(scope, f"IC.{name}", velocity)
        for name, velocity in items.items()
        if isinstance(velocity, InitialVelocity)
    )


def _announced(scope: Scope, block: str, n: int) -> list[str]:
    """Names of the sets that ``Sets`` announces; those beyond are reported."""
    names = [f"Set_{k}" for k in range(1, n + 1)]
    for name in scope.parsed.items(block):
        if name not in names:
            scope.problems.add(
                f"{block}.{name}", f"is beyond {block}.Sets = {n}; correct Sets or remove it"
            )
    return names


def _complete_velocity(scope: Scope, path: str, velocity: InitialVelocity) -> InitialVelocity:
    bodies = velocity.particle_list
    if scope.single and bodies is None:
        bodies = (0,)
    if not bodies:
        scope.problems.add(f"{path}.Particle_List", "missing; give the list of body ids, from 0")
    if scope.dimension == 2 and velocity.spin is not None and any(velocity.spin[:2]):
        scope.problems.add(f"{path}.Spin", "must be about z in 2D; give [0, 0, wz]")
    vector = vector3(velocity.velocity_vector)
    return velocity.model_copy(update={"velocity_vector": vector, "particle_list": bodies or ()})


def vector3(values: tuple[float, ...] | None) -> tuple[float, float, float]:
    """Set the missing components of a vector to zero."""
    x, y, z = (*(values or ()), 0.0, 0.0, 0.0)[:3]
    return x, y, z
