"""Constants of the material laws, and influence functions."""

# ruff: noqa: N803, N806 - symbols of the paper

from dataclasses import dataclass

import numpy as np
from scipy.integrate import quad

from .comparison import greater


@dataclass(frozen=True)
class Influence:
    """J(a) of the normalised bond length a = r / eps, and its moments."""

    kind: int
    p: tuple

    @classmethod
    def of(cls, material, dimension):
        """From a deck's Influence_Function; parameters left out get the original's defaults."""
        kind = material.influence_function.type
        p = list(material.influence_function.parameters)
        if kind == 0:
            p = p or [dimension + 1.0]
        elif kind == 1:
            p = p or [(dimension + 1.0) * (dimension + 2.0)]
            p = p if len(p) == 2 else [p[0], -p[0]]
        elif not p:
            moment = quad(lambda a: np.exp(-(a**2) / 0.2) * a**dimension, 0, 1, epsabs=1e-15)[0]
            p = [1 / moment, 0.2]
        return cls(kind, tuple(p))

    def __call__(self, a):
        """J(a)."""
        if self.kind == 0:
            return self.p[0] + 0 * a
        if self.kind == 1:
            return self.p[0] + self.p[1] * a
        return self.p[0] * np.exp(-(a**2) / self.p[1])

    def moment(self, i):
        """M_i, the integral of J(a) a^i over [0, 1]."""
        return quad(lambda a: self(a) * a**i, 0, 1, epsabs=1e-15)[0]


@dataclass(frozen=True)
class Elastic:
    """E, K, G, lambda [Pa], nu and Gc [J/m^2]."""

    E: float
    K: float
    G: float
    nu: float
    lame: float
    Gc: float


def elastic_constants(material):
    """All constants from the two given; bond-based laws have nu = 1/4 and E, else K."""
    E, K = material.young_modulus, material.bulk_modulus
    G, nu = material.shear_modulus, material.poisson_ratio
    if material.type != "PDState":
        nu = 0.25
        E = E if E is not None else 3 * K * (1 - 2 * nu)
        G = None
    elif E is None:  # K and G
        E = 9 * K * G / (3 * K + G)
        nu = (3 * K - 2 * G) / (2 * (3 * K + G))
    elif K is not None:
        nu = (3 * K - E) / (6 * K)
    elif G is not None:
        nu = E / (2 * G) - 1
    Gc = material.fracture_energy
    if Gc is None and material.fracture_toughness is not None:
        Gc = material.fracture_toughness**2 / E
    return Elastic(
        E=E,
        K=K if K is not None else E / (3 * (1 - 2 * nu)),
        G=G if G is not None else E / (2 * (1 + nu)),
        nu=nu,
        lame=E * nu / ((1 + nu) * (1 - 2 * nu)),
        Gc=Gc,
    )


class Law:
    """What the laws share: the break test |s| > limit, or s > limit in tension only."""

    state_based = False
    along_deformed_bond = True
    tension_only = False

    def break_limit(self, r):
        """Stretch [-] beyond which a bond of length r breaks."""
        return self.s0 + 1e-10

    def breaks(self, r, s):
        """Whether a bond of reference length r breaks at the stretch s."""
        return greater(s if self.tension_only else np.abs(s), self.break_limit(r))

    def damage(self, r, s):
        """|s| / s0."""
        return np.abs(s) / self.s0


class PDState(Law):
    """State-based linear peridynamic solid, eqs. 9 to 13."""

    state_based = True

    def __init__(self, K, G, s0):
        self.K, self.G, self.s0 = K, G, s0

    @classmethod
    def classical(cls, c, horizon):
        """(10) s0 = sqrt( Gc / ((3 G + (3/4)^4 (K - 5G/3)) eps) )."""
        s0 = np.sqrt(c.Gc / ((3 * c.G + (3 / 4) ** 4 * (c.K - 5 * c.G / 3)) * horizon))
        return cls(c.K, c.G, s0)


