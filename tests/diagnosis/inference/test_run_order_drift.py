"""A drift over the order of runs, which means of shuffled runs hide: repetitions lean on their place in the order."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.diagnosis.inference.unexplained_gap import RunOrderDrift
from scipy.stats import multivariate_normal
from support.records.linear_problems import gap_of

COUNT, REPETITIONS, SCATTER = 10, 4, 0.3
FACTORS = [{"place": float(c)} for c in range(COUNT)]
AMPLITUDES = (1.5, 4.0, 10.0)


def drift_of(size: float, seed: int = 0, columns: int = 1, shuffled: bool = True) -> RunOrderDrift:
    """Of a campaign that drifts by `size` tolerances from its first run to its last, in all its observables."""
    rng = np.random.default_rng(seed)
    runs = COUNT * REPETITIONS
    order = rng.permutation(np.tile(np.arange(COUNT), REPETITIONS)) if shuffled else np.arange(runs) // REPETITIONS
    time = np.linspace(0, 1, runs)
    residuals = size * time[:, None] + SCATTER * rng.standard_normal((runs, columns))
    return RunOrderDrift.of(gap_of(residuals, order, FACTORS, SCATTER))


@pytest.mark.parametrize("size", [-6.0, 0.0, 3.0])
def test_slope_is_that_of_the_drift(size: float):
    drift = drift_of(size)
    assert drift.slope[0] == pytest.approx(size, abs=3 * np.sqrt(drift.noise[0, 0]))


def test_slope_is_the_regression_with_a_mean_for_each_configuration():
    rng = np.random.default_rng(5)
    order = np.array([0, 1, 0, 2, 1, 2, 0, 1, 2, 2])
    residuals = rng.standard_normal((10, 2))
    drift = RunOrderDrift.of(gap_of(residuals, order, FACTORS[:3]))
    design = np.column_stack([np.linspace(0, 1, 10), np.eye(3)[order]])
    np.testing.assert_allclose(drift.slope, np.linalg.lstsq(design, residuals, rcond=None)[0][0])


@pytest.mark.parametrize("seed", range(4))
def test_planted_drift_raises_the_gain_and_noise_lowers_it(seed: int):
    gains = drift_of(5.0, seed).log_gains(AMPLITUDES)
    assert max(gains) > 10
    assert all(gain > 0 for gain in gains)
    assert all(gain < 0 for gain in drift_of(0.0, seed).log_gains(AMPLITUDES))


def test_gain_is_the_logarithm_of_the_ratio_of_two_gaussians():
    """Half of it for a drift of one size in all observables, half for one of its own in each."""
    drift = drift_of(2.0, columns=3)
    free = multivariate_normal(cov=drift.noise).logpdf(drift.slope)
    for size, gain in zip(AMPLITUDES, drift.log_gains(AMPLITUDES), strict=True):
        ratios = [
            multivariate_normal(cov=drift.noise + size**2 * kernel).logpdf(drift.slope) - free
            for kernel in (np.eye(3), np.ones((3, 3)))
        ]
        assert gain == pytest.approx(np.logaddexp(*ratios) - np.log(2))


def test_repetitions_that_follow_one_another_say_nothing():
    """What drifts lies in the means of the configurations instead."""
    drift = drift_of(5.0, shuffled=False)
    assert drift.columns.size == 0
    assert drift.log_gains(AMPLITUDES) == [0.0, 0.0, 0.0]
    assert (drift.means**2).sum(axis=1).mean() == pytest.approx(1.0, abs=0.02)


def test_means_vary_as_a_smooth_drift_makes_them():
    """A kernel over the order of runs, half of it the same for all, averaged within configurations."""
    order = np.random.default_rng(3).permutation(np.tile(np.arange(COUNT), REPETITIONS))
    drift = RunOrderDrift.of(gap_of(np.zeros((order.size, 1)), order, FACTORS))
    time = np.linspace(0, 1, order.size)
    kernel = 0.5 + 0.5 * np.exp(-0.5 * (time[:, None] - time[None, :]) ** 2 / 0.4**2)
    share = np.eye(COUNT)[order].T / REPETITIONS
    expected = share @ kernel @ share.T
    np.testing.assert_allclose(drift.means @ drift.means.T, expected, atol=2e-3 * expected.max())
