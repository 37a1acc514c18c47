"""Forces and energies between bodies: nodes against nodes, centres against centres."""

# ruff: noqa: N803, N806 - symbols of the paper

from dataclasses import dataclass

import numpy as np

from .bonds import distances
from .comparison import less


@dataclass(frozen=True)
class ContactLaw:
    """Constants of a pair of zones."""

    Rc: float  # contact radius [m]
    Kn: float  # normal stiffness [N/m^7]
    mu: float  # friction coefficient
    beta: float  # -2 C ln(eps_n) / sqrt(pi^2 + ln(eps_n)^2), without sqrt(kappa Rc meq)
    kappa: float  # effective bulk modulus [Pa]
    by_nodes: bool  # centre damping acts while nodes (not centres) are close
    node_damping: bool
    history: bool  # friction of a tangential spring, else of the direction of the slip alone
    kt: float  # stiffness of that spring [N/m^7]
    self_contact: bool  # also between nodes of one body that were never bonded to each other

    def damping(self, mass):
        """(23, 28) betan = beta sqrt(kappa Rc meq)."""
        return self.beta * np.sqrt(self.kappa * self.Rc * mass)


def make_contact_law(contact, kappa, h_min, horizon):
    """Constants from a deck's Contact.Zone_ij; defaults by eqs. 35 and 36."""
    factor = 0.95 if contact.contact_radius_factor is None else contact.contact_radius_factor
    Kn = 18 * kappa / (np.pi * horizon**5) if contact.kn is None else contact.kn
    ln = np.log(contact.epsilon) if contact.damping_on and contact.epsilon else 0.0
    ratio = contact.tangential_stiffness_ratio
    mu = contact.friction_coeff or 0.0 if contact.friction_on else 0.0
    return ContactLaw(
        Rc=factor * h_min if contact.contact_radius is None else contact.contact_radius,
        Kn=Kn * contact.kn_factor,
        mu=mu,
        beta=contact.beta_n_factor * -2 * ln / np.sqrt(np.pi**2 + ln**2),
        kappa=kappa,
        by_nodes=contact.center_damping_criterion == "nodes",
        node_damping=contact.node_damping and contact.damping_on,
        history=contact.friction_model == "history" and mu > 0,
        kt=(2 / 7 if ratio is None else ratio) * Kn * contact.kn_factor,
        self_contact=contact.self_contact,
    )


def harmonic(a, b):
    """2ab / (a + b): kappa_eff (25), meq (24, 29)."""
    return 2 * a * b / (a + b)


def touching(x, p, q, radius):
    """Pairs (i of p, j of q) of nodes closer than the radius: every pair is looked at.

    Within one body, nodes that are or were bonded do not touch: broken bonds have their own law.
    """
    near = less(distances(x[p.nodes], x[q.nodes]), radius)
    if p is q:
        near[p.solid.bonds.i, p.solid.bonds.j] = False
        np.fill_diagonal(near, val=False)
    i, j = np.nonzero(near)
    return p.start + i, q.start + j


@dataclass
class Pairs:
    """Forces on nodes i of p from nodes j of q, per unit volume of i."""

    i: np.ndarray
    j: np.ndarray
    normal: np.ndarray
    friction: np.ndarray
    damping: np.ndarray

    @property
    def total(self):
        """All three."""
        return self.normal + self.friction + self.damping


def pair_forces(state, p, q, law, *, springs, slip_time, original):
    """Forces on p from q, node by node; `springs`: elongations by pair, see `spring_friction`."""
    i, j = touching(state.x, p, q, law.Rc)
    dx = state.x[j] - state.x[i]
    d = np.linalg.norm(dx, axis=1)
    e_n = dx / d[:, None]  # (18)
    F = law.Kn * (d - law.Rc) * state.V[j]  # (17), at most 0
    w = state.v[j] - state.v[i]
    approach = np.sum(w * e_n, axis=1)
    slip = w - approach[:, None] * e_n
    if law.history:
        pairs = list(zip(i.tolist(), j.tolist(), strict=True))
        slid = slip * slip_time
        friction = spring_friction(law, pairs, springs, e_n=e_n, slid=slid, F=F, V_j=state.V[j])
    else:
        friction = slip_friction(law, slip, F, original=original)
    c = np.minimum(0, approach) * law.node_damping
    m = state.rho * state.V
    beta = law.damping(harmonic(m[i], m[j]))
    return Pairs(
        i,
        j,
        normal=F[:, None] * e_n,
        friction=friction,
        damping=(beta * c / state.V[i])[:, None] * e_n,  # (22)
    )


