"""Steps and ends of many initial value problems, on motions known in closed form."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Self

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray
from pyroshock.twin import ode
from pyroshock.twin.ode import DORMAND_PRINCE, RODAS, Ends, Method, Rates, StepTolerance, run

Floats = NDArray[np.float64]
METHODS = pytest.mark.parametrize(
    "method", [DORMAND_PRINCE, RODAS], ids=["Dormand and Prince", "Rodas5P"]
)


def stepped(
    method: Method, rates: Rates, time: ArrayLike, state: ArrayLike, step: ArrayLike
) -> tuple[Floats, Floats, Floats]:
    """One step of quantities (k, n), of floors 1."""
    at, now = np.asarray(time, dtype=np.float64), np.asarray(state, dtype=np.float64)
    each = np.broadcast_to(np.asarray(step, dtype=np.float64), now.shape[1:]).copy()
    at = np.broadcast_to(at, now.shape[1:]).copy()
    return method.step(rates, at, now, rates(at, now), each, np.ones_like(now))


def thrown(_: Floats, state: Floats) -> Floats:
    """x = sin t."""
    return np.stack([state[1], -state[0]])


def dragged(time: Floats, state: Floats) -> Floats:
    """x = 1 - cos t: by time and not linear, which Rodas needs to show no more than its order."""
    return np.stack([state[1], np.cos(time) + np.sin(time) ** 2 - state[1] ** 2])


@pytest.mark.parametrize(
    ("method", "rates", "start", "end"),
    [
        (DORMAND_PRINCE, thrown, [0.0, 1.0], np.sin(2)),
        (DORMAND_PRINCE, dragged, [0.0, 0.0], 1 - np.cos(2)),
        (RODAS, dragged, [0.0, 0.0], 1 - np.cos(2)),
    ],
)
def test_the_error_falls_with_the_fifth_power(
    method: Method, rates: Rates, start: list[float], end: float
) -> None:
    def error(n: int) -> float:
        state, step = np.array(start)[:, None], 2 / n
        for i in range(n):
            state = stepped(method, rates, i * step, state, step)[0]
        return float(abs(state[0, 0] - end))

    assert np.log2(error(40) / error(80)) == pytest.approx(5, abs=0.35)


@METHODS
def test_a_step_ends_with_the_rates_at_its_end_and_an_error_of_its_order(method: Method) -> None:
    state = np.array([[1 - np.cos(0.5)], [np.sin(0.5)]])
    sizes = [
        np.linalg.norm(stepped(method, dragged, 0.5, state, step)[2]) for step in (0.05, 0.025)
    ]
    assert np.log2(sizes[0] / sizes[1]) == pytest.approx(method.order, abs=0.35)
    state = np.array([[0.1, 0.2], [0.3, 0.4]])
    end, slope, _ = stepped(method, dragged, [0.3, 0.7], state, [0.1, 0.2])
    np.testing.assert_allclose(slope, dragged(np.array([0.4, 0.9]), end), rtol=1e-14)


def test_growth_by_dormand_and_prince_is_their_polynomial() -> None:
    """exp(z) to the fifth power, and z^6 / 600 (Hairer and Wanner II, section IV.2)."""
    z = np.array([[0.5, -1.0, 2.0], [-3.0, 1.5, 0.1]])
    end = stepped(
        DORMAND_PRINCE, lambda _, state: z / 0.25 * state, 0.0, np.full((2, 3), 2.0), 0.25
    )[0]
    polynomial = 1 + z + z**2 / 2 + z**3 / 6 + z**4 / 24 + z**5 / 120 + z**6 / 600
    np.testing.assert_allclose(end, 2 * polynomial, rtol=1e-14, atol=1e-14)


@METHODS
@pytest.mark.parametrize("power", range(5))
def test_powers_of_time_are_integrated_to_the_fourth(method: Method, power: int) -> None:
    """Exactly by Dormand and Prince, as well as it knows their slope by Rodas. The fourth-order
    estimate knows no error below that."""

    def rates(time: Floats, state: Floats) -> Floats:
        return (time**power)[None] + 0 * state

    digits = 1e-14 if method is DORMAND_PRINCE else 1e-5
    end, _, error = stepped(method, rates, [1.0, 2.0], np.zeros((1, 2)), [0.5, 2.0])
    exact = (np.array([1.5, 4.0]) ** (power + 1) - np.array([1.0, 2.0]) ** (power + 1)) / (
        power + 1
    )
    np.testing.assert_allclose(end[0], exact, rtol=digits)
    if power < 4:
        np.testing.assert_allclose(error[0] / exact, 0, atol=digits)
    elif method is DORMAND_PRINCE:
        assert np.abs(error[0] / exact).min() > 1e-6


def of_matrix(matrix: Floats) -> Rates:
    """Rates of linear systems (n, k, k), of one state each or of several."""
    return lambda _, state: np.einsum("nij,j...n->i...n", matrix, state)


def test_rodas_follows_coupled_linear_systems() -> None:
    """Each of them to the sixth power of the step, from matrices whose every entry counts."""
    from scipy.linalg import expm

    rng = np.random.default_rng(0)
    matrix, start = rng.normal(0, 1, (4, 3, 3)), rng.normal(0, 1, (3, 4))

    def errors(step: float) -> Floats:
        exact = np.stack([expm(step * a) @ y for a, y in zip(matrix, start.T, strict=True)], axis=1)
        return np.linalg.norm(
            stepped(RODAS, of_matrix(matrix), 0.0, start, step)[0] - exact, axis=0
        )

    coarse = errors(0.4)
    assert coarse.max() < 5e-5
    assert np.median(np.log2(coarse / errors(0.2))) == pytest.approx(6, abs=0.7)


def test_rodas_follows_stiff_problems() -> None:
    """L-stable: x' = -w (x - 1) with w h up to 1e8 has forgotten its start after a step. Prothero
    and Robinson's x' = -w (x - cos t) - sin t, from x = cos t, stays on its slow solution."""
    rate = np.array([1e6, 1e8])
    end, _, error = stepped(
        RODAS, lambda _, state: -rate * (state - 1), 0.0, np.full((1, 2), 3.0), 1.0
    )
    np.testing.assert_allclose(end[0], 1, atol=1e-4)
    assert np.abs(error).max() < 1e-3
    stiff = np.array([1e2, 1e4, 1e6])

    def rates(time: Floats, state: Floats) -> Floats:
        return (-stiff * (state[0] - np.cos(time)) - np.sin(time))[None]

    end = stepped(RODAS, rates, 0.3, np.full((1, 3), np.cos(0.3)), 0.1)[0]
    np.testing.assert_allclose(end[0], np.cos(0.4), atol=1e-6)


def test_rodas_takes_differences_downwards_by_the_size_of_a_quantity() -> None:
    """Above a body at rest the rates have a corner. A quantity counts as its floor at least."""
    asked: list[Floats] = []

    def rates(time: Floats, state: Floats) -> Floats:
        if state.ndim == 3:
            asked.append(state)
        return -state + 0 * time

    state, floor = np.array([[0.0, -8.0], [3.0, 0.5]]), np.array([[4.0, 4.0], [2.0, 2.0]])
    time = np.zeros(2)
    RODAS.step(rates, time, state, rates(time, state), np.full(2, 0.1), floor)
    moved = np.concatenate([each - state[:, None, :] for each in asked], axis=1)
    assert (moved <= 0).all()
    by_size = moved / np.array([[4.0, 8.0], [3.0, 2.0]])[:, None, :]
    each = by_size[by_size < 0]
    assert each.size == 4
    np.testing.assert_allclose(each, each[0], rtol=1e-6)
    assert -1e-5 < each[0] < -1e-9


@METHODS
def test_many_problems_step_as_each_alone(method: Method) -> None:
    rng = np.random.default_rng(1)
    matrix, start = rng.normal(0, 1, (5, 3, 3)), rng.normal(0, 1, (3, 5))
    time, step = rng.uniform(0, 1, 5), rng.uniform(0.1, 0.5, 5)
    together = stepped(method, of_matrix(matrix), time, start, step)
    for i in range(5):
        alone = stepped(method, of_matrix(matrix[[i]]), time[[i]], start[:, [i]], step[[i]])
        for one, all_of_them in zip(alone, together, strict=True):
            np.testing.assert_allclose(one[:, 0], all_of_them[:, i], rtol=1e-9, atol=1e-9)


@pytest.fixture(autouse=True)
def no_endless_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    """None of these problems takes as many."""
    monkeypatch.setattr(ode, "MOST_STEPS", 3000)


@dataclass(frozen=True)
class Thrown:
    """x'' = -w^2 x from rest at 0 with velocity 1: x = sin(w t) / w."""

    omega: Floats
    target: Floats

    def rates(self, time: Floats, state: Floats) -> Floats:
        return np.stack([state[1], -(self.omega**2) * state[0]])

    def given_up(self, time: Floats, state: Floats) -> NDArray[np.bool_]:
        return np.asarray(state[1] < 0)

    def longest_step(self, time: Floats) -> Floats:
        return np.full(time.shape, np.inf)

    def take(self, rows: NDArray[np.intp]) -> Thrown:
        return Thrown(self.omega[rows], self.target[rows])


@METHODS
def test_targets_are_met_when_they_should_be_as_each_alone(method: Method) -> None:
    omega = np.array([0.5, 1.0, 2.0])
    problem = Thrown(omega, np.array([1.0, 0.5, 9.0]))
    start = np.stack([np.zeros(3), np.ones(3)])
    ends = run(problem, start, np.full(3, 1e-3), StepTolerance(1e-10, np.full((2, 3), 0.1)), method)
    assert list(ends.reached) == [True, True, False]
    np.testing.assert_allclose(ends.state[0, :2], [1.0, 0.5], rtol=1e-9)
    expected = np.arcsin(problem.target[:2] * omega[:2]) / omega[:2]
    np.testing.assert_allclose(ends.time[:2], expected, rtol=1e-8)
    omega = np.geomspace(0.05, 3.0, 9)
    problem = Thrown(omega, np.linspace(0.9, 0.4, 9))
    start, floor = np.stack([np.zeros(9), np.ones(9)]), np.full((2, 9), 0.1)
    together = run(problem, start, np.full(9, 1e-2), StepTolerance(1e-8, floor), method)
    assert not together.reached.all() and together.reached.any()
    for i in range(9):
        one = np.array([i])
        alone = run(
            problem.take(one),
            start[:, one],
            np.full(1, 1e-2),
            StepTolerance(1e-8, floor[:, one]),
            method,
        )
        assert alone.reached[0] == together.reached[i]
        # one that is given up has no sharp end
        within = 1e-9 if together.reached[i] else 1e-4
        np.testing.assert_allclose(alone.time[0], together.time[i], rtol=within)
        np.testing.assert_allclose(
            alone.state[:, 0], together.state[:, i], rtol=within, atol=within
        )
    assert (start == np.stack([np.zeros(9), np.ones(9)])).all()  # the caller's stays


def test_a_first_step_out_of_the_rates_domain_is_taken_back() -> None:
    """x' = v, v' = -sqrt(v): v = (1 - t / 2)^2, and none beyond; no warning is given for what was
    only tried."""

    @dataclass(frozen=True)
    class Braked(Thrown):
        def rates(self, time: Floats, state: Floats) -> Floats:
            return np.stack([state[1], -np.sqrt(state[1])])

    with np.errstate(all="raise"):
        ends = run(
            Braked(np.ones(1), np.array([7 / 12])),
            np.array([[0.0], [1.0]]),
            np.array([100.0]),
            StepTolerance(1e-9, np.full((2, 1), 0.1)),
            DORMAND_PRINCE,
        )
    assert ends.time == pytest.approx([1.0], rel=1e-8)


@dataclass(frozen=True)
class Steady:
    """x = t + b t^2 + c t^3, exactly, with a log of the steps that were tried: times, steps and
    widths of arrays."""

    target: Floats
    bend: Floats
    twist: Floats
    longest: float = np.inf
    tried: list[tuple[Floats, Floats]] = field(default_factory=list)

    def rates(self, time: Floats, state: Floats) -> Floats:
        return np.stack([1 + 2 * self.bend * time + 3 * self.twist * time**2, np.zeros_like(time)])

    def given_up(self, time: Floats, state: Floats) -> NDArray[np.bool_]:
        return np.asarray(time > self.longest)

    def longest_step(self, time: Floats) -> Floats:
        return np.full(time.shape, np.inf)

    def take(self, rows: NDArray[np.intp]) -> Self:
        return type(self)(
            self.target[rows], self.bend[rows], self.twist[rows], self.longest, self.tried
        )

    def method(self, error: Callable[[Floats, Floats], ArrayLike], order: int = 2) -> Method:
        """Simpson's rule, which has no error for these, with an error that a test makes up."""

        def step(
            rates: Rates, time: Floats, state: Floats, first: Floats, step: Floats, _: Floats
        ) -> tuple[Floats, Floats, Floats]:
            self.tried.append((time.copy(), step.copy()))
            last = rates(time + step, state)
            new = state + step / 6 * (first + 4 * rates(time + step / 2, state) + last)
            return new, last, np.asarray(error(time, step)) * np.ones_like(state)

        return Method(step, order)


