"""Writing a model as a deck of the original's format."""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML

from ..build import Held
from ..deck import Contact, Deck, Neighbor
from ..deck.contact_pairs import pair_name
from ..deck.fields import Block
from ..deck.schema import MOST_JOINED, MOST_ZONES, Container
from ..errors import InputError
from ..files import make_folder, replace_file
from ..outside import FloatArray
from ..placement import Placement
from .mesh_files import mesh_content

DECK = "input.yaml"
PLACES = "particle_locations.csv"
_FLAT_AXIS = (0.0, 0.0, 1.0)


def deck_data(deck: Deck) -> dict[str, Any]:
    """Keys of a deck made in Python, as a file would have them.

    Parameters
    ----------
    deck : Deck
        Its blocks.

    Returns
    -------
    dict
        Plain values: numbers, text, lists and dicts.
    """
    names = [f"Zone_{k + 1}" for k in range(deck.n_zones)]
    data: dict[str, Any] = {
        "Model": _keys(deck.model),
        "Zone": {
            "Zones": deck.n_zones,
            **{name: _keys(zone) for name, zone in zip(names, deck.zones, strict=True)},
        },
        "Particle": {
            name: _keys(shape)
            for name, shape in zip(names, deck.particles, strict=True)
            if shape is not None
        },
        "Particle_Generation": _keys(deck.particle_generation),
        "Mesh": {name: _keys(mesh) for name, mesh in zip(names, deck.meshes, strict=True)},
        "Material": _materials(deck, names),
        "Contact": _contacts(deck),
    }
    if any(deck.gravity) or deck.force_sets:
        sets = _sets(deck.force_sets) if deck.force_sets else {}
        data["Force_BC"] = {"Gravity": list(deck.gravity), **sets}
    if deck.displacement_sets:
        data["Displacement_BC"] = _sets(deck.displacement_sets)
    if deck.initial_velocities:
        first, *others = deck.initial_velocities
        data["IC"] = {"Constant_Velocity": _keys(first), **(_sets(others) if others else {})}
    if deck.container is not None:
        data["Container"] = _keys(deck.container)
    if deck.neighbor.model_fields_set:
        data["Neighbor"] = _keys(deck.neighbor)
    data["Output"] = {**_keys(deck.output), "Path": str(deck.output.path)}
    return data


def _keys(block: Block | None, *, with_defaults: bool = True) -> dict[str, Any]:
    """Keys that were given, those that repeat a default left out if so asked."""
    if block is None:
        return {}
    content: dict[str, Any] = block.model_dump(
        mode="json",
        by_alias=True,
        exclude_unset=True,
        exclude_none=True,
        exclude_defaults=not with_defaults,
    )
    return content


def _sets(blocks: Sequence[Block]) -> dict[str, Any]:
    return {
        "Sets": len(blocks),
        **{f"Set_{k}": _keys(block) for k, block in enumerate(blocks, 1)},
    }


def _materials(deck: Deck, names: list[str]) -> dict[str, Any]:
    first: dict[str, int] = {}
    result: dict[str, Any] = {}
    for number, (name, material) in enumerate(zip(names, deck.materials, strict=True), 1):
        text = material.model_dump_json()
        if text in first:
            result[name] = {"Copy_Material_Data": first[text]}
        else:
            first[text] = number
            result[name] = _keys(material, with_defaults=False)
    return result


def _contacts(deck: Deck) -> dict[str, Any]:
    """Contact of each pair, repeated ones as copies."""
    made = {id(contact): _text(contact) for contact in deck.contacts.values()}
    texts = {pair: made[id(contact)] for pair, contact in deck.contacts.items()}
    usual = None
    if deck.n_zones > MOST_JOINED and texts:  # no deck of the original; tens of thousands of pairs
        usual = Counter(texts.values()).most_common(1)[0][0]
    first: dict[str, tuple[int, int]] = {}
    result: dict[str, Any] = {}
    for (i, j), text in texts.items():
        name = pair_name((i, j), deck.n_zones)
        if text not in first:
            first[text] = (i + 1, j + 1)
            result[name] = _keys(deck.contacts[i, j])
            if text == usual:
                result["Default_Pair"] = [i + 1, j + 1]
        elif text != usual:
            result[name] = {"Copy_Contact_Data": list(first[text])}
    return result


def _text(contact: Contact) -> str:
    return contact.model_dump_json()


