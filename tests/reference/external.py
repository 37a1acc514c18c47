"""Loads from outside: force sets and prescribed motion."""

# ruff: noqa: N803, N806 - symbols of the paper

from dataclasses import dataclass

import numpy as np

from .comparison import greater


@dataclass(frozen=True)
class LoadSet:
    """Nodes with amplitudes, directions (0, 1, 2), and a function of time."""

    nodes: np.ndarray
    amplitude: np.ndarray
    directions: tuple
    kind: str
    T: tuple
    zero: bool = False


def force_factor(load, t):
    """Factor in time of a force set."""
    T = load.T
    if load.kind == "linear":
        return t
    if load.kind == "linear_step":  # grows for T1, rests for T2, and so on
        cycles, rest = divmod(t, T[1] + T[2])
        return cycles * T[1] + min(rest, T[1])
    if load.kind == "linear_slow_fast":
        return (T[3] if greater(t, T[1]) else T[2]) * t
    if load.kind == "sin":
        return np.sin(np.pi * T[1] * t)
    return 1.0


def add_force_set(f, load, t):
    """f += amplitude times factor."""
    for d in load.directions:
        f[load.nodes, d] += load.amplitude * force_factor(load, t)


def motion(load, X, t, *, original):
    """Displacement and velocity, shape (k, 3), of the nodes of a displacement set."""
    a, T = load.amplitude[:, None], load.T
    one = np.ones((len(load.nodes), 3))
    if load.zero:
        return 0 * one, 0 * one
    if load.kind == "linear":
        return a * t * one, a * one
    if load.kind == "quadratic":  # the original gives half the rate of the quadratic part
        rate = T[1] * t if original else 2 * T[1] * t
        return (a * t + T[1] * t**2) * one, (a + rate) * one
    if load.kind == "sin":
        w = np.pi * T[1]
        return a * np.sin(w * t) * one, a * w * np.cos(w * t) * one
    if load.kind == "rotation":
        dX = X[load.nodes] - np.array(T[1:4])
        c, s = np.cos(T[0] * t), np.sin(T[0] * t)
        R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        dR = np.array([[-s, -c, 0], [c, -s, 0], [0, 0, 0]])
        return dX @ R.T - dX, T[0] * dX @ dR.T
    return a * one, 0 * one  # constant


def prescribe(state, load, t, *, original):
    """Set u, v and x of the set's directions."""
    u, v = motion(load, state.X, t, original=original)
    for d in load.directions:
        state.u[load.nodes, d] = u[:, d]
        state.v[load.nodes, d] = v[:, d]
        state.x[load.nodes, d] = state.X[load.nodes, d] + u[:, d]