def slip_friction(law, slip, F, *, original):
    """(19, 20) mu |F| along the slip of j past i, which drags i with it.

    The original (also eq. 20) has the other sign: it pushes i along its own slip.
    """
    speed = np.linalg.norm(slip, axis=1)[:, None]
    e_t = np.divide(slip, speed, out=np.zeros_like(slip), where=speed > 0)
    sign = 1 if original else -1
    return (sign * law.mu * F)[:, None] * e_t


def spring_friction(law, pairs, springs, *, e_n, slid, F, V_j):
    """Cundall, Strack 1979: a spring stretched by the slip pulls i by kt |xi| V_j <= mu |F|.

    `springs` holds xi of every pair that touched in the last evaluation; it is renewed. It is kept
    in the tangential plane, and cut back to the length that the limit allows.
    """
    renewed = {}
    force = np.zeros_like(slid)
    for k, pair in enumerate(pairs):
        xi = springs.get(pair, np.zeros(3)) + slid[k]
        xi = xi - (xi @ e_n[k]) * e_n[k]
        pull, limit = law.kt * np.linalg.norm(xi) * V_j[k], law.mu * abs(F[k])
        xi = xi * min(1.0, limit / pull) if pull > 0 else xi
        renewed[pair] = xi
        force[k] = law.kt * V_j[k] * xi
    springs.clear()
    springs.update(renewed)
    return force


def damped_volume(body, *, original):
    """|Omega_p| of (27), the body's volume; in the original the disc of the bounding radius."""
    return np.pi * body.radius**2 if original else body.volume


def center_damping(state, p, q, law, volumes):
    """(27) force densities on p and on q, or None when the dashpot is idle."""
    dx = state.x[q.center] - state.x[p.center]
    d = np.linalg.norm(dx)
    if law.by_nodes:
        active = len(touching(state.x, p, q, law.Rc)[0]) > 0
    else:
        active = less(d, p.radius + q.radius + 1.01 * law.Rc)
    n = dx / d
    c = min(0.0, (state.v[q.center] - state.v[p.center]) @ n)  # (26)
    if not active or c == 0:
        return None
    beta = law.damping(harmonic(p.rho * volumes[0], q.rho * volumes[1]))  # (28, 29)
    return beta * c * n / volumes[0], -beta * c * n / volumes[1]


def wall_damping(state, p, wall, law, volume):
    """(27) with every wall node near p as the other particle: force density on p, and F on them.

    Returns the density on every node of p, the wall nodes, and the reaction densities on those:
    the force on the whole of p, reversed, over the node's volume.
    """
    nodes = np.unique(touching(state.x, p, wall, law.Rc)[1])
    dx = state.x[nodes] - state.x[p.center]
    n = dx / np.linalg.norm(dx, axis=1)[:, None]
    c = np.minimum(0, np.sum((state.v[nodes] - state.v[p.center]) * n, axis=1))
    on_p = (law.damping(p.rho * volume) * c / volume)[:, None] * n
    return on_p.sum(axis=0), nodes, -on_p * (p.volume / state.V[nodes])[:, None]


def contact_energy(state, p, q, law):
    """Sum over touching pairs of Kn V_i V_j (d - Rc)^2 / 2: V_i f_i is minus its derivative."""
    i, j = touching(state.x, p, q, law.Rc)
    d = np.linalg.norm(state.x[j] - state.x[i], axis=1)
    return np.sum(0.5 * law.Kn * state.V[i] * state.V[j] * (d - law.Rc) ** 2)
