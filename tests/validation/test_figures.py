"""What was really wrong and what was said, in the same words, and scores of answers whose results
are known."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.twin.effects import catalogue
from pyroshock.validation.answer_sets import (
    Rate,
    brier,
    calibration_error,
    f1,
    label_set,
    negative_log,
    wilson,
)
from pyroshock.validation.case_results import CaseAnswer, CaseResult, stages_of
from pyroshock.validation.metrics import auroc, figures, found_above, threshold_at
from support.records.blind_rows import DRAG, LAYER, LEAK, label, says, stranger, verdict


def test_wilson_is_the_published_one() -> None:
    # Newcombe, Stat. Med. 17 (1998) 857, Table I: 81 of 263, 15 of 148, 0 of 20, 1 of 29.
    assert wilson(81, 263) == pytest.approx((0.2553, 0.3662), abs=1e-4)
    assert wilson(15, 148) == pytest.approx((0.0624, 0.1605), abs=1e-4)
    assert wilson(0, 20) == pytest.approx((0.0, 0.1611), abs=1e-4)
    assert wilson(1, 29) == pytest.approx((0.0061, 0.1718), abs=1e-4)
    assert Rate.of([]).as_json() == {"value": None, "low": 0.0, "high": 1.0, "n": 0}


def test_auroc_and_recall_of_known_ranks() -> None:
    assert auroc([0.9, 0.8], [0.1, 0.2]) == 1.0
    assert auroc([0.1], [0.9, 0.2]) == 0.0
    assert auroc([0.5], [0.5, 0.5]) == 0.5
    assert auroc([0.4, 0.8], [0.3, 0.6]) == 0.75
    assert math.isnan(auroc([], [0.5]))
    least = threshold_at(0.05, [i / 100 for i in range(100)])
    assert found_above([0.94, 0.941, 0.99], least) == [False, True, True]


@given(st.lists(st.integers(0, 9), min_size=1), st.lists(st.integers(0, 9), min_size=1))
def test_auroc_is_the_share_of_pairs_in_order(these: list[int], others: list[int]) -> None:
    pairs = [(a > b) + 0.5 * (a == b) for a in these for b in others]
    assert auroc([float(a) for a in these], [float(b) for b in others]) == pytest.approx(
        sum(pairs) / len(pairs)
    )


@given(st.lists(st.floats(0, 1), min_size=1, max_size=200))
def test_no_more_false_ones_than_allowed(others: list[float]) -> None:
    least = threshold_at(0.05, others)
    assert sum(found_above(others, least)) <= 0.05 * len(others)


def test_calibration_error_is_how_far_one_is_off() -> None:
    assert calibration_error(np.full(10, 0.9), np.arange(10) < 6) == pytest.approx(0.3)
    assert calibration_error(np.array([0.25, 0.95]), np.array([False, True])) == pytest.approx(0.15)
    rng = np.random.default_rng(1)
    p = rng.uniform(size=40_000)
    assert calibration_error(p, rng.uniform(size=p.size) < p) < 0.01


def test_nll_brier_and_smallest_set_of_known_answers() -> None:
    rows = [says(label(LEAK), {LEAK: 0.5, "none": 0.5}), says(label(LEAK), {LEAK: 1.0})]
    assert negative_log(rows) == pytest.approx(math.log(2) / 2)
    assert brier(rows) == pytest.approx((0.25 + 0.25) / 2)
    assert label_set({"a": 0.5, "b": 0.05, "c": 0.45}) == ("a", "c")
    assert label_set({"a": 0.9, "b": 0.1}) == ("a",)
    assert label_set({}) == ()


def test_first_label_group_and_two() -> None:
    answer = CaseAnswer.of(
        "c", verdict(([LEAK, DRAG], 0.7, [0.6, 0.4]), ([LAYER], 0.2, None), (["none"], 0.1, None))
    )
    labels = [label(effect_id) for effect_id in (LEAK, DRAG, LAYER, "gun.valve_flow")]
    case_figures = figures("t", [CaseResult(truth, answer) for truth in labels])
    entries = (
        case_figures.first,
        case_figures.first_group,
        case_figures.first_two,
        case_figures.first_two_groups,
    )
    hits = [entry.hits for entry in entries]
    assert hits == [1, 2, 2, 3]
    assert case_figures.first.n == 4
    assert case_figures.group_size == 2
    truth = label(LEAK, LAYER)
    answers = [f"{LAYER}+{LEAK}", f"{LEAK}+{DRAG}", LAYER, DRAG]
    tier_figures = figures("t", [says(truth, {named_causes: 1.0}) for named_causes in answers])
    assert (tier_figures.both, tier_figures.at_least_one) == (Rate(1, 4), Rate(3, 4))


def test_none_is_right_within_tolerance_and_a_false_alarm_without_effect() -> None:
    # It is no single effect to be found, and no false alarm either; its probability counts as
    # right.
    case_figures = figures(
        "t", [says(label(LEAK, gap_in_tolerances=0.5), {"none": 0.9, DRAG: 0.1})]
    )
    assert (case_figures.first.n, case_figures.false_alarms.n, case_figures.covered.hits) == (
        0,
        0,
        1,
    )
    assert case_figures.mistaken == ()
    rows = [
        says(label(), {"none": 0.7, LEAK: 0.3}),
        says(label(), {"unknown": 1.0}),
        says(label(LEAK), {DRAG: 1.0}),
    ]
    assert figures("t", rows).false_alarms == Rate(1, 2)


def test_unknown_effects_rank_above_the_others() -> None:
    rows = [says(stranger(), {"unknown": p, LEAK: 1 - p}) for p in (0.9, 0.4)]
    rows += [says(label(LEAK), {"unknown": p, LEAK: 1 - p}) for p in (0.1, 0.3)]
    found = figures("t", rows).unknown
    assert (found.auroc, found.declared, found.wrongly) == (1.0, Rate(1, 2), Rate(0, 2))
    answer = CaseAnswer("c", stages=("contact", "gun"))
    rows = [
        CaseResult(label(LAYER, stages=("contact",)), answer),
        CaseResult(label(LEAK, stages=("gun",)), answer),
    ]
    assert figures("t", rows).stage == Rate(1, 2)
    rows = [
        says(label(LAYER, stages=("contact",)), {cause: 1.0})
        for cause in (LAYER, "sensor.force_gain", LEAK, "none")
    ]
    assert figures("t", rows).stage == Rate(2, 4)


def test_figures_of_crashes_and_of_nothing_are_json() -> None:
    crash = CaseAnswer("c", error="ValueError: it broke")
    rows = [
        CaseResult(truth, crash) for truth in (label(), label(LEAK), label(LEAK, LAYER), stranger())
    ]
    found = figures("t", rows)
    assert found.errors == ("c: ValueError: it broke",) * 4
    assert (found.first, found.first_group, found.first_two, found.first_two_groups) == (
        Rate(0, 1),
    ) * 4
    assert (found.false_alarms, found.both, found.at_least_one) == (
        Rate(1, 1),
        Rate(0, 1),
        Rate(0, 1),
    )
    assert (found.unknown.declared, found.covered, found.stage.hits) == (Rate(0, 1), Rate(0, 4), 0)
    assert found.confusion["none"] == {"no answer": 1}
    assert found.reliability.nll == pytest.approx(-math.log(1e-6))
    for rows in ([], [says(label(LEAK), {LEAK: 1.0})]):
        json.dumps(figures("t", rows).as_json(), allow_nan=False)


def test_region_and_shrinkage_are_scored_where_the_effect_has_one() -> None:
    here = label(LAYER, inside=(0, 1, 2, 3))
    rows = [
        CaseResult(here, CaseAnswer("c", inside=((0, 1),))),
        CaseResult(here, CaseAnswer("c")),
        CaseResult(label(LEAK), CaseAnswer("c", inside=((0,),))),
    ]
    found = figures("t", rows)
    assert (found.region_f1, found.regions) == (pytest.approx((2 / 3 + 0) / 2), 2)
    answers = [
        CaseAnswer("c", shrinkage={"fraction": f, "ci90": [0.5, 0.8]}) for f in (0.8, 0.6, None)
    ]
    truths = (0.8, 0.8, 0.8)
    rows = [
        CaseResult(label(LEAK), s, {"fraction": f, "true_fraction": 0.7})
        for s, f in zip(answers, truths, strict=True)
    ]
    shrinkage = figures(
        "t", [*rows, CaseResult(label(LEAK), answers[0], {"fraction": None})]
    ).shrinkage
    assert (shrinkage.ratio_median, shrinkage.n) == (pytest.approx(0.75), 3)
    assert shrinkage.covered == Rate(3, 3)


@given(st.sets(st.integers(0, 20)), st.sets(st.integers(0, 20), min_size=1))
def test_f1_is_one_only_for_the_same_set(named: set[int], true: set[int]) -> None:
    assert (f1(named, true) == 1.0) == (named == true)
    assert 0 <= f1(named, true) <= 1


@pytest.mark.parametrize("effect", catalogue())
def test_every_effect_has_its_stage(effect: str) -> None:
    assert set(stages_of(effect)) <= {"gun", "contact", "plate"}
    assert stages_of(effect)


def test_shuffled_labels_give_chance() -> None:
    """Right answers to other cases: one in five is right by luck, and the ranks tell nothing."""
    rng = np.random.default_rng(2)
    truths = [stranger() if i % 5 == 0 else label(list(catalogue())[i % 5]) for i in range(2000)]
    answers = [{t.key: 0.9, "none": 0.1} for t in truths]
    order = rng.permutation(len(truths))
    right = figures("t", [says(t, a) for t, a in zip(truths, answers, strict=True)])
    shuffled = figures("t", [says(t, answers[i]) for t, i in zip(truths, order, strict=True)])
    assert (right.first.value, right.unknown.auroc) == (1.0, 1.0)
    assert shuffled.first.value == pytest.approx(0.2, abs=0.04)
    assert shuffled.unknown.auroc == pytest.approx(0.5, abs=0.04)
    assert shuffled.reliability.ece > 0.6


def test_group_s_probability_is_split_between_its_labels() -> None:
    answer = CaseAnswer.of("c", verdict(([LEAK, DRAG], 0.8, [0.25, 0.75]), (["none"], 0.2, None)))
    assert answer.labels == (DRAG, LEAK, "none")
    assert answer.probabilities == pytest.approx({LEAK: 0.2, DRAG: 0.6, "none": 0.2})
    answer = CaseAnswer.of("c", verdict(([LEAK, DRAG], 1.0, None)))
    assert answer.probabilities == pytest.approx({LEAK: 0.5, DRAG: 0.5})
    answer = CaseAnswer.of("c", verdict(([f"{LEAK}+{LAYER}"], 1.0, None)))
    assert answer.labels == (label(LEAK, LAYER).key,) == (label(LAYER, LEAK).key,)
    assert (label().key, label(LEAK).key, stranger().key) == ("none", LEAK, "unknown")
    held = [{"held_out_by": "corner: tank_pressure_bar > 2", "fraction": 0.1}]
    held += [{"held_out_by": "configuration", "fraction": 0.9}]
    shrinkage = CaseAnswer.of("c", verdict((["none"], 1.0, None), shrinkage=held)).shrinkage
    assert shrinkage["fraction"] == 0.9


@pytest.mark.parametrize(("size", "accepted"), [(0.9, {LEAK, "none"}), (1.1, {LEAK})])
def test_gap_within_tolerance_is_none_too(size: float, accepted: set[str]) -> None:
    assert label(LEAK, gap_in_tolerances=size).accepted == accepted
