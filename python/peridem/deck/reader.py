"""`read_deck`: the deck of a run, checked and complete."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from peridem.errors import InputError

from . import resolve as r
from .blocks import Parsed, parse_blocks
from .contact_pairs import resolve_contacts
from .fields import Block
from .loads import DisplacementSet, Forces, ForceSet, InitialVelocity
from .materials import Contact, Material
from .messages import Problems, problem_text
from .schema import (
    CompressiveTest,
    Container,
    MeshZone,
    Model,
    Neighbor,
    Output,
    ParticleGeneration,
    Particles,
    ParticleZone,
    Restart,
    Zone,
)
from .source import Source, load_source

B = TypeVar("B", bound=Block)


@dataclass(frozen=True, kw_only=True)
class Deck:
    """A deck that obeys all rules: copies resolved, defaults filled in, paths absolute.

    Zones are counted from 0 here; directions from 1, as in the deck. None stands for what the
    deck does not give.

    Attributes
    ----------
    path : Path
        The YAML file, absolute.
    sha256 : str
        Hash of its bytes, hexadecimal.
    model : Model
        Dimension, time, integrator, compatibility, seed.
    zones : tuple of Zone
        One for each zone; `is_wall` is True or False.
    particles : tuple of (ParticleZone or None)
        Shapes of the zones' bodies; None only in Single_Particle runs.
    meshes : tuple of MeshZone
        Reference meshes; `file` is absolute.
    materials : tuple of Material
        Materials, copies followed.
    contacts : dict of (int, int) to Contact
        Contact laws of zones (i, j), i <= j, copies followed; pairs of walls may lack one.
    gravity : tuple of three floats
        Acceleration of gravity [m/s^2].
    displacement_sets : tuple of DisplacementSet
        Prescribed displacements, in the order of the deck.
    force_sets : tuple of ForceSet
        Force densities, in the order of the deck.
    initial_velocities : tuple of InitialVelocity
        Velocities [m/s] and spins [rad/s] of some bodies at the start.
    output : Output
        What to write; `path` is absolute.
    neighbor : Neighbor
        Search settings, defaults when the deck has none.
    container : Container or None
        Region around the bodies.
    particle_generation : ParticleGeneration or None
        The csv of the bodies' places; `file` is absolute.
    test_name : str
        Name of the test; empty without one.
    compressive_test : CompressiveTest or None
        Body and direction of a compressive test.
    restart : Restart or None
        State to go on from; `file` is absolute.
    notes : tuple of str
        What the deck gives without effect, each with file and line.
    source : Source
        The file's values and lines.
    inputs : callable or None
        Gives the hash of each file by key path, where files are in memory only.
    """

    path: Path
    sha256: str
    model: Model
    zones: tuple[Zone, ...]
    particles: tuple[ParticleZone | None, ...]
    meshes: tuple[MeshZone, ...]
    materials: tuple[Material, ...]
    contacts: dict[r.Pair, Contact]
    gravity: tuple[float, float, float]
    displacement_sets: tuple[DisplacementSet, ...]
    force_sets: tuple[ForceSet, ...]
    initial_velocities: tuple[InitialVelocity, ...]
    output: Output
    neighbor: Neighbor
    container: Container | None
    particle_generation: ParticleGeneration | None
    test_name: str
    compressive_test: CompressiveTest | None
    restart: Restart | None
    notes: tuple[str, ...]
    source: Source = field(repr=False)
    inputs: Callable[[], dict[str, str]] | None = field(default=None, repr=False)

    @property
    def initial_velocity(self) -> InitialVelocity | None:
        """The first of the initial velocities, if there is any."""
        return self.initial_velocities[0] if self.initial_velocities else None

    @property
    def n_zones(self) -> int:
        """Number of zones."""
        return len(self.zones)

    @property
    def single_particle(self) -> bool:
        """Whether the run has one body, taken as its mesh is."""
        return self.model.particle_sim_type == "Single_Particle"

    def where(self, key_path: str) -> str:
        """File and line of a key, for messages.

        Parameters
        ----------
        key_path : str
            For example ``"Material.Zone_2.Horizon"`` or ``"Output.Tags[3]"``.

        Returns
        -------
        str
            ``"input.yaml:41"``; the line of the block around it when the deck lacks the key,
            the file's name alone when it lacks that too.
        """
        return self.source.where(key_path)

    def error(self, key_path: str, rule: str) -> InputError:
        """Error about a key's value, found after reading; raise what is returned.

        Parameters
        ----------
        key_path : str
            The key.
        rule : str
            ``"rule; remedy"``; file, line, key and value are put in front.
        """
        return InputError(problem_text(self.source, key_path, rule))


def read_deck(path: str | Path) -> Deck:
    """Read and check a deck.

    Parameters
    ----------
    path : str or Path
        The YAML file; paths inside it are relative to its folder.

    Returns
    -------
    Deck
        The deck, complete.

    Raises
    ------
    InputError
        When the file cannot be read or is not YAML, or when rules are broken: then the text has
        one line for each of them, ``file:line: key = value: rule; remedy``.
    """
    source = load_source(path)
    problems = Problems(source)
    for key_path, text in source.problems:
        problems.add(key_path, text)
    parsed = parse_blocks(source.data, problems)
    scope = r.make_scope(parsed, problems)
    r.check_zones(scope)
    zones = r.resolve_walls(scope)
    r.check_shapes(scope)
    r.check_bodies(scope)
    r.check_files(scope)
    r.check_test(scope)
    materials = r.resolve_materials(scope)
    contacts = resolve_contacts(scope, zones)
    displacements = r.resolve_sets(scope, "Displacement_BC", DisplacementSet)
    forces = r.resolve_sets(scope, "Force_BC", ForceSet)
    velocities = r.resolve_initial_velocities(scope)
    problems.raise_if_any()

    particle = _value(parsed, "Particle", Particles) or Particles()
    gravity = _value(parsed, "Force_BC", Forces)
    return Deck(
        path=source.path,
        sha256=source.sha256,
        model=_required(parsed, "Model", Model),
        zones=zones,
        particles=tuple(scope.item("Particle", name, ParticleZone) for name in scope.zone_names()),
        meshes=tuple(_meshes(scope)),
        materials=tuple(material for material in materials if material is not None),
        contacts=contacts,
        gravity=r.vector3(gravity.gravity if gravity else None),
        displacement_sets=displacements,
        force_sets=forces,
        initial_velocities=velocities,
        output=_output(scope),
        neighbor=_value(parsed, "Neighbor", Neighbor) or Neighbor(),
        container=_value(parsed, "Container", Container),
        particle_generation=_with_file(scope, _value(parsed, *_GENERATION)),
        test_name=particle.test_name,
        compressive_test=particle.compressive_test,
        restart=_with_file(scope, _value(parsed, "Restart", Restart)),
        notes=tuple(problem_text(source, key_path, text) for key_path, text in parsed.notes),
        source=source,
    )


_GENERATION = ("Particle_Generation", ParticleGeneration)
F = TypeVar("F", ParticleGeneration, Restart, MeshZone)


def _value(parsed: Parsed, name: str, kind: type[B]) -> B | None:
    value = parsed.value(name)
    return value if isinstance(value, kind) else None


def _required(parsed: Parsed, name: str, kind: type[B]) -> B:
    value = _value(parsed, name, kind)
    assert value is not None  # a missing or wrong block is reported before
    return value


def _with_file(scope: r.Scope, block: F | None) -> F | None:
    """Make the path of a block's file absolute."""
    if block is None or block.file is None:
        return block
    return block.model_copy(update={"file": r.absolute(scope, block.file)})


def _meshes(scope: r.Scope) -> list[MeshZone]:
    found = (scope.item("Mesh", name, MeshZone) for name in scope.zone_names())
    return [mesh for mesh in (_with_file(scope, mesh) for mesh in found) if mesh is not None]


def _output(scope: r.Scope) -> Output:
    output = _required(scope.parsed, "Output", Output)
    return output.model_copy(
        update={
            "path": r.absolute(scope, output.path),
            "tags": tuple(dict.fromkeys(output.tags)),
        }
    )
