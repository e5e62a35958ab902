"""Pulses in equal steps, and a recorded force in the place of one."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.twin.contact_interface import ForcePulses
from pyroshock.twin.sensors.measured_pulses import MeasuredForce, sampled


def triangle(contact_time_s: float, peak_n: float) -> ForcePulses:
    return ForcePulses(
        np.array([contact_time_s]), np.array([[0.0, peak_n, 0.0]]), np.array([contact_time_s / 2])
    )


def test_samples_keep_the_impulse_to_the_end_of_contact_or_the_cut() -> None:
    found = sampled(triangle(1e-3, 6.0), 2.3e-4)[0]
    assert found.sum() * 2.3e-4 == pytest.approx(3e-3, rel=1e-12)
    assert found[0] == 0.0 and found[-1] == 0.0
    assert found[1] / found[2] == pytest.approx(0.23 / 0.46, rel=1e-12)
    long, exact = sampled(triangle(1e-3, 6.0), 1e-4, 6)[0], sampled(triangle(3.0, 6.0), 1.0, 4)[0]
    np.testing.assert_allclose(long, 12e3 * 1e-4 * np.arange(6), rtol=1e-12)
    assert exact.sum() == pytest.approx(9.0, rel=1e-12)
    shorter, longer = (
        sampled(triangle(time, 1 / time), 1e-5, 8)[0] for time in (0.999e-5, 1.001e-5)
    )
    np.testing.assert_allclose(shorter, longer[: shorter.size], rtol=1e-9)
    assert not sampled(triangle(1e-3, 0.0), 1e-4).any()


@given(
    st.floats(-8.0, 0.0),
    st.floats(0.05, 0.95),
    st.sampled_from([1e-6, 1e-5, 1 / 51_200]),
    st.sampled_from([None, 4000]),
)
def test_a_contact_of_any_duration_keeps_its_impulse(
    logarithm: float, rise: float, step_s: float, most: int | None
) -> None:
    """From 10 ns to 1 s, of any rise; `most` may cut only what goes on beyond it."""
    time = 10.0**logarithm
    pulses = ForcePulses(
        np.array([time]),
        np.interp(np.linspace(0, 1, 65), [0, rise, 1], [0, 5.0, 0])[None],
        np.array([time]),
    )
    samples = math.ceil(time / step_s) + 2
    if most is None and samples > 100_000:
        step_s = time / 1000
    found = sampled(pulses, step_s, most)[0]
    if most is None or samples <= most:
        assert found.sum() * step_s == pytest.approx(float(pulses.impulse_n_s[0]), rel=1e-9)
    else:
        assert found.size == most and found.sum() * step_s <= float(pulses.impulse_n_s[0]) * 1.001
    assert found[0] == 0.0 and np.all(found >= 0)


def test_a_recorded_force_rises_from_nothing_and_falls_to_it() -> None:
    twice = MeasuredForce(np.array([1.0, 5.0, 2.0]), 1e4).repeated(2)
    assert twice.force_n.tolist() == [[0, 1, 5, 2, 0]] * 2
    assert twice.contact_time_s == pytest.approx([4e-4] * 2)
    assert twice.compression_time_s == pytest.approx([2e-4] * 2)
    assert twice.impulse_n_s == pytest.approx([8e-4] * 2)
    slow = MeasuredForce(np.array([1.0, 5.0, 2.0]), 0.5).repeated(1)
    assert slow.contact_time_s == pytest.approx([8.0])


@pytest.mark.parametrize(
    ("force_n", "rate_hz", "message"),
    [
        ([1.0, 2.0], 1e4, r"force_n has shape \(2,\): expected \(p,\), p of 3 or more, finite"),
        ([[1.0, 2.0, 1.0]], 1e4, r"force_n has shape \(1, 3\)"),
        ([1.0, math.nan, 1.0], 1e4, "finite"),
        ([1.0, 2.0, 1.0], 0.0, r"sampling_rate_hz = 0\.0: expected a positive number"),
        ([1.0, 2.0, 1.0], -0.5, r"sampling_rate_hz = -0\.5"),
        ([1.0, 2.0, 1.0], math.inf, "sampling_rate_hz = inf"),
        ([1.0, 2.0, 1.0], math.nan, "sampling_rate_hz = nan"),
    ],
)
def test_records_that_are_none_are_refused(
    force_n: list[float], rate_hz: float, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        MeasuredForce(np.array(force_n), rate_hz)
