"""Which contact law each pair of zones has: names of pairs, copies, the law of all others."""

from __future__ import annotations

from .fields import Block
from .materials import Contact, ContactCopy, ContactZones
from .resolve import Pair, Scope, follow
from .schema import MOST_JOINED, Zone

Names = dict[Pair, str]


def pair_name(pair: Pair, n_zones: int) -> str:
    """Name of a pair of zones, counted from 0, among `n_zones`."""
    i, j = pair[0] + 1, pair[1] + 1
    return f"Zone_{i}{j}" if n_zones <= MOST_JOINED else f"Zone_{i}_{j}"


def resolve_contacts(scope: Scope, zones: tuple[Zone, ...]) -> dict[Pair, Contact]:
    """Contact law of each pair of zones, 0-based with i <= j, copies followed."""
    if scope.n_zones is None:
        return {}
    names = _names(scope, scope.n_zones)
    items = scope.parsed.items("Contact")
    touching = {(i, j) for i, j in names if not (zones[i].is_wall and zones[j].is_wall)}
    block = scope.parsed.value("Contact")
    default = block.default_pair if isinstance(block, ContactZones) else None
    required: list[str] = []
    if not scope.single:
        _check_names(scope, names)
        if default is None and "Contact" in scope.parsed.blocks:
            required = [name for pair, name in names.items() if pair in touching]
            _check_given(scope, required)
    contacts = {}
    for pair, name in names.items():
        if name in items:
            contact = _given(scope, name, names, required)
            if contact is not None:
                contacts[pair] = contact
                if contact is items[name] and contact.self_contact and pair[0] != pair[1]:
                    text = "belongs to pairs Zone_ii: it is contact of a body with itself; move it"
                    scope.problems.add(f"Contact.{name}.Self_Contact", text)
    _note_no_force(scope, {names[pair]: contacts[pair] for pair in contacts if pair in touching})
    if default is not None:
        contacts = _completed(scope, names, contacts, default)
    return contacts


def _names(scope: Scope, n: int) -> Names:
    """Names of all pairs, as they are written where they are."""
    items = scope.parsed.items("Contact")
    names: Names = {}
    for i in range(n):
        for j in range(i, n):
            names[i, j] = usual = pair_name((i, j), n)
            apart = f"Zone_{i + 1}_{j + 1}"
            if apart == usual or apart not in items:
                continue
            if usual in items:
                scope.problems.add(f"Contact.{apart}", f"is given as {usual} too; keep one of them")
            names[i, j] = apart
            scope.problems.source.alias(f"Contact.{usual}", f"Contact.{apart}")
    return names


def _given(scope: Scope, name: str, names: Names, required: list[str]) -> Contact | None:
    """Contact that is described under a name, copies followed; None when it is wrong."""

    def copied(block: Block | None) -> str | None:
        if not isinstance(block, ContactCopy):
            return None
        i, j = sorted(block.copy_contact_data)
        return names.get((i - 1, j - 1), f"Zone_{i}{j}")

    value = follow(scope, "Contact", name, copied, required)
    return value if isinstance(value, Contact) else None


def _completed(
    scope: Scope, names: Names, contacts: dict[Pair, Contact], default: tuple[int, ...]
) -> dict[Pair, Contact]:
    """Give all pairs that are not described the law of one that is."""
    items = scope.parsed.items("Contact")
    i, j = sorted(default)
    law = contacts.get((i - 1, j - 1))
    if law is None:
        if names.get((i - 1, j - 1)) not in items:
            text = f"there is no Contact.Zone_{i}_{j}; name a pair that is given"
            scope.problems.add("Contact.Default_Pair", text)
        return contacts
    between = law.model_copy(update={"self_contact": False}) if law.self_contact else law
    rest = {pair: law if pair[0] == pair[1] else between for pair in names}
    return rest | {pair: contacts[pair] for pair in names if pair in contacts}


def _note_no_force(scope: Scope, contacts: dict[str, Contact]) -> None:
    """Note pairs that can touch but repel with nothing; copies are noted once."""
    noted: set[int] = set()
    for name, contact in contacts.items():
        if id(contact) in noted:
            continue
        for key_name, value in (("Kn", contact.kn), ("Kn_Factor", contact.kn_factor)):
            if value == 0:
                path = f"Contact.{name}.{key_name}"
                scope.parsed.notes.append((path, "means no contact force between these zones"))
                noted.add(id(contact))
                break


def _check_names(scope: Scope, names: Names) -> None:
    """Check that there is a block, and that every pair it describes exists."""
    if "Contact" not in scope.parsed.blocks:
        scope.problems.add("Contact", "missing; give Zone_ij for each pair of zones i <= j")
        return
    n = scope.n_zones or 0
    known = set(names.values())
    unknown = [name for name in scope.parsed.items("Contact") if name not in known]
    if not unknown:
        return
    meant: dict[str, list[str]] = {}
    for (i, j), name in names.items():
        for other in (f"Zone_{j + 1}{i + 1}", f"Zone_{j + 1}_{i + 1}"):
            meant.setdefault(other, []).append(name)
    joined: dict[str, list[str]] = {}
    for (i, j), name in names.items():
        joined.setdefault(f"Zone_{i + 1}{j + 1}", []).append(name)
    for name in unknown:
        text = f"no such pair: there are {n} zones; correct it or Zone.Zones"
        if n > MOST_JOINED and name in joined:
            text = (
                f"with more than {MOST_JOINED} zones the two numbers are written apart; write "
                f"{' or '.join(joined[name])}"
            )
        elif name in meant:
            text = f"pairs are written with the smaller zone first; write {meant[name][0]}"
        scope.problems.add(f"Contact.{name}", text)


def _check_given(scope: Scope, required: list[str]) -> None:
    """Check that every pair that can touch is described."""
    items = scope.parsed.items("Contact")
    for name in required:
        if name not in items:
            scope.problems.add(
                f"Contact.{name}",
                "missing; give the contact of this pair of zones, or Copy_Contact_Data: [k, l]",
            )
