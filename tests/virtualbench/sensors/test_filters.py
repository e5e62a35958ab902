"""Filters against their gains, the mounting against its closed form; the converter writes whole
counts."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.virtualbench.sensors.build import SensorBuild
from pyroshock.virtualbench.sensors.chain import calibrated, converted, counts, written
from pyroshock.virtualbench.sensors.filters import (
    PASS,
    STOP,
    anti_alias_taps,
    decimated,
    low_pass_decay_1_s,
    low_passed,
    mounted,
    zero_shift,
)
from scipy.signal import upfirdn

FS_HZ = 51_200.0


def gain_db(taps, share):
    """Gain of an FIR at `share` of its own sampling rate."""
    return 20 * np.log10(
        np.abs(np.exp(-2j * np.pi * np.outer(share, np.arange(taps.size))) @ taps) + 1e-300
    )


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


@pytest.mark.parametrize("ratio", [2, 4, 7, 20])
def test_decimation_is_scipys_filter_with_the_ends_held(ratio):
    values = np.random.default_rng(0).standard_normal(997)
    taps = anti_alias_taps(ratio)
    padded = np.pad(values, taps.size // 2, mode="edge")
    expected = upfirdn(taps, padded)[taps.size - 1 :][: values.size : ratio]
    np.testing.assert_allclose(decimated(values, ratio), expected, rtol=0, atol=1e-14)


def test_offset_after_a_shock_is_of_the_largest_load_that_is_left():
    values = np.random.default_rng(0).standard_normal(300)
    lag_s = np.subtract.outer(np.arange(300), np.arange(300)) / FS_HZ
    decayed_values = np.where(lag_s >= 0, np.abs(values) * np.exp(-np.maximum(lag_s, 0) / 1e-3), 0)
    expected = 0.02 * decayed_values.max(axis=1)
    np.testing.assert_allclose(zero_shift(values, 1 / FS_HZ, 0.02, 1e-3), expected, rtol=1e-12)


def test_low_pass_has_its_corner_begins_at_rest_and_dies_out():
    """Butterworth of order 4, 1 / sqrt(1 + r^8) at r corners: 1 / sqrt(257) an octave above."""
    rate = 1e6
    for frequency_hz, expected in ((10e3, 0.5**0.5), (20e3, 257**-0.5), (1e3, 1.0)):
        settled = low_passed(tone(frequency_hz, rate), 1 / rate, 10e3)[5000:]
        assert np.sqrt(2 * np.mean(settled**2)) == pytest.approx(expected, rel=0.02)
    ringing = np.abs(low_passed(np.concatenate([np.ones(2), np.zeros(2000)]), 1 / rate, 10e3))
    envelope = [ringing[first : first + 200].max() for first in (200, 600)]
    assert np.log(envelope[0] / envelope[1]) / 400e-6 == pytest.approx(
        low_pass_decay_1_s(10e3), rel=0.1
    )
    assert low_passed(np.full(100, 3.0), 1e-6, 1e4) == pytest.approx(np.full(100, 3.0))


def ramp_response(time, omega, damping):
    """Closed form of (2 z w s + w^2) / (s^2 + 2 z w s + w^2) to a ramp t: t - exp(-z w t) sin(wd t)
    / wd."""
    damped = omega * np.sqrt(1 - damping**2)
    return time - np.exp(-damping * omega * time) * np.sin(damped * time) / damped


@pytest.mark.parametrize(("resonance_hz", "damping"), [(45e3, 0.02), (15e3, 0.1), (3e3, 0.5)])
def test_mounting_answers_a_ramp_exactly(resonance_hz, damping):
    period = 1e-6
    time = period * np.arange(3000)
    felt = mounted(time, period, resonance_hz, damping)
    expected = ramp_response(time, 2 * np.pi * resonance_hz, damping)
    assert np.abs(felt - expected).max() < 1e-9 * time[-1]


def test_mounting_answers_a_half_sine_and_its_resonance_in_closed_form():
    """Undamped oscillator, base half-sine of frequency p, while it lasts: (w^2 sin pt - w p sin wt)
    / (w^2 - p^2)."""
    period, p, omega = 1e-7, np.pi / 200e-6, 2 * np.pi * 12e3
    time = period * np.arange(2000)
    felt = mounted(np.sin(p * time), period, omega / 2 / np.pi, 1e-9)
    expected = (omega**2 * np.sin(p * time) - omega * p * np.sin(omega * time)) / (omega**2 - p**2)
    assert np.abs(felt - expected).max() < 1e-5
    # |H| at w is sqrt(1 + 1 / (4 z^2)).
    rate, damping = 1e6, 0.05
    settled = mounted(tone(20e3, rate), 1 / rate, 20e3, damping)[10_000:]
    assert np.abs(settled).max() == pytest.approx(np.sqrt(1 + 1 / (4 * damping**2)), rel=0.01)
    values = tone(1e3, 1e5)
    assert mounted(values, 1e-5, 45e3, 0.02) is values


FORCE = SensorBuild("force", "force", "N", 1000.0, bits=16)
TANK = SensorBuild(
    "tank", "pressure", "bar", 16.0, 1e5, bits=16, sensitivity=0.5621, offset_v=0.3624
)


@given(st.integers(-(2**15), 2**15 - 1), st.floats(-0.49, 0.49))
def test_value_within_half_a_step_is_its_count(count, within):
    assert counts(np.array([(count + within) * FORCE.step]), FORCE)[0] == count


@given(st.sampled_from([8, 16, 24]), st.floats(1e-3, 1e6), st.data())
def test_written_numbers_are_their_counts_again(bits, full_scale, data):
    """A float32 holds 24 bits: no two counts fall together."""
    sensor = SensorBuild("s", "force", "N", full_scale, bits=bits)
    code = data.draw(st.integers(-(2 ** (bits - 1)), 2 ** (bits - 1) - 1))
    assert round(float(converted(np.array([code * sensor.step]), sensor)[0]) / sensor.step) == code


def test_values_are_written_in_volts_within_the_range():
    codes = counts(np.array([-1e9, -1000.0, 999.99, 1000.0, np.inf]), FORCE)
    assert codes.tolist() == [-32768, -32768, 32767, 32767, 32767]
    values = converted(np.array([-1e-9, -0.0, 0.0]), FORCE)
    assert values.dtype == np.float32
    assert not np.signbit(values).any()
    with pytest.raises(ValueError, match="sample 1 is NaN"):
        counts(np.array([0.0, np.nan]), FORCE)
    # Thesis, section 2.2.1: 0.5621 V/bar and 0.3624 V at rest.
    volts = written(np.array([0.0, 4e5]), TANK)
    assert volts == pytest.approx([0.3624, 0.3624 + 4 * 0.5621])
    assert calibrated(volts, TANK) == pytest.approx([0.0, 4e5], abs=1e-6)
    assert TANK.step == 10 / 2**15


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"full_scale": 0.0}, "full_scale is 0.0"),
        ({"bits": 25}, "bits is 25; expected 2 to 24"),
        ({"noise": -1.0}, "noise is -1.0"),
        ({"sensitivity": 0.0}, "sensitivity is 0"),
    ],
)
def test_instrument_that_cannot_be_is_refused(change, message):
    with pytest.raises(ValueError, match=message):
        SensorBuild(**{"name": "s", "quantity": "force", "unit": "N", "full_scale": 1.0, **change})
