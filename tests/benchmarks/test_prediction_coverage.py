"""The measurement of the bands in a reduced form: one bench, one quick model, and pairs of equal
models."""

from __future__ import annotations

import pytest

from benchmarks.prediction_coverage import coverage_rows, promotions_by_chance


@pytest.mark.slow
def test_bands_of_a_quick_model_hold_on_fresh_configurations() -> None:
    rows = list(coverage_rows([1], models=("ensemble",), benches=1, configurations=24, fresh=30))
    assert [row.model for row in rows] == ["ensemble"]
    assert all(0.7 <= share <= 1.0 for share in rows[0].coverage)


@pytest.mark.slow
def test_equal_models_are_seldom_promoted() -> None:
    assert promotions_by_chance(20, 3, models=("tree",)).count("better") <= 3
