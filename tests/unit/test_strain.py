"""Strain and stress at quadrature points: linear fields are exact, turned grains have none."""

import itertools
import math

import numpy as np
import pytest
from helpers import GRAIN_RADIUS, box_mesh, disc_mesh, displace, single_deck
from peridem import PeridemWarning
from peridem.output import read_pvd
from peridem.strain import StrainField, quadrature_points
from peridem.vtu import read_vtu

R = GRAIN_RADIUS
K, G = 2.16e7, 1.296e7  # helpers.MATERIAL
LAME = K - 2 * G / 3


def model_2d(deck_folder, order=1, plane_strain=False, quads=False, mode="corrected"):
    if quads:
        square = [-R, -R, 0, R, R, 0]
        deck = single_deck("", {"Type": "rectangle", "Parameters": square})
        deck["Mesh"]["Zone_1"] = {"CreateMesh": {"Flag": True}, "Mesh_Size": R / 6}
    else:
        name = deck_folder.mesh("disc", disc_mesh(R, jiggle=0.2))
        deck = single_deck(name, {"Type": "circle", "Parameters": [R]})
    deck["Material"]["Zone_1"] = {**deck["Material"]["Zone_1"], "Is_Plane_Strain": plane_strain}
    changes = {"Model.Quad_Approximation_Order": order, "Model.Compatibility": mode}
    return deck_folder.model(deck, changes)


def model_3d(deck_folder, order=1, mode="corrected"):
    name = deck_folder.mesh("cube", box_mesh((R,) * 3, (4,) * 3, jiggle=0.2))
    deck = single_deck(name, {"Type": "cube", "Parameters": [R]}, Dimension=3)
    changes = {"Model.Quad_Approximation_Order": order, "Model.Compatibility": mode}
    return deck_folder.model(deck, changes)


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
    model = model_2d(deck_folder, order, plane_strain=True, quads=quads, mode="original")
    e = stretched(model)
    strain, stress = StrainField(model).compute()
    np.testing.assert_allclose(strain, np.broadcast_to(as_rows(e), strain.shape), atol=1e-15)
    sigma = LAME * np.trace(e) * np.eye(3) + 2 * G * e
    expected = np.broadcast_to(as_rows(sigma), stress.shape)
    np.testing.assert_allclose(stress, expected, rtol=0, atol=1e-12 * K)


def test_linear_field_in_plane_stress_is_exact(deck_folder):
    # E/(1 - nu^2) (e_xx + nu e_yy), the textbook's form
    model = model_2d(deck_folder, 2, mode="original")
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
    model = model_3d(deck_folder, order, mode="original")
    e = stretched(model)
    strain, stress = StrainField(model).compute()
    np.testing.assert_allclose(strain, np.broadcast_to(as_rows(e), strain.shape), atol=1e-15)
    sigma = LAME * np.trace(e) * np.eye(3) + 2 * G * e
    expected = np.broadcast_to(as_rows(sigma), stress.shape)
    np.testing.assert_allclose(stress, expected, rtol=0, atol=1e-12 * K)


@pytest.mark.parametrize("make", [model_2d, model_3d])
def test_small_rotation_strains_in_second_order_in_original_mode(deck_folder, make):
    # cos(a) - 1 on the diagonal in the plane, nothing else
    model, angle = make(deck_folder, mode="original"), 1e-4
    c, s = math.cos(angle), math.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    displace(model, model.state.x_ref @ (turn - np.eye(3)).T)
    strain, _ = StrainField(model).compute()
    np.testing.assert_allclose(strain[:, :2], c - 1, rtol=0, atol=1e-17 / 1e-3)
    np.testing.assert_allclose(strain[:, 3:], 0, rtol=0, atol=1e-17 / 1e-3)


def turned_about(axis, angle):
    """Rotation (Rodrigues): I + sin a W + (1 - cos a) W^2, W the cross product with the axis."""
    x, y, z = np.array(axis) / np.linalg.norm(axis)
    w = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * w + (1 - math.cos(angle)) * w @ w


TURNS = [(model_2d, (0, 0, 1)), (model_3d, (1, 2, 3))]


@pytest.mark.parametrize(("make", "axis"), TURNS)
@pytest.mark.parametrize("angle", [0.3, math.pi / 2, math.pi])
def test_rigid_rotation_has_no_strain_and_no_stress(deck_folder, make, axis, angle):
    model = make(deck_folder)
    turn = turned_about(axis, angle)
    displace(model, model.state.x_ref @ (turn - np.eye(3)).T + [1e-3, -2e-3, 0])
    strain, stress = StrainField(model).compute()
    # a displacement of the size of the body, 1e-16 of it lost, over elements a few times smaller
    np.testing.assert_allclose(strain, 0, rtol=0, atol=1e-13)
    np.testing.assert_allclose(stress, 0, rtol=0, atol=1e-12 * K)


@pytest.mark.parametrize(("make", "axis"), TURNS)
def test_stretch_then_rotation_gives_the_strain_turned_with_the_body(deck_folder, make, axis):
    # F = R U with U = I + e: V = R U R^T, so the strain is R e R^T, whatever the size of e
    model, e = make(deck_folder), np.zeros((3, 3))
    e[0, 0], e[1, 1] = 0.2, -0.1
    turn = turned_about(axis, 0.7)
    displace(model, model.state.x_ref @ (turn @ (np.eye(3) + e) - np.eye(3)).T)
    strain, _ = StrainField(model).compute()
    expected = as_rows(turn @ e @ turn.T)
    if model.dimension == 2:
        strain = strain[:, [0, 1, 3]]
        expected = expected[[0, 1, 3]]
    np.testing.assert_allclose(strain, np.broadcast_to(expected, strain.shape), rtol=0, atol=1e-13)


def test_uniaxial_stretch_turned_by_90_degrees_has_its_stress_along_y(deck_folder):
    # plane strain, e_xx = e before the turn: sigma_yy = (lambda + 2 G) e, sigma_xx = lambda e
    model, e = model_2d(deck_folder, plane_strain=True), 0.01
    quarter = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    displace(model, model.state.x_ref @ (quarter @ np.diag([1 + e, 1, 1]) - np.eye(3)).T)
    _, stress = StrainField(model).compute()
    expected = [LAME * e, (LAME + 2 * G) * e, LAME * e, 0, 0, 0]
    np.testing.assert_allclose(stress, np.broadcast_to(expected, stress.shape), atol=1e-12 * K)


@pytest.mark.parametrize("make", [model_2d, model_3d])
def test_small_displacements_strain_as_in_original_mode(deck_folder, make):
    # They differ by products of gradients, here up to 3 (6e-9)^2; without rotation not at all.
    model, original = make(deck_folder), make(deck_folder, mode="original")
    for one in (model, original):
        displace(one, 1e-6 * one.state.x_ref @ GRADIENT.T)
    found, known = StrainField(model).compute()[0], StrainField(original).compute()[0]
    free = [0, 1, 3] if model.dimension == 2 else list(range(6))
    np.testing.assert_allclose(found[:, free], known[:, free], rtol=0, atol=2e-16)
    for one in (model, original):
        displace(one, one.state.x_ref @ (0.5 * (GRADIENT + GRADIENT.T)))
    found, known = StrainField(model).compute()[0], StrainField(original).compute()[0]
    np.testing.assert_allclose(found[:, free], known[:, free], rtol=0, atol=1e-15)


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
    with pytest.warns(PeridemWarning, match="no body has elements"):
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
