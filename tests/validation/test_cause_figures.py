"""What a reader acts on, scored on answers made by hand."""

from __future__ import annotations

import json
import math
from typing import Any

import pytest
from pyroshock.validation.case_results import CaseAnswer, CaseResult, WithheldTruth
from pyroshock.validation.cause_figures import (
    ALL,
    cause_figures,
    cause_tables,
    cause_text,
    first_entry_right,
)
from pyroshock.validation.report import Report, read_rows, write_rows

VALVE, LEAK, GAIN, DRAG = "gun.valve_flow", "gun.blow_by", "sensor.velocity_gain", "gun.barrel_loss"


def truth(*effects: str, shapley: dict[str, float] | None = None, **other: Any) -> WithheldTruth:
    shares = shapley or {effect: 1 / len(effects) for effect in effects}
    given: dict[str, Any] = {
        "case": "a",
        "tier": "gun with traces",
        "kind": "gun",
        "gap_in_tolerances": 20.0,
    }
    return WithheldTruth(**{**given, "effects": effects, "shapley": shares, **other})


def answer(
    *causes: tuple[list[str], float],
    shares: dict[str, tuple[float, float, float]] | None = None,
    **other: Any,
):
    rows = [
        {"effect": name, "share": s, "ci90": [low, high]}
        for name, (s, low, high) in (shares or {}).items()
    ]
    entries = [{"effects": effects, "probability": p} for effects, p in causes]
    return CaseAnswer.of("a", {"causes": entries, "effects": rows, "shrinkage": [], **other})


TWO = truth(VALVE, LEAK, shapley={VALVE: 0.7, LEAK: 0.3})


def value(field: str, *rows: CaseResult) -> float | None:
    return getattr(cause_figures("x", rows), field).value


def test_leader_is_the_effect_with_the_largest_share_and_not_the_first_name() -> None:
    right = answer(
        ([f"{LEAK}+{VALVE}"], 0.9), shares={VALVE: (0.6, 0.5, 0.8), LEAK: (0.4, 0.35, 0.5)}
    )
    wrong = answer(
        ([f"{LEAK}+{VALVE}"], 0.9), shares={VALVE: (0.4, 0.2, 0.5), GAIN: (0.6, 0.5, 0.7)}
    )
    rows = [CaseResult(TWO, right), CaseResult(TWO, wrong)]
    figures = cause_figures("x", rows)
    assert (figures.largest_leads.hits, figures.largest_leads.n) == (1, 2)
    assert figures.largest_named.value == 1.0
    assert figures.both_named.value == 1.0
    assert figures.shares_error == pytest.approx((0.1 + 0.1 + 0.3 + 0.3) / 4)
    assert (figures.shares_held.hits, figures.shares_held.n) == (1, 4)
    air = "gun.back_pressure"
    three = truth(air, VALVE, LEAK, shapley={air: 0.6, VALVE: 0.3, LEAK: 0.1})
    said = answer(
        ([air], 0.9), shares={air: (0.7, 0.6, 0.8), LEAK: (0.2, 0.1, 0.3), VALVE: (0.1, 0.0, 0.2)}
    )
    assert value("largest_leads", CaseResult(three, said)) == 1.0
    assert value("other_leads", CaseResult(three, said)) == 0.0
    assert value("other_leads", *rows) == 0.5
    assert value("other_leads", CaseResult(truth(air), said)) is None
    lost = CaseResult(TWO, CaseAnswer("a", error="out of time"))
    assert value("largest_leads", lost) == 0.0
    assert cause_figures("x", [lost]).shares_error == pytest.approx(0.5)


def test_names_that_do_not_act_are_counted_by_name_in_the_likeliest_member() -> None:
    said = answer(([f"{VALVE}+{GAIN}+{DRAG}", f"{VALVE}+{LEAK}"], 0.9))
    figures = cause_figures("x", [CaseResult(TWO, said), CaseResult(TWO, answer(([VALVE], 1.0)))])
    assert (figures.idle_named.hits, figures.idle_named.n) == (2, 4)
    assert figures.both_named.hits == 1


@pytest.mark.parametrize(
    ("causes", "wrong"),
    [
        ([([GAIN], 0.85)], 1.0),
        ([([GAIN], 0.75)], 0.0),
        ([([VALVE], 0.95)], 0.0),
        ([([GAIN, VALVE], 0.95)], 0.0),
        ([([f"{GAIN}+{VALVE}"], 0.95)], 0.0),
        ([(["unknown"], 0.95)], 0.0),
    ],
)
def test_one_wrong_effect_above_the_limit(
    causes: list[tuple[list[str], float]], wrong: float
) -> None:
    assert value("wrong_alone", CaseResult(TWO, answer(*causes))) == wrong


def test_sets_count_where_the_report_has_them() -> None:
    assert value("set_named", CaseResult(TWO, answer(([VALVE], 1.0)))) is None
    held = answer(([GAIN], 1.0), sets=[{"effects": [VALVE, DRAG]}, {"effects": [LEAK]}])
    other = answer(([GAIN], 1.0), sets=[{"effects": [LEAK, DRAG]}])
    alone = answer(([VALVE], 1.0), sets=[])
    figures = cause_figures("x", [CaseResult(TWO, said) for said in (held, other, alone)])
    assert (figures.set_named.hits, figures.set_named.n) == (2, 3)
    assert figures.set_size == pytest.approx(1.5)


