"""Sentences of random validations: each is allowed by its rule, none contradicts another, and each
number stands in the table of scores."""

from __future__ import annotations

import re
from typing import Any

from hypothesis import given, settings
from pyroshock.app.operations.sentence import HOLDS, NOT_ENOUGH, TOO_NARROW, TOO_WIDE
from pyroshock.app.operations.validate.validation import score_rows
from pyroshock.app.operations.validate.verdict import (
    NOMINAL,
    is_calibrated,
    joint_interval,
    needed_values,
    quantity_words,
    verdict_sentences,
)
from support.records.random_answers import validations

_NUMBER = re.compile(r"\d+(?:\.\d+)?")


@settings(max_examples=400)
@given(validations())
def test_claims_are_allowed_and_do_not_contradict(data: dict[str, Any]) -> None:
    sentences = verdict_sentences(data)
    rules = [each.rule for each in sentences]
    assert all(each.rule.allows(**each.evidence) for each in sentences if each.rule is not None)
    intervals = [joint_interval(row, len(data["quantities"])) for row in data["quantities"]]
    assert is_calibrated(data) == (TOO_NARROW not in rules)
    assert is_calibrated(data) == all(high >= NOMINAL for _, high in intervals)
    assert not {TOO_NARROW} & set(rules) or not {HOLDS, TOO_WIDE, NOT_ENOUGH} & set(rules)
    if HOLDS in rules:
        held = [
            row
            for row, (low, high) in zip(data["quantities"], intervals, strict=True)
            if low <= NOMINAL <= high
            and int(row["effective_values"]) >= needed_values(len(intervals))
        ]
        (sentence,) = [each for each in sentences if each.rule is HOLDS]
        others = [row for row in data["quantities"] if row not in held]
        assert held
        assert not others or all(quantity_words(row["name"]) in sentence.text for row in held)
        assert not any(quantity_words(row["name"]) in sentence.text for row in others)
    else:
        assert not is_calibrated(data) or {TOO_WIDE, NOT_ENOUGH} & set(rules)


@given(validations())
def test_every_number_stands_in_the_table(data: dict[str, Any]) -> None:
    cells = {str(value) for row in score_rows(data) for value in row.values()}
    needed = str(needed_values(len(data["quantities"])))
    for sentence in verdict_sentences(data):
        for number in sentence.numbers:
            assert str(number) in cells, f"{number} of {sentence}"
        text = sentence.text
        for row in data["quantities"]:
            text = re.sub(re.escape(quantity_words(row["name"])), "", text, flags=re.IGNORECASE)
        stated = {"90", needed} | {n for cell in map(str, sentence.numbers) for n in _found(cell)}
        assert set(_found(text)) <= stated, f"{text}: {stated}"


def _found(text: str) -> list[str]:
    return _NUMBER.findall(text)
