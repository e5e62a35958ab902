"""Errors and costs of pulses whose figures are known in closed form, and pulses rebuilt from 20
points."""

from __future__ import annotations

import math
import time
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.dataset.table import POINTS, PulseTable
from pyroshock.training.evaluation.metrics import (
    ELEMENTS,
    METRICS,
    figures,
    pulse_cost,
    pulse_errors,
    reconstruct,
)
from pyroshock.training.models.base import ContactPrediction
from scipy.interpolate import make_smoothing_spline
from support.records.pulse_tables import pulse_table

PHASE = np.linspace(0.0, 1.0, POINTS)


@pytest.fixture
def half_sines() -> PulseTable:
    """60 half-sines with their exact figures: peak A, impulse 2 A tau / pi, half of it in half the
    time."""
    table = pulse_table(np.random.default_rng(1), repetitions=1)
    peak, time = table.peak_force_n, table.contact_time_s
    impulse = 2 / np.pi * peak * time
    return replace(
        table,
        force_n=peak[:, None] * np.sin(np.pi * PHASE),
        compression_time_s=time / 2,
        impulse_n_s=impulse,
        compression_impulse_n_s=impulse / 2,
    )


def scaled(table: PulseTable, force: float = 1.0, time: float = 1.0) -> ContactPrediction:
    return ContactPrediction(force * table.force_n, time * table.contact_time_s, None, None)


def test_taller_pulse(half_sines: PulseTable) -> None:
    errors = pulse_errors(half_sines, scaled(half_sines, force=1.1))
    rms = np.sqrt(np.mean(np.sin(np.pi * PHASE) ** 2))
    # Neither the range nor the reconstruction sees the very top, which lies between two of the 20
    # points.
    assert np.allclose(errors.force_nrmse, 0.1 * rms / np.sin(np.pi * PHASE).max(), rtol=1e-12)
    assert np.allclose(errors.force_rmse_n, 0.1 * rms * half_sines.peak_force_n, rtol=1e-12)
    for name in ("peak_force_error", "impulse_error"):
        assert np.allclose(getattr(errors, name), 0.1, atol=2e-4), name
    # The greatest of 1,000 elements is up to half an element from the middle of the contact.
    assert np.allclose(
        errors.compression_impulse_error, 0.1, atol=1.1 * np.pi / 2 / ELEMENTS + 2e-4
    )
    assert np.allclose(errors.compression_time_error, 0.0, atol=1.1 / ELEMENTS)
    assert np.array_equal(errors.contact_time_error, np.zeros(60))


def test_longer_or_shorter_pulses(half_sines: PulseTable) -> None:
    errors = pulse_errors(half_sines, scaled(half_sines, time=1.2))
    assert np.array_equal(errors.force_rmse_n, np.zeros(60))
    for name in ("contact_time_error", "impulse_error"):
        assert np.allclose(getattr(errors, name), 0.2, atol=3e-4), name
    assert np.allclose(errors.compression_time_error, 0.2, atol=2 / ELEMENTS)
    errors = pulse_errors(half_sines, scaled(half_sines, force=1.25, time=0.8))
    assert np.allclose(errors.impulse_error, 0.0, atol=2e-4)
    assert np.allclose(errors.peak_force_error, 0.25, atol=2e-4)


def test_perfect_prediction_costs_what_reconstruction_costs() -> None:
    # The stored figures of the synthetic table are those of its points, not of a spline.
    table = pulse_table(np.random.default_rng(2), repetitions=1, noise=0.0)
    errors = pulse_errors(table, scaled(table))
    for name in ("force_rmse_n", "force_nrmse", "contact_time_error", "cost"):
        assert np.array_equal(getattr(errors, name), np.zeros(60)), name
    assert errors.impulse_error.max() < 0.005
    # sin^2: peak 1 in the middle, impulse half its duration, half of it before the peak. Its ends
    # are bent, a natural spline's are not: that costs 0.03 % of impulse.
    pulse_figures = figures(reconstruct(np.sin(np.pi * PHASE)[None] ** 2, 1001), np.array([4e-3]))
    assert np.isclose(pulse_figures.peak_force_n[0], 1.0, rtol=2e-3)
    assert np.isclose(pulse_figures.compression_time_s[0], 2e-3, rtol=2e-3)
    assert np.isclose(pulse_figures.impulse_n_s[0], 2e-3, rtol=5e-4)
    assert np.isclose(pulse_figures.compression_impulse_n_s[0], 1e-3, rtol=5e-3)


