"""What can be measured of a model: energies, momenta, fragments, contacts, stresses.

All quantities are those of the present state, in SI units; in 2D forces, masses, momenta and
energies are per unit thickness. docs/diagnostics.md has the formulas and their sources.
"""

from .deck_tests import (
    StopCriterion,
    TestWriter,
    check_finite,
    compressive_row,
    two_particle_row,
)
from .energy import energies, energy_warnings, prescribed_work
from .fragments import Fragments, fragments
from .momentum import momenta
from .network import ContactNetwork, contact_network
from .stress import body_stress, bulk_stress, contact_stress, node_stress

__all__ = [
    "ContactNetwork",
    "Fragments",
    "StopCriterion",
    "TestWriter",
    "body_stress",
    "bulk_stress",
    "check_finite",
    "compressive_row",
    "contact_network",
    "contact_stress",
    "energies",
    "energy_warnings",
    "fragments",
    "momenta",
    "node_stress",
    "prescribed_work",
    "two_particle_row",
]
