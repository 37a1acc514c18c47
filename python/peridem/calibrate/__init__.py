"""Calibration: parameters of a model for a wanted behaviour, found by short runs."""

from .crushing import Crushing, crushing, measure_crushing
from .restitution import Restitution, measure_restitution, restitution
from .search import Calibration

__all__ = [
    "Calibration",
    "Crushing",
    "Restitution",
    "crushing",
    "measure_crushing",
    "measure_restitution",
    "restitution",
]
