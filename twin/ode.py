"""Many small initial value problems at once, each with its own steps.

A problem runs until its first quantity has grown to a target. A step that passes the target is
taken again, shorter, until it ends there; what has ended leaves the arrays before long, so that the
slowest problem does not carry the others. The step is Dormand and Prince's (`DORMAND_PRINCE`), or
for stiff problems Rodas5P (`RODAS`). `gun.motion_kernel` does the same for the gun
alone, compiled.

Source: Dormand and Prince, J. Comput. Appl. Math. 6 (1980) 19; step control: Hairer, Norsett and
Wanner, Solving Ordinary Differential Equations I, section II.4.

A linearly implicit step for many small stiff problems: Rodas5P, of order 5 with an error of order
4, L-stable.

Source: Steinebach, BIT Numerical Mathematics 63 (2023) 27; the form of the stages, in which no
product with the Jacobian is left: Hairer and Wanner, Solving Ordinary Differential Equations II,
section IV.7.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np

from ..array_types import Flags, Floats, Rows

DORMAND_PRINCE_NODES = (0.2, 0.3, 0.8, 8 / 9, 1.0, 1.0)
DORMAND_PRINCE_STAGES = (
    np.array([1 / 5]),
    np.array([3 / 40, 9 / 40]),
    np.array([44 / 45, -56 / 15, 32 / 9]),
    np.array([19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729]),
    np.array([9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656]),
    np.array([35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84]),
)
# The difference of both orders.
DORMAND_PRINCE_ERROR = np.array(
    [71 / 57600, 0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40]
)
# So near the target, relative to it, a straight line leads there: what it misses goes with the
# square of this.
AT_TARGET = 1e-5
MOST_STEPS = 200_000
# What has ended leaves the arrays once the others are fewer than this share: to move them costs as
# well.
_KEPT = 0.5


class Problems(Protocol):
    """n initial value problems of k quantities; the target belongs to the first quantity."""

    @property
    def target(self) -> Floats:
        """(n,), positive; the first quantity starts below it."""
        ...

    def rates(self, time: Floats, state: Floats) -> Floats:
        """(k, n) for times (n,) and states (k, n), or (k, m, n) for m of both."""
        ...

    def given_up(self, time: Floats, state: Floats) -> Flags:
        """(n,): those that will never reach their target."""
        ...

    def longest_step(self, time: Floats) -> Floats:
        """(n,): up to the next moment at which the rates have a corner; infinite where there is
        none."""
        ...

    def take(self, rows: Rows) -> Self:
        """Some of them."""
        ...


@dataclass(frozen=True, eq=False)
class Ends:
    """Where n problems ended: times (n,), states (k, n), and which reached their targets (n,)."""

    time: Floats
    state: Floats
    reached: Flags


@dataclass(frozen=True)
class StepTolerance:
    """Error allowed in a step: `relative` times the size of a quantity, which counts as its `floor`
    (k, n) at least."""

    relative: float
    floor: Floats


Rates = Callable[[Floats, Floats], Floats]


@dataclass(frozen=True)
class Method:
    """A step: of (rates, time, state, rates at the begin, step, floor of the quantities), it gives
    the state at the end, the rates there and the estimated error, each (k, n). The error goes with
    the step to the power `order`.
    """

    step: Callable[[Rates, Floats, Floats, Floats, Floats, Floats], tuple[Floats, Floats, Floats]]
    order: int


def dormand_prince_step(
    rates: Rates, time: Floats, state: Floats, first: Floats, step: Floats, _: Floats
) -> tuple[Floats, Floats, Floats]:
    """One step of order 5, with an error of order 4 beside it."""
    k, n = state.shape
    slopes = np.empty((7, k, n))
    slopes[0] = first
    flat = slopes.reshape(7, k * n)
    for i, (node, weights) in enumerate(
        zip(DORMAND_PRINCE_NODES, DORMAND_PRINCE_STAGES, strict=True), 1
    ):
        at = (weights @ flat[:i]).reshape(k, n)
        at *= step
        at += state
        slopes[i] = rates(time + node * step, at)
    return at, slopes[6], (DORMAND_PRINCE_ERROR @ flat).reshape(k, n) * step


DORMAND_PRINCE = Method(dormand_prince_step, 5)


def run(
    problems: Problems, start: Floats, first_step: Floats, tolerance: StepTolerance, method: Method
) -> Ends:
    """Every problem from `start` (k, n) at time 0 to its end. `first_step` (n,) is where the search
    for steps begins.

    Raises `RuntimeError` when a problem takes more than 200,000 steps.
    """
    n = start.shape[1]
    ends = Ends(np.zeros(n), start.copy(), np.zeros(n, dtype=bool))
    rows, floor, under_way = np.arange(n), tolerance.floor, np.ones(n, dtype=bool)
    now = _Now(
        np.zeros(n),
        start.copy(),
        problems.rates(np.zeros(n), start),
        first_step.copy(),
        np.zeros(n, dtype=bool),
    )
    for _ in range(MOST_STEPS):
        # A step that is too long may leave what the rates are made for; it is not taken then.
        with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
            now, at_target = _advanced(problems, now, tolerance.relative, floor, method)
        ended = under_way & (at_target | problems.given_up(now.time, now.state))
        if ended.any():
            gone = rows[ended]
            ends.time[gone], ends.state[:, gone], ends.reached[gone] = (
                now.time[ended],
                now.state[:, ended],
                at_target[ended],
            )
            under_way &= ~ended
            stay = np.flatnonzero(under_way)
            if not stay.size:
                return ends
            if stay.size < _KEPT * rows.size:
                problems, now, rows, floor = (
                    problems.take(stay),
                    now.take(stay),
                    rows[stay],
                    floor[:, stay],
                )
                under_way = np.ones(stay.size, dtype=bool)
    rows = rows[under_way]
    raise RuntimeError(
        f"{rows.size} of {n} problems took more than {MOST_STEPS} steps; the "
        f"first is number {rows[0]}"
    )


@dataclass(frozen=True, eq=False)
class _Now:
    """How far problems are: time (n,), state and rates (k, n), the next step (n,), whether it aims
    at the target."""

    time: Floats
    state: Floats
    slope: Floats
    step: Floats
    aims: Flags

    def take(self, rows: Rows) -> _Now:
        return _Now(
            self.time[rows],
            self.state[:, rows],
            self.slope[:, rows],
            self.step[rows],
            self.aims[rows],
        )


def _advanced(
    problems: Problems, now: _Now, relative: float, floor: Floats, method: Method
) -> tuple[_Now, Flags]:
    """After one attempt of each, and which of them have reached their targets."""
    tried = np.minimum(now.step, problems.longest_step(now.time))
    new, slope, error = method.step(problems.rates, now.time, now.state, now.slope, tried, floor)
    error /= np.maximum(np.abs(new), floor)
    ratio = np.sqrt(np.einsum("kn,kn->n", error, error) / len(error)) / relative
    ratio[~np.isfinite(slope).all(axis=0)] = np.inf
    good = ratio <= 1  # not for NaN
    gap = new[0] - problems.target
    at_target = good & (np.abs(gap) <= AT_TARGET * problems.target)
    passed = good & (gap > 0) & ~at_target
    taken = good & ~passed
    time, step = now.time + tried, tried * _growth(ratio, method.order)
    step = np.where(
        taken & (tried < now.step), np.maximum(step, now.step), step
    )  # a corner was met, not an error
    if at_target.any():
        late = np.where(at_target, gap / np.where(at_target, slope[0], 1.0), 0.0)
        new -= late * slope
        time -= late
    short = taken & now.aims & (slope[0] > 0)
    step[short] = (-gap / np.where(short, slope[0], 1.0))[short]
    if passed.any():
        ends = (tried, now.state[0], now.slope[0], new[0], slope[0], problems.target)
        step[passed] = _aimed(*(value[passed] for value in ends))
    if taken.all():
        return _Now(time, new, slope, step, now.aims), at_target
    time, state = np.where(taken, time, now.time), np.where(taken, new, now.state)
    return _Now(time, state, np.where(taken, slope, now.slope), step, passed | now.aims), at_target


def _growth(ratio: Floats, order: int) -> Floats:
    """By how much the next step is longer."""
    with np.errstate(divide="ignore", over="ignore"):
        factor = 0.9 * ratio ** (-1 / order)
    return np.asarray(np.minimum(np.fmax(factor, 0.2), 5.0))  # fmax takes 0.2 for NaN


def _aimed(
    step: Floats, start: Floats, rate: Floats, end: Floats, end_rate: Floats, target: Floats
) -> Floats:
    """The step after which the first quantity is at its target, by the cubic through both ends of a
    longer one."""
    rise, r0, r1 = end - start, step * rate, step * end_rate
    s = straight = (target - start) / rise
    bend, twist = 3 * rise - 2 * r0 - r1, r0 + r1 - 2 * rise
    for _ in range(4):
        value = s * (r0 + s * (bend + s * twist))
        slope = r0 + s * (2 * bend + 3 * s * twist)
        s = np.minimum(
            np.maximum(s + (target - start - value) / np.where(slope > 0, slope, rise), 0.01), 1.0
        )
    # A cubic that turns back may lead to the end again, and would do so for ever.
    return np.asarray(step * np.where(s < 1, s, straight))


GAMMA = 0.21193756319429014
RODAS_NODES = (
    0.0,
    0.6358126895828704,
    0.4095798393397535,
    0.9769306725060716,
    0.4288403609558664,
    1.0,
    1.0,
    1.0,
)
RODAS_TIMES = (
    GAMMA,
    -2 * GAMMA,
    -0.3384627126235924,
    1.8046452872882734,
    2.325825639765069,
    0.0,
    0.0,
    0.0,
)
# What earlier stages add to the state, and, over the step, to the right-hand side.
_SIXTH = (
    -7.502846399306121,
    2.561846144803919,
    -11.627539656261098,
    -0.18268767659942256,
    0.030198172008377946,
)
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
_SEVENTH = (30.91273214028599, -3.1208243349937974, 77.79954646070892, 34.28646028294783,
-19.097331116725623,
            -28.087943162872662)
_EIGHTH = (37.80277123390563, -3.2571969029072276, 112.26918849496327, 66.9347231244047,
-40.06618937091002,
           -54.66780262877968, -9.48861652309627)
# fmt: on
RODAS_SIDE = (
    np.array([]),
    np.array([-14.155112264123755]),
    np.array([-17.97296035885952, -2.859693295451294]),
    np.array([147.12150275711716, -1.41221402718213, 71.68940251302358]),
    np.array([165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306]),
    np.array(
        [
            24.854864614690072,
            -3.0009227002832186,
            47.4931110020768,
            5.5814197821558125,
            -0.6610691825249471,
        ]
    ),
    np.array(_SEVENTH),
    np.array(_EIGHTH),
)


def rosenbrock_step(
    rates: Rates, time: Floats, state: Floats, first: Floats, step: Floats, floor: Floats
) -> tuple[Floats, Floats, Floats]:
    """One step (n,): state, its rates and the estimated error, each (k, n). `first` are the rates
    at the begin.

    The quantities' size, with its `floor` (k, n), sets the differences that the Jacobian is taken
    from.
    """
    k, n = state.shape
    by_state, by_time = _derivatives(
        rates, time, state, first, step, np.maximum(np.abs(state), floor)
    )
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

    No pivots are looked for: 1 / (gamma step) on the diagonal leads, and a step for which it does
    not is refused.
    """
    for i in range(len(system)):
        pivot = 1 / system[i, i]
        row, column = system[i] * pivot, system[:, i].copy()
        row[i] = pivot
        system[:, i] = 0.0
        system -= column[:, None] * row
        system[i] = row
    return system
