"""Field case 42: the contact time of all hits is 25 samples. Models train without warnings, and the
band of the time is no narrower than a sample."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.dataset.table import PulseTable
from pyroshock.training.models.catalogue import BuildOptions, entry_of
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
    inside = (
        np.abs(table.contact_time_s - answer.contact_time_s) <= 1.645 * answer.contact_time_spread_s
    )
    assert inside.all()
