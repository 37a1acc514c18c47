"""Numbers of the original program, for decks that need nothing but this repository.

The original's Z is in single precision, and its f lacks contact on walls: neither is looked at.
"""

import json
from pathlib import Path

import numpy as np
import pytest
from peridem import DEMModel

DATA = Path(__file__).parents[1] / "decks" / "data" / "original"
CASES = json.loads((DATA / "numbers.json").read_text(encoding="utf-8"))["cases"]


@pytest.mark.parametrize("name", CASES)
def test_original_mode_gives_the_numbers_of_the_original(name):
    case = CASES[name]
    model = DEMModel.from_deck(DATA / f"{name}.yaml", threads=1, compatibility="original")
    model.init()
    assert len(model.bonds.indices) == case["bonds"]
    if "h_min" in case:
        h_min = min(body.mesh_size for body in model.particles)
        assert h_min == pytest.approx(case["h_min"], rel=1e-14)
    for step, expected in case["steps"].items():
        model.step(int(step) - model.n)
        assert np.sum(model.bonds.intact == 0) == expected["broken"]
        nodes = expected["nodes"]
        # Measured: up to 3e-11. Positions of 1e-3 m are rounded by 1e-19 m, contacts overlap by
        # 1e-6 m and less: what starts at 1e-13 of a contact force grows a little in the steps.
        for key, array in (("u", model.state.u), ("f", model.state.f)):
            error = np.abs(array[nodes, :2] - expected[key]).max()
            assert error < 1e-9 * expected[f"largest_{key}"], (step, key)
