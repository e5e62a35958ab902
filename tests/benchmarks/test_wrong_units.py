"""The measurement of wrong units in a reduced form: campaigns of a gun and a hammer, right and with
one unit wrong."""

from __future__ import annotations

import pytest

from benchmarks.unit_campaigns import KINDS, TURNS, WRONG_UNITS
from benchmarks.wrong_units import report, unit_rows

#: One campaign of a hammer, one of a gun without force: the ones that are quickest to make.
BLOWS, GUN = 5, 8


def test_half_of_the_campaigns_have_a_gun_s_force_and_every_kind_has_its_wrong_units() -> None:
    turns = [TURNS[number % len(TURNS)] for number in range(240)]
    assert {kind: turns.count(kind) for kind in KINDS} == {
        **{"shots": 60, "chain": 60, "gun": 20},
        **{"blows": 30, "hammer": 30, "plate": 40},
    }
    assert set(WRONG_UNITS) == set(KINDS)


@pytest.mark.parametrize("number", [BLOWS, GUN])
def test_right_units_are_left_alone_and_a_wrong_one_is_refused_by_name(number: int) -> None:
    (row,) = unit_rows([number], seed=1)
    assert (row.kind, row.right) == (TURNS[number], [])
    assert row.outcome == "refused, named"
    assert f"| {row.wrong_unit} | {row.kind} | 1 | 1 | 0 |" in report([row])


@pytest.mark.slow
def test_no_campaign_of_a_full_turn_is_refused_or_warned_of() -> None:
    rows = list(unit_rows(range(len(TURNS)), seed=2, wrong_below=0))
    assert [(row.number, row.kind, row.right) for row in rows if row.right] == []
