"""The built-in uniform mesh of a rectangle."""

from __future__ import annotations

import math

import numpy as np

from ..errors import InputError
from .data import Mesh

_MOST_NODES = 50_000_000


def uniform_rectangle_mesh(  # noqa: PLR0917 - the corners as in a deck
    x0: float,
    y0: float,
    z0: float,
    x1: float,
    y1: float,
    z1: float,
    h: float,
    *,
    where: str = "CreateMesh",
) -> Mesh:
    """Mesh a rectangle with equal quads.

    Along a side of length L lie ``int(L / h)`` quads, so that they are at least `h` long.
    Nodes are numbered row by row, x fastest.

    Parameters
    ----------
    x0, y0, z0, x1, y1, z1 : float
        Lower and upper corner [m]; the mesh lies at z = `z0`.
    h : float
        Mesh size [m].
    where : str
        Start of an error message.

    Returns
    -------
    Mesh
        With quads and trapezoidal nodal volumes, per unit thickness [m^2].

    Raises
    ------
    InputError
        If a corner or `h` is not finite, the rectangle has no area or `h` is longer than
        one of its sides.
    """
    if not all(map(math.isfinite, (x0, y0, z0, x1, y1, z1, h))) or h <= 0.0:
        raise InputError(
            f"{where}: Mesh_Size = {h:g} for a rectangle from ({x0:g}, {y0:g}) to ({x1:g}, "
            f"{y1:g}): all must be finite and the size positive; correct Mesh_Size or Parameters"
        )
    x, wx = _stations(x0, x1, h, "x", where)
    y, wy = _stations(y0, y1, h, "y", where)
    nx, ny = len(x), len(y)
    if nx * ny > _MOST_NODES:
        raise InputError(
            f"{where}: Mesh_Size = {h:g} gives {nx * ny} nodes: at most {_MOST_NODES} are made; "
            "use a larger Mesh_Size"
        )
    points = np.column_stack([np.tile(x, ny), np.repeat(y, nx), np.full(nx * ny, z0)])
    corner = (np.arange(ny - 1)[:, None] * nx + np.arange(nx - 1)).reshape(-1, 1)
    cells = (corner + np.array([0, 1, nx + 1, nx])).astype(np.int32)
    source = f"uniform mesh of {nx - 1} x {ny - 1} quads"
    return Mesh(points, "quad", cells, np.outer(wy, wx).ravel(), source)


def _stations(
    start: float, end: float, h: float, axis: str, where: str
) -> tuple[np.ndarray, np.ndarray]:
    """Node positions along a side and their trapezoidal weights [m]."""
    length = float(end) - float(start)
    n = int(min(length / h, 1e18))
    if n < 1:
        raise InputError(
            f"{where}: Mesh_Size = {h:g} is longer than the rectangle's side {length:g} in {axis}: "
            "at least one element must fit; use a smaller Mesh_Size"
        )
    if n > _MOST_NODES:
        raise InputError(
            f"{where}: Mesh_Size = {h:g} gives {n} elements in {axis}: at most {_MOST_NODES} nodes "
            "are made; use a larger Mesh_Size"
        )
    step = length / n
    weights = np.full(n + 1, step)
    weights[[0, -1]] = 0.5 * step
    return start + np.arange(n + 1) * step, weights
