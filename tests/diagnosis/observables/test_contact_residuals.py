"""Pulses side by side: aligned, in newtons, and their spectra."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.diagnosis.observables.contact.stage import ContactObservables, pulse_residuals
from pyroshock.twin.effects import effect
from support.records.contact_campaigns import hammer_record, without

HEAVY = effect("contact.effective_mass", mass_factor=1.3)
RECORD = hammer_record([HEAVY], repetitions=1)


def test_true_effect_leaves_no_residual() -> None:
    found = pulse_residuals(ContactObservables(RECORD), [HEAVY])
    peak = found.measured.max(axis=1, keepdims=True)
    assert np.abs((found.measured - found.simulated) / peak).max() < 0.02


def test_missing_mass_shows_in_time_and_at_low_frequency() -> None:
    found = pulse_residuals(ContactObservables(RECORD))
    assert np.all((found.measured - found.simulated).max(axis=1) > 0.1 * found.measured.max(axis=1))
    ratio = found.spectrum_n_s(found.measured)[:, 0] / found.spectrum_n_s(found.simulated)[:, 0]
    assert ratio == pytest.approx(1.3, rel=5e-3)


def test_pulses_are_aligned_at_half_the_peak() -> None:
    found = pulse_residuals(ContactObservables(RECORD))
    at = int(np.argmin(np.abs(found.time_s)))
    for force in (found.measured, found.simulated):
        assert force[:, at] / force.max(axis=1) == pytest.approx(0.5, abs=0.02)
    assert found.frequency_hz.size == found.spectrum_n_s(found.measured).shape[1]


def test_missing_run_is_nan() -> None:
    found = pulse_residuals(ContactObservables(without(without(RECORD, 0, velocity_m_s=None), 1, force=None)))
    assert np.isnan(found.simulated).all(axis=1).tolist() == [True, False, False, False]
    assert np.isnan(found.measured).all(axis=1).tolist() == [False, True, False, False]


def test_nothing_to_compare_is_refused() -> None:
    silent = replace(RECORD, runs=tuple(replace(run, force=None) for run in RECORD.runs))
    with pytest.raises(ValueError, match="no run has both a recorded force and a velocity"):
        pulse_residuals(ContactObservables(silent))
