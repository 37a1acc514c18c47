"""Selection of nodes and amplitudes in space."""

from types import SimpleNamespace

import numpy as np
import pytest
from peridem.errors import InputError
from peridem.geometry import make_shape
from peridem.loads import amplitude, empty_selection_warning, select_nodes

# two bodies of three nodes each on the x axis
X = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [10, 0, 0], [11, 0, 0], [12, 0, 0]], dtype=float)
BODY = np.array([0, 0, 0, 1, 1, 1], dtype=np.int32)


def load(particles=None, exclude=None, time=("constant", (3.0,)), spatial=("constant", ())):
    return SimpleNamespace(
        particle_list=particles,
        particle_exclude_list=exclude,
        time_function=time and SimpleNamespace(type=time[0], parameters=time[1]),
        spatial_function=SimpleNamespace(type=spatial[0], parameters=spatial[1]),
    )


@pytest.mark.parametrize(
    ("particles", "exclude", "region", "expected"),
    [
        (None, None, None, []),
        (None, [0], None, []),  # without region or list an exclusion alone selects nothing
        ([1], None, None, [3, 4, 5]),
        ([0, 1], [0], None, [3, 4, 5]),
        (None, None, [1, -1, 0, 11, 1, 0], [1, 2, 3, 4]),
        ([0], None, [1, -1, 0, 11, 1, 0], [1, 2]),
        (None, [0], [1, -1, 0, 11, 1, 0], [3, 4]),
        ([], [], [1, -1, 0, 11, 1, 0], [1, 2, 3, 4]),  # empty lists say nothing
    ],
)
def test_selection_combines_region_and_lists(particles, exclude, region, expected):
    shape = make_shape("rectangle", region) if region else None
    nodes = select_nodes(load(particles, exclude), X, BODY, shape)
    assert nodes.dtype == np.int32
    assert nodes.tolist() == expected


@pytest.mark.parametrize(("particles", "exclude"), [([2], None), ([-1], None), ([0], [7])])
def test_unknown_body_is_an_error(particles, exclude):
    with pytest.raises(InputError, match=r"input.yaml:9: .*_List = .*counted from 0 to 1"):
        select_nodes(load(particles, exclude), X, BODY, None, where="input.yaml:9")


def test_selection_in_the_region_of_a_reference_case():
    # single_rect_loads of the original: 21 x 11 nodes 2e-4 m apart; x <= 3e-4 holds two
    # columns, so 22 nodes are fixed, as the original's result says
    x, y = np.meshgrid(np.arange(21) * 2e-4, np.arange(11) * 2e-4)
    nodes = np.column_stack([x.ravel(), y.ravel(), np.zeros(231)])
    shape = make_shape("rectangle", [-0.001, -0.001, 0.0, 0.0003, 0.003, 0.0])
    found = select_nodes(load(), nodes, np.zeros(231, dtype=np.int32), shape)
    assert found.tolist() == [21 * row + column for row in range(11) for column in (0, 1)]


def test_empty_selection_is_warned_of_and_others_are_not():
    nothing = np.empty(0, dtype=np.int32)
    shape = make_shape("circle", [1.0])
    warning = empty_selection_warning(load(), nothing, shape, where="input.yaml:9")
    assert warning.startswith("input.yaml:9: no node lies in the set's region (circle")
    assert "neither Region nor Particle_List" in empty_selection_warning(
        load(), nothing, None, where=""
    )
    assert "leave no body" in empty_selection_warning(load([0], [0]), nothing, None, where="")
    assert empty_selection_warning(load([0]), np.array([1]), None, where="") is None


# T0 = 3, p0 = 0.25, at x = 0, 1, 2 in a box from 0 to 2 (hat 0, 1, 0); sin(pi/4) = sqrt(1/2)
S = np.sqrt(0.5)


@pytest.mark.parametrize(
    ("kind", "spatial", "expected"),
    [
        ("displacement", "constant", [3, 3, 3]),
        ("displacement", "rotation", [3, 3, 3]),
        ("displacement", "hat_x", [0, 0.25, 0]),
        ("displacement", "sin_x", [0, 3 * S, 3]),
        ("displacement", "linear_x", [0, 0.75, 1.5]),
        ("force", "constant", [3, 3, 3]),
        ("force", "hat_x", [0, 0.75, 0]),
        ("force", "sin_x", [0, 0.75 * S, 0.75]),
        ("force", "linear_x", [0, 3 / 16, 6 / 16]),
    ],
)
@pytest.mark.parametrize("axis", ["x", "y"])
def test_amplitude_follows_the_table(kind, spatial, expected, axis):
    order = [0, 1, 2] if axis == "x" else [1, 0, 2]
    boxes = np.tile([[0.0, -1, 0], [2, 1, 0]], (3, 1, 1))[:, :, order]
    entry = load(spatial=(spatial.replace("_x", f"_{axis}"), (0.25,)))
    values = amplitude(entry, kind, X[:3, order], boxes)
    np.testing.assert_allclose(values, expected, rtol=1e-15, atol=1e-15)


def test_hat_uses_each_nodes_own_box_and_vanishes_outside():
    boxes = np.array([[[0, 0, 0], [2, 0, 0]], [[0, 0, 0], [4, 0, 0]], [[0, 0, 0], [1, 0, 0]]])
    points = np.array([[0.5, 0, 0], [0.5, 0, 0], [1.5, 0, 0]])
    values = amplitude(load(spatial=("hat_x", (1.0,))), "displacement", points, boxes)
    np.testing.assert_allclose(values, [0.5, 0.25, 0.0], rtol=1e-15)


def test_set_without_time_function_has_no_amplitude():
    boxes = np.zeros((2, 2, 3))
    assert amplitude(load(time=None), "displacement", X[:2], boxes).tolist() == [0, 0]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"time": ("linear", ())}, "Time_Function.Parameters"),
        ({"spatial": ("sin_x", ())}, "Spatial_Function.Parameters"),
        ({"spatial": ("sin_z", (1.0,))}, "sin_z: unknown"),
        ({"spatial": ("hat_y", (1.0,))}, "no width"),
    ],
)
def test_amplitude_refuses_what_it_cannot_compute(changes, words):
    boxes = np.tile([[0.0, 0, 0], [2, 0, 0]], (3, 1, 1))
    with pytest.raises(InputError, match=words):
        amplitude(load(**changes), "force", X[:3], boxes)