def steady(
    target: ArrayLike, bend: float = 0.0, twist: float = 0.0, longest: float = np.inf
) -> Steady:
    to = np.atleast_1d(np.asarray(target, dtype=np.float64))
    return Steady(to, np.full(to.shape, bend), np.full(to.shape, twist), longest)


def ran(
    problem: Steady,
    error: Callable[[Floats, Floats], ArrayLike] = lambda *_: 0.0,
    order: int = 2,
    relative: float = 2.0**-10,
    first: float = 1.0,
    floor: float = 1.0,
    start: float = 0.0,
) -> Ends:
    shape = (2, problem.target.size)
    return run(
        problem,
        np.full(shape, start),
        np.full(shape[1], first),
        StepTolerance(relative, np.full(shape, floor)),
        problem.method(error, order),
    )


def tried(problem: Steady) -> tuple[list[float], list[float]]:
    return [float(time[0]) for time, _ in problem.tried], [
        float(step[0]) for _, step in problem.tried
    ]


@pytest.mark.parametrize(
    ("order", "share", "growth"), [(2, 0.25, 1.8), (5, 1 / 32, 1.8), (3, 1.0, 0.9), (2, 0.0, 5.0)]
)
def test_steps_grow_with_the_room_below_the_tolerance(
    order: int, share: float, growth: float
) -> None:
    """By 0.9 of what would use it up, and to 5 times the last at most. An error of just the
    tolerance is allowed."""
    problem = steady(1e6, longest=5.0 if growth < 1 else 50.0)
    ran(problem, lambda *_: share * 2.0**-10 * 1e9, order, floor=1e9, first=1.0)
    times, steps = tried(problem)
    assert len(steps) >= 3 and steps[0] == 1.0
    np.testing.assert_allclose(np.divide(steps[1:], steps[:-1]), growth, rtol=1e-12)
    np.testing.assert_allclose(times, np.cumsum([0, *steps[:-1]]), rtol=1e-12)


