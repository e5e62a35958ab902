"""The diagnosis beside simpler ways, on one campaign."""

from __future__ import annotations

import pytest
from pyroshock.validation.baselines import BASELINES

from benchmarks import diagnosing


@pytest.mark.slow
def test_every_simple_way_has_its_time_and_its_answer():
    figures = list(diagnosing.measure_diagnosing(None, campaigns=1, learn_from=0))
    for of in ("time", "quality"):
        assert {f.rival for f in figures if f.of == of and f.value} == set(BASELINES)
    times = [f for f in figures if f.of == "time" and f.value]
    assert all(f.near.median > 0.5 for f in times)
    assert all("of 1 first" in f.ours and "of 1 first" in f.peer for f in figures if f.of == "quality")


def test_kinds_take_turns_and_seeds_repeat():
    case, seed, task = diagnosing.drawn("gun", 0)
    assert (case, seed) == diagnosing.drawn("gun", 0)[:2]
    assert case.kind == "gun" and len(case.strengths) == 1 and task.tier == diagnosing.TIER


def test_kept_rates_are_read_from_the_kept_rows(tmp_path):
    assert "right first 0." in diagnosing.kept_rates()
    assert diagnosing.kept_rates(tmp_path) == "the kept checks are not here"
