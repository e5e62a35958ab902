"""Sentences of random searches: each is allowed by its rule, all are about one setting, and each
number stands in a table of the answer."""

from __future__ import annotations

import re
from typing import Any

from hypothesis import given
from pyroshock.app.common.number_format import percent
from pyroshock.app.common.quantities import cell
from pyroshock.app.operations.sentence import FALLS_SHORT, REACHES
from pyroshock.app.operations.tune.verdict import (
    answer_sentences,
    best_proposal,
    best_sentences,
    drawn_share,
    next_steps,
    proposal_row,
    tuning_sentences,
    tuning_tables,
)
from support.records.random_answers import OBSTACLE, searches

_NUMBER = re.compile(r"\d+(?:\.\d+)?")


@given(searches())
def test_claims_are_allowed_and_do_not_contradict(data: dict[str, Any]) -> None:
    sentences = [*tuning_sentences(data), *next_steps(data)]
    assert all(each.rule.allows(**each.evidence) for each in sentences if each.rule is not None)
    answer, *further = answer_sentences(data)
    meets = any(
        row["probability_met"] >= data["attainability"]["at_least"] for row in data["proposals"]
    )
    assert (answer.rule is REACHES) == meets
    assert ("No setting meets" in answer.text) != meets
    assert [each.text for each in further] == ([] if meets else [OBSTACLE])
    scatter = [each for each in sentences if "scatter by" in each.text]
    assert all(each.rule is FALLS_SHORT for each in scatter)


@given(searches())
def test_all_sentences_are_about_one_setting(data: dict[str, Any]) -> None:
    required = data["attainability"]["at_least"]
    best = next(
        (row for row in data["proposals"] if row["probability_met"] >= required),
        next(iter(data["proposals"]), None),
    )
    assert best_proposal(data) is best
    if best is None:
        assert best_sentences(data) == []
        return
    row = proposal_row(best, data)
    assert row["target met"] == percent(drawn_share(best["probability_met"]))
    answer, *_ = answer_sentences(data)
    met = [number for number in answer.numbers if number.key == "probability"][:1]
    if "slightly less" not in answer.text:
        assert [number.cell for number in met] == [row["target met"]]
    of_row = {text for key, value in row.items() for text in (_cell(key, value),)}
    for sentence in best_sentences(data):
        assert {number.cell for number in sentence.numbers} <= of_row


@given(searches())
def test_every_number_stands_in_a_table(data: dict[str, Any]) -> None:
    cells = {
        _cell(key, value)
        for table in tuning_tables(data)
        for row in table.rows
        for key, value in row.items()
    }
    for sentence in [*tuning_sentences(data), *next_steps(data)]:
        for number in sentence.numbers:
            assert number.cell in cells, f"{number} of {sentence}"
        stated = {n for number in sentence.numbers for n in _NUMBER.findall(str(number))}
        assert set(_NUMBER.findall(sentence.text)) <= {"90", "1"} | stated, sentence.text


def _cell(key: str, value: Any) -> str:
    return value if isinstance(value, str) else cell(key, value)
