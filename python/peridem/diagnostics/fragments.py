"""The pieces of broken bodies: what intact bonds hold together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError

if TYPE_CHECKING:
    import pandas as pd

    from ..model import DEMModel

__all__ = ["Fragments", "fragments"]

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Fragments:
    """Connected components of the intact bonds of some bodies.

    Attributes
    ----------
    labels : ndarray of int, shape (n_nodes,)
        Fragment of each node of the model, -1 for nodes of other bodies; for colouring.
    body : ndarray of int, shape (k,)
        Body that each fragment was part of.
    nodes : ndarray of int, shape (k,)
        Number of nodes.
    masses : ndarray, shape (k,)
        Masses [kg], per unit thickness in 2D.
    volumes : ndarray, shape (k,)
        Volumes [m^3], areas [m^2] in 2D.
    centers : ndarray, shape (k, 3)
        Centres of mass [m].
    velocities : ndarray, shape (k, 3)
        Velocities [m/s] of the centres of mass.
    dimension : {2, 3}
        Dimension of the model.
    """

    labels: IndexArray
    body: IndexArray
    nodes: IndexArray
    masses: FloatArray
    volumes: FloatArray
    centers: FloatArray
    velocities: FloatArray
    dimension: int

    def __len__(self) -> int:
        return len(self.masses)

    @property
    def diameters(self) -> FloatArray:
        """Diameters [m] of discs, in 3D balls, of the same volumes, shape (k,)."""
        if self.dimension == 2:
            return np.asarray(2 * np.sqrt(self.volumes / np.pi))
        return np.asarray(np.cbrt(6 * self.volumes / np.pi))

    def to_frame(self) -> pd.DataFrame:
        """Table of the fragments, largest first: body, nodes, mass, volume, diameter, motion."""
        import pandas as pd

        frame = pd.DataFrame(
            {
                "body": self.body,
                "nodes": self.nodes,
                "mass": self.masses,
                "volume": self.volumes,
                "diameter": self.diameters,
                **{axis: self.centers[:, k] for k, axis in enumerate("xyz")},
                **{f"v{axis}": self.velocities[:, k] for k, axis in enumerate("xyz")},
            }
        ).rename_axis("fragment")
        return frame.sort_values("mass", ascending=False, kind="stable")

    def per_body(self) -> pd.DataFrame:
        """Count the fragments of each body, with the mass [kg] of the largest, by body id."""
        grouped = self.to_frame().groupby("body")["mass"]
        return grouped.agg(fragments="count", largest="max", mass="sum")

    def size_distribution(self, diameters: ArrayLike | None = None) -> pd.DataFrame:
        """Grading curve: how much of the mass is in fragments up to a diameter.

        Parameters
        ----------
        diameters : array_like, optional
            Sieve sizes [m]; the fragments' own diameters when left out.

        Returns
        -------
        pandas.DataFrame
            Diameter as index; ``passing``, the part of the mass (0 to 1), and ``count``, the
            number of fragments, in pieces not larger.
        """
        import pandas as pd

        order = np.argsort(self.diameters, kind="stable")
        own = self.diameters[order]
        sieves = np.unique(own) if diameters is None else np.sort(np.ravel(diameters)).astype(float)
        count = np.searchsorted(own, sieves, side="right")
        mass = np.concatenate([[0.0], np.cumsum(self.masses[order])])
        index = pd.Index(sieves, name="diameter")
        passing = mass[count] / max(mass[-1], 1e-300)
        return pd.DataFrame({"passing": passing, "count": count}, index)


def fragments(model: DEMModel, bodies: Any = None, *, min_nodes: int = 1) -> Fragments:
    """Find the fragments of bodies.

    Parameters
    ----------
    model : DEMModel
        The model.
    bodies : Body, Bodies, int, str or sequence of them, optional
        Bodies to look at; all that are no walls when left out.
    min_nodes : int
        Leave out fragments with fewer nodes; their nodes have the label -1.

    Returns
    -------
    Fragments
        In the order of their first nodes.

    Raises
    ------
    InputError
        If there is no such body, or `min_nodes` is below 1.
    """
    if min_nodes < 1:
        raise InputError(f"fragments: min_nodes = {min_nodes}: must be at least 1; leave it out")
    model.init()
    state: Any = model.state
    if bodies is None:
        looked_at = np.array([not body.is_wall for body in model._bodies])[state.particle_id]
    else:
        looked_at = np.zeros(model.n_nodes, dtype=bool)
        looked_at[model.nodes_of(bodies)] = True
    whole = np.asarray(model._core.fragment_labels())
    counts = np.bincount(whole)
    kept = looked_at & (counts[whole] >= min_nodes)
    labels = np.full(model.n_nodes, -1, dtype=np.int64)
    _, first, labels[kept], nodes = np.unique(
        whole[kept], return_index=True, return_inverse=True, return_counts=True
    )
    mine, k = labels[kept], len(nodes)
    volume, density = state.volume[kept], state.density[kept]
    masses = np.asarray(np.bincount(mine, volume * density, k), dtype=float)

    def mean(values: FloatArray) -> FloatArray:
        weighted = (volume * density)[:, None] * values[kept]
        sums = [np.bincount(mine, weighted[:, d], k) for d in range(3)]
        return np.asarray(np.stack(sums, axis=1) / masses[:, None])

    return Fragments(
        labels=labels,
        body=state.particle_id[kept][first].astype(np.int64),
        nodes=nodes,
        masses=masses,
        volumes=np.asarray(np.bincount(mine, volume, k), dtype=float),
        centers=mean(state.x),
        velocities=mean(state.v),
        dimension=model.dimension,
    )
