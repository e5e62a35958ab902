"""Sentences of random searches: each is allowed by its rule, all are about one setting, and each
number stands in a table of the answer."""

from __future__ import annotations

import re
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
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

LINES = [100.0, 1000.0, 10_000.0]
SHARES = st.sampled_from((0.0, 0.0149, 0.015, 0.4975, 0.5, 0.995, 1.0)) | st.floats(0.0, 1.0)
DECIBELS = st.floats(-40.0, 40.0).map(lambda value: round(value, 6))
LEVELS = st.lists(st.floats(1.0, 1e6), min_size=3, max_size=3)
OBSTACLE = "The shape stands in the way."
_NUMBER = re.compile(r"\d+(?:\.\d+)?")


@st.composite
def proposals(draw: st.DrawFn) -> dict[str, Any]:
    settings = {
        "tank_pressure_pa": draw(st.floats(2e4, 8e5)),
        "bullet_mass_kg": draw(st.floats(0.05, 2.0)),
        "tip_material": draw(st.sampled_from(("steel", "PLA"))),
        "tip_radius_m": draw(st.floats(0.01, 0.1)),
        "plate_material": "aluminum",
        "anvil_material": draw(st.sampled_from(("none", "steel"))),
        "insulator": draw(st.sampled_from(("none", "felt"))),
        "impact_position": "#A",
    }
    has_edge = draw(st.booleans())
    return {
        "settings": settings,
        "probability_met": draw(SHARES),
        "probability_within": draw(SHARES),
        "probability_95_percent_within": draw(SHARES),
        "share_within": draw(SHARES),
        "worst_margin_db": draw(DECIBELS) if has_edge else None,
        "worst_frequency_hz": draw(st.sampled_from(LINES)),
        "expected_m_s2": draw(LEVELS),
        "alternatives": [],
    }


@st.composite
def searches(draw: st.DrawFn) -> dict[str, Any]:
    rows = draw(st.lists(proposals(), max_size=4))
    required = draw(st.sampled_from((0.5, 1.0)) | st.floats(0.001, 1.0))
    meeting = sum(row["probability_met"] >= required for row in rows)
    obstacle = {
        "kind": draw(st.sampled_from(("shape", "tolerance", "measured shots"))),
        "sentence": OBSTACLE,
        "probability_without": draw(SHARES),
        "frequency_hz": draw(st.sampled_from(LINES)),
        "margin_db": draw(DECIBELS),
        "limits": [],
        "shot_scatter_db": draw(st.none() | st.floats(0.1, 5.0)),
    }
    return {
        "draws": draw(st.none() | st.integers(20, 1000)),
        "attainability": {
            "meets": bool(meeting),
            # older software has called the largest of all the best
            "probability": max((row["probability_met"] for row in rows), default=0.0),
            "at_least": required,
            "meeting": meeting,
            "lines": "every line of the next shot lies within tolerance",
            "obstacle": None if meeting else obstacle,
        },
        "proposals": [{"rank": rank, **row} for rank, row in enumerate(rows, 1)],
        "avoid": [],
        "frequency_hz": LINES,
        "prescribed_m_s2": draw(LEVELS),
    }


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