def test_none_and_unknown_by_what_is_true() -> None:
    none, unknown, named = (
        answer((["none"], 0.9)),
        answer((["unknown"], 0.9)),
        answer(([VALVE], 0.9)),
    )
    outside = truth(family="gun.tumbling", shapley={})
    smooth, rough = (
        truth(shapley={}, gap_in_tolerances=0.0),
        truth(shapley={}, gap_in_tolerances=0.0, rough=True),
    )
    small = truth(VALVE, gap_in_tolerances=0.5)
    rows = [
        CaseResult(t, said)
        for t in (TWO, outside, smooth, rough, small)
        for said in (none, unknown, named)
    ]
    rows = [row for row in rows if not (row.label.rough and row.said.labels == ("unknown",))]
    figures = cause_figures("x", rows)
    assert (figures.none_first.hits, figures.none_first.n) == (1, 3)
    assert (figures.unknown_first.hits, figures.unknown_first.n) == (1, 3)
    assert (figures.outside_unknown.hits, figures.outside_none.hits, figures.outside_none.n) == (
        1,
        1,
        3,
    )
    assert (figures.false_smooth.hits, figures.false_smooth.n) == (2, 3)
    assert (figures.false_rough.hits, figures.false_rough.n) == (1, 2)


@pytest.mark.parametrize(
    ("first", "right"),
    [
        ([f"{LEAK}+{VALVE}"], True),
        ([VALVE], False),
        ([GAIN, f"{LEAK}+{VALVE}"], True),
        ([f"{GAIN}+{LEAK}+{VALVE}"], False),
        (["unknown"], False),
    ],
)
def test_first_entry_may_leave_out_small_effects_alone(first: list[str], right: bool) -> None:
    assert first_entry_right(CaseResult(TWO, answer((first, 0.9)))) is right
    three = truth(VALVE, LEAK, GAIN, shapley={VALVE: 0.65, LEAK: 0.3, GAIN: 0.05})
    assert first_entry_right(CaseResult(three, answer(([f"{LEAK}+{VALVE}"], 0.9))))
    assert first_entry_right(CaseResult(truth(shapley={}), answer((["none"], 0.9))))
    figures = cause_figures("x", [CaseResult(TWO, answer((first, 0.9)))])
    assert figures.ece == pytest.approx(0.1 if right else 0.9)


def test_stage_corner_cost_and_the_naive_fit() -> None:
    chain = truth(VALVE, kind="gun-contact", stages=("gun",))
    shrinkage = [
        {"held_out_by": "configuration", "fraction": 0.9},
        {"held_out_by": "corner: tank_pressure > 2e+05", "fraction": 0.4},
    ]
    where = {"stage": [{"name": "gun"}, {"name": "contact"}]}
    said = answer(
        ([VALVE], 0.9), shrinkage=shrinkage, where=where, naive=0.93, cpu_s=12.0, memory_mb=300.0
    )
    figures = cause_figures("x", [CaseResult(chain, said), CaseResult(TWO, answer(([VALVE], 0.9)))])
    assert (figures.stage.hits, figures.stage.n) == (1, 1)
    assert (figures.corner.value, figures.corner.n) == (0.4, 1)
    assert figures.fraction.value == pytest.approx(0.45)
    assert (figures.at_least_naive.hits, figures.at_least_naive.n) == (0, 1)
    assert figures.cpu_s == (12.0, 12.0)
    assert figures.memory_mb == 300.0


def test_tables_by_tier_kind_and_all_come_back_from_a_file(tmp_path: Any) -> None:
    said = answer(([VALVE], 0.9), sets=[{"effects": [VALVE, DRAG]}], cpu_s=3.0)
    rows = [CaseResult(TWO, said), CaseResult(truth(LEAK, tier="outside", kind="hammer"), said)]
    rows.append(CaseResult(truth(LEAK, tier="outside"), said))
    write_rows(tmp_path / "scored.jsonl", {"seed": 1}, rows)
    _, back = read_rows(tmp_path / "scored.jsonl")
    tables = cause_tables(back, ("gun with traces", "outside", "null rough"))
    assert [table.name for table in tables] == [
        "gun with traces",
        "outside",
        "outside, hammer",
        "outside, gun",
        ALL,
    ]
    assert tables[-1].n == 3
    assert tables[0].set_named.value == 1.0
    text = cause_text(tables)
    assert "largest leads the shares" in text
    assert "both of two named" in text
    assert "false alarms, rough" not in text
    assert cause_text(()) == ""
    data = json.loads(json.dumps(Report(1, 1, (), {}, causes=tables).as_json(), allow_nan=False))
    assert data["causes"][0]["set_size"] == 2.0
    assert data["causes"][0]["corner"]["value"] is None
    assert math.isnan(tables[0].corner.value)
