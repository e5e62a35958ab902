"""Bands of random pulses on configurations that neither the model nor its calibration has seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pyroshock.training.estimators.linear import LinearPowers
from pyroshock.training.evaluation.unseen_configurations import unseen_draws, unseen_scores
from pyroshock.training.models.calibrated import Calibrated
from pyroshock.training.models.single_pass import SinglePass
from support.records.pulse_tables import pulse_table


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
        restored.predict(table.inputs).log_spread,
        again.predict(table.inputs).log_spread,
        rtol=1e-12,
    )


def test_impulses_of_a_hand_that_pushes_are_within_the_bands() -> None:
    """Impulses above two momenta were cut off at two, and half of them lay outside of the bands."""
    table = pulse_table(np.random.default_rng(2), repetitions=2)
    pushed = replace(
        table,
        force_n=1.4 * table.force_n,
        peak_force_n=1.4 * table.peak_force_n,
        impulse_n_s=1.4 * table.impulse_n_s,
    )
    model = Calibrated(SinglePass(LinearPowers())).fit(pushed, np.random.default_rng(0))
    draws = unseen_draws(model, pushed)
    scores = unseen_scores(pushed, {"a": draws, "b": draws}, np.random.default_rng(0))
    assert ((scores.inside[0].mean(axis=0) > 0.85) & (scores.inside[0].mean(axis=0) < 0.97)).all()
