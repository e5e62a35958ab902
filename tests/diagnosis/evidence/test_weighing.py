"""Planted effects are found, and none is accused of what it has not done."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from pyroshock.diagnosis import confusion
from pyroshock.diagnosis.causes import causes
from pyroshock.diagnosis.confusion import NEAR, distance, groups
from pyroshock.diagnosis.evidence.scene import Scene
from pyroshock.diagnosis.evidence.weighing import Weighed, weigh
from pyroshock.twin.effects import Effect, effect
from support.records.gun_shots import shots, tables

_, SURFACES, STAGE = tables(shots())


def weighed(effects: Sequence[Effect] = (), without: str = "", **campaign: float) -> Weighed:
    gap, _, _ = tables(shots(effects, **campaign), ("none of them",))
    return weigh(Scene.of(gap, [surface for surface in SURFACES if surface.id != without]))


PLANTED = [
    effect("gun.back_pressure", atmosphere_pa=1.0e5),
    effect("gun.blow_by", discharge_coefficient=0.15),
    effect("gun.valve_flow", loss_coefficient=0.0, opening_time_s=0.0, steady_loss_coefficient=30.0),
    effect("gun.sliding_friction", added_coefficient=0.0, seal_force_n=12.0),
    effect("sensor.pressure_offset", offset_pa=6e3),
    effect("sensor.velocity_gain", gain=1.08),
]


@pytest.mark.parametrize("planted", PLANTED, ids=lambda each: each.id)
def test_planted_effect_is_in_the_first_group(planted: Effect) -> None:
    found = weighed([planted], seed=3, scatter=0.006)
    first = causes(found, found.probability)[0]
    assert planted.id in first.effects
    assert first.probability > 0.7


@pytest.mark.parametrize("planted", PLANTED[2:], ids=lambda each: each.id)
def test_interval_of_the_parameter_holds_the_truth(planted: Effect) -> None:
    found = weighed([planted], seed=5, scatter=0.006)
    from pyroshock.diagnosis.fits import fitted_parameters

    rows = {row.name: row for row in fitted_parameters(found, planted.id)}
    moved = [
        item.name for item in planted.parameters() if item.name in rows and getattr(planted, item.name) != item.off
    ]
    for name in moved:
        low, high = rows[name].ci90
        width = high - low
        assert low - 0.5 * width <= getattr(planted, name) <= high + 0.5 * width


@pytest.mark.parametrize(("campaigns", "most"), [(6, 0), pytest.param(30, 2, marks=pytest.mark.slow)])
def test_no_effect_is_not_accused(campaigns: int, most: int) -> None:
    """With a background up to the tolerance. (Rates are the blind check's.)"""
    sizes = np.linspace(0.003, 0.009, campaigns)
    firsts = [next(iter(weighed(seed=100 + i, background=size).probability)) for i, size in enumerate(sizes)]
    assert len(firsts) - firsts.count("none") <= most


def test_constant_bias_within_tolerance_is_none() -> None:
    assert next(iter(weighed(seed=8, bias=0.008).probability)) == "none"


def test_unknown_where_the_cause_is_not_in_the_catalogue() -> None:
    """A loss that alternates from setting to setting, as no effect does."""
    record = shots(seed=4, scatter=0.006)
    from dataclasses import replace

    runs = tuple(
        replace(run, velocity_m_s=(run.velocity_m_s or 0) * (0.93 if run.configuration % 2 else 1.04))
        for run in record.runs
    )
    gap, _, _ = tables(replace(record, runs=runs), ("none of them",))
    assert next(iter(weigh(Scene.of(gap, SURFACES)).probability)) == "unknown"


def test_probabilities_sum_to_one() -> None:
    found = weighed([PLANTED[1]], seed=2)
    assert sum(found.probability.values()) == pytest.approx(1.0)
    assert sum(cause.probability for cause in causes(found, found.probability)) == pytest.approx(1.0)


def test_an_effect_within_tolerance_is_none() -> None:
    assert next(iter(weighed([effect("sensor.velocity_gain", gain=1.004)], seed=6).probability)) == "none"


def test_shuffled_labels_are_chance() -> None:
    """Six different causes, each diagnosed as if it were another's campaign: hits are those of guessing."""
    found = [causes(w, w.probability)[0].effects for w in (weighed([p], seed=3, scatter=0.006) for p in PLANTED)]
    shifted = [sum(PLANTED[(i + k) % 6].id in found[i] for i in range(6)) for k in range(1, 6)]
    assert np.mean(shifted) < 3 < sum(PLANTED[i].id in found[i] for i in range(6))


def test_uncertain_friction_is_not_taken_for_an_effect() -> None:
    """A gap that a declared uncertainty explains is none; the same gap without the declaration is not."""
    from pyroshock.diagnosis.gap import GapTable
    from pyroshock.diagnosis.stages.gun import GunStage

    record = shots([effect("gun.sliding_friction", added_coefficient=0.9, seal_force_n=0.0)], seed=9, scatter=0.006)
    firsts = []
    for uncertain in ({}, {"friction_coefficient": 0.6}):
        gap = GapTable.of(record, [GunStage(record, uncertain)])
        firsts.append(next(iter(weigh(Scene.of(gap, SURFACES)).probability)))
    assert firsts[0] != "none"
    assert firsts[1] == "none"


def test_nothing_repeated_still_answers() -> None:
    found = weighed([PLANTED[2]], seed=3, scatter=0.006, repetitions=1)
    assert found.scene.gap.noise.assumed
    assert next(iter(found.probability)) != "none"


def test_two_causes_that_the_data_leave_standing_are_one_entry() -> None:
    """However far apart they are as fitted: a tenth of the probability between the two of them is not told apart."""
    found = weighed([effect("gun.blow_by", discharge_coefficient=0.15)], seed=3, scatter=0.006)
    first, second = "gun.blow_by", "gun.back_pressure"
    assert distance(found, first, second) > NEAR
    others = {name: 1e-4 for name in found.log_joint if name not in (first, second)}
    near = groups(found, {first: 0.6, second: 0.3} | others)[0]
    far = groups(found, {first: 0.85, second: 0.05} | others)[0]
    assert second in near.members
    assert second not in far.members


def test_distance_allows_for_laws_that_err(monkeypatch: pytest.MonkeyPatch) -> None:
    """A share of 15 % of a change is no difference between two laws."""
    strong = weighed([effect("gun.blow_by", discharge_coefficient=0.4)], scatter=0.003)
    allowed = distance(strong, "gun.blow_by", "gun.sliding_friction")
    monkeypatch.setattr(confusion, "SHARES", (1e-9,))
    assert allowed < 0.7 * distance(strong, "gun.blow_by", "gun.sliding_friction")
