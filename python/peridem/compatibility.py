"""Which defects of the original program a deck meets, and what this run does about each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from .bodies import BodyPlan
from .deck import Contact, Deck, Material
from .deck.contact_pairs import pair_name


@dataclass(frozen=True)
class Defect:
    """A defect of the original that a deck meets.

    Attributes
    ----------
    key : str
        Key of the deck that meets it.
    original, corrected : str
        What happens in each mode, to be read after the key.
    """

    key: str
    original: str
    corrected: str


def compatibility_notes(deck: Deck, bodies: Sequence[BodyPlan], mode: str) -> list[str]:
    """Say, once for each, which defects of the original a deck meets.

    Parameters
    ----------
    deck : Deck
        The deck.
    bodies : sequence of BodyPlan
        Its bodies.
    mode : {"original", "corrected"}
        Whether the defects are reproduced.

    Returns
    -------
    list of str
        One line for each defect, with file and line of the key that meets it.
    """
    return [f"{deck.where(one.key)}: {one.key}: {_said(one, mode)}" for one in _met(deck, bodies)]


def _said(defect: Defect, mode: str) -> str:
    if mode == "original":
        return (
            f"{defect.original}: a defect of the original, reproduced as asked; with "
            f"Model.Compatibility: corrected {defect.corrected}"
        )
    return (
        f"{defect.corrected}, corrected here; in the original {defect.original}; "
        "Model.Compatibility: original reproduces it"
    )


def _met(deck: Deck, bodies: Sequence[BodyPlan]) -> Iterator[Defect]:
    touching = _touching(deck, bodies)
    yield from _friction(touching)
    yield from _quadratic_motion(deck)
    yield from _center_damping(deck, bodies, touching)
    yield from _influence_functions(deck)
    yield from _mixed_materials(deck, bodies)
    yield from _moving_walls(deck, bodies)


def _touching(deck: Deck, bodies: Sequence[BodyPlan]) -> list[tuple[str, Contact]]:
    """Contact laws that some pair of bodies can use, by their key in the deck."""
    count = [0] * deck.n_zones
    for body in bodies:
        count[body.zone] += 1
    return [
        (f"Contact.{pair_name((i, j), deck.n_zones)}", contact)
        for (i, j), contact in sorted(deck.contacts.items())
        if not (deck.zones[i].is_wall and deck.zones[j].is_wall)
        and (i != j or count[i] > 1 or contact.self_contact)
    ]


def _friction(touching: list[tuple[str, Contact]]) -> Iterator[Defect]:
    for key, contact in touching:
        # friction with history is no option of the original: it opposes slip in both modes
        if contact.friction_on and contact.friction_coeff and contact.friction_model == "slip":
            yield Defect(
                f"{key}.Friction_Coeff",
                "friction pushes along the slip and sliding gains energy",
                "friction opposes the slip",
            )
            return


def _quadratic_motion(deck: Deck) -> Iterator[Defect]:
    for k, load in enumerate(deck.displacement_sets):
        time = load.time_function
        if time.type == "quadratic" and time.parameters[1] != 0 and not load.zero_displacement:
            yield Defect(
                f"Displacement_BC.Set_{k + 1}.Time_Function",
                "the velocity of u = a t + T1 t^2 is a + T1 t",
                "the velocity of u = a t + T1 t^2 is a + 2 T1 t",
            )
            return


def _center_damping(
    deck: Deck, bodies: Sequence[BodyPlan], touching: list[tuple[str, Contact]]
) -> Iterator[Defect]:
    if len(bodies) < 2:
        return
    for key, contact in touching:
        dissipates = contact.epsilon is not None and contact.epsilon < 1
        if contact.damping_on and dissipates and contact.beta_n_factor > 0:
            yield Defect(
                f"{key}.Epsilon",
                "damping between centres takes the disc of the bounding radius for a body's volume",
                "damping between centres uses the volume of the body (its area in 2D)",
            )
            return


def _influence_functions(deck: Deck) -> Iterator[Defect]:
    functions = [material.influence_function for material in deck.materials]
    for zone, function in enumerate(functions):
        if function != functions[0]:
            yield Defect(
                f"Material.Zone_{zone + 1}.Influence_Function",
                "the influence function of Zone_1 serves all zones",
                "each zone has its own influence function",
            )
            return


def _law(material: Material) -> str:
    return "state-based" if material.state_based else "bond-based"


def _mixed_materials(deck: Deck, bodies: Sequence[BodyPlan]) -> Iterator[Defect]:
    first = deck.materials[bodies[0].zone]
    for zone, material in enumerate(deck.materials):
        if material.state_based != first.state_based:
            does = "is" if first.state_based else "is not"
            yield Defect(
                f"Material.Zone_{zone + 1}.Type",
                f"body 0, which is {_law(first)}, decides for all bodies that the dilatation and "
                f"the state-based break test {does} computed",
                f"each body has the dilatation and break test of its own material ({_law(material)}"
                f" here, {_law(first)} in Zone_{bodies[0].zone + 1})",
            )
            return


def _moving_walls(deck: Deck, bodies: Sequence[BodyPlan]) -> Iterator[Defect]:
    if len(bodies) < 2:
        return
    for zone, kind in enumerate(deck.zones):
        particle = deck.particles[zone]
        if kind.is_wall and not _held(deck, bodies, zone) and particle is not None:
            yield Defect(
                f"Particle.Zone_{zone + 1}",
                "a wall that is free to move takes no contact force",
                "a wall that is free to move takes contact forces as a grain does",
            )
            return


def _held(deck: Deck, bodies: Sequence[BodyPlan], zone: int) -> bool:
    """Whether all walls of a zone are held in every direction, or prescribed in all of them."""
    particle = deck.particles[zone]
    if particle is not None and particle.all_dofs_constrained:
        return True
    own = {k for k, body in enumerate(bodies) if body.zone == zone}
    prescribed: dict[int, set[int]] = {k: set() for k in own}
    for load in deck.displacement_sets:
        if load.region is None:
            listed = own & set(load.particle_list or ()) - set(load.particle_exclude_list or ())
        else:
            listed = own  # which nodes a region selects is not known here
        for k in listed:
            prescribed[k] |= set(load.direction)
    return all(len(directions) >= deck.model.dimension for directions in prescribed.values())
