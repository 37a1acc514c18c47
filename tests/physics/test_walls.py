"""The reaction of a wall is what it gives the grains."""

import numpy as np
import pytest

CONTACT = {
    "Friction_On": True,
    "Friction_Coeff": 0.3,
    "Damping_On": True,
    "Epsilon": 0.8,
    "Beta_n_Factor": 5.0,
}
MODES = pytest.mark.parametrize("mode", ["corrected", "original"])
GRAVITY = np.array([0.0, -500.0, 0.0])


def wall_deck(deck_folder, held):
    """A grain (body 1) that hits another (body 0) which is a wall, held or led."""
    walls = (1,) if held == "constrained" else ()
    deck = deck_folder.grains(offset=(3e-4, 2.11e-3), walls=walls)
    deck["Zone"]["Zone_1"]["Is_Wall"] = True
    for law in deck["Contact"].values():
        law.update(CONTACT)
    deck["IC"] = {"Constant_Velocity": {"Velocity_Vector": [2, -10.0, 0], "Particle_List": [1]}}
    deck["Force_BC"] = {"Gravity": GRAVITY.tolist()}
    if held == "led":
        lift = {"Type": "linear", "Parameters": [3.0]}
        deck["Displacement_BC"] = {
            "Sets": 1,
            "Set_1": {"Particle_List": [0], "Direction": [1, 2], "Time_Function": lift},
        }
    return deck


@MODES
@pytest.mark.parametrize("held", ["constrained", "led"])
def test_reaction_of_a_wall_is_the_momentum_it_gives(deck_folder, held, mode):
    model = deck_folder.model(wall_deck(deck_folder, held), compatibility=mode)
    s, grain = model.state, slice(model.particles[1].start, None)
    mass = (s.density * s.volume)[:, None]
    wall_mass = mass[: grain.start].sum()
    model.start()
    given, received, largest = np.zeros(3), -(mass * s.v)[grain].sum(axis=0), 0.0
    for _ in range(600):
        # the wall's force without its weight; its inner forces, if any, cancel
        reaction = (s.f * s.volume[:, None])[: grain.start].sum(axis=0) - wall_mass * GRAVITY
        largest = max(largest, np.abs(reaction).max())
        weight = mass[grain].sum() * GRAVITY
        on_grain = (s.f * s.volume[:, None])[grain].sum(axis=0) - weight
        assert np.abs(on_grain + reaction).max() <= 1e-10 * max(largest, abs(weight[1]))
        given += (weight - reaction) * model.dt
        model.step()
    received += (mass * s.v)[grain].sum(axis=0)
    assert np.abs(received - given).max() < 1e-10 * np.abs(received).max()
    assert received[1] > 5 * mass[grain].sum()  # the grain was turned back
    assert largest > 100 * abs(weight[1])


@MODES
def test_reaction_does_not_move_a_held_wall(deck_folder, mode):
    model = deck_folder.model(wall_deck(deck_folder, "constrained"), compatibility=mode)
    model.step(200)
    wall = slice(0, model.particles[0].stop)
    assert (model.state.f[wall] != GRAVITY * 1200.0).any()
    assert (model.state.u[wall] == 0).all()
    assert (model.state.v[wall] == 0).all()
    assert np.array_equal(model.state.x[wall], model.state.x_ref[wall])
