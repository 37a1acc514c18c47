"""Numbers that are allowed but hardly ever meant are warned of, and the usual ones are not."""

from __future__ import annotations

from typing import Any

import peridem as pd
import pytest
from modelling_parts import SIZE, Block, Disc, glass
from peridem.plausibility import MOST_STEPS, long_run_warnings, plausibility_warnings


def warnings_of(
    *, material: Any = None, contact: Any = None, gap: float = 2.2e-3, **disc: Any
) -> list[str]:
    """Warnings of a disc above a floor."""
    model = pd.DEMModel(threads=1)
    scale = disc.get("scale", 1.0)
    model.add_particle(Disc(), material=material or glass(), mesh_size=SIZE, name="top", **disc)
    model.add_wall(
        Block((4e-3 * scale, 5e-4 * scale)),
        material=glass(horizon=6e-4 * scale),
        mesh_size=SIZE * scale,
        at=(0, -scale * gap),
        name="floor",
    )
    if contact:
        model.set_contact(**contact)
    model.init()
    found = plausibility_warnings(model)
    # as the user sees them, in terms of his model
    assert len([text for text in model.warnings if "check" in text or "usual" in text]) == len(
        found
    )
    return model.warnings


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        (
            {"density": 2.6},
            "material PDState of 'top': density = 2.6: that of solids is between 10 and 25000",
        ),
        (
            {"bulk_modulus": None, "shear_modulus": None, "young_modulus": 3, "poisson_ratio": 0.2},
            "material PDState of 'top': young_modulus = 3: Young's modulus of solids is between "
            "1e+03 and 5e+12 Pa: check the unit",
        ),
        (
            # sqrt(Gc/(K horizon)) = sqrt(1e-9/(2.16e7 6e-4)) = 2.8e-7
            {"fracture_energy": 1e-9},
            "material PDState of 'top': fracture_energy = 1e-09: bonds break at a stretch of "
            "about 3e-07, usual is 0.0001 and more: check the unit (J/m^2)",
        ),
        (
            # 1.1 node distances of the rings: 4 neighbours or fewer
            {"horizon": 1.1e-3 / 6},
            "gives a node of body 0 ",
        ),
    ],
)
def test_unusual_material_is_told(changes: dict[str, Any], text: str) -> None:
    (told,) = warnings_of(material=glass(**changes))
    assert text in told


def test_unusual_friction_is_told_once() -> None:
    (told,) = warnings_of(contact={"friction": 20})
    assert "friction = 20: coefficients of friction are hardly above 2: check it" in told


def test_stray_wall_is_told() -> None:
    # 1 m below a disc of 2 mm: more than 100 diameters of it, 0.2 m
    (told,) = warnings_of(gap=1.0)
    assert "body 'floor': body 1 is 0.999 m from every other body" in told
    assert "more than 100 diameters of the largest grain: check the unit of its place" in told


def test_size_of_a_grain_in_another_unit_is_told() -> None:
    # a radius of 1e-3 scaled by 1e6 is 1 km
    (told,) = warnings_of(material=glass(horizon=600.0), scale=1e6)
    assert "the radius of body 0 is 1e+03 m: grains have 1e-06 to 100 m: check the unit" in told


@pytest.mark.parametrize(
    "usual",
    [
        {},
        {"material": glass(density=2600, bulk_modulus=4e10, shear_modulus=3e10, fracture_energy=8)},
        {"material": glass(bulk_modulus=1e5, shear_modulus=6e4, fracture_energy=0.1)},
        {"material": glass(horizon=2.0e-3 / 6 * 1.01)},  # two node distances
        {"material": glass(horizon=0.6), "scale": 1e3},  # a boulder of a metre
        {"contact": {"friction": 1.5}},
        {"gap": 0.1},  # a fall of 50 diameters
    ],
)
def test_usual_numbers_are_not_told(usual: dict[str, Any]) -> None:
    assert warnings_of(**usual) == []


def test_very_long_run_is_told() -> None:
    model = pd.DEMModel(threads=1, dt=1e-8)
    model.add_particle(Disc(), material=glass(), mesh_size=SIZE)
    model.init()
    assert long_run_warnings(model, MOST_STEPS) == []
    (told,) = long_run_warnings(model, 100_000_000)  # a second
    assert told.startswith("run of 1e+08 steps of 1e-08 s: more than 5e+06 are rarely meant: check")
