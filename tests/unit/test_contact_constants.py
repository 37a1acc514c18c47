"""Constants of contact that the deck gives or leaves out, and when damping acts."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from helpers import GRAIN_RADIUS, DeckFolder
from peridem import DEMModel


def kappa(deck_folder: DeckFolder, deck: dict[str, Any]) -> float:
    model = DEMModel.from_deck(deck_folder.write(deck), threads=1)
    model.init()
    return float(model._core.contact_law(0, 1)["kappa"])


@pytest.mark.parametrize("bulk_modulus", [1.0e6, 21.6e6, 1.0e9])
def test_kappa_takes_the_bulk_modulus_of_the_deck(
    deck_folder: DeckFolder, bulk_modulus: float
) -> None:
    # BEHAVIOUR: constants given directly to the bond law, K of the deck for contact; the
    # harmonic mean of two equal K is K.
    direct = {
        "Type": "PMBBond",
        "Compute_From_Classical": False,
        "Bond_Potential": {"Parameters": [1.0e18, 0.02]},
        "K": bulk_modulus,
        "Density": 1200.0,
        "Horizon": 6e-4,
    }
    deck = deck_folder.grains()
    deck["Material"] = {"Zone_1": direct, "Zone_2": dict(direct)}
    assert kappa(deck_folder, deck) == pytest.approx(bulk_modulus, rel=1e-15)


@pytest.mark.parametrize("order", [1, -1])
def test_default_stiffness_takes_the_largest_horizon_of_a_zone(
    deck_folder: DeckFolder, order: int
) -> None:
    deck = deck_folder.grains()
    rows = [(0, 0, 0, 0, GRAIN_RADIUS, 0.3), (0, 0.02, 0, 0, 3 * GRAIN_RADIUS, 0.0)][::order]
    deck_folder.places(*rows, (1, 0.0, 0.05, 0, GRAIN_RADIUS, 0.0))
    for zone in ("Zone_1", "Zone_2"):
        material = dict(deck["Material"][zone])
        material.pop("Horizon")
        deck["Material"][zone] = {**material, "Horizon_Mesh_Ratio": 4.0}
    for contact in deck["Contact"].values():
        contact.pop("Kn")
    model = DEMModel.from_deck(deck_folder.write(deck), threads=1)
    model.init()
    law = model._core.contact_law(0, 1)
    horizon = max(body.horizon for body in model.particles if body.zone == 0)
    # Jha et al. 2021, eq. 36
    assert law["kn"] == pytest.approx(18 * law["kappa"] / (np.pi * horizon**5), rel=1e-14)


@pytest.mark.parametrize("criterion", ["centers", "nodes"])
def test_damping_by_nodes_acts_however_far_the_centres_are(
    deck_folder: DeckFolder, criterion: str
) -> None:
    pair = {"Center_Damping_Criterion": criterion, "Damping_On": True, "Epsilon": 0.5}
    model = deck_folder.model(
        deck_folder.grains(), {f"Contact.Zone_12.{key}": value for key, value in pair.items()}
    )
    state = model.state
    lower, upper = model.particles
    # Body 1 flies off, but for one node that touches the top of body 0.
    top = lower.start + int(np.argmax(state.x[lower.start : lower.stop, 1]))
    centre = int(np.argmin(np.linalg.norm(state.x - upper.center, axis=1)))
    piece = upper.stop - 1
    assert piece != centre
    state.x[upper.start : upper.stop, 1] += 20 * GRAIN_RADIUS
    state.x[piece] = state.x[top] + [0.0, 0.5 * model.contact_radius(0, 1), 0.0]
    state.v[upper.start : upper.stop] = [0.0, -1.0, 0.0]
    # Damping pushes every node of body 1 alike; only the piece has other contact forces.
    damping = model.contact_forces()[centre]
    if criterion == "nodes":
        assert damping[1] > 0
    else:
        assert np.all(damping == 0)
