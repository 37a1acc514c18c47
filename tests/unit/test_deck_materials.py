"""Elastic constants of a material from those the deck gives."""

from __future__ import annotations

import math

import pytest
from peridem.deck import Material

# E = 2.5, nu = 0.25: K = E/(3(1 - 2 nu)) = 5/3, G = E/(2(1 + nu)) = 1,
# lambda = E nu/((1 + nu)(1 - 2 nu)) = 1.
EXPECTED = {"e": 2.5, "k": 5 / 3, "g": 1.0, "nu": 0.25, "lame": 1.0}


def _material(**given):
    keys = {"Type": "PDState", "Density": 1.0, "Horizon": 1.0, "Gc": 3.0}
    return Material.model_validate(keys | given)


def _check(constants):
    for name, value in EXPECTED.items():
        # a handful of roundings
        assert getattr(constants, name) == pytest.approx(value, rel=1e-14), name


@pytest.mark.parametrize(
    "given",
    [
        {"E": 2.5, "K": 5 / 3},
        {"E": 2.5, "G": 1.0},
        {"E": 2.5, "Poisson_Ratio": 0.25},
        {"K": 5 / 3, "G": 1.0},
    ],
)
def test_elastic_pair_gives_all_constants(given):
    material = _material(**given)
    assert list(material.rules()) == []
    _check(material.constants())


@pytest.mark.parametrize("given", [{"E": 2.5}, {"K": 5 / 3}])
def test_bond_law_constants_follow_from_e_or_k(given):
    # nu = 1/4 for bond-based laws
    _check(_material(Type="PMBBond", **given).constants())


def test_bond_law_keeps_the_given_k_for_contact():
    constants = _material(Type="RNPBond", E=2.5, K=7.0).constants()
    assert (constants.e, constants.k) == (2.5, 7.0)


def test_direct_constants_give_k_and_g():
    material = _material(
        Compute_From_Classical=False, Bond_Potential={"Parameters": [5 / 3, 1.0, 0.01]}
    )
    _check(material.constants())


def test_gc_follows_from_kic():
    material = Material.model_validate(
        {"Type": "PDState", "Density": 1.0, "Horizon": 1.0, "E": 2.5, "G": 1.0, "KIc": 5.0}
    )
    assert material.constants().gc == pytest.approx(10.0, rel=1e-15)  # KIc^2 / E


def test_constants_of_a_bond_law_without_moduli_are_refused():
    with pytest.raises(ValueError, match="E or K is needed"):
        _material(Type="PMBBond").constants()


def test_given_modulus_is_not_recomputed():
    constants = _material(K=0.1, G=0.3).constants()
    assert (constants.k, constants.g) == (0.1, 0.3)
    assert math.isclose(constants.e, 9 * 0.1 * 0.3 / (3 * 0.1 + 0.3), rel_tol=1e-15)
