"""Placing grains: lattices, random and poured packings, Voronoi tessellations.

All functions return a `Packing`, depend on nothing but their arguments (the same seed gives the
same packing) and know no material: see ``DEMModel.add_particles``.
"""

from .domains import Hopper
from .filling import random
from .lattices import grid, hexagonal
from .pouring import poured
from .result import Packing
from .sizes import Constant, Grading, LogNormal, Normal, Sizes, Uniform
from .tessellation import voronoi

__all__ = [
    "Constant",
    "Grading",
    "Hopper",
    "LogNormal",
    "Normal",
    "Packing",
    "Sizes",
    "Uniform",
    "grid",
    "hexagonal",
    "poured",
    "random",
    "voronoi",
]
