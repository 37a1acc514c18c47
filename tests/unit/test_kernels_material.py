"""Constants and closed forms of the laws, on bodies of two or three nodes in a row.

Two nodes of volume V at distance r, J(r/eps) = J, have m = r^2 J V; stretched by s they have
theta = 3/m r (r s) J V = 3 s.
"""

# ruff: noqa: N803, N806 - symbols of the paper

import numpy as np
import pytest
from helpers import displace, single_deck

R = 4.0e-3  # distance of the nodes
V = 1.6e-5
EPS = 1.0e-2  # R < EPS - R/2: no partial volumes
K, G, GC = 1.0e9, 5.0e8, 100.0
E = 9.0e9 / 7  # 9KG / (3K + G)
NU = 2 / 7  # (3K - 2G) / (2 (3K + G))
AXIS = {2: np.array([1.0, 0.0, 0.0]), 3: np.array([1.0, 2.0, 2.0]) / 3}  # of the row
CLOUD = {"Type": "circle", "Parameters": [1.0e-2]}


@pytest.fixture
def cloud(deck_folder):
    """Builder of a body of nodes in a row: cloud(material, positions, dimension)."""

    def build(material, x=(0.0, R), dimension=2):
        points = [(a * AXIS[dimension]).tolist() for a in x]
        name = deck_folder.nodes("cloud", points, [V] * len(x))
        shape = CLOUD if dimension == 2 else {**CLOUD, "Type": "sphere"}
        deck = single_deck(name, shape, Dimension=dimension)
        fracture = {} if "KIc" in material else {"Gc": GC}
        defaults = {"Density": 1000.0, "Horizon": EPS, **fracture}
        deck["Material"]["Zone_1"] = {**defaults, **material}
        return deck_folder.model(deck)

    return build


def stretch(model, s):
    """Stretch a body by s and return its forces along the row."""
    displace(model, s * model.state.x_ref)
    model.compute_forces()
    return model.state.f @ AXIS[model.dimension]


STATE = {"Type": "PDState", "K": K, "G": G}


def test_state_based_pair_pulls_with_18_k_s_by_r(cloud):
    # t J V = [2 r theta (3K - 5G)/m + 2 s r 15G/m] J V = 18 K s / r: G drops out
    model = cloud(STATE)
    f = stretch(model, 1e-3)
    np.testing.assert_allclose(f, [18 * K * 1e-3 / R, -18 * K * 1e-3 / R], rtol=1e-11)
    np.testing.assert_allclose(model.state.theta, 3e-3, rtol=1e-12)


# E = 9KG/(3K+G), nu = (3K-2G)/(2(3K+G)), and Gc = KIc^2/E
@pytest.mark.parametrize(
    "constants",
    [
        {"K": K, "G": G},
        {"E": E, "K": K},
        {"E": E, "G": G},
        {"E": E, "Poisson_Ratio": NU},
        {"K": K, "G": G, "KIc": np.sqrt(GC * E)},
    ],
    ids="-".join,
)
def test_state_based_constants_from_each_pair(cloud, constants):
    # Three nodes in a row, only next ones bonded (eps = 1.75 r, full volumes): m = 2 r^2 J V in
    # the middle, r^2 J V at the ends. The middle node moved by d: theta = 0 there, -+3 d/r at the
    # ends, so f = -2 d [3 (3K - 5G) + 15G (1/2 + 1)] / r^2 = -(18K + 15G) d / r^2.
    model = cloud({"Type": "PDState", "Horizon": 1.75 * R, **constants}, x=(0.0, R, 2 * R))
    d = 1e-3 * R
    u = np.zeros((3, 3))
    u[1, 0] = d
    displace(model, u)
    model.compute_forces()
    assert model.state.f[1, 0] == pytest.approx(-25.5e9 * d / R**2, rel=1e-11)
    # s0^2 = Gc / ((3G + 81/256 (K - 5G/3)) eps) = 100 / (1.552734375e9 * 7e-3)
    s0 = np.sqrt(100 / (1.552734375e9 * 7e-3))
    np.testing.assert_allclose(model.state.damage_z, 1e-3 / s0, rtol=1e-11)


def test_critical_stretch_of_the_paper_s_material_m1(cloud):
    # K = 5G/3: s0 = sqrt(Gc / (3 G eps)) = sqrt(50 / (3 * 1.296e7 * 6e-4)) = 0.0463 (eq. 10)
    m1 = {"Type": "PDState", "K": 2.16e7, "G": 1.296e7, "Gc": 50.0, "Horizon": 6e-4}
    model = cloud(m1, x=(0.0, 4e-4))
    stretch(model, 0.01)
    np.testing.assert_allclose(model.state.damage_z, 0.01 / 0.046296296, rtol=1e-7)