@pytest.mark.parametrize(
    ("share", "shrink"), [(1.21, 0.9 / 1.1), (4.0, 0.45), (1e9, 0.2), (np.nan, 0.2), (np.inf, 0.2)]
)
def test_a_step_beyond_the_tolerance_is_tried_again_shorter(share: float, shrink: float) -> None:
    problem = steady(1e6, longest=0.0)
    ran(problem, lambda time, step: np.where(step > 0.02, share, 0.5) * 2.0**-10, first=1.0)
    times, steps = tried(problem)
    assert set(times) == {0.0}  # nothing was taken before the last
    np.testing.assert_allclose(np.divide(steps[1:], steps[:-1]), shrink, rtol=1e-12)
    assert steps[-1] <= 0.02 < steps[-2]


def test_errors_count_by_the_size_of_each_quantity_in_the_mean_square() -> None:
    """Errors of 7 and 1 times the allowed are 5 times, with orders 2: 0.9 / sqrt 5; x is 10, the
    other's floor 2."""
    problem = steady(1e6, longest=0.0)
    allowed = 2.0**-10 * np.array([[10.0], [2.0]])
    ran(
        problem,
        lambda _, step: np.where(step > 9, np.array([[7.0], [1.0]]), 0.0) * allowed,
        first=10.0,
        floor=2.0,
    )
    assert tried(problem)[1] == pytest.approx([10.0, 9 / np.sqrt(5)], rel=1e-12)


