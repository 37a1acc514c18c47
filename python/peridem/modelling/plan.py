"""From what the modelling functions collect to the blocks of a deck, meshes and places."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from ..build import Held
from ..deck import (
    Contact,
    Deck,
    DisplacementSet,
    ForceSet,
    InitialVelocity,
    MeshZone,
    Model,
    Neighbor,
    Output,
    ParticleZone,
    Zone,
)
from ..deck.schema import ParticleGeneration
from ..errors import InputError
from ..mesh import Mesh
from ..mesh.checks import checked_mesh
from ..mesh.data import RawMesh
from ..outside import Outside
from ..placement import Placement
from .bodies import Body, Form, MeshableShape
from .contact import ContactRule, contact_block, idle_rule_warnings, pair_values, signature
from .export import PLACES, deck_data, places_csv
from .loads import LoadPart
from .mesh_files import mesh_content, suffix_of
from .source import ModelSource
from .words import Words

_NO_MOTION = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Layout:
    """Order of the bodies in the built model.

    Attributes
    ----------
    order : tuple of Body
        Bodies by their ids.
    ids : dict of Body to int
        Id of each body.
    starts : list of int
        First node of each body, and the number of nodes.
    """

    order: tuple[Body, ...]
    ids: dict[Body, int]
    starts: list[int]


@dataclass(frozen=True)
class Composition:
    """A model ready to be built.

    Attributes
    ----------
    deck : Deck
        Its blocks.
    held : Held
        What the deck would have in files.
    layout : Layout
        Order of the bodies.
    words : Words
        How messages about the deck are said in terms of the model.
    warnings : list of str
        What of the plan has no effect.
    """

    deck: Deck
    held: Held
    layout: Layout
    words: Words
    warnings: list[str]


@dataclass
class ModelPlan:
    """What has been asked for so far.

    Attributes
    ----------
    dimension : int
        2 or 3.
    gravity : tuple of float
        Acceleration [m/s^2].
    scheme : {"velocity_verlet", "central_difference"}
        Time integrator.
    compatibility : {"corrected", "original"}
        Whether defects of the original program are reproduced.
    bodies : list of Body
        In the order in which they were added.
    rules : list of ContactRule
        Contact, in the order in which it was set.
    loads : list of LoadPart
        Loads, in the order in which they were added.
    """

    dimension: int
    gravity: tuple[float, ...]
    scheme: str
    compatibility: str
    bodies: list[Body] = field(default_factory=list)
    rules: list[ContactRule] = field(default_factory=list)
    loads: list[LoadPart] = field(default_factory=list)
    _meshes: dict[Any, Mesh] = field(default_factory=dict)

    def compose(self, final_time: float, steps: int, output: Output) -> Composition:
        """Make the blocks of a deck, meshes and places.

        Raises
        ------
        InputError
            If there is no body, or a shape cannot be meshed.
        """
        if not self.bodies:
            raise InputError("model: has no bodies; add one with add_particle")
        zones = self._zones()
        order = tuple(body for zone in zones for body in zone)
        ids = {body: number for number, body in enumerate(order)}
        meshes = [self._mesh(zone[0]) for zone in zones]
        sizes = [len(mesh.points) for mesh, zone in zip(meshes, zones, strict=True) for _ in zone]
        starts = [0]
        for size in sizes:
            starts.append(starts[-1] + size)
        shapes = [self._particle_zone(zone[0], meshes[k]) for k, zone in enumerate(zones)]
        places = [
            _placement(body, number, shapes[number])
            for number, zone in enumerate(zones)
            for body in zone
        ]
        blocks, outside = self._load_blocks(order, ids)
        held = Held(meshes, places, outside)
        deck = Deck(
            path=Path("model"),
            sha256="",
            model=self._model(final_time, steps),
            zones=tuple(Zone.model_validate({"Is_Wall": zone[0].is_wall}) for zone in zones),
            particles=tuple(shapes),
            meshes=tuple(_mesh_zone(number) for number in _first_of(meshes)),
            materials=tuple(zone[0].material.block for zone in zones),
            contacts=self._contacts(zones),
            gravity=(self.gravity[0], self.gravity[1], self.gravity[2]),
            displacement_sets=tuple(b for b in blocks if isinstance(b, DisplacementSet)),
            force_sets=tuple(b for b in blocks if isinstance(b, ForceSet)),
            initial_velocities=_velocities(order),
            output=output,
            neighbor=Neighbor(),
            container=None,
            particle_generation=ParticleGeneration.model_validate(
                {"From_File": PLACES, "File_Data_Type": "loc_rad_orient"}
            ),
            test_name="",
            compressive_test=None,
            restart=None,
            notes=(),
            source=ModelSource(Path("model"), {}, {}, ""),
            inputs=_Inputs(held),
        )
        words = Words(zones, self.loads)
        kinds = [(signature(zone[0], self.rules), zone[0].is_wall) for zone in zones]
        idle = idle_rule_warnings(kinds, self.rules)
        return Composition(_identified(deck), held, Layout(order, ids, starts), words, idle)

    def _zones(self) -> list[list[Body]]:
        """Bodies alike in mesh, material, kind and contact, in the order of the first of each."""
        groups: dict[Any, list[Body]] = {}
        for body in self.bodies:
            key = (
                body.form.key,
                body.material,
                body.is_wall,
                body.fixed,
                signature(body, self.rules),
            )
            groups.setdefault(key, []).append(body)
        return list(groups.values())

    def _mesh(self, body: Body) -> Mesh:
        """Mesh of a body, made once for all that share it."""
        form = body.form
        if form.key not in self._meshes:
            self._meshes[form.key] = self._checked(form, body)
        return self._meshes[form.key]

    def _checked(self, form: Form, body: Body) -> Mesh:
        if form.given is not None:
            mesh = form.given
        else:
            assert form.shape is not None
            size = () if form.mesh_size is None else (form.mesh_size,)
            mesh = form.shape.mesh(*size)
        name = mesh.source or f"mesh of {body.name}"
        raw = RawMesh(mesh.points, {mesh.cell_type: mesh.cells.astype("int64")}, mesh.volumes)
        return replace(checked_mesh(raw, self.dimension, name), source=name)

    def _particle_zone(self, body: Body, mesh: Mesh) -> ParticleZone:
        """Block ``Particle.Zone_k``: the shape's own keys, or a circle or sphere around it."""
        shape = body.form.shape
        keys = shape.deck_keys if shape is not None else None
        if keys is not None and _has_keys(shape):
            content = dict(keys)
        else:
            if shape is not None:
                center, radius = shape.geometry.center, shape.geometry.bounding_radius
            else:
                center = 0.5 * (mesh.points.min(axis=0) + mesh.points.max(axis=0))
                radius = float(((mesh.points - center) ** 2).sum(axis=1).max() ** 0.5)
            kind = "circle" if self.dimension == 2 else "sphere"
            content = {"Type": kind, "Parameters": [float(radius), *map(float, center)]}
        if body.fixed:
            content["All_Dofs_Constrained"] = True
        return ParticleZone.model_validate(content)

    def _model(self, final_time: float, steps: int) -> Model:
        content = {
            "Dimension": self.dimension,
            "Discretization_Type": {"Spatial": "finite_difference", "Time": self.scheme},
            "Final_Time": final_time,
            "Time_Steps": steps,
        }
        content["Compatibility"] = self.compatibility
        return Model.model_validate(content)

    def _contacts(self, zones: list[list[Body]]) -> dict[tuple[int, int], Contact]:
        """Contact law of each pair of zones; equal ones are one object."""
        signs = [signature(zone[0], self.rules) for zone in zones]
        made: dict[Any, Contact] = {}
        contacts = {}
        for i, one in enumerate(zones):
            for j in range(i, len(zones)):
                if one[0].is_wall and zones[j][0].is_wall:
                    continue
                key = (*sorted((signs[i], signs[j])), i == j)
                if key not in made:
                    values = pair_values(signs[i], signs[j], self.rules)
                    if i != j:
                        values.pop("self_contact", None)
                    made[key] = contact_block(values, "set_contact")
                contacts[i, j] = made[key]
        return contacts

    def _load_blocks(
        self, order: Sequence[Body], ids: dict[Body, int]
    ) -> tuple[list[DisplacementSet | ForceSet], dict[tuple[str, int], Outside]]:
        blocks: list[DisplacementSet | ForceSet] = []
        outside: dict[tuple[str, int], Outside] = {}
        counts = {"displacement": 0, "force": 0}
        for part in self.loads:
            listed = None
            if part.matches is not None:
                listed = [ids[body] for body in order if part.matches(body)]
                self._check_hat(part, [order[number] for number in listed])
            blocks.append(part.block(listed))
            if part.outside is not None:
                outside[part.kind, counts[part.kind]] = part.outside
            counts[part.kind] += 1
        return blocks, outside

    def _check_hat(self, part: LoadPart, bodies: Sequence[Body]) -> None:
        """Check that a hat has the box of a shape that a deck can describe, or of a region."""
        space = part.content.get("Spatial_Function", {}).get("Type", "")
        if not space.startswith("hat") or "Region" in part.content:
            return
        for body in bodies:
            if not _has_keys(body.form.shape):
                raise InputError(
                    f"{part.label}: space = {space!r}: is over the box of body {body.name!r}, "
                    "which a deck cannot describe; give a region, two corners"
                )


