"""Reference meshes of bodies: read from files or made."""

from .data import Mesh
from .reader import read_mesh
from .uniform import uniform_rectangle_mesh

__all__ = ["Mesh", "read_mesh", "uniform_rectangle_mesh"]
