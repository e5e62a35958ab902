"""The entries of a report, on small campaigns that the twin itself has shot, and the keys of its
contract."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from pyroshock.diagnosis import conclusion, effect_sets
from pyroshock.diagnosis.diagnose import Options, diagnose
from pyroshock.diagnosis.options import first_entry_probability
from pyroshock.diagnosis.record import CampaignRecord
from pyroshock.diagnosis.verdict import NONE, OTHERS, UNKNOWN, Cause, Verdict
from pyroshock.twin.effects import Effect, effect
from support.records import verdicts
from support.records.gun_campaigns import gun_record

IDS = ("gun.dead_volume", "sensor.pressure_offset", "sensor.velocity_gain")
DEAD_VOLUME = effect("gun.dead_volume", volume_m3=1e-3)
GAIN = effect("sensor.velocity_gain", gain=1.05)
PRESSURES_PA = (0.3e5, 0.8e5, 1.4e5, 2.4e5)


@cache
def report(*planted: Effect, only: tuple[str, ...] = IDS, without: tuple[str, ...] = ()) -> Verdict:
    record = gun_record(planted, seed=3, pressures_pa=PRESSURES_PA)
    return diagnose(record, options=Options(catalogue=only, without=without, rate_pulses=False))


@cache
def alternating() -> CampaignRecord:
    """Velocities that are off to either side from one configuration to the next, as no effect makes
    them."""
    record = gun_record(seed=3, pressures_pa=PRESSURES_PA)
    factors = [1.09, 0.92, 0.93, 1.08, 1.1, 0.91, 0.92, 1.07]
    runs = tuple(
        replace(run, velocity_m_s=run.velocity_m_s * factors[run.configuration])
        for run in record.runs
    )
    return replace(record, runs=runs)


@cache
def unknown_report() -> Verdict:
    return diagnose(alternating(), options=Options(catalogue=IDS, rate_pulses=False))


REPORTS = pytest.mark.parametrize(
    "verdict_of",
    [lambda: report(), lambda: report(DEAD_VOLUME), lambda: report(GAIN), unknown_report],
    ids=["none", "dead volume", "gain", "unknown"],
)


@REPORTS
def test_entries_and_rows_keep_what_a_report_promises(verdict_of):
    values = [cause.probability for cause in verdict_of().causes]
    assert sum(values) == pytest.approx(1.0)
    assert values == sorted(values, reverse=True)
    names = {cause.effects for cause in verdict_of().causes}
    assert {(NONE,), (UNKNOWN,)} <= names
    verdict = verdict_of()
    assert sum(row.share for row in verdict.effects) + verdict.unexplained.share == pytest.approx(
        1.0
    )
    for row in [*verdict.effects, verdict.unexplained]:
        # Shapley values may be negative, and then others exceed one: only their sum is bounded.
        assert row.ci90[0] <= row.share <= row.ci90[1] and row.ci90[0] < row.ci90[1]
    rows = verdict_of().effects
    assert {row.effect for row in rows} == set(IDS)
    assert [row.share for row in rows] == sorted((row.share for row in rows), reverse=True)


@pytest.mark.parametrize("planted", [DEAD_VOLUME, GAIN], ids=["dead volume", "gain"])
def test_planted_effect_is_named_first_with_most_of_the_gap(planted: Effect):
    verdict = report(planted)
    assert verdict.first.effects[0] == planted.id
    assert verdict.effects[0].effect == planted.id
    assert verdict.effects[0].named
    assert verdict.effects[0].share > 0.75  # the rest is that of sets that do nearly the same
    # It ends where repetitions leave the gap.
    step, *others = verdict.path
    assert step.added == planted.id
    assert [other.added for other in others] in ([], [OTHERS])
    assert step.fraction > 0.9
    assert step.after < 0.2 * verdict.gap.before


def test_gap_within_tolerance_is_none_and_one_that_none_predicts_unknown():
    verdict = report()
    assert verdict.first.effects == (NONE,)
    assert verdict.path == ()
    assert not any(row.named for row in verdict.effects)
    # A change over a gap that scatter alone makes says nothing: it was -82 of the gap for an effect
    # that is not there.
    assert {row.held_out_gain for row in report().effects} == {0.0}
    verdict = unknown_report()
    assert verdict.first.effects == (UNKNOWN,)
    assert not any(row.named for row in verdict.effects)
    assert verdict.unexplained.share > 0.5
    # Never "none is needed": the setting where most remains, repeated in another order.
    first = unknown_report().next_runs[0]
    assert first.runs_needed >= 2
    assert "another order of runs" in first.why


def test_only_the_effects_of_the_catalogue_given_are_in_the_report():
    verdict = report(GAIN, without=("sensor.velocity_gain",))
    assert {row.effect for row in verdict.effects} == set(IDS) - {"sensor.velocity_gain"}
    named = {
        name for cause in verdict.causes for effects in cause.effects for name in effects.split("+")
    }
    assert "sensor.velocity_gain" not in named | set(verdict.fits)
    verdict = report(GAIN, only=("sensor.velocity_gain",))
    assert [row.effect for row in verdict.effects] == ["sensor.velocity_gain"]
    assert verdict.first.effects == ("sensor.velocity_gain",)
    with pytest.raises(LookupError, match=r"gun\.magic"):
        report(only=("gun.magic",))
    with pytest.raises(ValueError, match=r"contact\.viscous_loss cannot show"):
        report(only=("contact.viscous_loss",))


def test_named_sets_can_be_adopted():
    # `fits` has the effect, near what was planted.
    (own,) = report(GAIN).fits["sensor.velocity_gain"]
    assert own.as_json()["gain"] == pytest.approx(1.05, abs=0.01)
    gains = {row.effect: row.held_out_gain for row in report(DEAD_VOLUME).effects}
    assert gains["gun.dead_volume"] > 0.8
    assert max(abs(gain) for name, gain in gains.items() if name != "gun.dead_volume") < 0.2
    for planted in (DEAD_VOLUME, GAIN):
        assert [row.effect for row in report(planted).effects if row.named] == [planted.id]


def test_effects_that_the_data_cannot_tell_apart_share_one_entry():
    """Shots that are nearly alike and scatter: a leak or a gain may stand for the volume. The next
    experiment is of the likeliest two."""
    record = gun_record(
        [DEAD_VOLUME], seed=1, pressures_pa=(0.8e5, 1.0e5), masses_kg=(0.5, 0.55), scatter=0.015
    )
    names = ("gun.blow_by", "gun.dead_volume", "sensor.velocity_gain")
    verdict = diagnose(record, options=Options(catalogue=names, rate_pulses=False))
    assert {"gun.blow_by", "gun.dead_volume"} <= set(verdict.first.effects)
    assert set(names) == {name for entry in verdict.first.effects for name in entry.split("+")}
    assert (
        len(verdict.first.effects) == 4
    )  # sets of unlike size stand together, and no more are listed
    assert sum(verdict.first.split) == pytest.approx(1.0)
    assert list(verdict.first.split) == sorted(verdict.first.split, reverse=True)
    assert verdict.first.split[-1] > 0.05
    first, second = verdict.first.effects[:2]
    assert verdict.next_runs[0].why.startswith(f"separates {first} from {second}")


def test_what_the_first_entry_loses_and_gains_have_closed_forms():
    entries = [Cause(("a",), 0.9), Cause((NONE,), 0.06), Cause(("b+c",), 0.04)]
    first, other, none = conclusion._weighed(entries, 0.9)
    assert first.probability == pytest.approx(first_entry_probability(("a",), 0.9))
    # That other sets may act does not make it likelier that none does.
    assert none.probability == 0.06
    assert other.probability == pytest.approx(0.94 - first.probability)
    # A pair that predicts nothing is seldom right, but its rival is no better.
    first, second = conclusion._weighed([Cause(("a+b",), 0.6), Cause(("c",), 0.4)], 0.0)
    assert first.probability == pytest.approx(0.5)
    assert second.probability == pytest.approx(0.5)
    # No other set of the catalogue is near.
    known = conclusion._weighed([Cause(("a",), 1.0), Cause((NONE,), 0.0)], 0.8)
    table = {entry.effects: entry.probability for entry in conclusion._listed(known, 0.01)}
    assert table[(NONE,)] == 0.0
    assert table[(UNKNOWN,)] == pytest.approx(1 - 0.99 * first_entry_probability(("a",), 0.8))
    # Of what is explained to 0.95 at most a tenth is unknown.
    known = conclusion._weighed([Cause(("a",), 1.0), Cause((NONE,), 0.0)], 0.95)
    assert known[0].probability == pytest.approx(0.9)
    known = conclusion._weighed([Cause(("a",), 1.0), Cause((NONE,), 0.0)], 0.95, 0.04)
    assert conclusion._listed(known, 0.04)[1].probability == pytest.approx(0.1)
    # What is nobody's does not make "unknown" the likeliest: 0.4 of 0.9, and 0.1 of the map,
    # without the other half.
    first, unknown, none = conclusion._listed([Cause(("a+b",), 0.4), Cause((NONE,), 0.0)], 0.1)
    assert (first.effects, unknown.effects, none.probability) == (("a+b",), (UNKNOWN,), 0.0)
    assert first.probability / unknown.probability == pytest.approx(0.4 * 0.9 / 0.1)
    # Where the map says so, it is; and a background of 0.3 is none of it.
    none, unknown, first = conclusion._listed(
        [Cause(("a",), 0.7), Cause((NONE,), 0.3)], 0.9, background=0.75
    )
    assert (none.effects, unknown.effects) == ((NONE,), (UNKNOWN,))
    assert [none.probability, unknown.probability, first.probability] == pytest.approx(
        [0.7725, 0.1575, 0.07]
    )
    unknown, none, first = conclusion._listed([Cause(("a",), 0.7), Cause((NONE,), 0.3)], 0.8)
    assert [entry.probability for entry in (unknown, none, first)] == pytest.approx(
        [0.56, 0.3, 0.14]
    )
    # (sqrt 9 - sqrt 4) / (sqrt 16 - sqrt 1); configurations that are alike leave no standard error.
    held = _held(before=16.0, floor=1.0)
    value, error = effect_sets._gain(held, np.full(5, 9.0), np.full(5, 4.0))
    assert value == pytest.approx((3 - 2) / (4 - 1))
    assert error == pytest.approx(0.0, abs=1e-12)
    # Of a mean it is the textbook's standard error: here roots that are nearly linear.
    held, rng = _held(before=100.0, floor=1.0, count=40), np.random.default_rng(0)
    less = 50 + 0.1 * rng.standard_normal(40)
    _, error = effect_sets._gain(held, less, np.full(40, 4.0))
    slope = 0.5 / np.sqrt(50) / (10 - 1)
    assert error == pytest.approx(slope * less.std(ddof=1) / np.sqrt(40), rel=0.02)


def _held(before: float, floor: float, count: int = 5) -> SimpleNamespace:
    return SimpleNamespace(
        squares=lambda: np.full(count, before),
        gaps=SimpleNamespace(floor=np.full(count, floor)),
        split=SimpleNamespace(held_out=np.arange(count)),
    )


#: Key to what it holds, as the form of the answer was agreed.
CONTRACT = {
    "campaign": str,
    "simulator": str,
    "gap": {
        "metric": str,
        "before": float,
        "noise_floor": float,
        "tolerance": float,
        "beyond_noise": bool,
        "families": [
            {
                "family": str,
                "before": float,
                "noise_floor": float,
                "tolerance": float,
                "beyond_noise": bool,
            }
        ],
    },
    "where": {
        "stage": [
            {"name": str, "share": float, "ci90": [float], "own": float, "own_ci90": [float]}
        ],
        "factors": [{"rule": str, "excess": float, "p_value": float}],
        "time": [{"channel": str, "from_s": float, "to_s": float}],
        "frequency": [{"channel": str, "from_hz": float, "to_hz": float}],
    },
    "causes": [{"effects": [str], "probability": float}],
    "shrinkage": [{"effects": [str], "held_out_by": str, "before": float, "after": float}],
    "sets": [
        {
            "effects": [str],
            "inclusion": float,
            "share": float,
            "ci90": [float],
            "held_out_gain": float,
        }
    ],
    "effects": [
        {
            "effect": str,
            "inclusion": float,
            "share": float,
            "ci90": [float],
            "held_out_gain": float,
            "parameters": [{"name": str, "value": float, "unit": str, "ci90": [float]}],
        }
    ],
    "unexplained": {"share": float, "ci90": [float]},
    "path": [{"added": str, "after": float, "fraction": float}],
    "next_runs": [{"why": str, "settings": dict, "runs_needed": int}],
    "assumptions": [str],
    "seconds": float,
}


def follows(value: object, form: object) -> bool:
    """Whether plain data has at least the keys of a form, of their kinds."""
    if isinstance(form, dict):
        return isinstance(value, dict) and all(
            key in value and follows(value[key], form[key]) for key in form
        )
    if isinstance(form, list):
        return isinstance(value, list) and all(follows(element, form[0]) for element in value)
    assert isinstance(form, type)
    return isinstance(value, form)


def test_report_has_the_keys_of_the_contract() -> None:
    assert follows(json.loads(json.dumps(verdicts.gun().as_json())), CONTRACT)
    assert follows(json.loads(json.dumps(verdicts.unknown().as_json())), CONTRACT)
    parameter = verdicts.verdict().as_json()["causes"][0]["parameters"][0]
    assert parameter == {
        "name": "compliance_m_n",
        "value": 3.4e-8,
        "unit": "m/N",
        "ci90": [3.1e-8, 3.8e-8],
    }
    causes = verdicts.verdict().as_json()["causes"]
    assert causes[1:] == [
        {"effects": ["unknown"], "probability": 0.06},
        {"effects": ["none"], "probability": 0.01},
    ]
    assert verdicts.verdict().as_json()["shrinkage"][1]["fraction"] is None
    assert verdicts.none().as_json()["where"] == {
        "stage": [],
        "factors": [],
        "time": [],
        "frequency": [],
        "drift": [],
    }
    assert not {"pictures", "fits"} & verdicts.verdict().as_json().keys()
