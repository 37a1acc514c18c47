"""Materials in Python: the blocks they become, and messages about their arguments."""

from __future__ import annotations

from typing import Any

import peridem as pd
import pytest
from modelling_parts import glass

REST: dict[str, Any] = {"density": 1200, "horizon": 6e-4, "fracture_energy": 50}


def test_every_pair_of_constants_gives_the_others() -> None:
    # By hand: K = 2.16e7, G = 1.296e7 have E = 9 K G / (3 K + G) and nu = E / (2 G) - 1.
    e, k, g = 3.24e7, 2.16e7, 1.296e7
    nu = 0.25
    for pair in (
        {"young_modulus": e, "poisson_ratio": nu},
        {"bulk_modulus": k, "shear_modulus": g},
        {"young_modulus": e, "bulk_modulus": k},
        {"young_modulus": e, "shear_modulus": g},
    ):
        found = pd.PDState(**REST, **pair).constants
        assert (found.e, found.k, found.g) == pytest.approx((e, k, g), rel=1e-14)
        assert found.nu == pytest.approx(nu, rel=1e-14)
        assert found.gc == 50


def test_toughness_gives_the_fracture_energy() -> None:
    material = pd.PMBBond(density=1200, horizon=6e-4, young_modulus=4e7, fracture_toughness=2e4)
    assert material.constants.gc == pytest.approx(2e4**2 / 4e7, rel=1e-14)


def test_a_material_is_the_block_of_a_deck() -> None:
    block = glass(influence=("gaussian", 2.0, 0.3), bond_breaking="tension").block
    assert block.type == "PDState"
    assert (block.density, block.horizon, block.fracture_energy) == (1200, 6e-4, 50)
    assert block.influence_function.type == 2
    assert block.influence_function.parameters == (2.0, 0.3)
    assert block.bond_breaking == "tension"
    assert glass().block.influence_function.type == 1  # linear, as in the decks of the original
    direct = pd.RNPBond(
        density=1, horizon=1, law_parameters=(3, 4), critical_stretch_factor=2, irreversible=False
    ).block
    assert not direct.compute_from_classical
    assert direct.bond_potential.parameters == (3.0, 4.0)
    assert direct.bond_potential.check_sc_factor == 2
    assert not direct.bond_potential.irreversible_bond_fracture
    elastic = pd.PDElasticBond(density=1, horizon_mesh_ratio=3, bulk_modulus=1).block
    assert elastic.horizon_mesh_ratio == 3


def test_materials_are_values() -> None:
    assert glass() == glass()
    assert hash(glass()) == hash(glass())
    assert glass() != glass(density=1)
    assert glass(name="a") != glass(name="b")
    assert glass() != pd.PMBBond(**REST, young_modulus=1e7)
    with pytest.raises(AttributeError, match="materials do not change"):
        glass().name = "other"
    assert repr(glass(name="g")) == (
        "PDState(density=1200.0, horizon=0.0006, bulk_modulus=21600000.0, "
        "shear_modulus=12960000.0, fracture_energy=50.0, name='g')"
    )


GOOD: dict[str, Any] = {**REST, "bulk_modulus": 2e7, "shear_modulus": 1e7}
REFUSED: list[tuple[type, dict[str, Any], str]] = [
    (pd.PDState, {**GOOD, "density": -1}, "density = -1: must be positive; give the density"),
    (pd.PDState, {**GOOD, "horizon": "a"}, "horizon = a: must be a number; give the horizon in"),
    (pd.PDState, {**GOOD, "horizon": None}, "horizon: missing; give the horizon in metres"),
    (pd.PDState, {"density": 1}, "PDState needs exactly one pair of elastic constants"),
    (
        pd.PDState,
        {**REST, "bulk_modulus": 1},
        "has bulk_modulus; give (young_modulus, bulk_modulus)",
    ),
    (pd.PDState, {**GOOD, "poisson_ratio": 0.5}, "poisson_ratio = 0.5: must be below 0.5"),
    (pd.PDState, {**GOOD, "fracture_energy": None}, "fracture_energy: missing; give fracture_ener"),
    (pd.PDState, {**GOOD, "fracture_toughness": 1}, "is given besides fracture_energy"),
    (pd.PMBBond, {**REST, "bulk_modulus": 2e7, "poisson_ratio": 0.3}, "fix Poisson's ratio at 1/4"),
    (pd.PDState, {**GOOD, "horizon_mesh_ratio": 3}, "= 3: is given besides horizon; keep one"),
    (pd.PDState, {**GOOD, "densty": 1}, "densty: unknown argument; did you mean density?"),
    (pd.PDState, {**GOOD, "nu": 0.2}, "nu: unknown argument; did you mean poisson_ratio?"),
    (pd.PDState, {"horizon": 1}, "PDState: density: missing; give density=..., in kg/m^3"),
    (pd.PDState, {**GOOD, "influence": "gausian"}, "did you mean gaussian?"),
    (pd.PDState, {**GOOD, "influence": ()}, "influence = (): is empty"),
    (pd.PDState, {**GOOD, "influence": ("gaussian", 1)}, "influence = [1]: must be none or [alpha"),
    (pd.PDState, {**GOOD, "influence": ("linear", "a")}, "parameters must be numbers"),
    (pd.PDState, {**GOOD, "influence": ("constant", -1)}, "influence[1] = -1: must be positive"),
    (pd.PDState, {**GOOD, "bond_breaking": "tensile"}, "did you mean tension?"),
    (pd.PDState, {**GOOD, "name": 3}, "name = 3: must be text"),
    (pd.PDState, {**GOOD, "name": "g", "density": 0}, "PDState 'g': density = 0: must be positive"),
    (pd.PDState, {**REST, "law_parameters": (1, 2)}, "law_parameters = (1, 2): must be ["),
    (pd.RNPBond, {**REST, "law_parameters": (1, 2), "critical_stretch_factor": -1}, "= -1: must"),
    (pd.PMBBond, REST, "young_modulus: missing; PMBBond needs Young's modulus"),
    (pd.PDElasticBond, {"density": 1, "horizon": 1}, "young_modulus: missing"),
]


@pytest.mark.parametrize(("law", "arguments", "text"), REFUSED)
def test_materials_refuse(law: type, arguments: dict[str, Any], text: str) -> None:
    with pytest.raises(pd.InputError) as caught:
        law(**arguments)
    assert text in str(caught.value)


def test_constants_that_do_not_follow_say_so() -> None:
    material = pd.PMBBond(density=1, horizon=1, law_parameters=(1, 1))
    with pytest.raises(pd.InputError, match="do not follow from law_parameters"):
        _ = material.constants
