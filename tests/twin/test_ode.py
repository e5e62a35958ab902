"""Steps and ends of many initial value problems, on motions known in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest
from pyroshock.twin.ode import DORMAND_PRINCE, Tolerance, run
from pyroshock.twin.rosenbrock import RODAS


@dataclass(frozen=True)
class Thrown:
    """x'' = -w^2 x from rest at 0 with velocity 1: x = sin(w t) / w."""

    omega: np.ndarray
    target: np.ndarray

    def rates(self, time, state):
        return np.stack([state[1], -(self.omega**2) * state[0]])

    def given_up(self, time, state):
        return state[1] < 0

    def take(self, rows):
        return Thrown(self.omega[rows], self.target[rows])


def thrown(_, state):
    """x = sin t."""
    return np.stack([state[1], -state[0]])


def dragged(time, state):
    """x = 1 - cos t: by time and not linear, which Rodas needs to show no more than its order."""
    return np.stack([state[1], np.cos(time) + np.sin(time) ** 2 - state[1] ** 2])


@pytest.mark.parametrize(
    ("method", "rates", "start", "end"),
    [(DORMAND_PRINCE, thrown, [0.0, 1.0], np.sin(2)), (RODAS, dragged, [0.0, 0.0], 1 - np.cos(2))],
)
def test_the_error_falls_with_the_fifth_power(method, rates, start, end):
    def error(n):
        state, step = np.array(start)[:, None], np.full(1, 2 / n)
        for i in range(n):
            time = np.full(1, i * step[0])
            state = method.step(rates, time, state, rates(time, state), step, np.ones((2, 1)))[0]
        return abs(state[0, 0] - end)

    assert np.log2(error(20) / error(40)) == pytest.approx(5, abs=0.35)


@pytest.mark.parametrize("method", [DORMAND_PRINCE, RODAS])
def test_targets_are_met_when_they_should_be(method):
    omega = np.array([0.5, 1.0, 2.0])
    problem = Thrown(omega, np.array([1.0, 0.5, 9.0]))
    start = np.stack([np.zeros(3), np.ones(3)])
    ends = run(problem, start, np.full(3, 1e-3), Tolerance(1e-10, np.full((2, 3), 0.1)), method)
    assert list(ends.reached) == [True, True, False]
    np.testing.assert_allclose(ends.state[0, :2], [1.0, 0.5], rtol=1e-9)
    expected = np.arcsin(problem.target[:2] * omega[:2]) / omega[:2]
    np.testing.assert_allclose(ends.time[:2], expected, rtol=1e-8)