class _Inputs:
    """Hashes of the files that a model's parts would be written to, worked out when asked for."""

    def __init__(self, held: Held) -> None:
        self._held = held
        self._hashes: dict[str, str] | None = None

    def __call__(self) -> dict[str, str]:
        if self._hashes is None:
            of_mesh = {
                id(mesh): hashlib.sha256(mesh_content(mesh)).hexdigest()
                for mesh in self._held.meshes
            }
            self._hashes = {
                f"Mesh.Zone_{zone + 1}.File": of_mesh[id(mesh)]
                for zone, mesh in enumerate(self._held.meshes)
            }
            places = places_csv(self._held.placements)
            self._hashes["Particle_Generation.From_File"] = hashlib.sha256(places).hexdigest()
        return self._hashes


def _has_keys(shape: MeshableShape | None) -> bool:
    """Whether a deck can describe bodies of a shape, scaled and turned as they may be."""
    return (
        shape is not None
        and shape.deck_keys is not None
        and shape.geometry.scale_length is not None
    )


def _identified(deck: Deck) -> Deck:
    """Give the deck the keys it would be written with, and their hash."""
    deck.source.data.update(deck_data(deck))
    text = json.dumps(deck.source.data, sort_keys=True)
    return replace(deck, sha256=hashlib.sha256(text.encode()).hexdigest())