def test_rows_do_not_depend_on_each_other(half_sines: PulseTable) -> None:
    prediction = scaled(half_sines, 1.1, 1.1)
    part = slice(7, 9)
    alone = ContactPrediction(prediction.force_n[part], prediction.contact_time_s[part], None, None)
    together = pulse_errors(half_sines, prediction).take(part)
    for name, values in pulse_errors(half_sines.take(part), alone).arrays().items():
        assert np.allclose(values, together.arrays()[name], rtol=1e-9, atol=1e-12), name


def test_coverage_counts_points_in_the_band(half_sines: PulseTable) -> None:
    spread = np.full((60, POINTS), 1.0)
    off = np.where(np.arange(POINTS) < 5, 1.7, 1.6)
    prediction = ContactPrediction(
        half_sines.force_n + off,
        half_sines.contact_time_s + 1e-6,
        spread,
        np.where(np.arange(60) < 15, 0.6e-6, 0.7e-6),
    )
    errors = pulse_errors(half_sines, prediction)
    assert errors.force_covered is not None and np.allclose(errors.force_covered, 0.75)
    assert errors.time_covered is not None and errors.time_covered.mean() == 0.75
    assert tuple(pulse_errors(half_sines, scaled(half_sines)).arrays()) == METRICS


def test_what_cannot_be_compared_is_refused(half_sines: PulseTable) -> None:
    with pytest.raises(ValueError, match=r"force_n is \(59, 20\), the pulses' is \(60, 20\)"):
        pulse_errors(half_sines, scaled(half_sines.take(slice(1, None))))
    prediction = scaled(half_sines)
    prediction.contact_time_s[3] = np.nan
    with pytest.raises(ValueError, match=r"contact_time_s of pulse synthetic-000003 \(row 3\)"):
        pulse_errors(half_sines, prediction)
    impulse = half_sines.impulse_n_s.copy()
    impulse[5] = 0.0
    with pytest.raises(ValueError, match="synthetic-000005 has impulse_n_s = 0"):
        pulse_errors(replace(half_sines, impulse_n_s=impulse), scaled(half_sines))
    none = half_sines.take(slice(0, 0))
    with pytest.raises(ValueError, match="at least one"):
        pulse_errors(none, scaled(none))


def test_a_campaign_takes_less_than_a_second() -> None:
    table = pulse_table(np.random.default_rng(0), positions=3)
    began = time.process_time()
    assert len(pulse_errors(table, scaled(table, 1.1))) == 1800
    assert time.process_time() - began < 1.0


PULSE = np.array([[0.0, 30.0, 40.0, 10.0, 0.0]])
TIME = np.array([2e-3])


def test_cost_counts_the_elements_that_are_off() -> None:
    assert pulse_cost(PULSE, TIME, PULSE, TIME)[0] == 0.0
    assert math.isclose(pulse_cost(PULSE, TIME, PULSE + 400.0, TIME)[0], 5.0)
    # Both time vectors begin at zero.
    assert math.isclose(pulse_cost(PULSE, TIME, PULSE, 9 * TIME)[0], 4.0)
    # 0.2 ms late, element i of five by i / 4 of it (sigma 0.1 ms); one force is off by 6 N (sigma 4
    # N).
    force = PULSE + np.array([0.0, 6.0, 0.0, 0.0, 0.0])
    late = [(i / 4 * 2.0) ** 2 / 2 for i in range(5)]
    expected = sum(1 - math.exp(-(late[i] + (1.5**2 / 2 if i == 1 else 0.0))) for i in range(5))
    assert math.isclose(pulse_cost(PULSE, TIME, force, TIME + 0.2e-3)[0], expected, rel_tol=1e-12)
    force, time = PULSE * 1.05, TIME * 1.02
    newtons = pulse_cost(PULSE, TIME, force, time)
    assert np.allclose(
        newtons, pulse_cost(PULSE / 1e3, TIME * 1e3, force / 1e3, time * 1e3), rtol=1e-12
    )


def test_reconstruction_is_the_smoothing_spline_that_smooths_nothing() -> None:
    points = np.random.default_rng(0).standard_normal((3, 20))
    assert np.allclose(reconstruct(points, 191)[:, ::10], points, atol=1e-12)
    points = np.random.default_rng(1).standard_normal(20)
    peer = make_smoothing_spline(np.arange(20.0), points, lam=1e-10)(np.linspace(0, 19, 500))
    assert np.allclose(reconstruct(points[None], 500)[0], peer, atol=1e-6)
    fine = reconstruct(np.sin(np.pi * PHASE)[None])
    assert np.abs(fine[0] - np.sin(np.pi * np.linspace(0, 1, 1000))).max() < 2e-5
    with pytest.raises(ValueError, match="2 points"):
        reconstruct(np.zeros((1, 2)))
