"""Figures of benches on which many effects act, on rows whose figures are known."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from pyroshock.validation.bench_figures import Quantile, bench_figures, bench_tables, bench_text
from pyroshock.validation.case_results import CaseAnswer, CaseResult, WithheldTruth
from pyroshock.validation.report import Pool
from pyroshock.validation.tally import kinds, tables

VALVE, LEAK, GAIN = "gun.valve_flow", "gun.blow_by", "sensor.velocity_gain"
TRUE = {VALVE: 0.7, LEAK: 0.3}


def row(*causes: list[str], fraction: float | None = 0.8, **other: Any) -> CaseResult:
    """A bench with a valve and a leak, and a diagnosis whose entries are `causes`."""
    label = WithheldTruth(
        "a",
        "realistic",
        "gun",
        (VALVE, LEAK),
        shares=TRUE,
        shapley={VALVE: 0.6, LEAK: 0.4},
        shown=(VALVE, LEAK, GAIN),
    )
    probabilities = [0.9, *[0.1] * (len(causes) - 1)]
    held = {"held_out_by": "configuration", "fraction": fraction}
    verdict = {
        "causes": [
            {"effects": c, "probability": p} for c, p in zip(causes, probabilities, strict=True)
        ],
        "shrinkage": [] if fraction is None else [held],
    }
    return CaseResult(label, CaseAnswer.of("a", {**verdict, **other}))


def test_first_entry_names_and_only_its_first_alternative_accuses() -> None:
    figures = bench_figures("x", [row([f"{LEAK}+{VALVE}"])])
    assert (figures.largest_named.value, figures.large_named.value, figures.all_named.value) == (
        1.0,
        1.0,
        1.0,
    )
    assert figures.off_named.value == 0.0
    assert bench_figures("x", [row([GAIN, VALVE])]).largest_named.value == 1.0
    assert bench_figures("x", [row([VALVE, GAIN])]).off_named.value == 0.0
    assert bench_figures("x", [row([f"{VALVE}+{GAIN}"])]).off_named.value == 1.0
    figures = bench_figures("x", [row(["unknown"], [VALVE])])
    assert (figures.largest_named.value, figures.one_named.value, figures.unknown_first.value) == (
        0.0,
        0.0,
        1.0,
    )


def test_what_is_missing_counts_as_nothing() -> None:
    assert bench_figures("x", [row([VALVE], fraction=None)]).fraction.value == 0.0
    lost = CaseResult(row([VALVE]).label, CaseAnswer("a", error="out of time"))
    figures = bench_figures("x", [lost])
    assert (figures.fraction.value, figures.largest_named.value) == (0.0, 0.0)
    figures = bench_figures("x", [row([VALVE])])
    assert figures.shares_error == pytest.approx(0.5)
    assert figures.shares_held.value == 0.0


def test_shares_are_compared_with_the_truth() -> None:
    said = [
        {"effect": VALVE, "share": 0.6, "ci90": [0.5, 0.75]},
        {"effect": GAIN, "share": 0.4, "ci90": [0.1, 0.6]},
    ]
    figures = bench_figures("x", [row([VALVE], effects=said)])
    assert figures.shares_error == pytest.approx((0.1 + 0.3 + 0.4) / 3)
    assert figures.shapley_error == pytest.approx((0.0 + 0.4 + 0.4) / 3)
    assert figures.shares_held.hits == 1
    values = np.random.default_rng(1).normal(size=200)
    middle = Quantile.of(values.tolist(), 50)
    assert middle.low < middle.value < middle.high
    assert middle.high - middle.low == pytest.approx(2 * 1.96 * 1.2533 / math.sqrt(200), rel=0.3)


@pytest.mark.parametrize(("naive", "below"), [(0.81, 1.0), (0.83, 0.0)])
def test_answer_below_the_naive_fit_is_counted(naive: float, below: float) -> None:
    assert bench_figures("x", [row([VALVE], naive=naive)]).at_least_naive.value == below


def test_table_has_a_column_for_each_kind() -> None:
    text = bench_text(bench_tables([row([VALVE])], ("realistic", "foreign one")))
    assert "realistic" in text
    assert "foreign" not in text
    assert bench_text(()) == ""
    rows = [row([VALVE])]
    pool = Pool((), tables(rows), kinds(rows), bench_tables(rows, ("realistic",)))
    assert "fraction held out" in pool.text()
    assert pool.as_json()["benches"][0]["fraction"]["value"] == 0.8
