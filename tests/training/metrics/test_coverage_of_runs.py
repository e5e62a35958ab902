"""Shares within intervals, and pulses by their run."""

from __future__ import annotations

import numpy as np
from pyroshock.dataset.table import concatenate
from pyroshock.training.evaluation.coverage import LEVELS, coverage
from pyroshock.training.evaluation.pulse_runs import runs_of
from support.records.pulse_tables import pulse_table


def test_normal_errors_lie_within_normal_intervals() -> None:
    # 20,000 errors: five standard errors are 0.018 in the middle.
    assert np.abs(coverage(np.random.default_rng(0).standard_normal(20_000)) - LEVELS).max() < 0.018


def test_runs_of_two_campaigns_stay_apart() -> None:
    tables = [
        pulse_table(np.random.default_rng(0), repetitions=2, campaign=name)
        for name in ("spring", "autumn")
    ]
    runs = runs_of(concatenate(tables))
    assert len(runs) == 120
    assert runs.label[0] == "autumn 1" and runs.label[60] == "spring 1"
    assert runs.member[0] == 60
    table = pulse_table(np.random.default_rng(0), repetitions=2)
    values = np.arange(120.0)
    assert np.array_equal(runs_of(table).mean(values), np.arange(60) * 2 + 0.5)