@pytest.mark.parametrize(
    ("bend", "twist"), [(0.0, 0.0), (0.5, 0.0), (0.3, 0.7), (-0.2, 0.1), (2.0, -0.5)]
)
@pytest.mark.parametrize("before", [[], [0.11]], ids=["from rest", "on its way"])
def test_a_step_beyond_the_target_is_taken_again_to_end_there(
    bend: float, twist: float, before: list[float]
) -> None:
    """By the cubic through both its ends, which is the motion itself here."""
    problem = steady(0.6, bend, twist)
    long = 5 * before[0] if before else 1.0
    ends = ran(problem, first=[*before, long][0])
    roots = np.roots([twist, bend, 1.0, -0.6])
    when = min(float(root.real) for root in roots if abs(root.imag) < 1e-9 and root.real > 0)
    times, steps = tried(problem)
    begin = sum(before)
    if begin + long < when:  # a second one is taken, and five times that goes beyond
        before, begin, long = [*before, long], begin + long, 5 * long
    assert times == pytest.approx([*np.cumsum([0.0, *before]), begin], rel=1e-12)
    assert steps == pytest.approx([*before, long, when - begin], rel=1e-6)
    assert ends.reached.all()
    assert ends.time == pytest.approx([when], rel=1e-9)
    assert ends.state[0] == pytest.approx([0.6], rel=1e-14)