@pytest.mark.parametrize("constants", [{"E": 1e9}, {"K": 2e9 / 3}], ids=["E", "K"])
@pytest.mark.parametrize(("dimension", "J"), [(2, 3.0), (3, 4.0)])
def test_pmb_constants(cloud, constants, dimension, J):
    # nu = 1/4, lambda = 0.4 E. 2D: c = 24E/(pi eps^3 3/4) = 32e9/(pi 1e-6); 3D: 9.6e9/(pi 1e-6).
    # s0 = sqrt(5 pi Gc / (9 E eps)) = sqrt(1570.7963 / 9e7). Default J = d + 1.
    c = {2: 1.0185916357881e16, 3: 3.0557749073644e15}[dimension]
    model = cloud({"Type": "PMBBond", **constants}, dimension=dimension)
    f = stretch(model, 1e-3)
    np.testing.assert_allclose(f, [J * c * 1e-3 * V, -J * c * 1e-3 * V], rtol=1e-12)
    np.testing.assert_allclose(model.state.damage_z, 1e-3 / 4.1777138e-3, rtol=1e-7)


def test_elastic_bond_constant_and_no_breaking(cloud):
    # c = 24 lambda / (pi eps^3), lambda = 0.4 E
    model = cloud({"Type": "PDElasticBond", "E": 1e9})
    f = stretch(model, 0.5)
    np.testing.assert_allclose(np.abs(f), 3 * 3.0557749073644e15 * 0.5 * V, rtol=1e-12)
    assert model.bonds.intact.all()
    assert (model.state.damage_z == 0).all()


@pytest.mark.parametrize(("dimension", "J"), [(2, 3.0), (3, 4.0)])
def test_rnp_constants(cloud, dimension, J):
    # J = d + 1 has M_d = 1. 2D: C = pi Gc/4, C beta = 4 lambda = 1.6e9, F = pi eps^3;
    # 3D: C = 2 Gc/3, C beta = 5 lambda = 2e9, F = 4 pi/3 eps^4.
    C, C_beta, F = {
        2: (25 * np.pi, 1.6e9, np.pi * 1e-6),
        3: (200 / 3, 2.0e9, 4 * np.pi / 3 * 1e-8),
    }[dimension]
    beta, s = C_beta / C, 1e-3
    model = cloud({"Type": "RNPBond", "E": 1e9}, dimension=dimension)
    expected = J * 4 * s * C_beta * np.exp(-beta * R * s**2) / F * V
    np.testing.assert_allclose(stretch(model, s), [expected, -expected], rtol=1e-11)
    np.testing.assert_allclose(model.state.damage_z, s * np.sqrt(2 * beta * R), rtol=1e-11)


@pytest.mark.parametrize(
    ("law", "parameters", "force", "z"),
    [
        ("PDState", [K, G, 0.01], 18 * K * 1e-3 / R, 0.1),
        ("PMBBond", [1e16, 0.02], 3 * 1e16 * 1e-3 * V, 0.05),
        ("PDElasticBond", [1e16], 3 * 1e16 * 1e-3 * V, 0.0),
        # sc = sqrt(1/(2 beta r)) = sqrt(1/800)
        (
            "RNPBond",
            [80.0, 1e5],
            3 * 4e-3 * 80 * 1e5 * np.exp(-4e-4) / (np.pi * 1e-6) * V,
            1e-3 * np.sqrt(800),
        ),
    ],
)
def test_constants_given_directly(cloud, law, parameters, force, z):
    potential = {"Bond_Potential": {"Parameters": parameters}, "Compute_From_Classical": False}
    model = cloud({"Type": law, **potential})
    np.testing.assert_allclose(stretch(model, 1e-3), [force, -force], rtol=1e-11)
    np.testing.assert_allclose(model.state.damage_z, z, rtol=1e-11)


