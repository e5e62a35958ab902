"""Time windows, frequency bands and drift: planted ones come back, chance makes none."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.diagnosis.localisation.drift import drift
from pyroshock.diagnosis.localisation.windows import (
    amplitude_residual_db,
    frequency_bands,
    spans,
    time_windows,
)
from support.records.toy_bench import Scatter, ToyGun, campaign, stages_of

CONFIGURATION = np.repeat(np.arange(12), 3)


def _chance(rng: np.random.Generator, samples: int = 64) -> np.ndarray:
    """Scatter of every sample, and one that a whole run shares."""
    common = 0.03 * rng.standard_normal((CONFIGURATION.size, 1)) * np.hanning(samples)
    return common + 0.02 * rng.standard_normal((CONFIGURATION.size, samples))


@pytest.mark.parametrize(("first", "last"), [(20, 39), (48, 55), (5, 58)])
def test_planted_stretch_comes_back(first: int, last: int) -> None:
    rng = np.random.default_rng(0)
    residual = _chance(rng)
    residual[:, first : last + 1] += 0.1
    ((a, b),) = spans(residual, CONFIGURATION, 0.03, rng)
    both = min(b, last) - max(a, first) + 1
    assert both / (max(b, last) - min(a, first) + 1) >= 0.8


def test_stretch_is_found_whatever_its_sign_and_the_records() -> None:
    rng = np.random.default_rng(0)
    residual = _chance(rng)
    residual[:, 10:30] += 0.1 * np.where(CONFIGURATION % 2, 1.0, -1.0)[:, None]
    assert spans(residual, CONFIGURATION, 0.03, rng) == ((10, 29),)
    rng = np.random.default_rng(0)
    assert spans(0.1 * _chance(rng) + 0.02, CONFIGURATION, 0.03, rng) == ()
    rng = np.random.default_rng(0)
    residual = 0.01 * rng.standard_normal((12, 64))
    residual[:, 20:40] += 0.2
    assert spans(residual, np.arange(12), 0.05, rng) == ((20, 39),)
    rng = np.random.default_rng(0)
    residual = _chance(rng)
    residual[:, 20:40] += 0.1
    residual[::5] = np.nan
    assert spans(residual, CONFIGURATION, 0.03, rng) == ((20, 39),)


def test_chance_makes_no_stretch_and_steady_campaigns_no_drift() -> None:
    # Family-wise five per cent of 100: up to 11 with a probability of 99 %.
    rng = np.random.default_rng(0)
    assert (
        sum(bool(spans(_chance(rng), CONFIGURATION, 0.0, rng, flips=99)) for _ in range(100)) <= 11
    )
    assert sum(bool(_drift(0.0, seed)) for seed in range(40)) <= 6


def test_time_window_and_frequency_band_have_their_units() -> None:
    rng = np.random.default_rng(0)
    time_s = np.arange(1000) * 1e-6
    pulse = 1e3 * np.sin(np.pi * time_s / 1e-3) ** 2
    simulated = np.tile(pulse, (CONFIGURATION.size, 1))
    measured = simulated * (1 + 0.01 * rng.standard_normal((CONFIGURATION.size, 1)))
    measured[:, 600:800] += 100.0
    (stretch,) = time_windows(time_s, measured, simulated, CONFIGURATION, "force", rng)
    assert stretch.channel == "force"
    assert (stretch.from_s, stretch.to_s) == pytest.approx((6e-4, 8e-4), abs=1e-5)
    rng = np.random.default_rng(0)
    lines = 100 * 2.0 ** (np.arange(24) / 3)
    residual = 0.3 * rng.standard_normal((CONFIGURATION.size, 24))
    residual[:, 9:15] += 3.0
    (band,) = frequency_bands(lines, residual, CONFIGURATION, "acceleration_1", rng)
    assert (band.from_hz, band.to_hz) == pytest.approx(
        (lines[9] * 2 ** (-1 / 6), lines[14] * 2 ** (1 / 6))
    )


def test_amplitude_spectrum_of_a_gain() -> None:
    """Twice the force: 6.02 dB wherever the pulse has any content; a short pulse goes further than
    a long one."""
    time_s = np.arange(2048) * 1e-5
    pulses = np.array(
        [np.where(time_s < w, np.sin(np.pi * np.minimum(time_s, w) / w), 0.0) for w in (1e-3, 4e-3)]
    )
    spectrum = np.abs(np.fft.rfft(pulses, axis=1))
    lines, level = amplitude_residual_db(np.fft.rfftfreq(2048, 1e-5), 2 * spectrum, spectrum)
    assert np.allclose(level[np.isfinite(level)], 20 * np.log10(2))
    reach = [lines[np.isfinite(row)].max() for row in level]
    assert reach[0] == pytest.approx(4 * reach[1], rel=0.15)


def _drift(drifted: float, seed: int = 0) -> tuple[str, ...]:
    rng = np.random.default_rng(seed)
    record = campaign((), rng, scatter=Scatter(drift=drifted))
    stage = ToyGun(record)
    order = np.array([run.order for run in record.runs])
    return drift(
        stage.residuals(), record.configuration_of, order, stage.observables, rng, permutations=199
    )


def test_drift_is_told_with_its_size_and_needs_repetitions() -> None:
    (sentence,) = _drift(-0.04)
    assert sentence.startswith("gun: measured less simulated ln_velocity falls by 0.04")
    assert "(p = 0.005)" in sentence
    record = campaign((), np.random.default_rng(0), scatter=Scatter(drift=0.1))
    stage, (first,) = (
        stages_of(record)[0],
        [np.unique(record.configuration_of, return_index=True)[1]],
    )
    order = np.array([run.order for run in record.runs])[first]
    residual, of = stage.residuals()[first], record.configuration_of[first]
    assert drift(residual, of, order, stage.observables, np.random.default_rng(0)) == ()
