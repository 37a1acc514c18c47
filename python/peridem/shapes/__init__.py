"""Shapes of bodies: those of decks, any polygon or solid, drawings and mesh files."""

from .base import BodyShape
from .composite import Composite
from .deck import DeckShape
from .differences import CuboidMinusCuboid, RectangleMinusRectangle
from .files import GmshGeometry, MeshFile
from .plane import (
    Annulus,
    AnnulusRectangle,
    Circle,
    ConcaveHexagon,
    Ellipse,
    Hexagon,
    Rectangle,
    Square,
    Triangle,
)
from .polygon import Polygon
from .polyhedron import Polyhedron, Surface
from .solid import Cube, Cuboid, Cylinder, Sphere

__all__ = [
    "Annulus",
    "AnnulusRectangle",
    "BodyShape",
    "Circle",
    "Composite",
    "ConcaveHexagon",
    "Cube",
    "Cuboid",
    "CuboidMinusCuboid",
    "Cylinder",
    "DeckShape",
    "Ellipse",
    "GmshGeometry",
    "Hexagon",
    "MeshFile",
    "Polygon",
    "Polyhedron",
    "Rectangle",
    "RectangleMinusRectangle",
    "Sphere",
    "Square",
    "Surface",
    "Triangle",
]
