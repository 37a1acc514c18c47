"""Small strain and stress at quadrature points: linear fields are exact."""

import itertools
import math

import numpy as np
import pytest
from helpers import GRAIN_RADIUS, box_mesh, disc_mesh, displace, single_deck
from peridem.output import read_pvd
from peridem.strain import StrainField, quadrature_points
from peridem.vtu import read_vtu

R = GRAIN_RADIUS
K, G = 2.16e7, 1.296e7  # helpers.MATERIAL
LAME = K - 2 * G / 3


def model_2d(deck_folder, order=1, plane_strain=False, quads=False):
    if quads:
        square = [-R, -R, 0, R, R, 0]
        deck = single_deck("", {"Type": "rectangle", "Parameters": square})
        deck["Mesh"]["Zone_1"] = {"CreateMesh": {"Flag": True}, "Mesh_Size": R / 6}
    else:
        name = deck_folder.mesh("disc", disc_mesh(R, jiggle=0.2))
        deck = single_deck(name, {"Type": "circle", "Parameters": [R]})
    deck["Material"]["Zone_1"] = {**deck["Material"]["Zone_1"], "Is_Plane_Strain": plane_strain}
    return deck_folder.model(deck, {"Model.Quad_Approximation_Order": order})


def model_3d(deck_folder, order=1):
    name = deck_folder.mesh("cube", box_mesh((R,) * 3, (4,) * 3, jiggle=0.2))
    deck = single_deck(name, {"Type": "cube", "Parameters": [R]}, Dimension=3)
    return deck_folder.model(deck, {"Model.Quad_Approximation_Order": order})


GRADIENT = np.array([[3e-3, 1e-3, -2e-3], [5e-3, -4e-3, 2e-3], [1e-3, 4e-3, 6e-3]])


def stretched(model):
    """Apply the linear displacement GRADIENT X, in the plane in 2D."""
    gradient = GRADIENT.copy()
    gradient[model.dimension :] = 0
    gradient[:, model.dimension :] = 0
    displace(model, model.state.x_ref @ gradient.T + [1e-4, 2e-4, 0])
    return 0.5 * (gradient + gradient.T)


def as_rows(tensor):
    return tensor[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]


@pytest.mark.parametrize("order", range(1, 6))
@pytest.mark.parametrize("quads", [False, True])
def test_linear_field_in_plane_strain_is_exact(deck_folder, order, quads):
    model = model_2d(deck_folder, order, plane_strain=True, quads=quads)
    e = stretched(model)
    strain, stress = StrainField(model).compute()
    np.testing.assert_allclose(strain, np.broadcast_to(as_rows(e), strain.shape), atol=1e-15)
    sigma = LAME * np.trace(e) * np.eye(3) + 2 * G * e
    expected = np.broadcast_to(as_rows(sigma), stress.shape)
    np.testing.assert_allclose(stress, expected, rtol=0, atol=1e-12 * K)


def test_linear_field_in_plane_stress_is_exact(deck_folder):
    # E/(1 - nu^2) (e_xx + nu e_yy), the textbook's form
    model = model_2d(deck_folder, 2)
    e = stretched(model)
    strain, stress = StrainField(model).compute()
    young, nu = 9 * K * G / (3 * K + G), (3 * K - 2 * G) / (6 * K + 2 * G)
    factor = young / (1 - nu**2)
    sxx, syy = factor * (e[0, 0] + nu * e[1, 1]), factor * (e[1, 1] + nu * e[0, 0])
    ezz = -nu / young * (sxx + syy)
    np.testing.assert_allclose(strain[:, 2], ezz, rtol=1e-11)
    np.testing.assert_allclose(stress[:, 0], sxx, rtol=1e-9)
    np.testing.assert_allclose(stress[:, 1], syy, rtol=1e-9)
    np.testing.assert_allclose(stress[:, 3], 2 * G * e[0, 1], rtol=1e-11)
    assert np.all(stress[:, [2, 4, 5]] == 0)


@pytest.mark.parametrize("order", range(1, 6))
def test_linear_field_in_3d_is_exact(deck_folder, order):
    model = model_3d(deck_folder, order)
    e = stretched(model)
    strain, stress = StrainField(model).compute()
    np.testing.assert_allclose(strain, np.broadcast_to(as_rows(e), strain.shape), atol=1e-15)
    sigma = LAME * np.trace(e) * np.eye(3) + 2 * G * e
    expected = np.broadcast_to(as_rows(sigma), stress.shape)
    np.testing.assert_allclose(stress, expected, rtol=0, atol=1e-12 * K)


@pytest.mark.parametrize("make", [model_2d, model_3d])
def test_small_rotation_has_strain_of_second_order_only(deck_folder, make):
    # cos(a) - 1 on the diagonal in the plane, nothing else
    model, angle = make(deck_folder), 1e-4
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    displace(model, model.state.x_ref @ (turn - np.eye(3)).T)
    strain, _ = StrainField(model).compute()
    np.testing.assert_allclose(strain[:, :2], c - 1, rtol=0, atol=1e-17 / 1e-3)
    np.testing.assert_allclose(strain[:, 3:], 0, rtol=0, atol=1e-17 / 1e-3)