class Moving(Steady):
    """By its place and velocity at any time, which each motion below gives: steps are exact."""

    def place(self, time: Floats) -> Floats:
        raise NotImplementedError  # of a motion without a place nothing can be tested

    def velocity(self, time: Floats) -> Floats:
        raise NotImplementedError  # nor of one without a velocity

    def rates(self, time: Floats, state: Floats) -> Floats:
        return np.stack([self.velocity(time), np.zeros_like(time)])

    def method(self, error: Callable[[Floats, Floats], ArrayLike], order: int = 2) -> Method:
        def step(
            rates: Rates, time: Floats, state: Floats, first: Floats, step: Floats, _: Floats
        ) -> tuple[Floats, Floats, Floats]:
            self.tried.append((time.copy(), step.copy()))
            end = np.stack([self.place(time + step), 0 * time])
            return (
                end,
                rates(time + step, state),
                np.zeros_like(state) + np.asarray(error(time, step)),
            )

        return Method(step, order)


class Bent(Moving):
    """x = b (exp(t / c) - 1) / (exp(1 / c) - 1), which no cubic is; one at time 1."""

    def place(self, time: Floats) -> Floats:
        return self.bend * np.expm1(time / self.twist) / np.expm1(1 / self.twist)

    def velocity(self, time: Floats) -> Floats:
        return self.bend / self.twist * np.exp(time / self.twist) / np.expm1(1 / self.twist)


@pytest.mark.parametrize("size", [1e-4, 1.0, 1e4])
@pytest.mark.parametrize("scale", [0.3, 1.0, -0.5])
def test_a_motion_that_is_no_cubic_is_met_in_a_few_more_steps(scale: float, size: float) -> None:
    problem = Bent(np.array([size]), np.full(1, size), np.array([scale]))
    ends = ran(problem, first=1.4)
    assert ends.time == pytest.approx([1.0], abs=1e-9)
    assert ends.state[0] == pytest.approx([size], rel=1e-14)
    assert 2 <= len(problem.tried) <= 6
    assert tried(problem)[1][1] == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize("size", [0.02, 1.0])
def test_a_step_that_aims_short_is_followed_by_straight_lines(size: float) -> None:
    """Which fall short again, as the motion slows down, with twice the digits each time."""
    problem = Bent(np.array([size]), np.full(1, size), np.array([-0.5]))
    ran(problem, first=1.4)
    times, steps = tried(problem)
    assert times[1] == 0 < times[2] < times[3] < 1
    x = np.expm1(-2 * np.array(times[2:])) / np.expm1(-2.0)
    slope = -2 * np.exp(-2 * np.array(times[2:])) / np.expm1(-2.0)
    np.testing.assert_allclose(steps[2:], (1 - x) / slope, rtol=1e-6)
    assert times[-1] + steps[-1] == pytest.approx(1, abs=1e-5)


def test_a_body_that_turns_back_first_is_followed_beyond() -> None:
    """x = t - 2 t^2 + t^3 is at 4 / 27 at 1 / 3, at 0 at 1, and at 0.3 after that."""
    problem = steady(0.3, -2.0, 1.0)
    ends = ran(problem, lambda _, step: 2.0**-10 * (step / 0.2) ** 2, first=0.1)
    assert ends.time == pytest.approx([float(np.roots([1, -2, 1, -0.3])[0].real)], rel=1e-9)


