"""Loads: prescribed motion, force sets, gravity and initial velocity against closed forms."""

# ruff: noqa: N806 - symbols of the paper

import numpy as np
import pytest
from helpers import GRAIN_RADIUS, disc_mesh, single_deck

DT = 1e-6
CIRCLE = {"Type": "circle", "Parameters": [GRAIN_RADIUS]}
BOTH = pytest.mark.parametrize("mode", ["corrected", "original"])


@pytest.fixture
def grain(deck_folder):
    """Builder of a disc with loads: grain(changes, mode)."""
    deck = single_deck(deck_folder.mesh("disc", disc_mesh(GRAIN_RADIUS)), CIRCLE, dt=DT)
    return lambda changes, mode=None: deck_folder.model(deck, changes, compatibility=mode)


def led(time, parameters, directions=(1, 2), space=None, **options):
    """A displacement set on the whole body."""
    load = {
        "Particle_List": [0],
        "Direction": list(directions),
        "Time_Function": {"Type": time, "Parameters": list(parameters)},
        **({"Spatial_Function": space} if space else {}),
        **options,
    }
    return {"Displacement_BC": {"Sets": 1, "Set_1": load}}


def pushed(time, parameters, space=None, directions=(1,)):
    """A force set on the whole body, which never moves: f is the load alone."""
    changes = led(time, parameters, directions, space)
    return {"Force_BC": changes["Displacement_BC"], "Particle.Zone_1.All_Dofs_Constrained": True}