def test_points_move_with_the_body(deck_folder):
    model = model_2d(deck_folder)
    centroids = model.state.x[model.cells[0][1]].mean(axis=1)
    field = StrainField(model)
    np.testing.assert_allclose(field.points(), centroids, rtol=0, atol=1e-18)
    displace(model, np.full((model.n_nodes, 3), 1e-3))
    np.testing.assert_allclose(field.points(), centroids + 1e-3, rtol=0, atol=1e-18)


@pytest.mark.parametrize("cell_type", ["triangle", "tetra", "quad"])
@pytest.mark.parametrize("order", range(1, 6))
def test_points_allow_a_rule_of_their_order(cell_type, order):
    # There are weights with which the rule integrates all monomials up to its order. Moments of
    # the simplex: a! b! c! / (a + b + c + d)!; of the square [-1, 1]^2: products of 2/(a + 1).
    values, _ = quadrature_points(cell_type, order)
    if cell_type == "quad":
        corners = np.array([(-1, -1), (1, -1), (1, 1), (-1, 1)])
        points = values @ corners
    else:
        points = values[:, 1:]
    d = points.shape[1]
    powers = [p for p in itertools.product(range(order + 1), repeat=d) if sum(p) <= order]
    matrix = np.array([np.prod(points ** np.array(p), axis=1) for p in powers])
    if cell_type == "quad":
        moments = [np.prod([2 / (a + 1) if a % 2 == 0 else 0 for a in p]) for p in powers]
    else:
        moments = [
            math.prod(math.factorial(a) for a in p) / math.factorial(sum(p) + d) for p in powers
        ]
    weights, *_ = np.linalg.lstsq(matrix, np.array(moments), rcond=None)
    # the tabulated points have 15 digits
    np.testing.assert_allclose(matrix @ weights, moments, rtol=0, atol=1e-13)


@pytest.mark.parametrize("cell_type", ["triangle", "tetra", "quad"])
def test_shape_functions_sum_to_one_and_slopes_to_zero(cell_type):
    values, slopes = quadrature_points(cell_type, 4)
    np.testing.assert_allclose(values.sum(axis=1), 1, rtol=1e-14)
    np.testing.assert_allclose(slopes.sum(axis=1), 0, atol=1e-15)


def test_run_writes_a_series_of_its_own(deck_folder, tmp_path):
    name = deck_folder.mesh("disc", disc_mesh(R))
    deck = single_deck(name, {"Type": "circle", "Parameters": [R]}, steps=20)
    deck["Output"] = {"Output_Interval": 10, "Tags": ["Strain_Stress"], "Tag_PP": 3}
    model = deck_folder.model(deck)
    assert model.warnings == []
    displace(model, 1e-3 * model.state.x_ref)
    model.run(tmp_path / "out", steps=10)
    series = read_pvd(tmp_path / "out" / "output_strain_3.pvd")
    assert [path.name for _, path in series] == ["output_strain_3_0.vtu", "output_strain_3_1.vtu"]
    content = read_vtu(series[1][1])
    strain, stress = StrainField(model).compute()
    np.testing.assert_array_equal(content["arrays"]["Strain"], strain)
    np.testing.assert_array_equal(content["arrays"]["Stress"], stress)
    assert np.all(content["arrays"]["Particle_ID"] == 0)
    assert (content["step"], content["time"]) == (10, model.time)
    assert len(strain) == len(disc_mesh(R).cells)


def test_bodies_without_elements_are_a_warning(deck_folder, tmp_path):
    points = [(x * 1e-4, y * 1e-4, 0) for x in range(3) for y in range(3)]
    name = deck_folder.nodes("cloud", points, [1e-8] * 9)
    deck = single_deck(name, {"Type": "circle", "Parameters": [R]})
    deck["Output"] = {"Output_Interval": 10, "Tags": ["Strain_Stress"]}
    model = deck_folder.model(deck)
    (warning,) = model.warnings
    assert "Strain_Stress: no body has elements" in warning
    model.run(tmp_path / "out", steps=0)
    assert not (tmp_path / "out" / "output_strain.pvd").exists()


def test_stress_without_elastic_constants_is_nan_with_a_warning(deck_folder):
    name = deck_folder.mesh("disc", disc_mesh(R))
    deck = single_deck(name, {"Type": "circle", "Parameters": [R]})
    deck["Material"]["Zone_1"] = {
        "Type": "PMBBond",
        "Density": 1200.0,
        "Horizon": 6e-4,
        "Compute_From_Classical": False,
        "Bond_Potential": {"Parameters": [1e16, 0.02]},
    }
    deck["Output"] = {"Output_Interval": 10, "Tags": ["Strain_Stress"]}
    model = deck_folder.model(deck)
    assert "the stress of Zone_1 is not known" in model.warnings[0]
    strain, stress = StrainField(model).compute()
    assert np.isnan(stress).all()
    assert np.all(strain == 0)
