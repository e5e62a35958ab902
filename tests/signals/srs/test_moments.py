"""Temporal moments against closed forms."""

from __future__ import annotations

from dataclasses import astuple

import numpy as np
import pytest
from pyroshock.signals.srs.moments import temporal_moments

RATE = 1e6


def test_gaussian():
    s = 2e-4
    time = np.arange(-4000, 4001) / RATE
    found = temporal_moments(3 * np.exp(-((time / s) ** 2) / 2), RATE, start_s=float(time[0]))
    sigma = s / 2**0.5  # of the square
    assert found.energy_m2_s3 == pytest.approx(9 * s * np.pi**0.5, rel=1e-9)
    assert found.centroid_s == pytest.approx(0, abs=1e-12)
    assert found.rms_duration_s == pytest.approx(sigma, rel=1e-9)
    assert found.root_energy_amplitude_m_s2 == pytest.approx(3 * (s * np.pi**0.5 / sigma) ** 0.5, rel=1e-9)
    assert found.skewness == pytest.approx(0, abs=1e-4)
    assert found.kurtosis == pytest.approx(3**0.25, rel=1e-9)
    assert found.duration_10_90_s == pytest.approx(2 * 1.2815515655 * sigma, rel=5e-5)
    assert found.duration_5_95_s == pytest.approx(2 * 1.6448536270 * sigma, rel=5e-5)


def test_rectangle():
    length = 0.01
    found = temporal_moments(np.full(10001, -2.0), RATE)
    assert found.energy_m2_s3 == pytest.approx(4 * length, rel=1e-9)
    assert found.centroid_s == pytest.approx(length / 2, rel=1e-9)
    assert found.rms_duration_s == pytest.approx(length / 12**0.5, rel=1e-6)
    assert found.root_energy_amplitude_m_s2 == pytest.approx(2 * 12**0.25, rel=1e-6)
    assert found.kurtosis == pytest.approx((9 / 5) ** 0.25, rel=1e-6)
    assert found.duration_10_90_s == pytest.approx(0.8 * length, rel=1e-9)


def test_two_samples_share_one_step_evenly():
    found = temporal_moments(np.ones(2), RATE)
    assert found.duration_10_90_s == pytest.approx(0.8 / RATE, rel=1e-12)
    assert found.duration_5_95_s == pytest.approx(0.9 / RATE, rel=1e-12)


def test_decaying_exponential():
    tau = 1e-3
    found = temporal_moments(np.exp(-np.arange(20000) / RATE / tau), RATE)
    assert found.energy_m2_s3 == pytest.approx(tau / 2, rel=1e-6)
    assert found.centroid_s == pytest.approx(tau / 2, rel=1e-5)
    assert found.rms_duration_s == pytest.approx(tau / 2, rel=1e-5)
    assert found.skewness == pytest.approx(2 ** (1 / 3), rel=1e-4)
    assert found.kurtosis == pytest.approx(9**0.25, rel=1e-4)
    assert found.duration_10_90_s == pytest.approx(np.log(9) * tau / 2, rel=1e-5)


def test_silence_before_moves_the_centroid_and_nothing_else():
    pulse = np.sin(np.pi * np.arange(1001) / 1000)
    alone, later = temporal_moments(pulse, RATE), temporal_moments(np.pad(pulse, (5000, 3000)), RATE)
    assert later.centroid_s - alone.centroid_s == pytest.approx(5e-3, rel=1e-9)
    np.testing.assert_allclose(astuple(later)[2:4], astuple(alone)[2:4], rtol=1e-9)
    np.testing.assert_allclose(astuple(later)[5:], astuple(alone)[5:], rtol=1e-9)


def test_record_read_backwards_has_the_opposite_skewness():
    decay = np.exp(-np.arange(20000) / 1000)
    assert temporal_moments(decay[::-1], RATE).skewness == pytest.approx(-temporal_moments(decay, RATE).skewness)


def test_zeros_have_no_moments():
    found = temporal_moments(np.zeros(10), RATE)
    assert found.energy_m2_s3 == 0.0 and np.isnan(found.rms_duration_s)