@pytest.mark.parametrize(
    ("influence", "J"),
    [
        ({"Type": 0}, 3.0),
        ({"Type": 0, "Parameters": [2.5]}, 2.5),
        ({"Type": 1}, 12 * 0.6),
        ({"Type": 1, "Parameters": [5.0]}, 5 * 0.6),
        ({"Type": 1, "Parameters": [5.0, -2.0]}, 5 - 0.8),
        ({"Type": 2, "Parameters": [2.0, 0.5]}, 2 * np.exp(-0.32)),
        # alpha exp(-a^2/0.2): the second moment is 0.1 (sqrt(pi 0.2)/2 erf(sqrt 5) - exp(-5)),
        # with sqrt(pi 0.2)/2 = 0.396332730, erf(sqrt 5) = 0.998434598, exp(-5) = 0.006737947
        ({"Type": 2}, np.exp(-0.8) / (0.1 * (0.396332730 * 0.998434598 - 0.006737947))),
    ],
)
def test_influence_functions_at_0_4(cloud, influence, J):
    model = cloud({**STATE, "Influence_Function": influence})
    np.testing.assert_allclose(model.bonds.weight, J * V, rtol=1e-8)


def test_partial_volume_near_the_horizon(cloud):
    # h = r, eps = 1.2 r: r > eps - h/2, so V_j counts (1.2 + 0.5 - 1) = 0.7 of itself
    model = cloud({**STATE, "Horizon": 1.2 * R, "Influence_Function": {"Parameters": [1.0]}})
    np.testing.assert_allclose(model.bonds.weight, 0.7 * V, rtol=1e-12)


S0 = np.sqrt(100 / (1.552734375e9 * EPS))
LAWS = {
    "PDState": (STATE, S0),
    "PMBBond": ({"Type": "PMBBond", "E": 1e9}, np.sqrt(5 * np.pi * GC / (9 * 1e9 * EPS))),
    # a stretch of 1 / sqrt(2 beta r), here twice that
    "RNPBond": (
        {"Type": "RNPBond", "E": 1e9, "Bond_Potential": {"Check_Sc_Factor": 2.0}},
        2 / np.sqrt(2 * 1.6e9 / (25 * np.pi) * R),
    ),
}


@pytest.mark.parametrize("sign", [1, -1], ids=["tension", "compression"])
@pytest.mark.parametrize("law", LAWS)
def test_bonds_break_beyond_the_critical_stretch_and_its_tolerance(cloud, law, sign):
    # The original's comparison has a tolerance of 1e-5: |s| breaks above s0 (1 + 1e-5) + 1e-10.
    material, s0 = LAWS[law]
    for excess, intact in ((0.9e-5, True), (1.2e-5, False)):
        model = cloud(material)
        stretch(model, sign * s0 * (1 + excess))
        assert (model.bonds.intact == intact).all()
    stretch(model, 0.0)
    assert not model.bonds.intact.any()  # for good


@pytest.mark.parametrize("law", LAWS)
def test_bonds_that_break_in_tension_only_survive_compression(cloud, law):
    material, s0 = LAWS[law]
    model = cloud({**material, "Bond_Breaking": "tension"})
    stretch(model, -1.5 * s0)
    assert model.bonds.intact.all()
    stretch(model, 1.5 * s0)
    assert not model.bonds.intact.any()


def test_reversible_rnp_bonds_do_not_break(cloud):
    potential = {"Bond_Potential": {"Irreversible_Bond_Fracture": False}}
    model = cloud({"Type": "RNPBond", "E": 1e9, **potential})
    stretch(model, 0.5)
    assert model.bonds.intact.all()


# K behind Kn: the deck's for PDState; 5/3 c pi eps^3 / 24 for PMB, in 2D 10/3 of the deck's
# K = 2E/3; 5/3 lambda = 2E/3 for the other two.
@pytest.mark.parametrize(
    ("law", "bulk_modulus"),
    [
        ({"Type": "PDState", "K": K, "G": G}, K),
        ({"Type": "PMBBond", "E": 1e9}, 10 / 3 * 2e9 / 3),
        ({"Type": "PDElasticBond", "E": 1e9}, 2e9 / 3),
        ({"Type": "RNPBond", "E": 1e9}, 2e9 / 3),
    ],
    ids=["PDState", "PMBBond", "PDElasticBond", "RNPBond"],
)
def test_self_contact_of_a_broken_bond(cloud, law, bulk_modulus):
    model = cloud(law)
    model.set_intact([0, 0])
    assert (stretch(model, 0.1) == 0).all()
    assert (stretch(model, -0.04) == 0).all()  # 0.96 h: still apart
    f = stretch(model, -0.2)  # 0.8 h, overlap 0.15 h
    Kn = 18 * bulk_modulus / (np.pi * EPS**5)
    expected = Kn * V * 0.15 * R
    np.testing.assert_allclose(f, [-expected, expected], rtol=1e-12)
