"""Verdicts on records whose faults are known, and figures of measured records beside an independent
calculation."""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from support.records.labelled_records import KINDS, made_records

from benchmarks.independent_figures import (
    LIMITS,
    VARIABLE,
    Record,
    calculated_pulse,
    deviations,
    further_records,
    shipped_records,
)
from benchmarks.quality_scores import WRONG_TESTS, impact_tests, judge


def test_calculation_of_a_half_sine_is_its_closed_form():
    force = np.zeros(5000)
    force[2000:2501] = 100.0 * np.sin(np.pi * np.arange(501) / 500)
    figures = calculated_pulse(force, 1.25e6)
    assert figures["peak"] == pytest.approx(100.0)
    assert figures["half width"] == pytest.approx(0.4e-3 * 2 / 3, rel=1e-3)
    assert figures["impulse"] == pytest.approx(2 / np.pi * 100.0 * 0.4e-3, rel=1e-3)


def beyond(records: list[Record]) -> dict[str, dict[str, float]]:
    """Figures that deviate by more than their limit, by record."""
    far = {
        record.name: {
            name: value for name, value in deviations(record).items() if value > LIMITS[name]
        }
        for record in records
    }
    return {name: figures for name, figures in far.items() if figures}


def test_figures_of_measured_records_are_the_calculated_ones(real_data: Path):
    records = list(shipped_records(real_data))
    assert len(records) == 40
    assert beyond(records) == {}


@pytest.fixture
def further() -> Path:
    if VARIABLE not in os.environ:
        pytest.skip(f"{VARIABLE} names no folder of further records")
    return Path(os.environ[VARIABLE])


def test_figures_of_further_records_are_the_calculated_ones(further: Path):
    wrong = tuple(f"Test_{number}" for number in WRONG_TESTS)
    assert (
        beyond([record for record in further_records(further) if not record.name.startswith(wrong)])
        == {}
    )


def test_records_that_their_authors_call_wrong_are_rejected_and_no_others(further: Path):
    records = list(impact_tests(further))
    if not records:
        pytest.skip("the folder holds no Test_0*.lvm")
    assert {record.kind for record in records if judge(record)[0] != record.verdict} == set()


@pytest.fixture(scope="module")
def verdicts() -> Counter[tuple[str, str]]:
    """(deserved, given) of 336 made records."""
    return Counter((record.verdict, judge(record)[0]) for record in made_records(seed=5, each=12))


def test_labelled_set_is_large_and_varied(verdicts):
    assert sum(verdicts.values()) >= 300 and sum(map(len, KINDS.values())) == 28


@pytest.mark.parametrize(
    ("verdict", "precision", "recall"), [("reject", 0.98, 0.95), ("warning", 0.8, 0.8)]
)
def test_verdicts_are_right_and_complete(verdicts, verdict, precision, recall):
    right = verdicts[verdict, verdict]
    given = sum(count for (_, verdict_given), count in verdicts.items() if verdict_given == verdict)
    deserved = sum(count for (label, _), count in verdicts.items() if label == verdict)
    assert right / given >= precision
    assert right / deserved >= recall
