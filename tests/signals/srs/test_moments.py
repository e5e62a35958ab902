"""Temporal moments against closed forms."""

from __future__ import annotations

from dataclasses import astuple

import numpy as np
import pytest
from pyroshock.signals.srs.moments import temporal_moments

RATE = 1e6


#: Record, start (s), and each moment in closed form with its relative and absolute tolerance.
GAUSSIAN_S, RECTANGLE_S, DECAY_S = 2e-4, 0.01, 1e-3
GAUSSIAN_TIME = np.arange(-4000, 4001) / RATE
CLOSED_FORMS = {
    "gaussian": (
        3 * np.exp(-((GAUSSIAN_TIME / GAUSSIAN_S) ** 2) / 2),
        float(GAUSSIAN_TIME[0]),
        {
            "energy_m2_s3": (9 * GAUSSIAN_S * np.pi**0.5, 1e-9, 0),
            "centroid_s": (0, 0, 1e-12),
            "rms_duration_s": (GAUSSIAN_S / 2**0.5, 1e-9, 0),  # of the square
            "root_energy_amplitude_m_s2": (3 * (2 * np.pi) ** 0.25, 1e-9, 0),
            "skewness": (0, 0, 1e-4),
            "kurtosis": (3**0.25, 1e-9, 0),
            "duration_10_90_s": (2 * 1.2815515655 * GAUSSIAN_S / 2**0.5, 5e-5, 0),
            "duration_5_95_s": (2 * 1.6448536270 * GAUSSIAN_S / 2**0.5, 5e-5, 0),
        },
    ),
    "rectangle": (
        np.full(10001, -2.0),
        0.0,
        {
            "energy_m2_s3": (4 * RECTANGLE_S, 1e-9, 0),
            "centroid_s": (RECTANGLE_S / 2, 1e-9, 0),
            "rms_duration_s": (RECTANGLE_S / 12**0.5, 1e-6, 0),
            "root_energy_amplitude_m_s2": (2 * 12**0.25, 1e-6, 0),
            "kurtosis": ((9 / 5) ** 0.25, 1e-6, 0),
            "duration_10_90_s": (0.8 * RECTANGLE_S, 1e-9, 0),
        },
    ),
    "decaying exponential": (
        np.exp(-np.arange(20000) / RATE / DECAY_S),
        0.0,
        {
            "energy_m2_s3": (DECAY_S / 2, 1e-6, 0),
            "centroid_s": (DECAY_S / 2, 1e-5, 0),
            "rms_duration_s": (DECAY_S / 2, 1e-5, 0),
            "skewness": (2 ** (1 / 3), 1e-4, 0),
            "kurtosis": (9**0.25, 1e-4, 0),
            "duration_10_90_s": (np.log(9) * DECAY_S / 2, 1e-5, 0),
        },
    ),
    "two samples": (
        np.ones(2),
        0.0,
        {"duration_10_90_s": (0.8 / RATE, 1e-12, 0), "duration_5_95_s": (0.9 / RATE, 1e-12, 0)},
    ),
}


@pytest.mark.parametrize(("record", "start_s", "moments"), CLOSED_FORMS.values(), ids=CLOSED_FORMS)
def test_moments_are_the_closed_forms(record, start_s, moments):
    computed = temporal_moments(record, RATE, start_s=start_s)
    for name, (expected, rel, absolute) in moments.items():
        assert getattr(computed, name) == pytest.approx(expected, rel=rel, abs=absolute), name


def test_moments_of_silence_and_of_a_record_read_backwards():
    pulse = np.sin(np.pi * np.arange(1001) / 1000)
    alone, later = (
        temporal_moments(pulse, RATE),
        temporal_moments(np.pad(pulse, (5000, 3000)), RATE),
    )
    assert later.centroid_s - alone.centroid_s == pytest.approx(5e-3, rel=1e-9)
    np.testing.assert_allclose(astuple(later)[2:4], astuple(alone)[2:4], rtol=1e-9)
    np.testing.assert_allclose(astuple(later)[5:], astuple(alone)[5:], rtol=1e-9)
    decay = np.exp(-np.arange(20000) / 1000)
    assert temporal_moments(decay[::-1], RATE).skewness == pytest.approx(
        -temporal_moments(decay, RATE).skewness
    )
    found = temporal_moments(np.zeros(10), RATE)
    assert found.energy_m2_s3 == 0.0 and np.isnan(found.rms_duration_s)