def assert_motion(model, u, v):
    """Components x and y of all nodes, and positions; one rounding of each operation."""
    s = model.state
    n = len(s)
    np.testing.assert_allclose(s.u[:, :2], np.broadcast_to(u, (n, 2)), rtol=1e-13, atol=1e-19)
    np.testing.assert_allclose(s.v[:, :2], np.broadcast_to(v, (n, 2)), rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(s.x, s.x_ref + s.u, rtol=1e-14, atol=1e-19)


# t = 5e-6 after five steps
@pytest.mark.parametrize(
    ("time", "motion"),
    [
        (("constant", [2e-5]), (2e-5, 0.0)),
        (("linear", [3.0]), (1.5e-5, 3.0)),
        # sin: a sin(pi T1 t), T1 t = 1/6: a/2 and a pi T1 cos(pi/6)
        (("sin", [2e-5, 1e6 / 30]), (1e-5, 2e-5 * np.pi * 1e6 / 30 * np.sqrt(3) / 2)),
    ],
    ids=["constant", "linear", "sin"],
)
@BOTH
def test_led_body_follows_the_function_of_time(grain, time, motion, mode):
    model = grain(led(*time), mode)
    model.step(5)
    assert_motion(model, *motion)
    assert (model.state.fixity == 3).all()


@pytest.mark.parametrize(("mode", "v"), [("corrected", 2.0 + 2 * 0.5), ("original", 2.0 + 0.5)])
def test_quadratic_motion_and_its_velocity(grain, mode, v):
    # u = a t + T1 t^2 = 1e-5 + 1e5 * 25e-12; v = a + 2 T1 t, in the original a + T1 t
    model = grain(led("quadratic", [2.0, 1e5]), mode)
    model.step(5)
    assert_motion(model, 1.25e-5, v)


def test_rotation_about_a_point(grain):
    # angle 1e5 * 5e-6 = 0.5 about (1e-3, -2e-3): x = c + R (X - c), v = rate times normal
    rate, center = 1e5, np.array([1e-3, -2e-3])
    model = grain(led("rotation", [rate, *center, 0.0]))
    model.step(5)
    c, s = np.cos(0.5), np.sin(0.5)
    arm = (model.state.x_ref[:, :2] - center) @ np.array([[c, s], [-s, c]])
    np.testing.assert_allclose(model.state.x[:, :2] - center, arm, rtol=1e-12, atol=1e-17)
    normal = np.column_stack([-arm[:, 1], arm[:, 0]])
    np.testing.assert_allclose(model.state.v[:, :2], rate * normal, rtol=1e-12, atol=1e-11)
    # a rigid motion: no forces to round-off of 1e-16 of K / horizon per unit stretch
    assert np.abs(model.state.f).max() < 1e-10 * 2.16e7 / 6e-4


def test_rotation_of_one_direction_leaves_the_other_free(grain):
    model = grain(led("rotation", [1e4, 0.0, 0.0, 0.0], directions=[1]))
    model.step(1)
    X, angle = model.state.x_ref, 1e-2
    u = X[:, 0] * (np.cos(angle) - 1) - X[:, 1] * np.sin(angle)
    np.testing.assert_allclose(model.state.u[:, 0], u, rtol=1e-12, atol=1e-19)
    assert (model.state.fixity == 1).all()


@pytest.mark.parametrize(
    ("space", "factor"),
    [
        ({"Type": "constant"}, lambda x, y: 2.0 + 0 * x),
        ({"Type": "sin_x", "Parameters": [300.0]}, lambda x, y: 2 * np.sin(np.pi * 300 * x)),
        ({"Type": "linear_y", "Parameters": [300.0]}, lambda x, y: 2 * 300 * y),
        # hat replaces the amplitude; the box of the disc is [-R, R]
        ({"Type": "hat_x", "Parameters": [5.0]}, lambda x, y: 5 * (1 - np.abs(x) / 1e-3)),
    ],
    ids=lambda s: s["Type"] if isinstance(s, dict) else "",
)
def test_led_body_varies_in_space(grain, space, factor):
    model = grain(led("linear", [2.0], [2], space))
    model.step(1)
    v = factor(*model.state.x_ref[:, :2].T)
    np.testing.assert_allclose(model.state.v[:, 1], v, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(model.state.u[:, 1], v * DT, rtol=1e-12, atol=1e-18)


def test_zero_displacement_holds_directions_and_frees_the_others(grain):
    changes = led("constant", [0.0], [2], Zero_Displacement=True)
    model = grain({**changes, "Force_BC": {"Gravity": [7.0, -10.0, 0.0]}})
    model.step(3)
    # x falls freely: v = g t, u = g dt^2 (1 + 2 + 3)
    np.testing.assert_allclose(model.state.u[:, 0], 7.0 * 6 * DT**2, rtol=1e-8)
    assert (model.state.u[:, 1] == 0).all()
    assert (model.state.v[:, 1] == 0).all()


# Factors at t = 0 to 6 microseconds
@pytest.mark.parametrize(
    ("time", "parameters", "values"),
    [
        ("constant", [4e6], [4e6] * 7),
        ("linear", [4e12], [0, 4e6, 8e6, 12e6, 16e6, 20e6, 24e6]),
        # grows over 1.5 us, rests for 1 us: t = 0, 1, then 1.5, 2 (1.5 + 0.5), 3, 3, 4
        (
            "linear_step",
            [4e12, 1.5e-6, 1e-6],
            [0, 4e6, 6e6, 8e6, 12e6, 12e6, 16e6],
        ),
        # T2 t up to T1 = 2.5 us, T3 t after it
        (
            "linear_slow_fast",
            [4.0, 2.5e-6, 1e12, 3e12],
            [0, 4e6, 8e6, 36e6, 48e6, 60e6, 72e6],
        ),
        ("sin", [4e6, 2.5e5], [4e6 * np.sin(np.pi * k / 4) for k in range(7)]),
    ],
)
def test_force_follows_the_function_of_time(grain, time, parameters, values):
    model = grain(pushed(time, parameters))
    model.start()
    for k, value in enumerate(values):
        if k:
            model.step()
        # times are sums of dt, and sin(pi) is no exact zero
        np.testing.assert_allclose(model.state.f[:, 0], value, rtol=1e-12, atol=1e-8)
    assert (model.state.f[:, 1] == 0).all()
    assert (model.state.force_fixity == 1).all()


@pytest.mark.parametrize(
    ("space", "factor"),
    [
        ({"Type": "sin_y", "Parameters": [300.0]}, lambda x, y: 300 * np.sin(np.pi * 300 * y)),
        ({"Type": "linear_x", "Parameters": [300.0]}, lambda x, y: 300**2 * x),
        ({"Type": "hat_y", "Parameters": [5.0]}, lambda x, y: 5 * (1 - np.abs(y) / 1e-3)),
    ],
    ids=lambda s: s["Type"] if isinstance(s, dict) else "",
)
def test_force_varies_in_space(grain, space, factor):
    model = grain(pushed("constant", [7.0], space))
    model.start()
    expected = 7 * factor(*model.state.x_ref[:, :2].T)
    np.testing.assert_allclose(model.state.f[:, 0], expected, rtol=1e-12, atol=1e-9)


def test_gravity_acts_on_every_node_by_its_density(deck_folder):
    deck = deck_folder.grains(offset=(0, 5e-3), walls=(2,))
    deck["Material"]["Zone_2"]["Density"] = 2000.0
    model = deck_folder.model(deck, {"Force_BC.Gravity": [1.0, -10.0, 0.0]})
    model.compute_forces()
    wall = model.particles[1].start
    # the rounding of inner forces: 1e-16 of K / horizon = 4e10
    np.testing.assert_allclose(model.state.f[:wall], [[1200.0, -12000.0, 0.0]] * wall, atol=1e-4)
    assert (model.state.f[wall:] == [2000.0, -20000.0, 0.0]).all()


def test_initial_velocity_of_listed_bodies(deck_folder):
    deck = deck_folder.grains(offset=(0, 5e-3))
    velocity = {"Velocity_Vector": [1.0, 2.0, 0.0], "Particle_List": [1]}
    model = deck_folder.model(deck, {"IC.Constant_Velocity": velocity})
    model.start()
    second = model.particles[1].start
    assert (model.state.v[:second] == 0).all()
    assert (model.state.v[second:] == [1.0, 2.0, 0.0]).all()


def test_initial_velocity_of_a_single_body_without_list(grain):
    model = grain({"IC.Constant_Velocity.Velocity_Vector": [1.0, 2.0, 0.0]})
    model.start()
    assert (model.state.v == [1.0, 2.0, 0.0]).all()


@pytest.mark.parametrize("scheme", ["central_difference", "velocity_verlet"])
def test_free_fall_of_each_integrator(deck_folder, scheme):
    # n steps of central difference: u = g dt^2 n (n + 1) / 2; of Verlet: g t^2 / 2 exactly
    name = deck_folder.mesh("disc", disc_mesh(GRAIN_RADIUS))
    deck = single_deck(name, CIRCLE, dt=DT, scheme=scheme)
    model = deck_folder.model(deck, {"Force_BC.Gravity": [0.0, -8.0, 0.0]})
    model.step(10)
    u = -8.0 * DT**2 * (55 if scheme == "central_difference" else 50)
    # the rounding of inner forces, 1e-5 against a weight of 1e4
    np.testing.assert_allclose(model.state.u[:, 1], u, rtol=1e-8)
    np.testing.assert_allclose(model.state.v[:, 1], -8.0 * 10 * DT, rtol=1e-8)
    assert model.n == 10
    assert model.time == pytest.approx(10 * DT, rel=1e-14)
