"""Figures of measured records are those of a reckoning that shares nothing with the product."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from benchmarks.independent_figures import (
    LIMITS,
    VARIABLE,
    Record,
    deviations,
    further_records,
    reckoned_pulse,
    shipped_records,
)
from benchmarks.quality_scores import WRONG_TESTS, impact_tests, judge


def test_reckoning_of_a_half_sine_is_its_closed_form():
    force = np.zeros(5000)
    force[2000:2501] = 100.0 * np.sin(np.pi * np.arange(501) / 500)
    figures = reckoned_pulse(force, 1.25e6)
    assert figures["peak"] == pytest.approx(100.0)
    assert figures["half width"] == pytest.approx(0.4e-3 * 2 / 3, rel=1e-3)
    assert figures["impulse"] == pytest.approx(2 / np.pi * 100.0 * 0.4e-3, rel=1e-3)


def beyond(records: list[Record]) -> dict[str, dict[str, float]]:
    """Figures that deviate by more than their limit, by record."""
    far = {
        record.name: {name: value for name, value in deviations(record).items() if value > LIMITS[name]}
        for record in records
    }
    return {name: figures for name, figures in far.items() if figures}


def test_figures_of_measured_records_are_the_reckoned_ones(real_data: Path):
    records = list(shipped_records(real_data))
    assert len(records) == 40
    assert beyond(records) == {}


@pytest.fixture
def further() -> Path:
    if VARIABLE not in os.environ:
        pytest.skip(f"{VARIABLE} names no folder of further records")
    return Path(os.environ[VARIABLE])


def test_figures_of_further_records_are_the_reckoned_ones(further: Path):
    wrong = tuple(f"Test_{number}" for number in WRONG_TESTS)
    assert beyond([record for record in further_records(further) if not record.name.startswith(wrong)]) == {}


def test_records_that_their_authors_call_wrong_are_rejected_and_no_others(further: Path):
    records = list(impact_tests(further))
    if not records:
        pytest.skip("the folder holds no Test_0*.lvm")
    assert {record.kind for record in records if judge(record)[0] != record.verdict} == set()
