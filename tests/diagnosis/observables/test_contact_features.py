"""Features of pulses against closed forms, and what must not change them: phase, scale, zero line,
noise."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.diagnosis.observables.contact.features import (
    NAMES,
    OBSERVABLES,
    _Spline,
    features,
    interpolated,
    series_features,
    zeroed,
)
from pyroshock.diagnosis.record import Series
from pyroshock.twin.contact.hertz import hertz
from pyroshock.virtualbench.sensors.filters import decimated
from scipy.interpolate import make_interp_spline
from support.records.contact_bodies import impacts

TOLERANCE = np.array([one.tolerance for one in OBSERVABLES])
TIME_S, PEAK_N = 1e-3, 500.0
_PULSE = hertz(impacts())


def half_sine(time_s: np.ndarray) -> np.ndarray:
    inside = (time_s > 0) & (time_s < TIME_S)
    return np.where(inside, PEAK_N * np.sin(np.pi * time_s / TIME_S), 0.0)


def hertz_at(time_s: np.ndarray) -> np.ndarray:
    phase = time_s / _PULSE.contact_time_s[0]
    force = np.zeros_like(time_s)
    inside = (phase > 0) & (phase < 1)
    force[inside] = _PULSE.force_at(phase[inside])[0]
    return force


def named(row: np.ndarray) -> dict[str, float]:
    return dict(zip(NAMES, row.tolist(), strict=True))


def sampled(samples: int, rng: np.random.Generator) -> np.ndarray:
    """A Hertz pulse with so many samples in its contact, at a random phase."""
    step = float(_PULSE.contact_time_s[0]) / samples
    return features(hertz_at((np.arange(-20, 4 * samples) + rng.random()) * step)[None], step)[0]


EXACT = sampled(2000, np.random.default_rng(0))


@pytest.mark.parametrize("share", [0.0, 0.05, 0.4])
def test_second_hit_counts_by_its_impulse(share: float) -> None:
    """A second half sine of 0.6 of the length, a fifth of it later, has 0.6 of the impulse for each
    share of height."""
    step = TIME_S / 400
    time = np.arange(-200, 2000) * step
    force = half_sine(time) + share * half_sine((time - 1.2 * TIME_S) / 0.6)
    found = named(features(force[None], step)[0])
    assert found["after_share"] == pytest.approx(0.6 * share / (1 + 0.6 * share), abs=2e-3)
    assert found["ln_width_half"] == pytest.approx(np.log(TIME_S * 2 / 3), abs=0.003)


@pytest.mark.parametrize("samples", [6, 9, 15, 40])
def test_sampling_phase_makes_no_gap_of_its_own(samples: int) -> None:
    rng = np.random.default_rng(samples)
    found = np.array([sampled(samples, rng) for _ in range(30)])
    assert np.abs((found.mean(axis=0) - EXACT) / TOLERANCE).max() < 0.3


@pytest.mark.parametrize("samples", [6, 9, 15])
def test_anti_alias_filter_makes_no_gap_of_its_own(samples: int) -> None:
    step, finer = float(_PULSE.contact_time_s[0]) / samples, 32
    rng = np.random.default_rng(samples)
    fine = [
        (np.arange(-60 * finer, 60 * finer) + rng.integers(finer)) * step / finer for _ in range(10)
    ]
    found = np.array([features(decimated(hertz_at(time), finer)[None], step)[0] for time in fine])
    assert np.abs((found.mean(axis=0) - EXACT) / TOLERANCE).max() < 0.3


@settings(max_examples=20)
@given(st.floats(0.01, 100), st.floats(0.05, 20))
def test_force_and_time_scale(force: float, time: float) -> None:
    step = TIME_S / 40
    pulse = half_sine(np.arange(-20, 100) * step)[None]
    change = features(force * pulse, time * step)[0] - features(pulse, step)[0]
    expected = np.zeros(len(NAMES))
    expected[:4] = np.log(force), np.log(force * time), np.log(time), np.log(time)
    assert change == pytest.approx(expected, abs=1e-9)


def test_pulse_backwards_has_the_opposite_skew() -> None:
    time = np.arange(-50, 250) / 100
    force = np.where((time > 0) & (time < 1), np.maximum(time, 0) ** 2 * (1 - time), 0.0)
    there, back = (named(features(each[None], 1e-5)[0]) for each in (force, force[::-1]))
    assert there["skew"] == pytest.approx(-back["skew"], abs=2e-3)
    assert there["rise_share"] == pytest.approx(1 - back["rise_share"], abs=2e-3)
    assert there["skew"] > 0.05
    step = TIME_S / 400
    pulse_features = named(features(half_sine(np.arange(-200, 1000) * step)[None], step)[0])
    assert pulse_features["ln_peak"] == pytest.approx(np.log(PEAK_N), abs=0.003)
    assert pulse_features["ln_impulse"] == pytest.approx(
        np.log(2 * PEAK_N * TIME_S / np.pi), abs=0.003
    )
    assert pulse_features["ln_width_half"] == pytest.approx(np.log(TIME_S * 2 / 3), abs=0.003)
    assert pulse_features["ln_width_tenth"] == pytest.approx(
        np.log(TIME_S * (1 - 2 * np.arcsin(0.1) / np.pi)), abs=0.003
    )
    assert pulse_features["rise_share"] == pytest.approx(0.5, abs=1e-3)
    assert pulse_features["skew"] == pytest.approx(0.0, abs=1e-3)


def test_strongest_pulse_counts_and_no_force_has_no_features() -> None:
    time = np.arange(-30, 120) * TIME_S / 40
    there, shifted = (
        Series(half_sine(time) + offset, 40 / TIME_S, float(time[0])) for offset in (0.0, 20.0)
    )
    assert series_features(shifted) == pytest.approx(series_features(there), abs=1e-12)
    assert zeroed(shifted).values[-1] == 0.0
    time = np.arange(-100, 600) * TIME_S / 40
    one, two = half_sine(time), half_sine(time) + 0.6 * half_sine(time - 4 * TIME_S)
    assert features(two[None], TIME_S / 40) == pytest.approx(
        features(one[None], TIME_S / 40), abs=1e-3
    )
    assert np.isnan(features(np.zeros((1, 50)), 1e-5)).all()
    assert np.isnan(series_features(Series(np.full(50, np.nan), 1e5, 0.0))).all()


@pytest.mark.parametrize("samples", [30, 1000])
def test_noise_of_a_hundredth_stays_within_half_a_tolerance(samples: int) -> None:
    rng, step = np.random.default_rng(1), TIME_S / samples
    clean = half_sine(np.arange(-samples, 3 * samples) * step)
    noisy = clean + 0.01 * PEAK_N * rng.standard_normal((60, clean.size))
    off = (
        np.vstack([features(row[None], step) for row in noisy]) - features(clean[None], step)
    ) / TOLERANCE
    assert off.std(axis=0).max() < 0.6
    assert np.abs(off.mean(axis=0)).max() < 0.5


@given(st.integers(3, 60), st.integers(2, 9), st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_spline_of_even_samples_is_that_of_scipy(samples: int, finer: int, seed: int) -> None:
    values = np.random.default_rng(seed).standard_normal((4, samples))
    place = np.arange((samples - 1) * finer + 1) / finer
    expected = make_interp_spline(np.arange(samples), values, k=min(5, samples - 1), axis=1)(place)
    np.testing.assert_allclose(
        _Spline.of(samples, finer).finer(values), expected, atol=1e-9 * np.abs(expected).max()
    )


@given(st.integers(2, 40), st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_between_points_a_series_is_straight_and_outside_of_them_nothing(
    samples: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    values = rng.standard_normal((3, samples))
    place = rng.uniform(-2, samples + 1, (3, 50))
    place[:, :4] = 0.0, samples - 1.0, np.nan, samples - 1 + 1e-9
    expected = [
        np.interp(p, np.arange(samples), row, left=0.0, right=0.0)
        for p, row in zip(place, values, strict=True)
    ]
    np.testing.assert_allclose(interpolated(values, place), np.nan_to_num(expected), atol=1e-12)
