"""Forces and energies inside one body."""

# ruff: noqa: N806 - symbols of the paper

from dataclasses import dataclass

import numpy as np

from .bonds import Bonds, sum_at


@dataclass
class Solid:
    """A body: its bonds, its law and its self-contact. Arrays are over its own nodes."""

    X: np.ndarray
    V: np.ndarray
    bonds: Bonds
    law: object
    Rc_self: float  # 0.95 h
    Kn_self: float  # 18 K / (pi eps^5)
    dilates: bool = True  # False: no dilatation, no state-based break test (original, see model)


@dataclass
class Internal:
    """Result of a force evaluation."""

    f: np.ndarray
    theta: np.ndarray
    Z: np.ndarray


def deformed(solid, u):
    """y = (X_j - X_i) + (u_j - u_i) of every bond, and its length."""
    b = solid.bonds
    y = (solid.X[b.j] - solid.X[b.i]) + (u[b.j] - u[b.i])
    return y, np.linalg.norm(y, axis=1)


def internal_force(solid, u, intact):
    """Force density, dilatation and damage; breaks bonds in `intact`."""
    if solid.law.state_based:
        return state_based(solid, u, intact)
    return bond_based(solid, u, intact)


def factors(solid):
    """a = 3K/m - 15G/(3m) and b = 15G/m of every node, eq. 9."""
    b = 15 * solid.law.G / solid.bonds.m
    return 3 * solid.law.K / solid.bonds.m - b / 3, b


def dilatation(solid, e, intact):
    """(13) theta = 3/m sum over unbroken bonds of r e J V_j."""
    b = solid.bonds
    return 3 / b.m * sum_at(b.i, np.where(intact, b.r * e * b.w, 0), len(solid.X))


def state_based(solid, u, intact):
    """PDState: the break test comes first, so that a breaking bond carries nothing."""
    bonds, n = solid.bonds, len(solid.X)
    i, j, r = bonds.i, bonds.j, bonds.r
    y, length = deformed(solid, u)
    e = length - r
    s = e / r
    if solid.dilates:
        intact[solid.law.breaks(r, s)] = False  # (11)
    theta = dilatation(solid, e, intact) * solid.dilates
    a, b = factors(solid)
    # (12) T + T' = J [ r (theta a + theta' a') + e (b + b') ], along the deformed bond
    t = r * (theta[i] * a[i] + theta[j] * a[j]) + e * (b[i] + b[j])
    pull = (bonds.w * t / length)[:, None] * y
    f = sum_at(i, np.where(intact[:, None], pull, self_contact(solid, y, length)), n)
    return Internal(f, theta, damage(solid, s))


def bond_based(solid, u, intact):
    """PMBBond, PDElasticBond, RNPBond.

    A bond exerts no force in the evaluation that breaks it; its self-contact starts in the next.
    """
    law, bonds, n = solid.law, solid.bonds, len(solid.X)
    i, j, r = bonds.i, bonds.j, bonds.r
    y, length = deformed(solid, u)
    xi = solid.X[j] - solid.X[i]
    if law.along_deformed_bond:
        s, direction = (length - r) / r, y / length[:, None]
    else:
        s, direction = np.sum((u[j] - u[i]) * xi, axis=1) / r**2, xi / r[:, None]
    broken_before = ~intact
    intact[law.breaks(r, s)] = False
    pull = (bonds.w * law.force(r, s))[:, None] * direction
    f = sum_at(i, np.where(intact[:, None], pull, 0), n)
    contact = self_contact(solid, y, length)
    f += sum_at(i, np.where(broken_before[:, None], contact, 0), n)
    return Internal(f, np.zeros(n), damage(solid, s))


def self_contact(solid, y, length):
    """(17, 36) between the ends of a broken bond: min(0, Kn V_j (|y| - Rc) / |y|) y."""
    push = solid.Kn_self * solid.V[solid.bonds.j] * (length - solid.Rc_self) / length
    return np.minimum(0, push)[:, None] * y


def damage(solid, s):
    """(14) Z = max over all neighbours, broken ones too, of |s| / s0."""
    Z = np.zeros(len(solid.X))
    np.maximum.at(Z, solid.bonds.i, solid.law.damage(solid.bonds.r, s))
    return Z


def strain_energy(solid, u, intact):
    """W with V_i f_i = -dW/du_i while no bond breaks [J, per unit thickness in 2D].

    PDState: W = sum_i V_i [ (K - 5G/3) theta_i^2 / 2 + 15 G / (2 m_i) sum_j J V_j e_ij^2 ].
    The derivative with respect to e_ij of i's part is V_i [ (K - 5G/3) theta_i 3 r / m_i +
    15 G e / m_i ] J V_j, that is V_i V_j J (theta_i a_i r + b_i e) with the factors of eq. 9.
    Bonds count from both ends, hence 1/2 for pair potentials; broken ones repel as springs.
    """
    law, b = solid.law, solid.bonds
    _, length = deformed(solid, u)
    e = length - b.r
    if law.state_based:
        theta = dilatation(solid, e, intact)
        shear = sum_at(b.i, np.where(intact, b.w * e**2, 0), len(solid.X))
        density = 0.5 * (law.K - 5 * law.G / 3) * theta**2 + 0.5 * 15 * law.G / b.m * shear
        bulk = np.sum(solid.V * density)
    else:
        xi = solid.X[b.j] - solid.X[b.i]
        linear = np.sum((u[b.j] - u[b.i]) * xi, axis=1) / b.r**2
        s = e / b.r if law.along_deformed_bond else linear
        bulk = 0.5 * np.sum(np.where(intact, solid.V[b.i] * b.w * law.potential(b.r, s), 0))
    overlap = np.minimum(0, length - solid.Rc_self)
    pairs = 0.5 * solid.Kn_self * solid.V[b.i] * solid.V[b.j] * overlap**2
    return bulk + 0.5 * np.sum(np.where(intact, 0, pairs))