def places_csv(placements: Sequence[Placement]) -> bytes:
    """Contents of the placement file of some bodies."""
    turned = any(place.axis != _FLAT_AXIS for place in placements)
    lines = ["i,x,y,z,r,o" + (",ax,ay,az" if turned else "")]
    for place in placements:
        numbers = [*place.site, place.radius, place.orientation or 0.0]
        numbers += place.axis if turned else ()
        lines.append(",".join([str(place.zone), *(repr(float(one)) for one in numbers)]))
    return ("\n".join(lines) + "\n").encode("ascii")


def check_sayable(deck: Deck, held: Held) -> None:
    """Check that a deck can say everything about a model.

    Raises
    ------
    InputError
        With one line for each thing it cannot.
    """
    problems = [
        f"to_deck: {one.label}: {one.unsayable}: a deck has no words for it; use built-in "
        "functions and regions, or keep the model as a script"
        for one in held.outside.values()
    ]
    if deck.n_zones > MOST_ZONES:
        problems.append(
            f"to_deck: {deck.n_zones} combinations of shape, mesh size, material and contact: a "
            f"deck has at most {MOST_ZONES} zones; use fewer, or keep the model as a script"
        )
    if problems:
        raise InputError("\n".join(dict.fromkeys(problems)))


def spelled_out(deck: Deck, stiffness: Callable[[int, int], float], box: FloatArray) -> Deck:
    """Give a deck what the original program asks for and this one works out by itself.

    Parameters
    ----------
    deck : Deck
        Its blocks.
    stiffness : callable
        Gives Kn of two zones.
    box : ndarray, shape (2, 3)
        Corners [m] of the box of all nodes.

    Returns
    -------
    Deck
        With contact radius, Kn, container and search settings; it gives the same run. Kn is left
        out with more zones than decks of the original can have.
    """
    has_kn = deck.n_zones <= MOST_JOINED
    contacts: dict[tuple[int, int], Contact] = {}
    made: dict[tuple[int, float], Contact] = {}
    for (i, j), contact in deck.contacts.items():
        kn = stiffness(i, j) if has_kn else 0.0
        if (id(contact), kn) not in made:
            changes: dict[str, Any] = {}
            if has_kn and contact.kn is None:
                changes |= {"kn": kn, "kn_factor": 1.0}
            if contact.contact_radius is None and contact.contact_radius_factor is None:
                changes["contact_radius_factor"] = 0.95
            made[id(contact), kn] = contact.model_copy(update=changes)
        contacts[i, j] = made[id(contact), kn]
    margin = 10 * (box[1] - box[0])
    corners = [*(box[0] - margin).tolist(), *(box[1] + margin).tolist()]
    shape = "rectangle" if deck.model.dimension == 2 else "cuboid"
    neighbor = {"Update_Criteria": "simple_all", "Search_Factor": 5.0, "Search_Interval": 1}
    return replace(
        deck,
        contacts=contacts,
        container=Container.model_validate({"Geometry": {"Type": shape, "Parameters": corners}}),
        neighbor=Neighbor.model_validate(neighbor),
        output=deck.output.model_copy(update={"path": Path("out")}),
    )


def write_deck(deck: Deck, held: Held, folder: Path) -> Path:
    """Write a deck with its meshes and places.

    Parameters
    ----------
    deck : Deck
        Its blocks.
    held : Held
        Meshes and places.
    folder : Path
        Where to; created when missing.

    Returns
    -------
    Path
        The YAML file.

    Raises
    ------
    InputError
        If a deck cannot say what the model does, or a file cannot be written.
    """
    check_sayable(deck, held)
    make_folder(folder)
    done: set[Path] = set()
    for zone, mesh in zip(deck.meshes, held.meshes, strict=True):
        assert zone.file is not None
        path = folder / zone.file.name
        if path not in done:
            _write(path, mesh_content(mesh))
            done.add(path)
    _write(folder / PLACES, places_csv(held.placements))
    _write(folder / DECK, yaml_text(deck_data(deck)).encode("utf-8"))
    return folder / DECK


def yaml_text(data: Mapping[str, Any]) -> str:
    """Text of a deck's file."""
    yaml = YAML(typ="safe", pure=True)
    yaml.default_flow_style = None
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment]
    yaml.width = 100
    stream = io.StringIO()
    yaml.dump(dict(data), stream)
    return stream.getvalue()


def _write(path: Path, content: bytes) -> None:
    with replace_file(path) as temporary:
        temporary.write_bytes(content)
