"""Bands of random pulses on configurations that neither the model nor its calibration has seen."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.dataset.table import PulseTable
from pyroshock.training.estimators.linear import LinearPowers
from pyroshock.training.evaluation.unseen_configurations import unseen_draws, unseen_scores
from pyroshock.training.models.calibrated import Calibrated
from pyroshock.training.models.catalogue import BuildOptions, entry_of
from pyroshock.training.models.single_pass import SinglePass
from support.records.pulse_tables import pulse_table

SAMPLE_S = 1 / 51_200


def constant_target() -> PulseTable:
    """48 hits and more whose contact lasts 25 samples, all of them (field case 42)."""
    table = pulse_table(np.random.default_rng(0), repetitions=1)
    n = len(table)
    return replace(table, contact_time_s=np.full(n, 25 * SAMPLE_S), sample_s=np.full(n, SAMPLE_S))


@pytest.mark.parametrize("name", ["linear", "svr", "coregional-gp"])
def test_band_of_a_constant_time_is_no_narrower_than_a_sample(name: str) -> None:
    table = constant_target()
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        model = entry_of(name).make(BuildOptions()).fit(table, np.random.default_rng(0))
        answer = model.predict(table.inputs)
    assert answer.contact_time_spread_s is not None and answer.log_spread is not None
    assert (2 * 1.645 * answer.contact_time_spread_s >= SAMPLE_S).all()
    assert (2 * 1.645 * answer.log_spread[:, 1] * answer.contact_time_s >= 0.999 * SAMPLE_S).all()
    inside = np.abs(table.contact_time_s - answer.contact_time_s) <= 1.645 * answer.contact_time_spread_s
    assert inside.all()


def test_refitted_bands_forget_the_configurations_that_are_left_out() -> None:
    """The quantities that widen a band are those of the other configurations alone."""
    table = pulse_table(np.random.default_rng(1), repetitions=2)
    model = Calibrated(SinglePass(LinearPowers())).fit(table, np.random.default_rng(0))
    names = np.unique(table.configuration)
    others = table.take(~np.isin(table.configuration, names[:12]))
    again = model.relearn(others, np.random.default_rng(0))
    assert model.unseen_ is not None and again.unseen_ is not None
    assert set(again.unseen_.configuration) == set(names[12:])
    assert len(again.difficulty_[0].x) == len(others)
    restored = Calibrated(SinglePass(LinearPowers())).restore(again.arrays())
    np.testing.assert_allclose(
        restored.predict(table.inputs).log_spread, again.predict(table.inputs).log_spread, rtol=1e-12
    )


def test_impulses_of_a_hand_that_pushes_are_within_the_bands() -> None:
    """Impulses above two momenta were cut off at two, and half of them lay outside of the bands."""
    table = pulse_table(np.random.default_rng(2), repetitions=2)
    pushed = replace(
        table, force_n=1.4 * table.force_n, peak_force_n=1.4 * table.peak_force_n, impulse_n_s=1.4 * table.impulse_n_s
    )
    model = Calibrated(SinglePass(LinearPowers())).fit(pushed, np.random.default_rng(0))
    draws = unseen_draws(model, pushed)
    scores = unseen_scores(pushed, {"a": draws, "b": draws}, np.random.default_rng(0))
    assert ((scores.inside[0].mean(axis=0) > 0.85) & (scores.inside[0].mean(axis=0) < 0.97)).all()
