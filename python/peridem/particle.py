"""What a model tells about itself: its bodies and its stable time steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Particle:
    """A body of the model: a particle or a wall.

    Attributes
    ----------
    id : int
        Number of the body; walls and particles share one numbering.
    zone : int
        Zone, counted from 0.
    type : {"particle", "wall"}
        Kind of body.
    start, stop : int
        Its nodes are ``start`` to ``stop - 1``.
    center : ndarray, shape (3,)
        Current position [m] of the node nearest to the centre of the shape.
    bounding_radius : float
        Radius [m] of the shape about its centre.
    mesh_size : float
        Smallest distance h [m] between two of its nodes.
    horizon : float
        Horizon [m].
    volume : float
        Sum of its nodal volumes [m^3], per unit thickness [m^2] in 2D.
    n_bonds : int
        Directed bonds, 0 before `DEMModel.init`.
    constrained : bool
        Whether the body never moves.
    """

    id: int
    zone: int
    type: str
    start: int
    stop: int
    center: FloatArray
    bounding_radius: float
    mesh_size: float
    horizon: float
    volume: float
    n_bonds: int
    constrained: bool


@dataclass(frozen=True)
class StableTimeStep:
    """Estimated largest stable time steps, on the safe side.

    Attributes
    ----------
    bonds : float
        Limit [s] of the linearised bond forces.
    contact : float
        Limit [s] of two nodes in full contact.
    self_contact : float
        Limit [s] of the spring that keeps the ends of a broken bond apart, in bodies that can
        break; infinite without.
    """

    bonds: float
    contact: float
    self_contact: float
