"""Where the bodies of a deck come from: shapes, sites, sizes, orientations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .deck import Deck, ParticleZone
from .errors import InputError, InputErrors
from .geometry import Shape, make_shape
from .mesh import Mesh
from .placement import Placement, read_particle_locations

SMALLEST_SIZE, LARGEST_SIZE = 1e-20, 1e20
"""Bounds [m] on the size of a body: fifth powers of lengths must be numbers."""

FARTHEST = 1e8
"""Largest distance of a body from the origin, by its size."""

MOST_REPORTED = 20


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


def shape_of(deck: Deck, keys: Any, path: str) -> Shape | None:
    """Shape from the keys ``Type`` and ``Parameters`` of a block; None when they are not given."""
    if keys is None or keys.type is None or keys.parameters is None:
        return None
    where = f"{deck.where(path)}: {path}"
    dimension = deck.model.dimension
    return make_shape(
        keys.type, keys.parameters, keys.vec_type, keys.vec_flag, dimension, where=where
    )


def zone_shape(deck: Deck, zone: int) -> Shape | None:
    """Shape of a zone's reference mesh."""
    reference = deck.meshes[zone].reference_particle
    if reference is not None:
        return shape_of(deck, reference, f"Mesh.Zone_{zone + 1}.Reference_Particle")
    return shape_of(deck, deck.particles[zone], f"Particle.Zone_{zone + 1}")


def place_bodies(deck: Deck, placements: Sequence[Placement] | None = None) -> list[BodyPlan]:
    """Bodies zone by zone, in the order of the placements inside a zone.

    Parameters
    ----------
    deck : Deck
        The deck.
    placements : sequence of Placement, optional
        Where the bodies stand; read from the deck's placement file when left out.

    Raises
    ------
    InputError
        With one line for each problem of the placement file, else of the zones.
    """
    shapes = [zone_shape(deck, zone) for zone in range(deck.n_zones)]
    if deck.single_particle:
        return [BodyPlan(0, shapes[0], (0.0, 0.0, 0.0), 1.0, 0.0, deck.where("Mesh.Zone_1"))]
    placements = _read_placements(deck) if placements is None else placements
    bodies = []
    problems = InputErrors()
    for zone in range(deck.n_zones):
        if _is_created(deck.particles[zone]):
            where = deck.where(f"Particle.Zone_{zone + 1}")
            bodies.append(BodyPlan(zone, shapes[zone], (0.0, 0.0, 0.0), 1.0, 0.0, where))
        else:
            own = [placement for placement in placements if placement.zone == zone]
            with problems.collect():
                bodies += _bodies_of_zone(deck, zone, shapes[zone], own)
    problems.raise_if_any()
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
            where=placement.where or f"{deck.particle_generation.file}:{placement.line}",
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


def check_test(deck: Deck, count: int) -> None:
    """Check that the bodies of the deck's test exist among `count` bodies.

    Raises
    ------
    InputError
        If they do not.
    """
    test = deck.compressive_test
    if test is not None and test.particle_id >= count:
        raise deck.error(
            "Particle.Compressive_Test.Particle_Id",
            f"no such body: the deck has bodies 0 to {count - 1}, zone by zone; correct it",
        )
    if deck.test_name == "two_particle" and count < 2:
        raise deck.error("Particle.Test_Name", "needs two bodies, the deck has 1; use another name")


def check_places(deck: Deck, bodies: list[BodyPlan], meshes: list[Mesh]) -> None:
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
