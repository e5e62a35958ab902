"""Filters of the sensors against closed forms and an integration of their own, with parameters for
each row."""

from __future__ import annotations

from decimal import Decimal, localcontext

import numpy as np
import pytest
from pyroshock.array_types import Floats
from pyroshock.twin.effects import Value, effect
from pyroshock.twin.sensors.chain import SensorChain
from pyroshock.twin.sensors.effect import filtered
from scipy.signal import TransferFunction, lfilter, lsim

STEP_S = 1e-5


def low_pass(**parameters: Value) -> SensorChain:
    """Of one pole or two, by which of them is given."""
    return SensorChain.of(
        [effect("sensor.force_bandwidth", **{"time_constant_s": 0.0, **parameters})]
    )


def mount(**parameters: Value) -> SensorChain:
    return SensorChain.of([effect("sensor.mount_resonance", **parameters)])


def recursion(gain: float, memory: float) -> tuple[Floats, Floats]:
    return np.array([gain, 0.5]), np.array([1.0, -memory])


@pytest.mark.parametrize("shape", [(5, 40), (5, 3, 40), (5, 5, 5)])
@pytest.mark.parametrize(
    ("gain", "memory"),
    [
        (np.array([1.0, 2.0, 1.0, 3.0, 2.0]), np.array([0.1, 0.5, 0.1, 0.5, 0.9])),
        (np.array([1.0, 2.0, 1.0, 3.0, 2.0]), 0.3),
        (1.5, np.array([0.9, 0.9, 0.0, 0.1, 0.2])),
        (1.5, 0.3),
        (np.array(1.5), np.array(0.3)),
    ],
)
def test_each_row_is_filtered_by_its_own_parameters(
    shape: tuple[int, ...], gain: Value, memory: Value
) -> None:
    series = np.random.default_rng(2).standard_normal(shape)
    found = filtered(series, recursion, gain, memory)
    gains, memories = np.broadcast_to(gain, 5), np.broadcast_to(memory, 5)
    for row, of_row in enumerate(series):
        expected = lfilter([gains[row], 0.5], [1.0, -memories[row]], of_row, axis=-1)
        np.testing.assert_array_equal(found[row], expected)


def test_one_series_takes_one_set_of_parameters_and_rows_that_share_them_share_a_design() -> None:
    series = np.random.default_rng(2).standard_normal(40)
    np.testing.assert_array_equal(
        filtered(series, recursion, 2.0, 0.4), lfilter([2.0, 0.5], [1.0, -0.4], series)
    )
    with pytest.raises(ValueError, match=r"40 values of a parameter for series of shape \(40,\)"):
        filtered(series, recursion, np.linspace(1, 2, 40), 0.4)
    for name in ("time_constant_s", "corner_period_s"):
        with pytest.raises(
            ValueError, match=r"2 values of a parameter for series of shape \(3, 8\)"
        ):
            low_pass(**{name: np.array([1e-5, 2e-5])}).measured_force_n(np.ones((3, 8)), STEP_S)
    designs = []

    def counted(gain: float, memory: float) -> tuple[Floats, Floats]:
        designs.append((gain, memory))
        return recursion(gain, memory)

    filtered(
        np.ones((4, 2, 6)), counted, np.array([1.0, 2.0, 1.0, 2.0]), np.array([0.1, 0.2, 0.1, 0.3])
    )
    assert sorted(designs) == [(1.0, 0.1), (2.0, 0.2), (2.0, 0.3)]


def triangle_through_one_pole(share: float, count: int) -> list[float]:
    """Response to a force of 1 at the first sample, 0 at all others and straight between, by steps
    / time constant.

    The second difference of the response to a ramp, t - (1 - exp(-t)), which loses digits: two
    hundred are taken.
    """
    with localcontext() as digits:
        digits.prec = 200
        r = Decimal(share)
        ramp = [Decimal(0)] * 2 + [n - (1 - (-n * r).exp()) / r for n in range(1, count + 1)]
        return [
            float(after - 2 * now + before)
            for before, now, after in zip(ramp, ramp[1:], ramp[2:], strict=False)
        ]


@pytest.mark.parametrize("steps", [1e-9, 1e-6, 3e-5, 9.9e-5, 1.01e-4, 1e-3, 0.3, 1.0, 20.0])
def test_one_pole_is_its_closed_form_for_any_time_constant(steps: float) -> None:
    tau, one = 8e-3, np.zeros(12)
    one[0] = 1.0
    seen = low_pass(time_constant_s=tau).measured_force_n(one, steps * tau)
    np.testing.assert_allclose(seen, triangle_through_one_pole(steps * tau / tau, 12), rtol=5e-9)


def test_each_shot_has_its_own_time_constant_and_none_is_none() -> None:
    tau = np.array([2e-5, 0.0, 3e-4, 0.0, 2e-5])
    force = np.random.default_rng(4).standard_normal((5, 60))
    seen = low_pass(time_constant_s=tau).measured_force_n(force, STEP_S)
    np.testing.assert_array_equal(seen[[1, 3]], force[[1, 3]])
    for row in (0, 2, 4):
        answer = triangle_through_one_pole(STEP_S / tau[row], 60)
        np.testing.assert_allclose(seen[row], np.convolve(force[row], answer)[:60], atol=1e-12)


