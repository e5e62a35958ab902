"""Pulses that fill much of their record, against closed forms: a half sine and its square, with noise, and through the
high pass of an AC-coupled sensor."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.ingest.pulses import extract_pulses
from scipy.signal import lfilter

RATE_HZ, SAMPLES, NOISE_N, PEAK_N = 20_000.0, 4000, 3.0, 1000.0
RECORD_S = SAMPLES / RATE_HZ
SHARES = (0.01, 0.05, 0.2, 0.4, 0.5, 0.6, 0.7, 0.8)
#: By shape: exponent of the sine, and its mean over the pulse.
SHAPES = {"half sine": (1, 2 / np.pi), "haversine": (2, 0.5)}


def record(share: float, shape: str, start: float = 0.1, noise: float = NOISE_N, constant_s: float | None = None):
    """(n,) force in newtons of one pulse that fills a share of the record; `constant_s` of the sensor's high pass."""
    phase = (np.arange(SAMPLES) / SAMPLES - start) / share
    force = PEAK_N * np.where((phase > 0) & (phase < 1), np.sin(np.pi * np.clip(phase, 0, 1)) ** SHAPES[shape][0], 0.0)
    if constant_s:
        keep = constant_s / (constant_s + 1 / RATE_HZ)
        force = lfilter([keep, -keep], [1, -keep], force)
    return force + noise * np.random.default_rng(4).standard_normal(SAMPLES)


@pytest.mark.parametrize("sign", [1, -1], ids=["positive", "negative"])
@pytest.mark.parametrize("start", [0.02, 0.15])
@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("shape", SHAPES)
def test_peak_and_impulse_are_those_of_the_closed_form(shape, share, start, sign):
    """Peak within 1 % and three deviations of noise, impulse within 1 % and what the threshold cuts off the flanks."""
    (pulse,) = extract_pulses(sign * record(share, shape, start), RATE_HZ)
    assert pulse.peak_force_n == pytest.approx(PEAK_N, abs=0.01 * PEAK_N + 3 * NOISE_N)
    assert pulse.impulse_n_s == pytest.approx(PEAK_N * share * RECORD_S * SHAPES[shape][1], rel=0.012)
    assert abs(pulse.rest_n) < NOISE_N
    assert not pulse.truncated


@pytest.mark.parametrize("share", SHARES)
def test_without_noise_a_slow_half_sine_is_exact(share):
    (pulse,) = extract_pulses(record(share, "half sine", noise=0.0), RATE_HZ)
    assert pulse.peak_force_n == pytest.approx(PEAK_N, rel=2e-3)
    assert pulse.impulse_n_s == pytest.approx(PEAK_N * share * RECORD_S * 2 / np.pi, rel=2e-3)
    assert pulse.contact_time_s == pytest.approx(share * RECORD_S, rel=0.01, abs=2 / RATE_HZ)


@pytest.mark.parametrize("share", [0.05, 0.2, 0.4, 0.6, 0.8])
@pytest.mark.parametrize("lengths", [5, 20])
def test_what_an_ac_coupled_sensor_sags_below_rest_is_not_taken_for_rest(share, lengths):
    """Truth: the filtered record without noise. Behind the pulse the sensor lies below its rest, before it at rest."""
    constant_s = lengths * share * RECORD_S
    clean = record(share, "half sine", noise=0.0, constant_s=constant_s)
    (pulse,) = extract_pulses(record(share, "half sine", constant_s=constant_s), RATE_HZ)
    assert abs(pulse.rest_n) < NOISE_N
    assert pulse.peak_force_n == pytest.approx(clean.max(), abs=0.01 * PEAK_N + 3 * NOISE_N)
    assert pulse.impulse_n_s == pytest.approx(np.maximum(clean, 0).sum() / RATE_HZ, rel=0.012)


@pytest.mark.parametrize("share", [0.6, 0.8])
def test_record_that_begins_with_the_pulse_rests_where_it_ends(share):
    """No rest before it: that behind it is taken, and the pulse is said to be cut."""
    force = record(share, "half sine", start=-0.1)
    (pulse,) = extract_pulses(force, RATE_HZ)
    assert abs(pulse.rest_n) < NOISE_N
    assert pulse.truncated
