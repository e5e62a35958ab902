"""The cost of eq. 5.4."""

from __future__ import annotations

import math

import numpy as np
from pyroshock.training.evaluation.metrics import pulse_cost

PULSE = np.array([[0.0, 30.0, 40.0, 10.0, 0.0]])
TIME = np.array([2e-3])


def test_equal_pulses_cost_nothing() -> None:
    assert pulse_cost(PULSE, TIME, PULSE, TIME)[0] == 0.0


def test_far_pulses_cost_their_elements() -> None:
    assert math.isclose(pulse_cost(PULSE, TIME, PULSE + 400.0, TIME)[0], 5.0)


def test_far_times_cost_all_elements_but_the_first() -> None:
    """Both time vectors begin at zero."""
    assert math.isclose(pulse_cost(PULSE, TIME, PULSE, 9 * TIME)[0], 4.0)


def test_elements_by_hand() -> None:
    """0.2 ms late, element i of five by i / 4 of it (sigma 0.1 ms); one force is off by 6 N (sigma 4 N)."""
    force = PULSE + np.array([0.0, 6.0, 0.0, 0.0, 0.0])
    late = [(i / 4 * 2.0) ** 2 / 2 for i in range(5)]
    expected = sum(1 - math.exp(-(late[i] + (1.5**2 / 2 if i == 1 else 0.0))) for i in range(5))
    assert math.isclose(pulse_cost(PULSE, TIME, force, TIME + 0.2e-3)[0], expected, rel_tol=1e-12)


def test_units_do_not_matter() -> None:
    force, time = PULSE * 1.05, TIME * 1.02
    newtons = pulse_cost(PULSE, TIME, force, time)
    assert np.allclose(newtons, pulse_cost(PULSE / 1e3, TIME * 1e3, force / 1e3, time * 1e3), rtol=1e-12)
