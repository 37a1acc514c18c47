"""Linear and angular momentum of bodies."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import pandas as pd

    from ..model import DEMModel

__all__ = ["momenta", "sum_over_bodies"]

FloatArray = NDArray[np.float64]


def sum_over_bodies(model: DEMModel, values: FloatArray) -> FloatArray:
    """Sum values of nodes, shape (n_nodes, ...), over each body: shape (n_bodies, ...)."""
    starts = [body.start for body in model._bodies]
    return np.asarray(np.add.reduceat(values, starts, axis=0))


def momenta(model: DEMModel) -> pd.DataFrame:
    """Measure the momenta of every body.

    Parameters
    ----------
    model : DEMModel
        The model.

    Returns
    -------
    pandas.DataFrame
        A row for each body, by id: ``mass`` [kg]; ``x, y, z``, the centre of mass [m];
        ``px, py, pz``, the momentum [kg m/s]; ``Lx, Ly, Lz``, the angular momentum about the
        origin [kg m^2/s]; ``Sx, Sy, Sz``, that about the own centre of mass. Masses and momenta
        are per unit thickness in 2D. The sums of p and L are those of the whole model.

    Notes
    -----
    Central differences keep velocities half a step before the positions; velocity Verlet at the
    same time.
    """
    import pandas as pd

    state: Any = model.state
    node_mass = state.volume * state.density
    p_nodes = node_mass[:, None] * state.v
    mass = sum_over_bodies(model, node_mass)
    center = sum_over_bodies(model, node_mass[:, None] * state.x) / mass[:, None]
    p = sum_over_bodies(model, p_nodes)
    about_center = np.cross(state.x - center[state.particle_id], p_nodes)
    spin = sum_over_bodies(
        model, about_center
    )  # the nodes' p - m v_c adds nothing about the centre
    table = np.column_stack([mass, center, p, spin + np.cross(center, p), spin])
    columns = ["mass", *"xyz", "px", "py", "pz", "Lx", "Ly", "Lz", "Sx", "Sy", "Sz"]
    return pd.DataFrame(table, columns=columns).rename_axis("body")
