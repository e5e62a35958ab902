"""The anti-alias filter and the low-pass against their gains, the mounting against its closed form."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.virtualbench.sensors.filters import (
    PASS,
    STOP,
    anti_alias_taps,
    decimated,
    low_pass_decay_1_s,
    low_passed,
    mounted,
)

FS_HZ = 51_200.0


def gain_db(taps, share):
    """Gain of an FIR at `share` of its own sampling rate."""
    return 20 * np.log10(np.abs(np.exp(-2j * np.pi * np.outer(share, np.arange(taps.size))) @ taps) + 1e-300)


def tone(frequency_hz, rate_hz, seconds=0.02):
    return np.sin(2 * np.pi * frequency_hz * np.arange(round(seconds * rate_hz)) / rate_hz)


@pytest.mark.parametrize("ratio", [2, 7, 20])
def test_pass_band_is_flat_and_stop_band_silent(ratio):
    """Of symmetric taps."""
    taps = anti_alias_taps(ratio)
    assert taps == pytest.approx(taps[::-1], abs=0)
    assert np.abs(gain_db(taps, np.linspace(0, PASS, 50) / ratio)).max() < 0.001
    assert gain_db(taps, np.array([(PASS + STOP) / 2 / ratio])) == pytest.approx([-6.02], abs=0.05)
    assert gain_db(taps, np.linspace(STOP / ratio, 0.5, 2000)).max() < -98


def test_tone_in_the_band_comes_through_in_time_and_one_above_leaves_no_alias():
    ratio, inside = 20, slice(100, -100)
    through = decimated(tone(12e3, ratio * FS_HZ), ratio)
    assert through[inside] == pytest.approx(tone(12e3, FS_HZ)[inside], abs=2e-5)
    for frequency_hz in (26e3, 40e3, 51.3e3, 120e3, 500e3):
        assert np.abs(decimated(tone(frequency_hz, ratio * FS_HZ), ratio)[inside]).max() < 2e-5
    assert decimated(np.full(500, 5e5), 10) == pytest.approx(np.full(50, 5e5), rel=1e-9)


def test_low_pass_has_its_corner():
    """Butterworth of order 4, 1 / sqrt(1 + r^8) at r corners: 1 / sqrt(257) an octave above."""
    rate = 1e6
    for frequency_hz, expected in ((10e3, 0.5**0.5), (20e3, 257**-0.5), (1e3, 1.0)):
        settled = low_passed(tone(frequency_hz, rate), 1 / rate, 10e3)[5000:]
        assert np.sqrt(2 * np.mean(settled**2)) == pytest.approx(expected, rel=0.02)


def test_low_pass_begins_at_rest_and_dies_out_at_its_slowest_rate():
    rate = 1e6
    ringing = np.abs(low_passed(np.concatenate([np.ones(2), np.zeros(2000)]), 1 / rate, 10e3))
    envelope = [ringing[first : first + 200].max() for first in (200, 600)]
    assert np.log(envelope[0] / envelope[1]) / 400e-6 == pytest.approx(low_pass_decay_1_s(10e3), rel=0.1)
    assert low_passed(np.full(100, 3.0), 1e-6, 1e4) == pytest.approx(np.full(100, 3.0))


def ramp_response(time, omega, damping):
    """Closed form of (2 z w s + w^2) / (s^2 + 2 z w s + w^2) to a ramp t: t - exp(-z w t) sin(wd t) / wd."""
    damped = omega * np.sqrt(1 - damping**2)
    return time - np.exp(-damping * omega * time) * np.sin(damped * time) / damped


@pytest.mark.parametrize(("resonance_hz", "damping"), [(45e3, 0.02), (15e3, 0.1), (3e3, 0.5)])
def test_mounting_answers_a_ramp_exactly(resonance_hz, damping):
    period = 1e-6
    time = period * np.arange(3000)
    felt = mounted(time, period, resonance_hz, damping)
    expected = ramp_response(time, 2 * np.pi * resonance_hz, damping)
    assert np.abs(felt - expected).max() < 1e-9 * time[-1]


def test_mounting_answers_a_half_sine_in_closed_form():
    """Undamped oscillator, base half-sine of frequency p, while it lasts: (w^2 sin pt - w p sin wt) / (w^2 - p^2)."""
    period, p, omega = 1e-7, np.pi / 200e-6, 2 * np.pi * 12e3
    time = period * np.arange(2000)
    felt = mounted(np.sin(p * time), period, omega / 2 / np.pi, 1e-9)
    expected = (omega**2 * np.sin(p * time) - omega * p * np.sin(omega * time)) / (omega**2 - p**2)
    assert np.abs(felt - expected).max() < 1e-5


def test_mounting_amplifies_at_resonance_by_its_quality_and_is_rigid_far_above_the_grid():
    """|H| at w is sqrt(1 + 1 / (4 z^2))."""
    rate, damping = 1e6, 0.05
    settled = mounted(tone(20e3, rate), 1 / rate, 20e3, damping)[10_000:]
    assert np.abs(settled).max() == pytest.approx(np.sqrt(1 + 1 / (4 * damping**2)), rel=0.01)
    values = tone(1e3, 1e5)
    assert mounted(values, 1e-5, 45e3, 0.02) is values