class PMBBond(Law):
    """Prototype microelastic brittle bond: f = J c s."""

    def __init__(self, c, s0):
        self.c, self.s0 = c, s0

    @classmethod
    def classical(cls, c, horizon, dimension):
        """c from E in 2D and lambda in 3D, as in the program."""
        if dimension == 3:
            stiffness = 24 * c.lame / (np.pi * horizon**3)
        else:
            stiffness = 24 * c.E / (np.pi * horizon**3 * (1 - c.nu))
        return cls(stiffness, np.sqrt(5 * np.pi * c.Gc / (9 * c.E * horizon)))

    def force(self, r, s):
        """Magnitude per J V_j, along the bond."""
        return self.c * s

    def potential(self, r, s):
        """Energy of a bond per J V_i V_j: its derivative along the bond is `force`."""
        return 0.5 * self.c * r * s**2

    def bulk_modulus(self, horizon):
        """K the program recovers from c."""
        return 5 / 3 * self.c * np.pi * horizon**3 / 24


class PDElasticBond(PMBBond):
    """A bond that never breaks."""

    def __init__(self, c):
        super().__init__(c, np.inf)

    @classmethod
    def classical(cls, c, horizon):
        """c from lambda."""
        return cls(24 * c.lame / (np.pi * horizon**3))


class RNPBond(Law):
    """Regularised nonlinear bond, softening: its stretch is linearised."""

    along_deformed_bond = False

    def __init__(self, C, beta, horizon, dimension, moment):
        self.C, self.beta = C, beta
        self.F = horizon ** (dimension + 1) * {1: 2, 2: np.pi, 3: 4 * np.pi / 3}[dimension]
        self.dimension, self.moment = dimension, moment
        self.factor, self.irreversible = 1.0, True

    @classmethod
    def classical(cls, c, horizon, dimension, moment):
        """C and beta from Gc, lambda and the d-th moment of J."""
        if dimension == 3:
            C = 2 * c.Gc / (3 * moment)
            return cls(C, 5 * c.lame / (C * moment), horizon, dimension, moment)
        C = np.pi * c.Gc / (4 * moment)
        return cls(C, 4 * c.lame / (C * moment), horizon, dimension, moment)

    def critical(self, r):
        """Stretch of the largest force, sqrt(1 / (2 beta r))."""
        return np.sqrt(1 / (2 * self.beta)) / np.sqrt(r)

    def break_limit(self, r):
        """Factor times the critical stretch; bonds may be told not to break."""
        return self.factor * self.critical(r) if self.irreversible else np.inf + 0 * r

    def breaks(self, r, s):
        """As for the others, unless fracture is reversible."""
        return super().breaks(r, s) if self.irreversible else np.zeros(np.shape(s), dtype=bool)

    def damage(self, r, s):
        """|s| / sc(r)."""
        return np.abs(s) / self.critical(r)

    def force(self, r, s):
        """Magnitude per J V_j, along the reference bond."""
        return 4 * s * self.C * self.beta * np.exp(-self.beta * r * s**2) / self.F

    def potential(self, r, s):
        """Energy of a bond per J V_i V_j."""
        return 2 * self.C * (1 - np.exp(-self.beta * r * s**2)) / self.F

    def bulk_modulus(self, horizon):
        """K = 5/3 lambda for nu = 1/4, lambda from C and beta."""
        lame = self.C * self.moment * self.beta / (5 if self.dimension == 3 else 4)
        return 5 / 3 * lame


def make_law(material, influence, horizon, dimension):
    """Build the law of a deck's material for a body of this horizon."""
    direct = None if material.compute_from_classical else material.bond_potential.parameters
    c = None if direct else elastic_constants(material)
    if material.type == "PDState":
        law = PDState(*direct) if direct else PDState.classical(c, horizon)
    elif material.type == "PMBBond":
        law = PMBBond(*direct) if direct else PMBBond.classical(c, horizon, dimension)
    elif material.type == "PDElasticBond":
        law = PDElasticBond(*direct) if direct else PDElasticBond.classical(c, horizon)
    else:
        size = (horizon, dimension, influence.moment(dimension))
        law = RNPBond(*direct, *size) if direct else RNPBond.classical(c, *size)
        law.factor = material.bond_potential.check_sc_factor
        law.irreversible = material.bond_potential.irreversible_bond_fracture
    law.tension_only = material.bond_breaking == "tension"
    return law


def law_bulk_modulus(law, horizon):
    """K behind the self-contact of broken bonds."""
    return law.K if law.state_based else law.bulk_modulus(horizon)


def contact_bulk_modulus(material, law, horizon):
    """K behind the damping of contact: the deck's, else the law's."""
    if material.compute_from_classical:
        return elastic_constants(material).K
    return law_bulk_modulus(law, horizon)
