"""What to do next follows from the verdict: two to five full sentences, and under unknown always an experiment."""

from __future__ import annotations

from dataclasses import replace

import pytest
from pyroshock.app.diagnose.recommendations import limit_of, next_experiment, recommendations, rest_sentence
from pyroshock.app.diagnose.wording import effect_check
from pyroshock.diagnosis.verdict import Cause, Fitted, NextRun, StageShare, Unexplained, Verdict, Where
from support.records import verdicts

BARE = Where()
UNKNOWN_ALONE = replace(
    verdicts.unknown(), effects=(), unexplained=None, path=(), where=BARE, causes=(Cause(("unknown",), 1.0),)
)
MADE = {
    "gun": verdicts.gun(),
    "group": verdicts.verdict(),
    "unknown": verdicts.unknown(),
    "unknown alone": UNKNOWN_ALONE,
    "none": verdicts.none(),
}


@pytest.mark.parametrize("made", MADE.values(), ids=MADE)
def test_two_to_five_full_sentences(made: Verdict) -> None:
    steps = recommendations(made)
    assert next_experiment(made)
    assert 2 <= len(steps) <= 5
    for step in steps:
        assert step[0].isupper() and step.endswith(".")


@pytest.mark.parametrize("made", [verdicts.unknown(), UNKNOWN_ALONE], ids=["where", "nowhere"])
def test_unknown_has_an_experiment_and_a_measurement(made: Verdict) -> None:
    runs, measurement = next_experiment(made)
    assert runs.startswith("Fire three repetitions")
    assert measurement.startswith("Measure ")
    assert not any("needed" in line for line in (runs, measurement))
    assert set(next_experiment(made)) <= set(recommendations(made))


def test_predicting_set_is_adopted_and_others_are_told_apart() -> None:
    command = "pyroshock diagnose spring --adopt gun.valve_flow+gun.back_pressure+gun.blow_by."
    assert recommendations(verdicts.gun())[0].endswith(command)
    spaced = recommendations(verdicts.gun(campaign="spring 2"))[0]
    assert "pyroshock diagnose 'spring 2' --adopt" in spaced
    path = (replace(verdicts.gun().path[0], fraction=0.2),)  # does not predict
    assert recommendations(verdicts.gun(path=path))[0].startswith("Do not adopt the flow resistance of the valve, ")
    (line,) = next_experiment(verdicts.verdict())
    assert line == (
        "Fire 4 runs at tank_pressure_bar = 0.3, bullet_mass_kg = 1 and tip_material = steel: this separates the "
        "compliance of the insulating layer from the plate that gives way under the impact."
    )
    (line, *_) = next_experiment(verdicts.verdict(next_runs=()))
    assert line.startswith("These runs cannot tell whether the compliance of the insulating layer or the plate that")
    assert effect_check("contact.layer_compliance") in line


@pytest.mark.parametrize(
    ("why", "runs", "line"),
    [
        (
            "separates gun.valve_flow from gun.barrel_loss only to 0.2 of the 4 standard deviations that it takes", 30,
            "Even 30 runs at tank_pressure_bar = 0.9 would not separate the flow resistance of the valve from the flow "
            f"resistance of the barrel; measure {effect_check('gun.valve_flow')} or {effect_check('gun.barrel_loss')} "
            "instead.",
        ),
        (
            "separates gun.valve_flow from gun.blow_by+gun.valve_flow only to 0.2 of the 4 standard deviations", 30,
            "Even 30 runs at tank_pressure_bar = 0.9 would not separate the flow resistance of the valve from the leak "
            "past the projectile with the flow resistance of the valve; measure the clearance between projectile and "
            "barrel with a bore gauge instead.",
        ),
        (
            "shows whether gun.blow_by acts", 1,
            "Fire 1 run at tank_pressure_bar = 0.9: this shows whether the leak past the projectile acts.",
        ),
    ],
)  # fmt: skip
def test_run_that_cannot_decide_says_what_to_measure_instead(why: str, runs: int, line: str) -> None:
    run = NextRun(why, {"tank_pressure_bar": 0.9}, runs)
    assert next_experiment(verdicts.verdict(next_runs=(run,))) == (line,)


def test_large_rest_says_where_it_lies_in_its_main_stage() -> None:
    where = verdicts.unknown().where
    steps = recommendations(verdicts.gun(unexplained=Unexplained(0.3, (0.2, 0.4)), where=where))
    assert any("where striker = 254 mm" in step and "peak force of the contact falls" in step for step in steps)
    assert not any("striker" in step for step in recommendations(verdicts.gun(where=where)))
    contact = verdicts.unknown().where
    assert "in the force from 0.1 to 0.4 ms and in the force from 800 to 4000 Hz" in rest_sentence(verdicts.unknown())
    gun = replace(contact, stage=(StageShare("gun", 0.9, (0.8, 1.0), 9.0), StageShare("contact", 0.1, (0.0, 0.2), 1.0)))
    assert "force from" not in rest_sentence(verdicts.unknown(where=gun))


def test_ends_of_ranges_repetitions_and_nearest_effects_are_said() -> None:
    valve, *others = verdicts.gun().effects
    end = Fitted("loss_coefficient", 10000.0, "", (9000.0, 10000.0))
    steps = recommendations(verdicts.gun(effects=(replace(valve, parameters=(end,)), *others)))
    assert any("loss_coefficient of the flow resistance of the valve lies at the end of its range (10000)" in s
               for s in steps)  # fmt: skip
    assert not any("end of its range" in step for step in recommendations(verdicts.gun()))
    note = "floor assumed: nothing was repeated, the scatter of one run is the sensors' data sheets'"
    assert any(step.startswith("Repeat three") for step in recommendations(verdicts.gun(assumptions=(note,))))
    assert not any(step.startswith("Repeat three") for step in recommendations(verdicts.gun()))
    first = recommendations(verdicts.unknown())[0]
    assert "the damping of the contact, which takes 31 % of the error away" in first
    assert "the plastic yield of tip or target 14 %; the effects of the path together take 38 %" in first
    bare = replace(verdicts.unknown(), effects=(), path=(), unexplained=None)
    sentence = "The nearest answer of the catalogue is the flow resistance of the valve (8 %)."
    assert recommendations(bare)[0] == sentence


@pytest.mark.parametrize(
    ("identity", "name", "value", "end"),
    [
        ("gun.valve_flow", "loss_coefficient", 10000.0, 10000.0),
        ("gun.valve_flow", "gun.valve_flow.loss_coefficient", 9990.0, 10000.0),
        ("gun.valve_flow", "loss_coefficient [PLA]", 10000.0, 10000.0),
        ("gun.valve_flow", "loss_coefficient", 31.0, None),
        ("gun.valve_flow", "loss_coefficient", 0.0, None),  # off: it does nothing
        ("gun.valve_flow", "colour", 1.0, None),
        ("gun.magic", "loss_coefficient", 1.0, None),
    ],
)
def test_limits_are_those_of_the_catalogue(identity: str, name: str, value: float, end: float | None) -> None:
    assert limit_of(identity, Fitted(name, value, "", (value, value))) == end
