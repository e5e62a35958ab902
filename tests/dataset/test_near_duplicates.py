"""Copies of a pulse do not straddle a split: a model would be judged on what it has learned."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.dataset.table import PulseTable, concatenate, first_copies, split_of
from support.records.pulse_tables import pulse_table


def copied(table: PulseTable, factor: float) -> PulseTable:
    """Times and forces times a factor, under other keys, runs and configurations."""
    figures = ("force_n", "contact_time_s", "peak_force_n", "impulse_n_s")
    values = {name: getattr(table, name) * factor for name in figures}
    names = np.array([f"copy-{name}" for name in table.configuration])
    keys = np.array([f"copy-{key}" for key in table.key])
    return replace(
        table, **values, configuration=names, treatment=names, key=keys, run=table.run + 1000
    )


@pytest.mark.parametrize("text", ["repetitions", "configurations", "treatments"])
def test_copies_are_on_one_side(text: str) -> None:
    table = pulse_table(np.random.default_rng(4), repetitions=4)
    both = concatenate([table, copied(table, 1 + 1e-7)])
    split = split_of(both, text)
    held_out = np.zeros(len(both), dtype=bool)
    held_out[split.test] = True
    np.testing.assert_array_equal(held_out[: len(table)], held_out[len(table) :])
    assert 0.1 < held_out.mean() < 0.3


def test_measured_repetitions_are_no_copies() -> None:
    table = pulse_table(np.random.default_rng(4), repetitions=4, noise=1e-4)
    np.testing.assert_array_equal(first_copies(table), np.arange(len(table)))
    np.testing.assert_array_equal(
        first_copies(concatenate([table, copied(table, 1.001)])), np.arange(2 * len(table))
    )


def test_many_pulses_take_little_time() -> None:
    table = pulse_table(np.random.default_rng(4), repetitions=40)
    begin = time.process_time()
    first_copies(concatenate([table, copied(table, 1 + 1e-7)]))
    assert time.process_time() - begin < 5
