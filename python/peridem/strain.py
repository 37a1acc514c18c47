"""Strain and stress at the quadrature points of the elements (tag ``Strain_Stress``)."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from .deck import Material
    from .model import DEMModel

__all__ = [
    "COMPONENTS",
    "StrainField",
    "hooke",
    "quadrature_points",
    "small_strain",
    "stretch_strain",
]

FloatArray = NDArray[np.float64]

COMPONENTS = ("xx", "yy", "zz", "xy", "xz", "yz")
"""Order of the components of strain (e_xy, not 2 e_xy) and stress."""

_PAIRS = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))

# Barycentric coordinates of the points of symmetric rules, one entry for each orbit: all distinct
# permutations of it are points. Dunavant 1985 (triangle), Keast 1986 (tetrahedron).
_A4, _B4 = 0.445948490915965, 0.091576213509771
_A5, _B5 = (6 - 15**0.5) / 21, (6 + 15**0.5) / 21
_TRIANGLE = (
    ((1 / 3, 1 / 3, 1 / 3),),
    ((1 / 6, 1 / 6, 2 / 3),),
    ((1 / 3, 1 / 3, 1 / 3), (1 / 5, 1 / 5, 3 / 5)),
    ((_A4, _A4, 1 - 2 * _A4), (_B4, _B4, 1 - 2 * _B4)),
    ((1 / 3, 1 / 3, 1 / 3), (_A5, _A5, 1 - 2 * _A5), (_B5, _B5, 1 - 2 * _B5)),
)
_C2 = (5 - 5**0.5) / 20
_C4, _D4 = 0.399403576166799, 0.100596423833201
_C5, _D5 = 0.433449846426336, 0.066550153573664
_CENTER = (1 / 4, 1 / 4, 1 / 4, 1 / 4)
_TETRAHEDRON = (
    (_CENTER,),
    ((_C2, _C2, _C2, 1 - 3 * _C2),),
    (_CENTER, (1 / 6, 1 / 6, 1 / 6, 1 / 2)),
    (_CENTER, (1 / 14, 1 / 14, 1 / 14, 11 / 14), (_C4, _C4, _D4, _D4)),
    (
        _CENTER,
        (1 / 3, 1 / 3, 1 / 3, 0.0),
        (1 / 11, 1 / 11, 1 / 11, 8 / 11),
        (_C5, _C5, _D5, _D5),
    ),
)
_QUAD_CORNERS = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])


def quadrature_points(cell_type: str, order: int) -> tuple[FloatArray, FloatArray]:
    """Shape functions and their derivatives at the quadrature points of an element.

    Parameters
    ----------
    cell_type : {"triangle", "quad", "tetra"}
        Kind of element, with linear shape functions.
    order : int
        Degree, 1 to 5, up to which the rule is exact.

    Returns
    -------
    values : ndarray, shape (q, k)
        Shape function of node k at point q.
    slopes : ndarray, shape (q, k, d)
        Derivatives by the d coordinates of the reference element.
    """
    if cell_type == "quad":
        return _quad_points(order)
    orbits = (_TRIANGLE if cell_type == "triangle" else _TETRAHEDRON)[order - 1]
    values = np.array([point for orbit in orbits for point in _permutations(orbit)])
    k = values.shape[1]
    # barycentric: phi_0 = 1 - sum xi, phi_i = xi_i
    slopes = np.vstack([-np.ones(k - 1), np.eye(k - 1)])
    return values, np.broadcast_to(slopes, (len(values), k, k - 1))


def _permutations(orbit: Sequence[float]) -> list[tuple[float, ...]]:
    return sorted(set(itertools.permutations(orbit)))


def _quad_points(order: int) -> tuple[FloatArray, FloatArray]:
    """Points of Gauss in both directions, the bilinear functions (1 + x x_k)(1 + y y_k)/4."""
    places, _ = np.polynomial.legendre.leggauss(order // 2 + 1)
    points = np.array(list(itertools.product(places, repeat=2)))
    factors = 1 + points[:, None, :] * _QUAD_CORNERS
    values = factors.prod(axis=2) / 4
    slopes = _QUAD_CORNERS * factors[:, :, ::-1] / 4
    return values, slopes


def small_strain(gradient: FloatArray) -> FloatArray:
    """Small strain (H + H^T)/2, which takes a rotation for a strain.

    Parameters
    ----------
    gradient : ndarray, shape (..., d, d)
        Displacement gradient H in the reference configuration.

    Returns
    -------
    ndarray, shape (..., d, d)
        Strain.
    """
    return 0.5 * (gradient + np.swapaxes(gradient, -1, -2))


def stretch_strain(gradient: FloatArray) -> FloatArray:
    """Strain V - I of the left stretch tensor V, F = V R: in the present axes, without rotation.

    Its principal values are the relative elongations along the principal axes as they lie now.
    It is the small strain where nothing turns (H symmetric), and to first order elsewhere.

    Parameters
    ----------
    gradient : ndarray, shape (..., d, d)
        Displacement gradient H = F - I in the reference configuration.

    Returns
    -------
    ndarray, shape (..., d, d)
        Strain.
    """
    # V^2 - I = F F^T - I = H + H^T + H H^T, so that small strains keep all their digits
    turned = np.swapaxes(gradient, -1, -2)
    squares, axes = np.linalg.eigh(gradient + turned + gradient @ turned)
    # sqrt(1 + w) - 1; w >= -1 but for round-off
    elongations = squares / (1 + np.sqrt(np.maximum(1 + squares, 0.0)))
    return np.asarray((axes * elongations[..., None, :]) @ np.swapaxes(axes, -1, -2))


def hooke(material: Material, strain: FloatArray, dimension: int) -> tuple[FloatArray, FloatArray]:
    """Strain and stress of an isotropic material, out of the plane too.

    sigma = lambda tr(e) I + 2 G e. In 2D plane strain has e_zz = 0, plane stress sigma_zz = 0,
    hence e_zz = -lambda/(lambda + 2 G) (e_xx + e_yy).

    Parameters
    ----------
    material : Material
        The material; ``Is_Plane_Strain`` matters in 2D.
    strain : ndarray, shape (n, 6)
        Strain in the order of `COMPONENTS`, zero out of the plane in 2D.
    dimension : int
        Dimension, 2 or 3.

    Returns
    -------
    strain, stress : ndarray, shape (n, 6)
        Strain, and stress [Pa]: NaN when the material has no elastic constants.
    """
    strain = strain.copy()
    try:
        constants = material.constants()
    except ValueError:  # a bond-based law whose constants are given directly
        return strain, np.full_like(strain, np.nan)
    lame, g = constants.lame, constants.g
    plane_stress = dimension == 2 and not material.is_plane_strain
    if plane_stress:
        strain[:, 2] = -lame / (lame + 2 * g) * (strain[:, 0] + strain[:, 1])
    stress = 2 * g * strain
    stress[:, :3] += lame * strain[:, :3].sum(axis=1, keepdims=True)
    if plane_stress:
        stress[:, 2] = 0.0  # without the round-off
    return strain, stress


@dataclass(frozen=True)
class _Elements:
    """Elements of one body.

    Attributes
    ----------
    body : int
        The body.
    material : Material
        Its material.
    cells : ndarray, shape (m, k)
        Global node numbers.
    values : ndarray, shape (q, k)
        Shape functions at the quadrature points.
    gradients : ndarray, shape (m, q, k, d)
        Their gradients [1/m] in the reference configuration.
    """

    body: int
    material: Material
    cells: NDArray[np.int32]
    values: FloatArray
    gradients: FloatArray


class StrainField:
    """Strain and stress of a model at the quadrature points of its elements.

    The strain is `stretch_strain` and the stress follows from it by Hooke's law, both in the
    present axes: a grain that turns has none. In original mode it is `small_strain`, as in the
    original program: of use only as long as nothing turns. Gradients are those of the shape
    functions in the reference configuration. They do not know of broken bonds: across a crack
    the strain is large. Bodies without elements have no points.

    Parameters
    ----------
    model : DEMModel
        The model; ``Model.Quad_Approximation_Order`` chooses the points.

    Attributes
    ----------
    particle_id : ndarray of int32, shape (n_points,)
        Body of each point.
    """

    def __init__(self, model: DEMModel) -> None:
        self._model = model
        self._measure = small_strain if model.compatibility == "original" else stretch_strain
        self._elements = list(_elements(model))
        counts = [len(e.cells) * len(e.values) for e in self._elements]
        bodies = np.array([e.body for e in self._elements], dtype=np.int32)
        self.particle_id = np.repeat(bodies, counts)

    def __len__(self) -> int:
        return len(self.particle_id)

    def points(self) -> FloatArray:
        """Return the current places of the quadrature points, shape (n_points, 3) [m]."""
        x = self._model.state.x
        found = [np.einsum("qk,mkd->mqd", e.values, x[e.cells]) for e in self._elements]
        return _stacked(found, 3)

    def compute(self) -> tuple[FloatArray, FloatArray]:
        """Strain and stress of the present displacements.

        Returns
        -------
        strain : ndarray, shape (n_points, 6)
            In the order of `COMPONENTS`.
        stress : ndarray, shape (n_points, 6)
            In the same order [Pa]; NaN for materials without elastic constants.
        """
        u, d = self._model.state.u, self._model.dimension
        strains, stresses = [], []
        for e in self._elements:
            gradient = np.einsum("mki,mqkj->mqij", u[e.cells][..., :d], e.gradients)
            tensor = np.zeros((*gradient.shape[:2], 3, 3))
            tensor[..., :d, :d] = self._measure(gradient)
            rows = np.stack([tensor[..., i, j] for i, j in _PAIRS], axis=-1)
            strain, stress = hooke(e.material, rows.reshape(-1, 6), d)
            strains.append(strain)
            stresses.append(stress)
        return _stacked(strains, 6), _stacked(stresses, 6)


def _stacked(parts: list[FloatArray], width: int) -> FloatArray:
    return np.concatenate([np.empty((0, width)), *(part.reshape(-1, width) for part in parts)])


def _elements(model: DEMModel) -> list[_Elements]:
    d = model.dimension
    kinds = ("triangle", "quad") if d == 2 else ("tetra",)
    order = model.deck.model.quad_approximation_order
    found = []
    for body, (cell_type, cells) in enumerate(model.cells):
        if cell_type not in kinds:
            continue
        values, slopes = quadrature_points(cell_type, order)
        # dX/dxi of each element and point, then dphi/dX = dphi/dxi (dX/dxi)^-1
        x = model.state.x_ref[cells][..., :d]
        jacobian = np.einsum("mki,qkj->mqij", x, slopes)
        gradients = np.einsum("qkj,mqji->mqki", slopes, np.linalg.inv(jacobian))
        material = model.deck.materials[model.particle(body).zone]
        found.append(_Elements(body, material, cells, values, gradients))
    return found
