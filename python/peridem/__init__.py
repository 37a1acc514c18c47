"""Granular media whose grains deform and break: peridynamics inside, DEM contact between.

The model is that of Jha, Desai, Bhattacharya, Lipton, JMPS 151 (2021) 104376.
"""

from ._core import __version__
from .bonds import Bonds
from .deck import Deck, read_deck
from .errors import InputError, NumericalError
from .model import DEMModel, Particle

__all__ = [
    "Bonds",
    "DEMModel",
    "Deck",
    "InputError",
    "NumericalError",
    "Particle",
    "__version__",
    "read_deck",
]
