"""A linearly implicit step for many small stiff problems: Rodas, of order 4 with an error of order 3, L-stable.

Source: Hairer and Wanner, Solving Ordinary Differential Equations II, section IV.7, and their program RODAS.
"""

from __future__ import annotations

import numpy as np

from .ode import Floats, Method, Rates

_GAMMA = 0.25
_NODES = (0.0, 0.386, 0.21, 0.63, 1.0, 1.0)
_TIMES = (0.25, -0.1043, 0.1035, -0.0362, 0.0, 0.0)
# What earlier stages add to the state, and, over the step, to the right-hand side.
_STATE = (
    np.array([]),
    np.array([1.544]),
    np.array([0.9466785280815826, 0.2557011698983284]),
    np.array([3.314825187068521, 2.896124015972201, 0.9986419139977817]),
    np.array([1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950]),
    np.array([1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 1.0]),
)
_SIDE = (
    np.array([]),
    np.array([-5.6688]),
    np.array([-2.430093356833875, -0.2063599157091915]),
    np.array([-0.1073529058151375, -9.594562251023355, -20.47028614809616]),
    np.array([7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160]),
    np.array([8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054]),
)


def rosenbrock_step(
    rates: Rates, time: Floats, state: Floats, first: Floats, step: Floats, size: Floats
) -> tuple[Floats, Floats, Floats]:
    """One step (n,): state, its rates and the estimated error, each (k, n). `first` are the rates at the begin.

    `size` (k, n) of the quantities sets the differences that the Jacobian is taken from.
    """
    k, n = state.shape
    by_state, by_time = _derivatives(rates, time, state, first, step, size)
    # Rows as the last axis but one: n small systems.
    system = np.eye(k) / (_GAMMA * step[:, None, None]) - by_state
    inverse = np.linalg.inv(system)
    stages = np.empty((6, k, n))
    flat = stages.reshape(6, k * n)
    for i in range(6):
        at = state + (_STATE[i] @ flat[:i]).reshape(k, n) if i else state
        side = rates(time + _NODES[i] * step, at) if i else first.copy()
        side += (_SIDE[i] @ flat[:i]).reshape(k, n) / step + _TIMES[i] * step * by_time
        stages[i] = np.einsum("nij,jn->in", inverse, side)
    end = at + stages[5]
    return end, rates(time + step, end), stages[5]


RODAS = Method(rosenbrock_step, 4)


def _derivatives(
    rates: Rates, time: Floats, state: Floats, first: Floats, step: Floats, size: Floats
) -> tuple[Floats, Floats]:
    """Of the rates, by the state (n, k, k) and by time (k, n): all differences in one call."""
    k = len(state)
    # Downwards: rates of a body at rest, which nothing pulls back, have their corner above.
    delta = -1e-7 * size
    moved = np.repeat(state[:, None, :], k + 1, axis=1)
    for i in range(k):
        moved[i, i] += delta[i]
    later = np.repeat(time[None, :], k + 1, axis=0)
    small = 1e-6 * step
    later[k] += small
    found = np.stack([rates(later[i], moved[:, i]) for i in range(k + 1)], axis=1) - first[:, None, :]
    return np.moveaxis(found[:, :k] / delta[None], 2, 0), found[:, k] / small