@pytest.mark.parametrize(
    ("swing", "often", "first"),
    [(0.3, 5.0, 3.0), (0.8, 3.0, 4.0), (0.8, 3.0, 5.0), (0.5, 5.0, 5.0), (0.3, 9.0, 3.5)],
)
def test_a_body_that_swings_meets_its_target_somewhere(
    swing: float, often: float, first: float
) -> None:
    """x = 7 + t + a sin(w t), from steps so long that no cubic tells where. Time never runs back,
    nor does it stand."""

    class Swinging(Moving):
        def place(self, time: Floats) -> Floats:
            return 7 + time + swing * np.sin(often * time)

        def velocity(self, time: Floats) -> Floats:
            return 1 + swing * often * np.cos(often * time)

    problem = Swinging(np.array([9.0]), np.zeros(1), np.zeros(1))
    ends = ran(problem, first=first, start=7.0)
    assert ends.time + swing * np.sin(often * ends.time) == pytest.approx([2.0], rel=1e-9)
    steps = tried(problem)[1]
    assert min(steps) > 0
    assert len(steps) < 30


def test_a_body_that_waits_on_its_way_is_waited_for() -> None:
    """At 0.5 from 0.5 to 1.5, where no straight line leads to the target."""

    class Waiting(Moving):
        def place(self, time: Floats) -> Floats:
            return np.minimum(time, 0.5) + np.maximum(time - 1.5, 0.0)

        def velocity(self, time: Floats) -> Floats:
            return np.where((time > 0.5) & (time < 1.5), 0.0, 1.0)

    problem = Waiting(np.array([0.55]), np.zeros(1), np.zeros(1))
    ends = ran(problem, first=2.0)
    assert ends.time == pytest.approx([1.55], rel=1e-9)
    assert [time for time in tried(problem)[0] if 0.5 < time < 1.5]  # it was aimed from there


def test_a_step_to_where_rates_are_none_is_tried_again_shorter() -> None:

    class Walled(Moving):
        def place(self, time: Floats) -> Floats:
            return time

        def velocity(self, time: Floats) -> Floats:
            return np.where(time > 0.5, np.inf, 1.0)

    problem = Walled(np.array([0.4]), np.zeros(1), np.zeros(1))
    ends = ran(problem, first=10.0)
    assert ends.time == pytest.approx([0.4])
    np.testing.assert_allclose(tried(problem)[1][:2], [10.0, 2.0], rtol=1e-12)


def test_what_has_ended_leaves_the_arrays_once_most_have_and_stays_what_it_was() -> None:
    """One of three ends soon; the two others keep it in the arrays, where it runs past its target.
    What is given up says where."""

    def error(_: Floats, step: Floats) -> Floats:
        return 2.0**-10 * (step / 0.1) ** 2

    four = steady([1.0, 2.0, 3.0, 4.0])
    np.testing.assert_allclose(ran(four, error, first=0.1).time, [1, 2, 3, 4], rtol=1e-9)
    widths = [time.size for time, _ in four.tried]
    assert sorted(set(widths)) == [1, 4]  # two of four are half
    assert widths == sorted(widths, reverse=True)
    given_up = ran(steady([0.5, 50.0, 60.0], longest=3.0), error, first=0.1)
    assert given_up.reached.tolist() == [True, False, False]
    assert given_up.time[0] == pytest.approx(0.5)
    assert (given_up.time[1:] > 3).all() and (given_up.time[1:] < 3.2).all()
    np.testing.assert_allclose(given_up.state[0], given_up.time, rtol=1e-12)
    ends = ran(
        steady([0.25, 2.0, 2.5], bend=0.1, longest=2.2),
        lambda _, step: 4 * error(_, step),
        first=0.05,
    )
    assert ends.reached.all()
    expected = [(np.sqrt(1 + 0.4 * x) - 1) / 0.2 for x in (0.25, 2.0, 2.5)]
    np.testing.assert_allclose(ends.time, expected, rtol=1e-8)
    np.testing.assert_allclose(ends.state[0], [0.25, 2.0, 2.5], rtol=1e-12)


def test_problems_without_an_end_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ode, "MOST_STEPS", 40)
    problem = steady([1e9, 0.5, 1e9, 1e9, 0.7])
    with pytest.raises(
        RuntimeError, match="3 of 5 problems took more than 40 steps; the first is number 0"
    ):
        ran(problem, lambda _, step: 2.0**-10 * (step / 0.1) ** 2, first=0.1)
    assert len(problem.tried) == 40
    late = steady([0.5, 0.6, 0.7, 1e9, 0.8])
    with pytest.raises(
        RuntimeError, match="1 of 5 problems took more than 40 steps; the first is number 3"
    ):
        ran(late, lambda _, step: 2.0**-10 * (step / 0.1) ** 2, first=0.1)
