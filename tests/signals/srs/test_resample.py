from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.signals.srs.spectrum import factors, shock_response_spectrum, upsampled


def burst(rate_hz: float, centre_hz: float = 2500.0, duration_s: float = 0.04):
    """A ringing under a bell: at rest at its ends, and nothing of it above 4 kHz."""
    t = np.arange(round(duration_s * rate_hz) + 1) / rate_hz
    return np.exp(-(((t - duration_s / 2) / 0.002) ** 2) / 2) * np.sin(2 * np.pi * centre_hz * t + 0.4)


@given(st.integers(2, 300), st.sampled_from([2, 4, 8]), st.integers(0, 10**6))
def test_old_samples_stay(n, factor, seed):
    record = np.random.default_rng(seed).normal(size=(2, n))
    fine = upsampled(record, factor)
    assert fine.shape == (2, (n - 1) * factor + 1)
    assert fine[:, ::factor] == pytest.approx(record, rel=0, abs=1e-12)


def test_factor_is_the_least_power_of_two_and_repair_finds_what_sampling_hides():
    lines = np.array([100.0, 1000.0, 1001.0, 2000.0, 4500.0])
    assert factors(lines, 1e4, 10.0).tolist() == [1, 1, 2, 2, 8]
    assert factors(lines, 1e4, None).tolist() == [1, 1, 1, 1, 1]
    assert factors(lines, 1e4, 0.5).tolist() == [1, 1, 1, 1, 1]
    assert factors(lines, 1e4, 1000.0).tolist() == [16, 128, 128, 256, 512]
    # At 4 samples a cycle a line shows less than three quarters; repaired, what the fine record shows.
    lines = np.array([500.0, 1500.0, 2500.0, 3500.0, 4500.0])
    coarse = shock_response_spectrum(burst(1e4), 1e4, lines)
    repaired = shock_response_spectrum(burst(1e4), 1e4, lines, resample=100.0)
    truth = shock_response_spectrum(burst(1.28e6), 1.28e6, lines)
    assert coarse.maximax[2] < 0.75 * truth.maximax[2]
    assert repaired.maximax[2:] == pytest.approx(truth.maximax[2:], rel=2e-3)
    assert repaired.pseudo_velocity_m_s[2:] == pytest.approx(truth.pseudo_velocity_m_s[2:], rel=2e-3)


@pytest.mark.parametrize("resample", [None, 10.0, 30.0, 100.0])
def test_loses_no_more_than_it_states(resample):
    lines = np.array([2500.0, 3000.0, 3500.0])
    found = shock_response_spectrum(burst(1e4), 1e4, lines, resample=resample)
    truth = shock_response_spectrum(burst(2.56e6), 2.56e6, lines)
    for name in ("maximax", "pseudo_velocity_m_s"):
        share = getattr(found, name) / getattr(truth, name)
        assert np.all(share <= 1 + 1e-4)
        assert np.all(share >= 1 - found.sampling_error)
    if resample:
        assert np.all(found.sampling_error <= 1 - np.cos(np.pi / resample) * np.sinc(1 / resample) ** 2 + 1e-12)


@pytest.mark.parametrize("factor", [1, 2, 8])
@pytest.mark.parametrize("duration", [0.04, 0.0401])  # an even and an odd number of samples
def test_band_limited_record_is_exact(factor, duration):
    fine = upsampled(burst(1e4, duration_s=duration)[np.newaxis], factor)[0]
    assert fine == pytest.approx(burst(factor * 1e4, duration_s=duration), rel=0, abs=1e-12)
    for resample in (0.0, -3.0, np.nan, np.inf, 1e6):
        with pytest.raises(ValueError, match="resample"):
            factors(np.array([100.0]), 1e4, resample)
