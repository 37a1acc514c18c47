"""Meshes of shapes, made by gmsh, kept in a cache, judged by how even their nodes are."""

from ..mesh.writer import write_msh
from .cache import cache_folder, clear_cache
from .make import MOST_NODES, mesh_shape
from .quality import MeshQuality, MeshWarning, mesh_quality, nodal_volumes

__all__ = [
    "MOST_NODES",
    "MeshQuality",
    "MeshWarning",
    "cache_folder",
    "clear_cache",
    "mesh_quality",
    "mesh_shape",
    "nodal_volumes",
    "write_msh",
]