def _first_of(meshes: list[Mesh]) -> list[tuple[int, str]]:
    """Give number and suffix of each zone's mesh file; zones that share it share the number."""
    numbers: dict[int, int] = {}
    found = []
    for mesh in meshes:
        number = numbers.setdefault(id(mesh), len(numbers) + 1)
        found.append((number, suffix_of(mesh)))
    return found


def _mesh_zone(numbered: tuple[int, str]) -> MeshZone:
    return MeshZone.model_validate({"File": f"mesh_{numbered[0]}{numbered[1]}"})


def _placement(body: Body, zone: int, shape: ParticleZone) -> Placement:
    length = _scale_length(shape)
    return Placement(
        zone=zone,
        site=body.at,
        radius=body.scale * length,
        orientation=body.angle,
        line=0,
        axis=body.axis,
        where=f"body {body.name!r}",
    )


def _scale_length(shape: ParticleZone) -> float:
    from ..geometry import make_shape

    assert shape.type is not None and shape.parameters is not None
    # The dimension does not matter here: it only refuses plane shapes in 3D.
    made = make_shape(shape.type, shape.parameters, shape.vec_type, shape.vec_flag, 2)
    assert made.scale_length is not None
    return made.scale_length


def _velocities(order: Sequence[Body]) -> tuple[InitialVelocity, ...]:
    """Make the initial velocities, bodies with the same one together."""
    groups: dict[Any, list[int]] = {}
    for number, body in enumerate(order):
        if body.velocity != _NO_MOTION or body.spin != _NO_MOTION:
            groups.setdefault((body.velocity, body.spin), []).append(number)
    return tuple(
        InitialVelocity.model_validate(
            {
                "Velocity_Vector": velocity,
                "Particle_List": bodies,
                **({} if spin == _NO_MOTION else {"Spin": spin}),
            }
        )
        for (velocity, spin), bodies in groups.items()
    )
