"""Durations: steps that reach a time, intervals, time steps to the last bit."""

from __future__ import annotations

import pytest
from peridem.duration import duration_until, exact_duration, interval_in_steps, steps_until
from peridem.errors import InputError


def test_steps_reach_the_time_and_not_one_more_for_round_off() -> None:
    assert steps_until(1e-3, 1e-7) == 10_000
    assert steps_until(3 * 0.1, 0.1) == 3  # 0.30000000000000004 / 0.1
    assert steps_until(1.05e-6, 1e-7) == 11
    assert steps_until(0.0, 1e-7) == 0


@pytest.mark.parametrize("dt", [1e-7, 3.3e-8, 0.1, 1 / 3, 1.218026796589525e-07])
@pytest.mark.parametrize("steps", [1, 7, 999, 123_457])
def test_exact_durations_give_the_time_step_again(dt: float, steps: int) -> None:
    final_time, n = exact_duration(dt, steps)
    assert final_time / n == dt
    assert steps <= n <= steps + 200


def test_a_duration_keeps_the_time_step_or_the_end() -> None:
    assert duration_until(1.05e-6, 1e-7) == (1.05e-6, 11)
    final_time, n = duration_until(3e-5, 3e-7)
    assert (final_time / n, n) == (3e-7, 100)
    # an interval of 5e-6 s takes 17 steps of at most 3e-7 s
    assert duration_until(2e-5, 3e-7, 5e-6) == (2e-5, 4 * 17)
    assert duration_until(2e-5, 3e-7, 6e-6)[1] == 67  # does not fill the time


def test_intervals_are_steps_or_seconds() -> None:
    assert interval_in_steps("every", 50, 1e-7) == 50
    assert interval_in_steps("every", 2e-5, 1e-7) == 200
    with pytest.raises(InputError, match="every = True: must be a finite number"):
        interval_in_steps("every", True, 1e-7)
