"""Hashes that tell whether a deck, its files and its bonds are those of a checkpoint."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from .errors import InputError

if TYPE_CHECKING:
    from .deck import Deck
    from .model import DEMModel

__all__ = ["bonds_sha256", "input_hashes", "physics_sha256"]

# Without effect on the state: where results go, when a run ends, what only names files (their
# contents have hashes of their own) or is compared by itself.
_NOT_PHYSICS = ("Restart", "Output", "Policy", "HPX", "Neighbor")
_NOT_PHYSICS_OF_MODEL = ("Final_Time", "Time_Steps", "Compatibility", "Quad_Approximation_Order")


def physics_sha256(deck: Deck) -> str:
    """Hash of what a deck says about the physics, hexadecimal.

    Left out: the blocks Restart, Output, Policy, HPX and Neighbor, Final_Time and Time_Steps (the
    time step is compared by itself), Compatibility, names of files, comments and layout.
    """
    data = {name: block for name, block in deck.source.data.items() if name not in _NOT_PHYSICS}
    for name, keys in (
        ("Model", _NOT_PHYSICS_OF_MODEL),
        ("Particle_Generation", ("From_File",)),
    ):
        data[name] = _without(data.get(name), keys)
    data["Mesh"] = {
        zone: _without(block, ("File",)) for zone, block in dict(data.get("Mesh") or {}).items()
    }
    text = json.dumps(data, sort_keys=True, default=str)
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


def input_hashes(deck: Deck) -> dict[str, str]:
    """SHA-256 of the meshes and csv that a deck names, by key path.

    Raises
    ------
    InputError
        If one of them can no longer be read.
    """
    if deck.inputs is not None:
        return deck.inputs()
    files = {
        f"Mesh.Zone_{zone + 1}.File": mesh.file
        for zone, mesh in enumerate(deck.meshes)
        if mesh.file is not None and not mesh.creates
    }
    if deck.particle_generation is not None and not deck.single_particle:
        files["Particle_Generation.From_File"] = deck.particle_generation.file
    try:
        of_file = {file: hashlib.sha256(file.read_bytes()).hexdigest() for file in files.values()}
    except OSError as error:
        raise InputError(
            f"{error.filename}: cannot be read: {error.strerror}; the deck needs it"
        ) from error
    return {key: of_file[file] for key, file in files.items()}


def bonds_sha256(model: DEMModel) -> str:
    """Hash of the bond lists (offsets and neighbours) of an initialised model, hexadecimal."""
    digest = hashlib.sha256(np.ascontiguousarray(model.bonds.offsets).data)
    digest.update(np.ascontiguousarray(model.bonds.indices).data)
    return digest.hexdigest()


def _without(block: Any, keys: tuple[str, ...]) -> Any:
    if not isinstance(block, Mapping):
        return block
    return {name: value for name, value in block.items() if name not in keys}
