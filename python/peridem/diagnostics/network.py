"""The contact network: which nodes and bodies press on each other, and how."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..files import replace_file

if TYPE_CHECKING:
    import pandas as pd

    from ..model import DEMModel

__all__ = ["ContactNetwork", "contact_network", "contacts_path", "write_contacts"]

FloatArray = NDArray[np.float64]
IndexArray = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class ContactNetwork:
    """Contacts between nodes, and what they add up to between bodies.

    Forces are in N, per unit thickness in 2D. Those between nodes are equal and opposite: given
    are the forces on the first of a pair. (With ``compatibility="original"`` walls that are free
    to move do not take theirs.)

    Attributes
    ----------
    nodes : ndarray of int, shape (k, 2)
        Pairs of nodes in contact, the smaller number first.
    normal, friction, node_damping : ndarray, shape (k, 3)
        Forces on the first node of each pair.
    points : ndarray, shape (k, 3)
        Middles between the two nodes [m].
    bodies : ndarray of int, shape (m, 2)
        Pairs of bodies with nodes in contact or dampers between them, the smaller id first.
    contacts : ndarray of int, shape (m,)
        Number of node pairs in contact.
    force, damping, reaction : ndarray, shape (m, 3)
        On the first body: from the nodes in contact (`force`), from the dampers between centres
        and against walls (`damping`); and the dampers' force on the second body, which is not
        always the opposite (docs/diagnostics.md).
    normal_force : ndarray, shape (m,)
        Size of the sum of the normal forces.
    places : ndarray, shape (m, 3)
        Points of contact [m]: the mean of `points` weighted by the normal forces; where nothing
        but a damper acts, the middle between the centres of mass.
    centers : ndarray, shape (n_bodies, 3)
        Centres of mass [m] of all bodies.
    is_wall : ndarray of bool, shape (n_bodies,)
        Which bodies are walls.
    """

    nodes: IndexArray
    normal: FloatArray
    friction: FloatArray
    node_damping: FloatArray
    points: FloatArray
    bodies: IndexArray
    contacts: IndexArray
    force: FloatArray
    damping: FloatArray
    reaction: FloatArray
    normal_force: FloatArray
    places: FloatArray
    centers: FloatArray
    is_wall: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.bodies)

    def forces_on_bodies(self) -> FloatArray:
        """Force of contact and damping on each body [N], shape (n_bodies, 3)."""
        total = np.zeros_like(self.centers)
        np.add.at(total, self.bodies[:, 0], self.force + self.damping)
        np.add.at(total, self.bodies[:, 1], self.reaction - self.force)
        return total

    def coordination(self) -> IndexArray:
        """Count the other bodies that touch each body, shape (n_bodies,)."""
        touching = self.bodies[self.contacts > 0]
        return np.bincount(touching.ravel(), minlength=len(self.centers))

    def chains(self, factor: float = 1.0, min_bodies: int = 3) -> IndexArray:
        """Find force chains: bodies linked by strong contacts.

        A contact is strong when its normal force is above the mean of all (Radjai et al. 1998).

        Parameters
        ----------
        factor : float
            Multiple of the mean force above which a contact is strong, positive.
        min_bodies : int
            Bodies that make a chain at least.

        Returns
        -------
        ndarray of int, shape (m,)
            Number of the chain that each pair of bodies belongs to, from 0 for that with the most
            bodies; -1 for none.

        Raises
        ------
        InputError
            If `factor` is not positive.

        References
        ----------
        Radjai, Wolf, Jean, Moreau, Phys. Rev. Lett. 80 (1998) 61.
        """
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        if not factor > 0:
            raise InputError(f"chains: factor = {factor!r}: must be positive; 1 is the mean force")
        chain = np.full(len(self.bodies), -1)
        touching = self.contacts > 0
        if not touching.any():
            return chain
        strong = touching & (self.normal_force > factor * self.normal_force[touching].mean())
        n = len(self.centers)
        i, j = self.bodies[strong].T
        _, label = connected_components(coo_array((np.ones(len(i)), (i, j)), shape=(n, n)), False)
        sizes = np.bincount(label)
        order = [one for one in np.argsort(-sizes, kind="stable") if sizes[one] >= min_bodies]
        number = np.full(len(sizes), -1)
        number[order] = np.arange(len(order))
        chain[strong] = number[label[i]]
        return chain

    def to_frame(self) -> pd.DataFrame:
        """Table of the pairs of bodies: ids, node contacts, forces, places, chain."""
        import pandas as pd

        sums = {"f": self.force, "d": self.damping, "": self.places}
        return pd.DataFrame(
            {
                "body_i": self.bodies[:, 0],
                "body_j": self.bodies[:, 1],
                "contacts": self.contacts,
                "normal_force": self.normal_force,
                **{
                    f"{letter}{axis}": values[:, k]
                    for letter, values in sums.items()
                    for k, axis in enumerate("xyz")
                },
                "chain": self.chains(),
            }
        )

    def nodes_to_frame(self) -> pd.DataFrame:
        """Table of the pairs of nodes: numbers, places, forces on the first."""
        import pandas as pd

        sums = {"": self.points, "n": self.normal, "t": self.friction, "d": self.node_damping}
        return pd.DataFrame(
            {
                "node_i": self.nodes[:, 0],
                "node_j": self.nodes[:, 1],
                **{
                    f"{letter}{axis}": values[:, k]
                    for letter, values in sums.items()
                    for k, axis in enumerate("xyz")
                },
            }
        )


def contact_network(model: DEMModel) -> ContactNetwork:
    """Find the contacts of the present state and their forces.

    Parameters
    ----------
    model : DEMModel
        The model; it stays as it is.

    Returns
    -------
    ContactNetwork
    """
    model.init()
    state: Any = model.state
    nodes, parts = model._core.node_contacts()
    of_bodies, dampers = model._core.body_dampings()
    nodes = np.asarray(nodes, dtype=np.int64)
    node_bodies = state.particle_id[nodes].astype(np.int64)
    other = node_bodies[:, 0] != node_bodies[:, 1]  # not the self-contact of one body
    pairs = np.concatenate([node_bodies[other], of_bodies]).astype(np.int64)
    bodies, place = np.unique(np.sort(pairs, axis=1), axis=0, return_inverse=True)
    place, m = place.ravel(), len(bodies)
    at_nodes, at_dampers = place[: other.sum()], place[other.sum() :]

    def sums(index: IndexArray, values: FloatArray) -> FloatArray:
        return np.stack([np.bincount(index, values[:, d], m) for d in range(3)], axis=1)

    # Forces on the body with the smaller id, which need not be the first.
    sign = np.where(np.diff(node_bodies[other], axis=1) > 0, 1.0, -1.0)
    normal, whole = sign * parts[other, 0], sign * parts[other].sum(axis=1)
    swapped = (np.diff(of_bodies.astype(np.int64), axis=1) < 0)[:, 0]
    dampers = np.where(swapped[:, None, None], dampers[:, ::-1], dampers)
    points = state.x[nodes].mean(axis=1)
    size = np.linalg.norm(normal, axis=1)
    weight = np.bincount(at_nodes, size, m)
    mass = state.volume * state.density
    starts = [body.start for body in model._bodies]
    centers = (
        np.add.reduceat(mass[:, None] * state.x, starts) / np.add.reduceat(mass, starts)[:, None]
    )
    places = centers[bodies].mean(axis=1)
    pressed = weight > 0
    places[pressed] = sums(at_nodes, size[:, None] * points[other])[pressed] / weight[pressed, None]
    return ContactNetwork(
        nodes=nodes,
        normal=parts[:, 0],
        friction=parts[:, 1],
        node_damping=parts[:, 2],
        points=points,
        bodies=bodies,
        contacts=np.bincount(at_nodes, minlength=m),
        force=sums(at_nodes, whole),
        damping=sums(at_dampers, dampers[:, 0]),
        reaction=sums(at_dampers, dampers[:, 1]),
        normal_force=np.linalg.norm(sums(at_nodes, normal), axis=1),
        places=places,
        centers=centers,
        is_wall=np.array([body.is_wall for body in model._bodies]),
    )


def contacts_path(output: Path) -> Path:
    """Name of the table of contacts that goes with an output: ``contact_network_<k>.csv``."""
    return output.with_name(f"{output.stem.replace('output', 'contact_network', 1)}.csv")


def write_contacts(path: Path, network: ContactNetwork) -> None:
    """Write the pairs of bodies as csv (tag ``Contact_Network``), as `to_frame` has them.

    Raises
    ------
    InputError
        If the file cannot be written.
    """
    with replace_file(path) as temporary:
        network.to_frame().to_csv(temporary, index=False, lineterminator="\n")
