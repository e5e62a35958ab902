"""The next experiment: what tells causes apart, and what to repeat where nothing explains the
gap."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from pyroshock.diagnosis import next_runs as planning
from pyroshock.diagnosis.gap import GapTable
from pyroshock.diagnosis.inference.posterior import HypothesisPosterior
from pyroshock.diagnosis.next_runs import APART, MOST_RUNS, candidate_stages, next_runs
from pyroshock.diagnosis.observables.gun.stage import GunObservables
from pyroshock.diagnosis.record import CampaignRecord
from pyroshock.diagnosis.verdict import NONE, UNKNOWN, Cause, NextRun
from pyroshock.twin.effects import catalogue, effect
from support.records.gun_campaigns import gun_record
from support.records.gun_shots import shots

IDS = ("gun.dead_volume", "gun.blow_by")
UNEXPLAINED = (Cause((UNKNOWN,), 0.97), Cause((NONE,), 0.03))
TWO = tuple(Cause((name,), 0.45) for name in IDS)


@cache
def posterior_of(record: CampaignRecord) -> tuple[HypothesisPosterior, GunObservables]:
    stage = GunObservables(record)
    return HypothesisPosterior.of(
        GapTable.of(record, [stage]), [stage], [catalogue()[name] for name in IDS]
    ), stage


@cache
def alternating() -> CampaignRecord:
    """No effect makes velocities like these; configuration 4, of 2.4 bar and 0.25 kg, is off
    most."""
    record = gun_record(seed=3)
    factors = [1.08, 0.93, 0.92, 1.07, 0.6, 1.08]
    runs = tuple(
        replace(run, velocity_m_s=run.velocity_m_s * factors[run.configuration])
        for run in record.runs
    )
    return replace(record, runs=runs)


@cache
def planted() -> CampaignRecord:
    return gun_record([effect("gun.dead_volume", volume_m3=1e-3)], seed=3)


def planned(record: CampaignRecord, causes: tuple[Cause, ...]) -> tuple[NextRun, ...]:
    posterior, stage = posterior_of(record)
    return next_runs(posterior, [stage], causes, np.random.default_rng(0))


def test_unknown_alone_has_a_next_experiment():
    # With no pair of causes to tell apart, the configuration with the most of the gap is repeated.
    (run,) = planned(alternating(), UNEXPLAINED)
    assert run.settings == {"tank_pressure_bar": 2.4, "bullet_mass_kg": 0.25}
    assert run.runs_needed >= 2
    assert "another order of runs" in run.why
    posterior, _ = posterior_of(alternating())
    assert "in the gun" in run.why
    assert posterior.likeliest_pattern.pattern in run.why


def test_unknown_is_repeated_only_before_causes():
    first, *others = planned(
        planted(), (Cause((UNKNOWN,), 0.6), *(replace(cause, probability=0.2) for cause in TWO))
    )
    assert "another order of runs" in first.why
    assert [run.why.split(" only")[0] for run in others] == [
        "separates gun.dead_volume from gun.blow_by"
    ]
    causes = (Cause((IDS[0],), 0.9), Cause((UNKNOWN,), 0.1))
    assert planned(planted(), causes) == ()
    assert planned(planted(), (Cause((NONE,), 0.99), Cause((UNKNOWN,), 0.01))) == ()


def test_causes_and_members_of_a_group_are_told_apart_in_the_units_of_columns():
    (run,) = planned(planted(), TWO)
    assert set(run.settings) == {"tank_pressure_bar", "bullet_mass_kg"}
    assert 0.3 / 1.5 <= float(run.settings["tank_pressure_bar"]) <= 2.4 * 1.5
    assert 1 <= run.runs_needed <= MOST_RUNS
    # A group's two members are as good as two causes.
    (run,) = planned(planted(), (Cause(IDS, 0.9, split=(0.6, 0.4)), Cause((UNKNOWN,), 0.1)))
    assert run.why.startswith("separates gun.dead_volume from gun.blow_by")
    names = ("a", "b", "c")
    causes = [Cause((name,), p) for name, p in zip(names, (0.5, 0.1, 0.4), strict=True)]
    assert planning._pairs(causes) == [("a", "c"), ("a", "b"), ("b", "c")]


@pytest.mark.parametrize("shots", [1, 4, 25])
def test_distance_is_in_standard_deviations_of_n_shots(shots: int):
    """Of one observable: the difference over the root of both spreads and the scatter over n."""
    first, second = (
        planning._Forecast(np.array([[mean]]), np.array([[[variance]]]))
        for mean, variance in ((1.0, 0.2), (3.5, 0.3))
    )
    distance = planning._distances(first, second, np.array([[0.8]]), shots)
    assert distance[0] == pytest.approx(2.5 / np.sqrt(0.2 + 0.3 + 0.8 / shots))


def test_setting_with_the_fewest_shots_is_chosen():
    # Two settings: at the second one the causes differ by more.
    forecasts = {
        name: planning._Forecast(np.array([[mean], [3 * mean]]), np.zeros((2, 1, 1)))
        for name, mean in (("a", 0.0), ("b", 1.0))
    }
    settings = [{"tank_pressure": 1e5}, {"tank_pressure": 2e5}]
    run = planning._best(("a", "b"), forecasts, settings, np.array([[4.0]]))
    assert run.settings == {"tank_pressure_bar": 2.0}
    assert run.runs_needed == np.floor(4.0 * APART**2 / 9) + 1  # 3 / sqrt(4 / n) > APART
    forecasts = {
        name: planning._Forecast(np.array([[mean]]), np.zeros((1, 1, 1)))
        for name, mean in (("a", 0), ("b", 1))
    }
    run = planning._best(("a", "b"), forecasts, [{"tank_pressure": 1e5}], np.array([[4.0]]))
    assert run.runs_needed == MOST_RUNS
    assert f"only to {1 / np.sqrt(4 / MOST_RUNS):.1f} of the {APART:g}" in run.why
    forecasts = {name: planning._Forecast(np.ones((1, 1)), np.zeros((1, 1, 1))) for name in "ab"}
    assert (
        planning._best(("a", "b"), forecasts, [{"tank_pressure": 1e5}], np.array([[4.0]])) is None
    )


def test_a_proposed_shot_has_the_travel_of_the_nearest_projectile() -> None:
    travels = {0.25: 0.885, 0.5: 0.6, 1.0: 0.45}
    record = shots()
    record = replace(
        record,
        runs=tuple(replace(run, travel_m=travels[run.bullet_mass_kg]) for run in record.runs),
    )
    (stage,) = candidate_stages([GunObservables(record)])
    assert len(stage.record.configurations) > len(record.configurations)
    for run in stage.record.runs:
        nearest = min(travels, key=lambda mass: abs(mass - run.bullet_mass_kg))
        assert run.travel_m == travels[nearest]
