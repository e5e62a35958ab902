"""A linearly implicit step for many small stiff problems: Rodas5P, of order 5 with an error of order 4, L-stable.

Source: Steinebach, BIT Numerical Mathematics 63 (2023) 27; the form of the stages, in which no product with the
Jacobian is left: Hairer and Wanner, Solving Ordinary Differential Equations II, section IV.7.
"""

from __future__ import annotations

import numpy as np

from ..array_types import Floats
from .ode import Method, Rates

GAMMA = 0.21193756319429014
RODAS_NODES = (0.0, 0.6358126895828704, 0.4095798393397535, 0.9769306725060716, 0.4288403609558664, 1.0, 1.0, 1.0)
RODAS_TIMES = (GAMMA, -2 * GAMMA, -0.3384627126235924, 1.8046452872882734, 2.325825639765069, 0.0, 0.0, 0.0)
# What earlier stages add to the state, and, over the step, to the right-hand side.
_SIXTH = (-7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256, 0.030198172008377946)
RODAS_STATE = (
    np.array([]),
    np.array([3.0]),
    np.array([2.849394379747939, 0.45842242204463923]),
    np.array([-6.954028509809101, 2.489845061869568, -10.358996098473584]),
    np.array([2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641]),
    np.array(_SIXTH),
    np.array([*_SIXTH, 1.0]),
    np.array([*_SIXTH, 1.0, 1.0]),
)
# fmt: off
_SEVENTH = (30.91273214028599, -3.1208243349937974, 77.79954646070892, 34.28646028294783, -19.097331116725623,
            -28.087943162872662)
_EIGHTH = (37.80277123390563, -3.2571969029072276, 112.26918849496327, 66.9347231244047, -40.06618937091002,
           -54.66780262877968, -9.48861652309627)
# fmt: on
RODAS_SIDE = (
    np.array([]),
    np.array([-14.155112264123755]),
    np.array([-17.97296035885952, -2.859693295451294]),
    np.array([147.12150275711716, -1.41221402718213, 71.68940251302358]),
    np.array([165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306]),
    np.array([24.854864614690072, -3.0009227002832186, 47.4931110020768, 5.5814197821558125, -0.6610691825249471]),
    np.array(_SEVENTH),
    np.array(_EIGHTH),
)


def rosenbrock_step(
    rates: Rates, time: Floats, state: Floats, first: Floats, step: Floats, floor: Floats
) -> tuple[Floats, Floats, Floats]:
    """One step (n,): state, its rates and the estimated error, each (k, n). `first` are the rates at the begin.

    The quantities' size, with its `floor` (k, n), sets the differences that the Jacobian is taken from.
    """
    k, n = state.shape
    by_state, by_time = _derivatives(rates, time, state, first, step, np.maximum(np.abs(state), floor))
    system = -by_state
    system[np.arange(k), np.arange(k)] += 1 / (GAMMA * step)
    inverse = _inverse(system)
    count = len(RODAS_NODES)
    stages = np.empty((count, k, n))
    flat = stages.reshape(count, k * n)
    for i in range(count):
        at = state + (RODAS_STATE[i] @ flat[:i]).reshape(k, n) if i else state
        side = rates(time + RODAS_NODES[i] * step, at) if i else first.copy()
        side += (RODAS_SIDE[i] @ flat[:i]).reshape(k, n) / step + RODAS_TIMES[i] * step * by_time
        stages[i] = np.einsum("ijn,jn->in", inverse, side)
    end = at + stages[-1]
    return end, rates(time + step, end), stages[-1]


RODAS = Method(rosenbrock_step, 5)


def _derivatives(
    rates: Rates, time: Floats, state: Floats, first: Floats, step: Floats, size: Floats
) -> tuple[Floats, Floats]:
    """Of the rates, by the state (k, k, n) and by time (k, n): all differences in one call."""
    k = len(state)
    # Downwards: rates of a body at rest, which nothing pulls back, have their corner above.
    delta = -1e-7 * size
    moved = np.repeat(state[:, None, :], k + 1, axis=1)
    for i in range(k):
        moved[i, i] += delta[i]
    later = np.repeat(time[None, :], k + 1, axis=0)
    small = 1e-6 * step
    later[k] += small
    rate_changes = rates(later, moved) - first[:, None, :]
    return rate_changes[:, :k] / delta, rate_changes[:, k] / small


def _inverse(system: Floats) -> Floats:
    """Of n matrices (k, k, n), in their place, by Gauss and Jordan.

    No pivots are looked for: 1 / (gamma step) on the diagonal leads, and a step for which it does not is refused.
    """
    for i in range(len(system)):
        pivot = 1 / system[i, i]
        row, column = system[i] * pivot, system[:, i].copy()
        row[i] = pivot
        system[:, i] = 0.0
        system -= column[:, None] * row
        system[i] = row
    return system
