"""Granular media whose grains deform and break: peridynamics inside, DEM contact between.

The model is that of Jha, Desai, Bhattacharya, Lipton, JMPS 151 (2021) 104376.
"""

import os

# How long threads that wait for the next loop keep a processor busy: about 0.2 ms. The default of
# GCC's OpenMP, several ms, slows a machine down that has other work; it is read when _core loads.
os.environ.setdefault("GOMP_SPINCOUNT", "10000")

from . import calibrate, packing, plot, recorders
from ._core import __version__
from .bonds import Bonds
from .deck import Deck, read_deck
from .errors import InputError, NumericalError, PeridemWarning
from .materials import PDElasticBond, PDState, PMBBond, RNPBond
from .meshing import MeshQuality, MeshWarning, mesh_quality
from .model import DEMModel, Particle
from .modelling.bodies import Bodies, Body
from .result import Result
from .shapes import (
    Annulus,
    AnnulusRectangle,
    Circle,
    Composite,
    ConcaveHexagon,
    Cube,
    Cuboid,
    CuboidMinusCuboid,
    Cylinder,
    Ellipse,
    GmshGeometry,
    Hexagon,
    MeshFile,
    Polygon,
    Polyhedron,
    Rectangle,
    RectangleMinusRectangle,
    Sphere,
    Square,
    Surface,
    Triangle,
)
from .studies import StudyWarning, sample, study

__all__ = [
    "Annulus",
    "AnnulusRectangle",
    "Bodies",
    "Body",
    "Bonds",
    "Circle",
    "Composite",
    "ConcaveHexagon",
    "Cube",
    "Cuboid",
    "CuboidMinusCuboid",
    "Cylinder",
    "DEMModel",
    "Deck",
    "Ellipse",
    "GmshGeometry",
    "Hexagon",
    "InputError",
    "MeshFile",
    "MeshQuality",
    "MeshWarning",
    "NumericalError",
    "PDElasticBond",
    "PDState",
    "PMBBond",
    "Particle",
    "PeridemWarning",
    "Polygon",
    "Polyhedron",
    "RNPBond",
    "Rectangle",
    "RectangleMinusRectangle",
    "Result",
    "Sphere",
    "Square",
    "StudyWarning",
    "Surface",
    "Triangle",
    "__version__",
    "calibrate",
    "diagnostics",
    "mesh_quality",
    "packing",
    "plot",
    "read_deck",
    "recorders",
    "sample",
    "study",
]
