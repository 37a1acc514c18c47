"""The deck: the YAML input of a run, its schema and its reader."""

from .loads import DisplacementSet, ForceSet, InitialVelocity, LoadSet
from .materials import Contact, ElasticConstants, Material
from .reader import Deck, read_deck
from .schema import DeckFile, MeshZone, Model, Neighbor, Output, ParticleZone, Restart, Zone
from .shapes import Geometry

__all__ = [
    "Contact",
    "Deck",
    "DeckFile",
    "DisplacementSet",
    "ElasticConstants",
    "ForceSet",
    "Geometry",
    "InitialVelocity",
    "LoadSet",
    "Material",
    "MeshZone",
    "Model",
    "Neighbor",
    "Output",
    "ParticleZone",
    "Restart",
    "Zone",
    "read_deck",
]
