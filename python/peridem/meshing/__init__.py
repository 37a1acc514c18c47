"""Meshes of shapes, made by gmsh, kept in a cache, judged by how even their nodes are."""

from .cache import cache_folder, clear_cache
from .generate import MOST_NODES, mesh_shape

__all__ = ["MOST_NODES", "cache_folder", "clear_cache", "mesh_shape"]
