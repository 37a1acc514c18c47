"""Reference meshes of bodies: read from files, made, written."""

from .data import Mesh
from .reader import read_mesh
from .uniform import uniform_rectangle_mesh
from .writer import write_msh, write_nodes

__all__ = ["Mesh", "read_mesh", "uniform_rectangle_mesh", "write_msh", "write_nodes"]