def ramp_through_two_poles(time_s: Floats, period_s: float) -> Floats:
    """Butterworth's w^2 / (p^2 + sqrt(2) w p + w^2), whose poles are w (-1 +- i) / sqrt(2), to t
    from t = 0 on."""
    a = 2 * np.pi / period_s / np.sqrt(2)
    t = np.maximum(time_s, 0.0)
    return np.asarray(t - (1 - np.exp(-a * t) * np.cos(a * t)) / a)


@pytest.mark.parametrize("period_s", [3e-6, 5e-5, 1e-3, 2e-2])
def test_two_poles_of_a_ramp_are_the_closed_form(period_s: float) -> None:
    time = np.arange(300) * STEP_S
    seen = low_pass(corner_period_s=period_s).measured_force_n(3.0 * time, STEP_S)
    expected = 3.0 * ramp_through_two_poles(time, period_s)
    np.testing.assert_allclose(seen, expected, rtol=1e-8, atol=1e-10 * expected.max())


def test_each_shot_has_its_own_corner_and_none_is_none() -> None:
    period = np.array([0.0, 7e-5, 1e-3, 0.0])
    force = np.random.default_rng(5).standard_normal((4, 80))
    seen = low_pass(corner_period_s=period).measured_force_n(force, STEP_S)
    np.testing.assert_array_equal(seen[[0, 3]], force[[0, 3]])
    for row in (1, 2):
        ramp = ramp_through_two_poles(np.arange(-1, 81) * STEP_S, period[row])
        answer = (ramp[2:] - 2 * ramp[1:-1] + ramp[:-2]) / STEP_S
        np.testing.assert_allclose(seen[row], np.convolve(force[row], answer)[:80], atol=1e-9)


@pytest.mark.parametrize(
    ("parameters", "corner_hz", "lag_rad"),
    [
        ({"time_constant_s": 1e-4}, 1 / (2 * np.pi * 1e-4), np.pi / 4),
        ({"corner_period_s": 1e-3}, 1e3, np.pi / 2),
    ],
)
def test_at_the_corner_half_of_the_power_is_left(
    parameters: dict[str, float], corner_hz: float, lag_rad: float
) -> None:
    step = 1 / corner_hz / 400
    angle = 2 * np.pi * corner_hz * np.arange(400 * 20) * step
    seen = low_pass(**parameters).measured_force_n(np.sin(angle), step)
    last = slice(-400, None)  # a whole period, long after the beginning
    amplitude = 2 / 400 * np.sum(seen[last] * np.exp(-1j * angle[last])) * 1j
    assert abs(amplitude) == pytest.approx(2**-0.5, rel=1e-4)
    assert -np.angle(amplitude) == pytest.approx(lag_rad, abs=1e-4)


def test_poles_keep_the_impulse_and_two_follow_the_one() -> None:
    force = np.concatenate(([0.0], np.hanning(50), np.zeros(2000)))
    for parameters in ({"corner_period_s": 1e-3}, {"time_constant_s": 1.6e-5}):
        assert low_pass(**parameters).measured_force_n(force, STEP_S).sum() == pytest.approx(
            force.sum(), rel=1e-9
        )
    force = np.random.default_rng(6).standard_normal((2, 50))
    both = low_pass(time_constant_s=3e-5, corner_period_s=2e-4).measured_force_n(force, STEP_S)
    one = low_pass(time_constant_s=3e-5).measured_force_n(force, STEP_S)
    np.testing.assert_array_equal(
        both, low_pass(corner_period_s=2e-4).measured_force_n(one, STEP_S)
    )


@pytest.mark.parametrize(
    "zeta", [np.array([0.02, 0.02, 0.5, 0.2]), 0.1], ids=["own damping", "one damping"]
)
def test_each_shot_has_its_own_mount_and_none_is_none(zeta: Value) -> None:
    period, dampings = np.array([5e-5, 0.0, 3e-4, 5e-5]), np.broadcast_to(zeta, 4)
    base = np.random.default_rng(7).standard_normal((4, 2, 120))
    base[..., 0] = 0.0  # lsim begins at the first sample, a record a sample before it
    seen = mount(period_s=period, damping_ratio=zeta).measured_acceleration_m_s2(base, STEP_S)
    np.testing.assert_array_equal(seen[1], base[1])
    for row in (0, 2, 3):
        w = 2 * np.pi / period[row]
        system = TransferFunction([2 * dampings[row] * w, w**2], [1.0, 2 * dampings[row] * w, w**2])
        alone = mount(period_s=period[row], damping_ratio=dampings[row])
        for channel in range(2):
            _, expected, _ = lsim(system, base[row, channel], np.arange(120) * STEP_S)
            np.testing.assert_allclose(seen[row, channel], expected, atol=1e-10)
            single = alone.measured_acceleration_m_s2(base[row, channel], STEP_S)
            np.testing.assert_array_equal(seen[row, channel], single)


def test_mount_rings_at_its_damped_frequency_and_loses_its_share_each_turn() -> None:
    """From rest to a step: 1 - exp(-zeta w t) (cos wd t - zeta w / wd sin wd t)."""
    period, zeta, step = 1e-3, 0.1, 1e-6
    w = 2 * np.pi / period
    wd, time = w * np.sqrt(1 - zeta**2), np.arange(4000) * step
    force = np.ones(4000)
    seen = mount(period_s=period, damping_ratio=zeta).measured_acceleration_m_s2(force, step)
    late = time + step / 2  # the first sample is reached over a step
    expected = 1 - np.exp(-zeta * w * late) * (
        np.cos(wd * late) - zeta * w / wd * np.sin(wd * late)
    )
    np.testing.assert_allclose(seen, expected, atol=1e-5)
