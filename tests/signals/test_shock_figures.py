"""Figures of classical pulses and ringings against their closed forms, and against another
package."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.signals.shock_figures import SRS_Q, shock_figures, summary_lines
from pyroshock.signals.srs.moments import temporal_moments
from pyroshock.signals.srs.spectrum import shock_response_spectrum

RATE = 100_000.0
REST_S = 0.05


def record(pulse, duration_s, before_s=REST_S, after_s=REST_S):
    """Rest, a pulse that is a function of its time, and rest."""
    time = np.arange(round((before_s + duration_s + after_s) * RATE)) / RATE - before_s
    return np.where((time >= 0) & (time <= duration_s), pulse(time), 0.0)


def half_sine(peak, duration_s):
    return record(lambda t: peak * np.sin(np.pi * t / duration_s), duration_s)


@pytest.mark.parametrize("peak", [500.0, -500.0])
def test_half_sine_has_its_closed_figures(peak):
    duration = 11e-3
    found = shock_figures(half_sine(peak, duration), RATE, start_s=2.0)
    assert found.signed_peak_acceleration_m_s2 == pytest.approx(peak, rel=1e-4)
    assert found.peak_acceleration_m_s2 == pytest.approx(500.0, rel=1e-4)
    assert found.peak_time_s == pytest.approx(2.0 + REST_S + duration / 2, abs=1.5 / RATE)
    assert found.pulse_duration_s == pytest.approx(
        duration * (1 - 2 * np.arcsin(0.1) / np.pi), rel=2e-4
    )
    assert found.effective_duration_s == pytest.approx(
        duration * (1 - 2 * np.arcsin(1 / 3) / np.pi), rel=2e-4
    )
    for velocity_m_s in (found.velocity_change_m_s, found.record_velocity_change_m_s):
        assert velocity_m_s == pytest.approx(2 * peak * duration / np.pi, rel=1e-4)
    assert found.rest_m_s2 == pytest.approx(0.0, abs=1e-12)


def test_sawtooth_trapezoid_and_rectangle_have_their_closed_figures():
    duration = 6e-3
    found = shock_figures(record(lambda t: 1000.0 * t / duration, duration), RATE)
    assert found.peak_acceleration_m_s2 == pytest.approx(1000.0, rel=1e-3)
    assert found.pulse_duration_s == pytest.approx(0.9 * duration, abs=1.5 / RATE)
    assert found.effective_duration_s == pytest.approx(2 / 3 * duration, abs=1.5 / RATE)
    assert found.velocity_change_m_s == pytest.approx(
        1000.0 * duration / 2, rel=3e-3
    )  # the drop takes one sample
    duration, flank = 10e-3, 1e-3
    found = shock_figures(
        record(lambda t: 800.0 * np.clip(np.minimum(t, duration - t) / flank, 0, 1), duration), RATE
    )
    assert found.pulse_duration_s == pytest.approx(duration - 0.2 * flank, rel=1e-4)
    assert found.effective_duration_s == pytest.approx(duration - 2 / 3 * flank, rel=1e-4)
    assert found.velocity_change_m_s == pytest.approx(800.0 * (duration - flank), rel=1e-4)
    found = shock_figures(record(lambda t: np.full_like(t, 300.0), 20e-3), RATE)
    assert found.energy_duration_s == pytest.approx(0.9 * 20e-3, rel=2e-3)


def test_decaying_sinusoid_at_a_line_excites_it_as_the_closed_form_says():
    """With little damping the amplitude of the response follows A' = -d w A + a exp(-zeta w t) w /
    2, d = 1 / 2Q."""
    frequency, zeta = 640.0, 0.01  # a line of the summary
    omega, time = 2 * np.pi * frequency, np.arange(30_000) / RATE
    x = np.concatenate(
        [np.zeros(5_000), 100.0 * np.exp(-zeta * omega * time) * np.sin(omega * time)]
    )
    found = shock_figures(x, RATE)
    assert found.srs_peak_frequency_hz == frequency
    d = 1 / (2 * SRS_Q)
    s = np.linspace(0, 60, 200_001)
    envelope = 100.0 / (2 * (d - zeta)) * (np.exp(-zeta * s) - np.exp(-d * s))
    assert found.srs_peak_m_s2 == pytest.approx(envelope.max(), rel=0.03)


def test_spectrum_is_that_of_another_package():
    assert summary_lines(100_000, 100_000.0) == tuple(10.0 * 2**i for i in range(10))
    assert summary_lines(1_000, 100_000.0)[0] == 160.0  # the first of at least a period in 10 ms
    assert summary_lines(5, 100_000.0) == ()
    assert summary_lines(100, 50.0) == ()
    from pyyeti import srs

    x = half_sine(500.0, 11e-3)
    found = shock_figures(x, RATE)
    theirs = srs.srs(
        x, RATE, np.array(found.srs_frequency_hz), SRS_Q, ic="zero", peak="abs", stype="absacce"
    )
    assert found.srs_maximax_m_s2 == pytest.approx(theirs, rel=0.02)
    assert found.srs_peak_m_s2 == max(found.srs_maximax_m_s2)


@pytest.mark.parametrize("decay_s", [0.005, 0.05, 0.5])
def test_spectrum_is_the_whole_records(decay_s):
    rng = np.random.default_rng(3)
    time = np.arange(100_000) / RATE - 0.2
    ringing = sum(
        a * np.sin(2 * np.pi * f * time) for a, f in ((1e4, 2700.0), (3e3, 410.0), (800.0, 95.0))
    )
    x = np.where(time > 0, np.exp(-time / decay_s) * ringing, 0.0) + rng.normal(size=time.size)
    found = shock_figures(x, RATE)
    whole = shock_response_spectrum(
        x - found.rest_m_s2, RATE, found.srs_frequency_hz, q=SRS_Q
    ).maximax
    assert np.array(found.srs_maximax_m_s2) == pytest.approx(whole, rel=0.01)


def test_energy_duration_is_that_of_the_whole_record():
    rng = np.random.default_rng(5)
    for samples in (3, 100, 4096, 4097, 20_000):
        x = rng.normal(size=samples) * np.exp(-np.arange(samples) / (samples / 5))
        moments = temporal_moments(x, RATE)
        assert shock_figures(x, RATE).energy_duration_s == pytest.approx(
            moments.duration_5_95_s, rel=1e-9
        )


def test_offset_noise_and_lost_samples_leave_the_velocity_change():
    rng = np.random.default_rng(4)
    x = half_sine(500.0, 11e-3)
    noisy = x + 12.0 + rng.normal(size=x.size) * 2.0
    found = shock_figures(noisy, RATE)
    assert found.rest_m_s2 == pytest.approx(12.0, abs=0.2)
    assert found.velocity_change_m_s == pytest.approx(2 * 500 * 11e-3 / np.pi, rel=0.01)
    assert found.pulse_duration_s == pytest.approx(0.936 * 11e-3, rel=0.01)
    x[100:120] = np.nan
    assert shock_figures(x, RATE).velocity_change_m_s == pytest.approx(
        2 * 500 * 11e-3 / np.pi, rel=1e-3
    )
    x = half_sine(500.0, 11e-3)[5_000:]
    assert shock_figures(x, RATE).rest_m_s2 is None


@pytest.mark.parametrize(
    "x", [np.zeros(100), np.full(100, 3.0), np.full(100, np.nan), np.ones(1), np.empty(0)]
)
def test_what_never_moves_has_no_figures(x):
    assert shock_figures(x, RATE) is None


@given(st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=80), st.floats(0.1, 10.0))
def test_figures_scale_with_the_record(samples, gain):
    x = np.round(samples, 6)
    found, scaled = shock_figures(x, 1000.0), shock_figures(gain * x, 1000.0)
    assert (found is None) == (scaled is None)
    if found is None or found.peak_acceleration_m_s2 < 1e-6:
        return
    assert scaled.peak_acceleration_m_s2 == pytest.approx(
        gain * found.peak_acceleration_m_s2, rel=1e-6
    )
    assert 0 <= found.pulse_duration_s <= (x.size - 1 + 1e-9) / 1000
    assert 0 <= found.effective_duration_s <= (x.size - 1 + 1e-9) / 1000
    assert 0 <= found.energy_duration_s <= (x.size - 1 + 1e-9) / 1000
