"""Opened labels in the words of the score, and what the right effect would have done."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pyroshock.diagnosis.options import Options
from pyroshock.twin.effects import effect
from pyroshock.validation.case_plan import CaseTask
from pyroshock.validation.cases.case import Label as Opened
from pyroshock.validation.cases.draw import draw_case
from pyroshock.validation.cases.record import label_of
from pyroshock.validation.oracle_fit import OpenedTask, oracle
from pyroshock.validation.tally import label, named_regions

TASK = CaseTask("strong-0000", "strong", (1,))


def opened(kind: str, cause: str, **other: Any) -> Opened:
    case = draw_case(kind, "strong", np.random.default_rng(1), cause=cause, number=0, **other)
    return label_of(case, 5)


def test_effects_of_and_outside_the_catalogue() -> None:
    truth = opened("gun", "gun.valve_flow")
    found = label(TASK, truth)
    assert (found.key, found.kind, found.stages, found.inside) == (
        "gun.valve_flow",
        "gun",
        ("gun",),
        None,
    )
    assert 3 < found.gap_in_floors < 6
    assert found.gap_in_tolerances == pytest.approx(truth.gap["gun"])
    assert label(TASK, replace(truth, gap={"gun": 0.9})).within_tolerance
    assert not label(TASK, replace(truth, gap={"gun": 1.1})).within_tolerance
    pressures = [row["tank_pressure_bar"] for row in truth.configurations]
    assert named_regions(truth, [{"rule": "tank_pressure_bar > 1.2"}]) == [
        [i for i, p in enumerate(pressures) if p > 1.2]
    ]
    found = label(TASK, opened("gun", "none"))
    assert (found.key, found.stages, found.gap_in_tolerances) == ("none", (), 0.0)
    found = label(TASK, opened("gun", "gun.tumbling"))
    assert (found.key, found.family, found.stages) == ("unknown", "gun.tumbling", ("gun",))


def test_layer_acts_where_there_is_one() -> None:
    truth = opened("hammer", "contact.layer_compliance")
    inside = label(TASK, truth).inside
    words = [row["insulator"] for row in truth.configurations]
    assert inside == tuple(i for i, word in enumerate(words) if word == "polymeric")
    regions = [{"rule": "insulator = polymeric"}, {"rule": "tank_pressure_bar > 1"}]
    assert named_regions(truth, regions) == [list(inside), []]


def test_right_effect_shrinks_the_gap(monkeypatch: pytest.MonkeyPatch) -> None:
    """And the wrong one, as fitted by nobody, leaves it."""
    from pyroshock.validation import oracle_fit as module

    case = draw_case(
        "gun",
        "very strong",
        np.random.default_rng(1),
        cause="gun.dead_volume",
        number=0,
        decoy=False,
    )
    monkeypatch.setattr(module, "case_of_task", lambda task: (case, 5))
    none = effect("gun.dead_volume", volume_m3=0.0).as_json()
    found = oracle(OpenedTask(TASK, Options(), (none,)))
    assert found["fraction"] > 0.8
    assert found["true_fraction"] == pytest.approx(0.0, abs=1e-9)
