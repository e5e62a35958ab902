"""Pulses rebuilt from 20 points."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.training.evaluation.metrics import figures, reconstruct
from scipy.interpolate import make_smoothing_spline

PHASE = np.linspace(0.0, 1.0, 20)


def test_passes_through_its_points() -> None:
    points = np.random.default_rng(0).standard_normal((3, 20))
    assert np.allclose(reconstruct(points, 191)[:, ::10], points, atol=1e-12)


def test_is_the_smoothing_spline_that_smooths_nothing() -> None:
    points = np.random.default_rng(1).standard_normal(20)
    peer = make_smoothing_spline(np.arange(20.0), points, lam=1e-10)(np.linspace(0, 19, 500))
    assert np.allclose(reconstruct(points[None], 500)[0], peer, atol=1e-6)


def test_half_sine_comes_back() -> None:
    fine = reconstruct(np.sin(np.pi * PHASE)[None])
    assert np.abs(fine[0] - np.sin(np.pi * np.linspace(0, 1, 1000))).max() < 2e-5


def test_figures_of_a_von_hann_pulse() -> None:
    """sin^2: peak 1 in the middle, impulse half its duration, half of it before the peak.

    Its ends are bent, a natural spline's are not: that costs 0.03 % of impulse.
    """
    found = figures(reconstruct(np.sin(np.pi * PHASE)[None] ** 2, 1001), np.array([4e-3]))
    assert np.isclose(found.peak_force_n[0], 1.0, rtol=2e-3)
    assert np.isclose(found.compression_time_s[0], 2e-3, rtol=2e-3)
    assert np.isclose(found.impulse_n_s[0], 2e-3, rtol=5e-4)
    assert np.isclose(found.compression_impulse_n_s[0], 1e-3, rtol=5e-3)


def test_too_few_points_are_refused() -> None:
    with pytest.raises(ValueError, match="2 points"):
        reconstruct(np.zeros((1, 2)))
