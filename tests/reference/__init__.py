"""The method in NumPy, written for reading: the oracle of the core's fast kernels.

Equation numbers are those of Jha, Desai, Bhattacharya, Lipton, JMPS 151 (2021) 104376. Where the
program differs from the paper, the program is followed and the difference is said.

``material``    constants of the laws and influence functions
``bonds``       nodal volumes, mesh size, neighbours, weighted volume
``peridynamic`` forces and energies inside a body
``contact``     forces and energies between bodies
``external``    gravity, force sets, prescribed motion
``model``       `ReferenceModel`: a whole model, step by step
"""

from .model import ReferenceModel

__all__ = ["ReferenceModel"]
