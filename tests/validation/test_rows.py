"""What was really wrong, and what was said, in the words in which they are compared."""

from __future__ import annotations

import pytest
from pyroshock.validation.case_results import CaseAnswer
from support.records.blind_rows import DRAG, LAYER, LEAK, label, stranger, verdict


def test_group_s_probability_is_split_between_its_labels() -> None:
    answer = CaseAnswer.of("c", verdict(([LEAK, DRAG], 0.8, [0.25, 0.75]), (["none"], 0.2, None)))
    assert answer.labels == (DRAG, LEAK, "none")
    assert answer.probabilities == pytest.approx({LEAK: 0.2, DRAG: 0.6, "none": 0.2})


def test_group_without_split_is_shared_evenly() -> None:
    answer = CaseAnswer.of("c", verdict(([LEAK, DRAG], 1.0, None)))
    assert answer.probabilities == pytest.approx({LEAK: 0.5, DRAG: 0.5})


def test_pairs_are_the_same_in_either_order() -> None:
    answer = CaseAnswer.of("c", verdict(([f"{LEAK}+{LAYER}"], 1.0, None)))
    assert answer.labels == (label(LEAK, LAYER).key,) == (label(LAYER, LEAK).key,)


def test_truths_have_the_words_of_a_report() -> None:
    assert (label().key, label(LEAK).key, stranger().key) == ("none", LEAK, "unknown")


@pytest.mark.parametrize(("size", "accepted"), [(0.9, {LEAK, "none"}), (1.1, {LEAK})])
def test_gap_within_tolerance_is_none_too(size: float, accepted: set[str]) -> None:
    assert label(LEAK, gap_in_tolerances=size).accepted == accepted


def test_only_shrinkage_by_configuration_is_scored() -> None:
    held = [{"held_out_by": "corner: tank_pressure_bar > 2", "fraction": 0.1}]
    held += [{"held_out_by": "configuration", "fraction": 0.9}]
    shrinkage = CaseAnswer.of("c", verdict((["none"], 1.0, None), shrinkage=held)).shrinkage
    assert shrinkage is not None
    assert shrinkage["fraction"] == 0.9
