"""Scatter of a run: what lines of a channel share counts once, and what they do not share is not made up."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.diagnosis.noise import Noise
from pyroshock.diagnosis.stages.base import Observable

LINES = 24


def observables() -> list[Observable]:
    lines = [
        Observable(f"{channel} {f:.0f} Hz", "plate", channel, "dB", 0.5, 0.15, float(f))
        for channel in ("acceleration_1", "acceleration_2")
        for f in 100 * 2 ** (np.arange(LINES) / 3)
    ]
    return [Observable("ln velocity", "gun", "velocity", "1", 0.01, 0.01), *lines]


def deviations(rng: np.random.Generator, shared: float, configurations: int = 8) -> tuple[np.ndarray, np.ndarray]:
    """Three runs each; every channel is louder as a whole by `shared` dB, its lines by 0.3 dB of their own."""
    of = np.repeat(np.arange(configurations), 3)
    loud = shared * rng.standard_normal((len(of), 2))
    lines = np.repeat(loud, LINES, axis=1) + 0.3 * rng.standard_normal((len(of), 2 * LINES))
    values = np.concatenate([0.01 * rng.standard_normal((len(of), 1)), lines], axis=1)
    return values - np.array([values[of == c].mean(axis=0) for c in of]), of


def correlation(noise: Noise) -> np.ndarray:
    sigma = np.sqrt(np.diag(noise.covariance))
    return np.asarray(noise.covariance / np.outer(sigma, sigma))


def within(found: np.ndarray, first: slice, second: slice) -> float:
    block = found[first, second]
    return float(np.median(block[~np.eye(len(block), dtype=bool)]))


ONE, TWO = slice(1, 1 + LINES), slice(1 + LINES, 1 + 2 * LINES)


def test_a_louder_shot_counts_once() -> None:
    """16 degrees of freedom for 49 observables: drawn towards none the correlation of 0.92 would be 0.23."""
    found = correlation(Noise.of(*deviations(np.random.default_rng(1), 1.0), observables()))
    assert within(found, ONE, ONE) == pytest.approx(0.92, abs=0.15)
    assert within(found, TWO, TWO) == pytest.approx(0.92, abs=0.15)
    assert abs(within(found, ONE, TWO)) < 0.35


def test_lines_that_scatter_alone_share_nothing() -> None:
    found = correlation(Noise.of(*deviations(np.random.default_rng(2), 0.0), observables()))
    assert abs(within(found, ONE, ONE)) < 0.1


def test_mean_of_the_lines_scatters_as_it_does() -> None:
    """What a gain is read from: the variance of a channel's mean line, over campaigns."""
    ratio = []
    weight = np.zeros(1 + 2 * LINES)
    weight[ONE] = 1 / LINES
    for seed in range(40):
        noise = Noise.of(*deviations(np.random.default_rng(seed), 0.8), observables())
        ratio.append(weight @ noise.covariance @ weight / (0.8**2 + 0.3**2 / LINES))
    assert np.mean(ratio) == pytest.approx(0.87, abs=0.15)  # the data sheet and the weight of "none" take a part


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10_000), st.floats(0, 3), st.integers(1, 6), st.floats(0, 0.4))
def test_covariance_is_one(seed: int, shared: float, configurations: int, lost: float) -> None:
    """Symmetric, and positive but for what pairs with different gaps do to it."""
    rng = np.random.default_rng(seed)
    values, of = deviations(rng, shared, configurations)
    values[rng.random(values.shape) < lost] = np.nan
    noise = Noise.of(values, of, observables())
    assert np.allclose(noise.covariance, noise.covariance.T)
    found = correlation(noise)
    assert np.all(np.abs(found) <= 1 + 1e-9)
    if lost == 0:
        assert np.linalg.eigvalsh(found).min() > -1e-9
