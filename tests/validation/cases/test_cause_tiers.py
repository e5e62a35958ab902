"""The tiers that score what a reader acts on draw what they say."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from pyroshock.array_types import Floats
from pyroshock.validation.case_plan import BENCHES, GROUPS, SPLITS, TIERS, case_of_task, tasks
from pyroshock.validation.cases.case import ALL_KINDS, GUN_AND_CONTACT, KINDS, ActingCause
from pyroshock.validation.cases.draw import (
    ALONE_GAPS,
    ALWAYS,
    BENCH_DEFAULT,
    FULL_SCALE,
    OUTSIDE_GAP,
    SMALL_GAP,
    STRONGEST,
    draw_outside,
    draw_visible_bench,
    total_gap,
)
from pyroshock.validation.cases.effect_size import changes, gap
from pyroshock.validation.cases.record import label_of, record_case
from pyroshock.validation.cases.scale_cause import cause_of, largest, ratio_of
from pyroshock.validation.cases.unknowns import families

SEED = 4711


def test_earlier_tiers_and_kinds_keep_their_places() -> None:
    assert list(TIERS)[:12][-5:] == [
        "realistic",
        "realistic full scale",
        "foreign one",
        "foreign two",
        "foreign full scale",
    ]
    assert GROUPS["causes"] == tuple(list(TIERS)[12:])
    assert (*KINDS, GUN_AND_CONTACT) == ALL_KINDS
    seeds = {
        task.seed
        for tier in GROUPS["causes"]
        for split in SPLITS
        for task in tasks(3, 1, [tier], split)
    }
    rows = sum(3 for tier in GROUPS["causes"] if not BENCHES[tier].seeds_of) * len(SPLITS)
    assert len(seeds) == rows


@pytest.mark.parametrize(
    ("tier", "kind"),
    [
        ("foreign one", "gun"),
        ("foreign one", "hammer"),
        ("foreign one", "plate"),
        ("one with traces", "gun"),
    ],
)
def test_calibration_campaigns_are_drawn_by_their_own_laws(
    tier: str, kind: str, tmp_path: Path
) -> None:
    case = BENCHES[tier].draw(kind, np.random.default_rng(SEED), "calibration", 0)
    assert case.laws == "calibration"
    label = record_case(case, tmp_path / "case", 1, name="case")
    other = record_case(replace(case, laws="development"), tmp_path / "other", 1, name="case")
    assert label.folder_sha256 != other.folder_sha256


def test_split_that_there_is_not_is_told() -> None:
    with pytest.raises(
        ValueError, match="'tuning': expected one of development, calibration, sealed"
    ):
        BENCHES["foreign one"].draw("gun", np.random.default_rng(SEED), "tuning", 0)


@pytest.mark.parametrize(("kind", "limits"), [("gun", FULL_SCALE["gun"]), ("hammer", SMALL_GAP)])
def test_each_of_many_effects_is_as_large_as_drawn(kind: str, limits: tuple[float, float]) -> None:
    case = draw_visible_bench(
        kind, np.random.default_rng(SEED), "development", effects=(5, 6), limits=limits
    )
    assert case.laws == "development"
    assert 5 <= len(case.strengths) <= 6
    assert limits[0] <= total_gap(case) <= limits[1]
    least, most = ALONE_GAPS[limits == FULL_SCALE["gun"]]
    assert (ALWAYS in case.strengths) == (kind == "gun")
    for name, strength in case.strengths.items():
        if name == ALWAYS:
            continue
        end = largest(name, 1 if strength > 0 else -1, "development")
        assert abs(strength) <= abs(end)
        alone = gap(kind, case.design, cause_of(name, strength, laws="development"))
        if name.startswith("sensor."):
            assert abs(strength) <= STRONGEST * BENCH_DEFAULT.get(name, 1.0) * (1 + 1e-9)
        elif strength != end:
            assert least * 0.95 <= alone <= most * 1.05


@pytest.mark.parametrize("kind", ["gun", "hammer"])
def test_cause_outside_is_of_the_split_and_of_its_size(kind: str) -> None:
    case = draw_outside(kind, np.random.default_rng(SEED), "development")
    assert case.unknown in families(kind, "development")
    assert OUTSIDE_GAP[0] <= ratio_of(case) * case.floor <= OUTSIDE_GAP[1]
    assert label_of(case, 1).cause == ("unknown",)


def test_half_of_the_nulls_are_rough_and_half_of_the_guns_recorded() -> None:
    guns = [
        case_of_task(task)[0] for task in tasks(4, SEED, ["null rough"], "development", ["gun"])
    ]
    assert [case.background.rough for case in guns] == [False, True, False, True]
    assert [case.traces for case in guns] == [True, True, False, False]
    assert all(case.cause == ("none",) for case in guns)
    hammer = case_of_task(tasks(1, SEED, ["null rough"], "development", ["hammer"])[0])[0]
    assert not hammer.traces
    outside = [
        case_of_task(task)[0] for task in tasks(2, SEED, ["outside"], "development", ["gun"])
    ]
    assert [case.traces for case in outside] == [True, False]
    first, second = (replace(case, traces=False) for case in guns[:2])
    assert first != second


def test_bench_that_cannot_be_integrated_is_drawn_again(monkeypatch: pytest.MonkeyPatch) -> None:
    first, *_ = tasks(1, 7, ("gun without traces",), "development")
    calls: list[str] = []

    def stiff_once(kind: str, number: int, cause: ActingCause) -> dict[str, Floats]:
        calls.append(kind)
        if len(calls) == 1:
            raise RuntimeError("the shot could not be integrated")
        return changes(kind, number, cause)

    monkeypatch.setattr("pyroshock.validation.cases.draw.changes", stiff_once)
    rng = np.random.default_rng(first.seed)
    case = draw_visible_bench("gun", rng, "development", effects=(5, 7), limits=FULL_SCALE["gun"])
    assert len(calls) > 1
    monkeypatch.undo()
    assert FULL_SCALE["gun"][0] <= total_gap(case) <= FULL_SCALE["gun"][1]
