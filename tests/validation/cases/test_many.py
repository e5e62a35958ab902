"""Benches on which many effects act, and what each of them makes of the gap."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from pyroshock.validation.cases.attribution import attribution, shapley_values, shares
from pyroshock.validation.cases.case import KINDS, ActingCause, Case
from pyroshock.validation.cases.draw import (
    ALWAYS,
    BENCH_DEFAULT,
    FOREIGN_GAPS,
    FULL_SCALE,
    STRONGEST,
    USUAL_GAP,
    WEAKEST,
    draw_foreign,
    draw_foreign_bench,
    draw_realistic,
    total_gap,
)
from pyroshock.validation.cases.effect_size import gap
from pyroshock.validation.cases.record import record_case
from pyroshock.validation.cases.scale_cause import RANGES, cause_of, ratio_of
from pyroshock.validation.cases.unknowns import FAMILIES


@pytest.mark.parametrize("kind", KINDS)
def test_strengths_are_those_of_a_bench(kind: str) -> None:
    case = draw_realistic(kind, np.random.default_rng(3))
    sizes = {
        n: abs(v) / BENCH_DEFAULT.get(n, 1.0) for n, v in case.strengths.items() if n != ALWAYS
    }
    assert all(WEAKEST <= size <= STRONGEST for size in sizes.values())
    assert USUAL_GAP[0] <= total_gap(case) <= USUAL_GAP[1]


@pytest.mark.parametrize("kind", ["gun", "chain"])
def test_every_gun_stands_in_an_atmosphere(kind: str) -> None:
    case = draw_realistic(kind, np.random.default_rng(4))
    assert RANGES[ALWAYS].low <= case.strengths[ALWAYS] <= RANGES[ALWAYS].high


def test_effects_are_off_as_often_as_said() -> None:
    cases = [draw_realistic("hammer", np.random.default_rng(seed)) for seed in range(40)]
    assert np.mean([len(case.strengths) for case in cases]) == pytest.approx(0.7 * 9, abs=0.8)
    first, second = (draw_realistic("gun", np.random.default_rng(6)) for _ in range(2))
    assert first == second


@pytest.mark.parametrize("kind", ["gun", "plate"])
def test_full_scale_is_many_tolerances(kind: str) -> None:
    case = draw_realistic(kind, np.random.default_rng(5), full_scale=True)
    assert FULL_SCALE[kind][0] <= total_gap(case) <= FULL_SCALE[kind][1]
    assert all(
        abs(v) <= 3 * BENCH_DEFAULT[n]
        for n, v in case.strengths.items()
        if n in BENCH_DEFAULT and "." in n[6:]
    )


def test_single_effect_has_the_whole_gap() -> None:
    parts = attribution("hammer", 0, ActingCause((("contact.effective_mass", 2.0),)))
    assert shares(parts.left_out) == {"contact.effective_mass": pytest.approx(1.0)}
    assert shares(parts.shapley) == {"contact.effective_mass": pytest.approx(1.0)}
    parts = attribution("hammer", 0, ActingCause())
    assert shares(parts.left_out) == {}
    table = {"gun": {"a": 1.0}, "contact": {"b": 2.0, "c": 1.0}}
    assert shares(table) == {"a": 0.25, "b": 0.5, "c": 0.25}


def test_shapley_values_add_up_to_the_squared_gap() -> None:
    cause = ActingCause(
        (
            ("contact.effective_mass", 2.0),
            ("contact.viscous_loss", 1.0),
            ("sensor.force_gain", 0.05),
        )
    )
    parts = attribution("hammer", 1, cause)
    from pyroshock.validation.cases.effect_size import changes, gaps

    whole = gaps(changes("hammer", 1, cause))["contact"] ** 2
    assert sum(parts.shapley["contact"].values()) == pytest.approx(whole)


def test_shapley_values_have_closed_forms() -> None:
    worth = {"a": 3.0, "b": -1.0, "c": 0.5, "d": 0.0, "e": 2.0, "f": 1.0}
    values = shapley_values(list(worth), lambda some: sum(worth[name] for name in some))
    assert values == pytest.approx(worth)
    values = shapley_values(["a", "b"], lambda some: float(len(some) == 2))
    assert values == {"a": 0.5, "b": 0.5}


@cache
def foreign_hammer(split: str, effects: int) -> Case:
    return draw_foreign("hammer", np.random.default_rng(7), split, effects=effects)


@pytest.mark.parametrize("split", ["development", "calibration", "sealed"])
@pytest.mark.parametrize("effects", [1, 2])
def test_foreign_case_has_its_gap_by_the_laws_of_its_split(effects: int, split: str) -> None:
    case = foreign_hammer(split, effects)
    assert (case.laws, len(case.strengths)) == (split, effects)
    assert FOREIGN_GAPS[effects][0] <= ratio_of(case) < FOREIGN_GAPS[effects][1]


def test_foreign_bench_has_five_to_seven_effects(tmp_path: Path) -> None:
    case = draw_foreign_bench("gun", np.random.default_rng(8), "sealed")
    assert 5 <= len(case.strengths) <= 7
    assert FULL_SCALE["gun"][0] <= total_gap(case) <= FULL_SCALE["gun"][1]
    case = foreign_hammer("sealed", 1)
    other = record_case(replace(case, laws=""), tmp_path / "a", 1, name="c")
    assert record_case(case, tmp_path / "b", 1, name="c").folder_sha256 != other.folder_sha256


@pytest.mark.parametrize(
    "name", [name for name, family in FAMILIES.items() if family.split == "sealed"]
)
def test_sealed_family_shows_and_is_gone_without_amount(name: str) -> None:
    kind = {"gun": "gun", "contact": "hammer", "plate": "plate"}[FAMILIES[name].stage]
    assert gap(kind, 1, cause_of(name, FAMILIES[name].high)) > 3.0
    assert gap(kind, 1, cause_of(name, 0.0)) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("stage", ["gun", "contact", "plate"])
def test_every_stage_has_three_sealed_families(stage: str) -> None:
    assert (
        sum(family.split == "sealed" and family.stage == stage for family in FAMILIES.values()) >= 3
    )
