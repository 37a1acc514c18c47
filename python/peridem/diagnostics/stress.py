"""Stresses from the forces of bonds and contacts: of nodes, bodies and regions."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .momentum import sum_over_bodies
from .network import contact_network

if TYPE_CHECKING:
    from ..model import DEMModel

__all__ = ["body_stress", "bulk_stress", "contact_stress", "node_stress"]

FloatArray = NDArray[np.float64]


def _virials(model: DEMModel) -> FloatArray:
    """Each node's share of volume times stress [J], from bonds and contacts: (n_nodes, 3, 3)."""
    model.init()
    virials = np.array(model._core.bond_virials())
    nodes, forces = model._core.node_contacts()
    x = model.state.x
    pulls = 0.5 * np.einsum("ki,kj->kij", forces.sum(axis=1), x[nodes[:, 1]] - x[nodes[:, 0]])
    np.add.at(virials, nodes[:, 0], pulls)
    np.add.at(virials, nodes[:, 1], pulls)
    return virials


def _damper_virials(model: DEMModel) -> FloatArray:
    """Each node's share of volume times stress [J] from dampers between bodies: (n_nodes, 3, 3).

    A damper acts on all nodes of a body alike and carries its force from centre to centre: half of
    F x (c_q - c_p) is either body's. Against a wall, it is from the place of contact to the
    particle's centre, all in the particle.
    """
    network, state = contact_network(model), model.state
    moment, force = np.zeros((len(network.centers), 3, 3)), np.zeros((len(network.centers), 3))
    (i, j), on_i, on_j = network.bodies.T, network.damping, network.reaction
    for body, other, pull in ((i, j, on_i), (j, i, on_j)):
        wall = network.is_wall[other][:, None]
        end = np.where(wall, network.places, network.centers[other])
        share = np.where(wall, 1.0, 0.5) * pull
        np.add.at(force, body, share)
        np.add.at(moment, body, np.einsum("ki,kj->kij", share, end))
    ids = state.particle_id
    part = state.volume / sum_over_bodies(model, state.volume)[ids]
    arms = moment[ids] - np.einsum("ni,nj->nij", force[ids], state.x)
    return np.asarray(part[:, None, None] * arms)


def node_stress(model: DEMModel) -> FloatArray:
    r"""Measure the virial stress at every node.

    .. math:: \sigma_i = \frac{1}{2 V_i} \sum_j F_{ij} \otimes (x_j - x_i)

    over the bonds and contacts of a node (their dampers included), with the force F_ij on i from j.
    Dampers between centres and against walls are not: they act on all nodes of a body alike, as
    gravity does.

    Parameters
    ----------
    model : DEMModel
        The model.

    Returns
    -------
    ndarray, shape (n_nodes, 3, 3)
        Cauchy stress [Pa], tension positive.

    References
    ----------
    Lehoucq, Silling, J. Mech. Phys. Solids 56 (2008) 1566; Subramaniyan, Sun, Int. J. Solids
    Struct. 45 (2008) 4340.
    """
    return np.asarray(_virials(model) / model.state.volume[:, None, None])


def body_stress(model: DEMModel) -> FloatArray:
    """Measure the mean virial stress of every body, from its bonds and half of its contacts.

    Parameters
    ----------
    model : DEMModel
        The model.

    Returns
    -------
    ndarray, shape (n_bodies, 3, 3)
        Cauchy stress [Pa], tension positive: the mean of `node_stress` by volume.
    """
    volume = sum_over_bodies(model, model.state.volume)
    return np.asarray(sum_over_bodies(model, _virials(model)) / volume[:, None, None])


def contact_stress(model: DEMModel) -> FloatArray:
    r"""Measure the mean stress of every body by what acts on it from outside.

    .. math:: \bar\sigma = \frac{1}{V} \sum_c F_c \otimes (x_c - x_0)

    over the forces of contact and damping on its nodes, x_0 its centre of mass (Love, Weber). In a
    body at rest under these forces and uniform ones like gravity it is the mean of the stress
    inside, `body_stress` but for the halves of the contacts. Dampers between centres and against
    walls act on all nodes of a particle alike, so that their sum is zero; on a wall they act where
    it is touched, and count.

    Parameters
    ----------
    model : DEMModel
        The model.

    Returns
    -------
    ndarray, shape (n_bodies, 3, 3)
        Cauchy stress [Pa], tension positive.

    References
    ----------
    Weber, Cahiers Groupe Franc. Rheol. 1 (1966) 161; Bagi, Mech. Mater. 22 (1996) 165.
    """
    state: Any = model.state
    mass = state.volume * state.density
    center = sum_over_bodies(model, mass[:, None] * state.x)
    center /= sum_over_bodies(model, mass)[:, None]
    arm = state.x - center[state.particle_id]
    force = state.volume[:, None] * model.contact_forces()
    volume = sum_over_bodies(model, state.volume)
    whole = sum_over_bodies(model, np.einsum("ni,nj->nij", force, arm))
    return np.asarray(whole / volume[:, None, None])


def bulk_stress(
    model: DEMModel,
    region: Sequence[Sequence[float]] | None = None,
    *,
    volume: float | None = None,
    kinetic: bool = False,
) -> FloatArray:
    """Measure the stress of an assembly, or of the part of it in a box.

    Of bonds, contacts and dampers: a damper between two bodies carries its force F from centre to
    centre, F x (c_q - c_p), one against a wall from the place of contact to the centre.

    Parameters
    ----------
    model : DEMModel
        The model.
    region : pair of points, optional
        Lower and upper corner [m] of a box; nodes in it count, those of walls do not. All bodies
        but walls when left out.
    volume : float, optional
        Volume [m^3] to divide by, area [m^2] in 2D; that of the box, without one that of the
        bodies (without pores) when left out.
    kinetic : bool
        Subtract the momentum flux of the motion about the mean, as in a gas.

    Returns
    -------
    ndarray, shape (3, 3)
        Cauchy stress [Pa], tension positive; the pressure is -trace / dimension.

    Raises
    ------
    InputError
        If the box is empty or the volume not positive.
    """
    state: Any = model.state
    chosen = ~np.array([body.is_wall for body in model._bodies])[state.particle_id]
    if region is not None:
        box = np.asarray(region, dtype=float)
        d = model.dimension
        if box.shape not in ((2, d), (2, 3)) or not (box[0, :d] < box[1, :d]).all():
            raise InputError(
                f"bulk_stress: region = {region!r}: must be the lower and the upper corner of a "
                f"box, {d} numbers each; correct it"
            )
        x = state.x[:, :d]
        chosen = chosen & ((x >= box[0, :d]) & (x < box[1, :d])).all(axis=1)
        whole = float(np.prod(box[1, :d] - box[0, :d]))
    else:
        whole = float(state.volume[chosen].sum())
    whole = whole if volume is None else float(volume)
    if not whole > 0:
        raise InputError(f"bulk_stress: volume = {whole!r}: must be positive; correct it")
    stress = (_virials(model) + _damper_virials(model))[chosen].sum(axis=0)
    if kinetic and chosen.any():
        mass = (state.volume * state.density)[chosen]
        v = state.v[chosen] - np.average(state.v[chosen], axis=0, weights=mass)
        stress -= np.einsum("n,ni,nj->ij", mass, v, v)
    return np.asarray(stress / whole)
