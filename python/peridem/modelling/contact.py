"""Contact between bodies: rules for pairs of them, and the contact law that follows."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from ..deck import Contact
from ..errors import InputError
from .arguments import validated
from .bodies import Body

_KEYS = {
    "friction": "Friction_Coeff",
    "damping_ratio": "Epsilon",
    "damping_factor": "Beta_n_Factor",
    "radius": "Contact_Radius",
    "radius_factor": "Contact_Radius_Factor",
    "stiffness": "Kn",
    "stiffness_factor": "Kn_Factor",
    "damping_criterion": "Center_Damping_Criterion",
    "node_damping": "Node_Damping",
    "friction_model": "Friction_Model",
    "tangential_stiffness_ratio": "Tangential_Stiffness_Ratio",
    "self_contact": "Self_Contact",
}
ARGUMENTS = {key: argument for argument, key in _KEYS.items()}

Matches = Callable[[Body], bool]
Signature = tuple[tuple[bool, bool], ...]
Kind = tuple[Signature, bool]


def anything(_: Body) -> bool:
    """Match every body."""
    return True


@dataclass(frozen=True)
class ContactRule:
    """Values for the contact between two kinds of bodies.

    Attributes
    ----------
    a, b : callable
        Tell whether a body is of the kind.
    sides : int
        How many of the two were named; more make the rule more specific.
    values : dict
        What was given, by argument.
    """

    a: Matches
    b: Matches
    sides: int
    values: Mapping[str, Any] = field(default_factory=dict)


def make_rule(
    a: Matches | None, b: Matches | None, values: Mapping[str, Any], who: str
) -> ContactRule:
    """Make a rule of the arguments that are not None, checked.

    Raises
    ------
    InputError
        If a value breaks its rule, or none is given.
    """
    given = {name: value for name, value in values.items() if value is not None}
    if not given:
        raise InputError(f"{who}: nothing is given; give at least one of {', '.join(_KEYS)}")
    if "radius" in given and "radius_factor" in given:
        raise InputError(
            f"{who}: radius = {given['radius']!r}: is given besides radius_factor; keep one of them"
        )
    contact_block(given, who)
    sides = (a is not None) + (b is not None)
    return ContactRule(a or anything, b or anything, sides, given)


def contact_block(values: Mapping[str, Any], who: str) -> Contact:
    """Block ``Contact.Zone_ij`` of a deck for the arguments of `set_contact`."""
    content: dict[str, Any] = {_KEYS[name]: value for name, value in values.items()}
    content["Friction_On"] = values.get("friction") not in (None, 0)
    content["Damping_On"] = values.get("damping_ratio") is not None
    if not content["Friction_On"]:
        validated(Contact, {**content, "Friction_On": False}, who, ARGUMENTS)
        for name in ("friction", "friction_model", "tangential_stiffness_ratio"):
            content.pop(_KEYS[name], None)
    if not content["Damping_On"]:
        for name in ("damping_factor", "damping_criterion", "node_damping"):
            if name not in values:
                content.pop(_KEYS[name], None)
    return validated(Contact, content, who, ARGUMENTS)


def signature(body: Body, rules: list[ContactRule]) -> Signature:
    """Which sides of which rules a body is on: bodies with the same are alike in contact."""
    return tuple((rule.a(body), rule.b(body)) for rule in rules)


def idle_rule_warnings(kinds: Iterable[Kind], rules: list[ContactRule]) -> list[str]:
    """Return a warning for each rule that is about no two bodies that can touch.

    Parameters
    ----------
    kinds : iterable of (signature, bool)
        Signature of each zone's bodies, and whether they are walls.
    rules : list of ContactRule
        All rules.

    Returns
    -------
    list of str
        Warnings, in the order of the rules.
    """
    seen = list(dict.fromkeys(kinds))
    pairs = [
        (one, other)
        for k, (one, is_wall) in enumerate(seen)
        for other, other_is_wall in seen[k:]
        if not (is_wall and other_is_wall)
    ]
    warnings = []
    for k, rule in enumerate(rules):
        if not any((one[k][0] and two[k][1]) or (two[k][0] and one[k][1]) for one, two in pairs):
            said = ", ".join(f"{name} = {value!r}" for name, value in rule.values.items())
            warnings.append(
                f"set_contact: {said}: has no effect, as there are no two such bodies that can "
                "touch; correct a and b, or leave it out"
            )
    return warnings


def pair_values(one: Signature, other: Signature, rules: list[ContactRule]) -> dict[str, Any]:
    """Values that the rules give to two bodies: general rules first, later ones last."""
    values: dict[str, Any] = {}
    order = sorted(range(len(rules)), key=lambda k: rules[k].sides)
    for k in order:
        (a1, b1), (a2, b2) = one[k], other[k]
        if not ((a1 and b2) or (a2 and b1)):
            continue
        given = rules[k].values
        if "radius" in given or "radius_factor" in given:
            values.pop("radius", None)
            values.pop("radius_factor", None)
        values.update(given)
    return values
