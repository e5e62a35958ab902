"""The smoothing spline is the library's, on the sample index."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.ingest.pulses import nrmse, smoothing_spline


@pytest.mark.parametrize("samples", [5, 6, 7, 30, 400])
@pytest.mark.parametrize("smoothing", [0.01, 0.5, 0.99, 0.999999])
def test_is_scipys_smoothing_spline(samples, smoothing):
    from scipy.interpolate import make_smoothing_spline

    x = np.arange(float(samples))
    values = 1e3 * np.sin(x / samples * np.pi) + np.random.default_rng(samples).normal(0, 10, samples)
    at = np.linspace(0, samples - 1, 10 * samples)
    expected = make_smoothing_spline(x, values, lam=(1 - smoothing) / smoothing)(at)
    np.testing.assert_allclose(smoothing_spline(values, smoothing)(at), expected, rtol=0, atol=1e-9)


def test_few_samples_or_none_to_smooth_are_gone_through():
    values = np.random.default_rng(0).normal(size=20)
    np.testing.assert_allclose(smoothing_spline(values, 1.0)(np.arange(20.0)), values, atol=1e-12)
    for samples in (2, 3, 4):
        squares = np.arange(samples) ** 2.0
        np.testing.assert_allclose(smoothing_spline(squares, 0.5)(np.arange(float(samples))), squares, atol=1e-12)


def test_straight_line_is_left_as_it_is():
    values = 3.0 * np.arange(50.0) - 7.0
    np.testing.assert_allclose(smoothing_spline(values, 0.01)(np.array([0.5, 48.25])), [-5.5, 137.75], rtol=1e-12)


@pytest.mark.parametrize(("samples", "smoothing", "power"), [(2, 0.5, 1), (3, 0.5, 2), (4, 0.5, 3), (9, 1.0, 3)])
def test_interpolation_is_of_the_highest_order_up_to_a_cubic(samples, smoothing, power):
    spline = smoothing_spline(np.arange(float(samples)) ** power, smoothing)
    between = np.arange(samples - 1) + 0.5
    np.testing.assert_allclose(spline(between), between**power, rtol=1e-9)


def test_error_is_over_the_range_of_the_values():
    assert nrmse(np.array([5.0, 5.5]), np.array([5.05, 5.45])) == pytest.approx(0.1)  # equation 4.4
    assert nrmse(np.full(4, 7.0), np.full(4, 8.0)) == 0.0
