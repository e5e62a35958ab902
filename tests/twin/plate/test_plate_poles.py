"""Poles and amplitudes of damped ringing, against ringing that was written down."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.twin.plate.poles import (
    Basis,
    damping_ratios,
    frequencies_hz,
    orthonormal,
    poles_of,
    refined,
    search_poles,
    waves,
)

STEP_S, SAMPLES = 1 / 20_000, 2000
FREQUENCY, RATIO = np.array([310.0, 800.0, 1900.0]), np.array([0.004, 0.01, 0.006])


def ringing(poles: np.ndarray, amplitudes: np.ndarray, offset: float = 0.0) -> np.ndarray:
    """(n, k) of complex amplitudes (M, k)."""
    time = STEP_S * np.arange(SAMPLES)[:, None]
    waves_ = np.exp(poles * time)
    return np.asarray((waves_ @ amplitudes).real + offset)


def some(rng: np.random.Generator, modes: int = 3, records: int = 4) -> np.ndarray:
    return rng.uniform(0.5, 2.0, (modes, records)) * np.exp(
        2j * np.pi * rng.uniform(size=(modes, records))
    )


def test_amplitudes_come_back_from_waves_that_are_exponentials() -> None:
    poles, amplitudes = poles_of(FREQUENCY, RATIO), some(np.random.default_rng(1))
    projected = Basis.of(poles, SAMPLES, STEP_S).projected(ringing(poles, amplitudes, offset=3.0))[
        0
    ]
    assert projected == pytest.approx(amplitudes, abs=1e-8)
    poles = poles_of(FREQUENCY, RATIO)
    exact = np.exp(poles * (STEP_S * np.arange(777))[:, None])
    assert waves(poles, 777, STEP_S) == pytest.approx(
        np.hstack([exact.real, exact.imag]), abs=1e-11
    )


@given(seed=st.integers(0, 1000), off=st.floats(-0.01, 0.01), wider=st.floats(0.5, 2.0))
@settings(max_examples=15)
def test_poles_are_refined_from_a_near_guess(seed: int, off: float, wider: float) -> None:
    poles = poles_of(FREQUENCY, RATIO)
    records = ringing(poles, some(np.random.default_rng(seed)))
    fitted = refined(poles_of(FREQUENCY * (1 + off), RATIO * wider), records, STEP_S, 15)
    assert frequencies_hz(fitted) == pytest.approx(FREQUENCY, rel=1e-5)
    assert damping_ratios(fitted) == pytest.approx(RATIO, rel=1e-3)


def test_lines_are_found_without_a_guess() -> None:
    rng = np.random.default_rng(2)
    records = ringing(poles_of(FREQUENCY, RATIO), some(rng), offset=0.2)
    records = records + 0.01 * rng.standard_normal(records.shape)
    poles = search_poles(records, STEP_S, (200.0, 4000.0), 0.005, 10)
    assert frequencies_hz(poles) == pytest.approx(FREQUENCY, rel=1e-3)
    assert damping_ratios(poles) == pytest.approx(RATIO, rel=0.05)
    rng = np.random.default_rng(3)
    damped = ringing(poles_of(FREQUENCY, 6 * RATIO), some(rng)) + 0.002 * rng.standard_normal(
        (SAMPLES, 4)
    )
    poles = search_poles(damped, STEP_S, (200.0, 4000.0), 0.005, 10)
    assert frequencies_hz(poles) == pytest.approx(FREQUENCY, rel=5e-3)
    noise = np.random.default_rng(4).standard_normal((SAMPLES, 8))
    assert search_poles(noise, STEP_S, (200.0, 4000.0), 0.005, 10).size == 0


def test_predicted_scatter_is_that_of_many_records_and_parallel_columns_have_a_basis() -> None:
    rng, poles = np.random.default_rng(5), poles_of(FREQUENCY, RATIO)
    amplitudes, noise = some(rng, records=1), 0.02
    basis = Basis.of(poles, SAMPLES, STEP_S)
    clean = ringing(poles, amplitudes)
    found = [
        np.log(np.abs(basis.projected(clean + noise * rng.standard_normal(clean.shape))[0])[:, 0])
        for _ in range(200)
    ]
    _, jtj = basis.step(amplitudes, np.zeros((2 * FREQUENCY.size, 1)))
    assert basis.deviations(jtj, amplitudes, noise)[1][:, 0] == pytest.approx(
        np.std(found, axis=0), rel=0.25
    )
    base = np.random.default_rng(6).standard_normal((50, 3))
    base[:, 2] = base[:, 1] * (1 + 1e-13)
    q, r = orthonormal(base)
    assert q @ r == pytest.approx(base, abs=1e-9)
