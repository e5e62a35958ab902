from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.signals.srs.resampling import upsampled


def burst(rate_hz: float, centre_hz: float = 2500.0, duration_s: float = 0.04):
    """A ringing under a bell: at rest at its ends, and nothing of it above 4 kHz."""
    t = np.arange(round(duration_s * rate_hz) + 1) / rate_hz
    return np.exp(-(((t - duration_s / 2) / 0.002) ** 2) / 2) * np.sin(
        2 * np.pi * centre_hz * t + 0.4
    )


@given(st.integers(2, 300), st.sampled_from([2, 4, 8]), st.integers(0, 10**6))
def test_old_samples_stay(n, factor, seed):
    record = np.random.default_rng(seed).normal(size=(2, n))
    fine = upsampled(record, factor)
    assert fine.shape == (2, (n - 1) * factor + 1)
    assert fine[:, ::factor] == pytest.approx(record, rel=0, abs=1e-12)


@pytest.mark.parametrize("factor", [1, 2, 8])
@pytest.mark.parametrize("duration", [0.04, 0.0401])  # an even and an odd number of samples
def test_band_limited_record_is_exact(factor, duration):
    fine = upsampled(burst(1e4, duration_s=duration)[np.newaxis], factor)[0]
    assert fine == pytest.approx(burst(factor * 1e4, duration_s=duration), rel=0, abs=1e-12)


@pytest.mark.parametrize("level", [0.0, 3.0])
def test_a_record_that_ends_while_it_rings_does_not_ring_more_there(level):
    """Cut off anywhere, with its rest at 0 or not: an end that meets the other one in a jump would
    ring over the whole record, by a tenth of the jump."""
    whole, fine = burst(1e4) + level, burst(8e4) + level
    cut = slice(170, 260)
    finer = upsampled(whole[np.newaxis, cut], 8)[0]
    apart = np.abs(finer - fine[8 * 170 : 8 * 259 + 1])
    assert apart.max() < 0.15
    assert apart[8 * 10 : -8 * 10].max() < 0.01
