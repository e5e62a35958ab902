"""What a report says of a diagnosis: names in words of the bench, its first sentences, and what to
do next."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest
from pyroshock.app.common.number_format import times
from pyroshock.app.common.quantities import shown_in
from pyroshock.app.operations.diagnose.headline import headline
from pyroshock.app.operations.diagnose.page_parts import list_row, stage_cards
from pyroshock.app.operations.diagnose.recommendations import rest_sentence
from pyroshock.app.operations.diagnose.report import effect_rows
from pyroshock.app.operations.diagnose.request import (
    considered_effects,
    full_name,
    restriction_sentences,
    uncertain_numbers,
)
from pyroshock.app.operations.diagnose.statements import nearest_effects, summary
from pyroshock.app.operations.diagnose.texts import (
    next_experiment,
    recommendations,
    where_lines,
)
from pyroshock.app.operations.diagnose.waterfall import path_levels, waterfall_rows
from pyroshock.app.operations.diagnose.wording import (
    EFFECT_CHECKS,
    EFFECT_SUBJECTS,
    cause_lines,
    cause_title,
    effect_check,
    effect_subject,
    fitted_words,
    observable_label,
    with_labels,
)
from pyroshock.diagnosis.observables.contact.features import OBSERVABLES
from pyroshock.diagnosis.observables.plate.stage import PlateObservables
from pyroshock.diagnosis.verdict import (
    Cause,
    EffectShare,
    FamilyGap,
    Fitted,
    GapSize,
    NextRun,
    StageShare,
    Unexplained,
    Verdict,
    Where,
)
from pyroshock.twin.effects import catalogue
from support.records import verdicts
from support.records.plate_records import played


# --- every effect and every observable has words of the test bench ---
def test_effects_and_observables_have_words_of_their_own() -> None:
    assert set(EFFECT_SUBJECTS) == set(EFFECT_CHECKS) == set(catalogue())
    assert len(set(EFFECT_SUBJECTS.values())) == len(EFFECT_SUBJECTS)
    for identity in catalogue():
        for words in (effect_subject(identity), effect_check(identity)):
            assert words and "_" not in words and "." not in words, identity
    names = [item.name for item in PlateObservables(played([])).observables]
    labels = {name: observable_label(name) for name in names}
    assert len({label.text for label in labels.values()}) == len(names)
    for name, label in labels.items():
        assert "_" not in label.text and "ln " not in label.text, name
        assert label.relative == ("ln " in name), name
    texts = {
        "ln_width_tenth": "pulse width at 10 % of the peak",
        "ln damping of the mode at 412 Hz": "damping of the mode at 412 Hz",
        "acceleration_1 spectrum at 400 Hz": "shock response spectrum at 400 Hz, acceleration 1",
        "acceleration_2 ln amplitude of the mode at 412 "
        "Hz": "amplitude of the mode at 412 Hz, acceleration 2",
        "left rest from 2 to 5 ms": "level at rest from 2 to 5 ms over the peak, left",
        "left delay": "delay over the contact time, left",
        "a_new_one": "a new one",
    }
    assert {name: observable_label(name).text for name in texts} == texts
    sentence = with_labels("contact: measured less simulated ln_peak rises by 0.1")
    assert sentence == "contact: measured less simulated peak force rises by 0.1"


@pytest.mark.parametrize("name", ["ln_velocity", *(item.name for item in OBSERVABLES)])
def test_features_have_physical_labels(name: str) -> None:
    label = observable_label(name)
    assert (
        "_" not in label.text
        and not label.text.startswith("ln ")
        and label.relative == name.startswith("ln_")
    )


# --- `--with` and `--without`: which effects are left, what a report says of it, and what is
# refused ----------------
GUN = ("gun.back_pressure", "gun.blow_by", "gun.valve_flow", "sensor.velocity_gain")


@pytest.mark.parametrize(("only", "without", "effects"), [
    ((), (), GUN),
    (("gun.valve_flow", "gun.blow_by"), (), ("gun.blow_by", "gun.valve_flow")),
    ((), ("gun.blow_by",), ("gun.back_pressure", "gun.valve_flow", "sensor.velocity_gain")),
    (("gun.valve_flow", "gun.blow_by"), ("gun.blow_by",), ("gun.valve_flow",)),
])  # fmt: skip
def test_effects_that_are_left(only, without, effects) -> None:
    assert considered_effects("spring", GUN, only, without) == effects


@pytest.mark.parametrize(("only", "without", "kind", "message"), [
    ("gun.magic", (), LookupError,
     "--with 'gun.magic': the catalogue has no such effect; it has gun.back_p"),
    ((), "plate.damping", ValueError,
     "--without plate.damping: the channels of spring cannot show this effect; they can show "
     "gun.back_pressure"),
    ("gun.blow_by", "gun.blow_by", ValueError, "leave no effect to consider for spring"),
])  # fmt: skip
def test_effects_that_cannot_be_considered_are_named(only, without, kind, message) -> None:
    with pytest.raises(kind, match=message):
        considered_effects("spring", GUN, (only,) if only else (), (without,) if without else ())


def test_restrictions_size_shares_and_what_the_fit_has_not_seen_are_told() -> None:
    assert restriction_sentences() == ()
    only, without = restriction_sentences(("gun.blow_by",), ("gun.valve_flow", "gun.back_pressure"))
    assert (
        "only gun.blow_by" in only and "not consider gun.valve_flow, gun.back_pressure" in without
    )
    sentences = summary(verdicts.gun())
    assert sentences.startswith(
        "The model error is 42 times the tolerance and 99 times the "
        "measurement noise; it arises in the gun."
    )
    assert (
        "The flow resistance of the valve causes 61 % of it (52 to 68 %), the atmosphere ahead of "
        "the projectile 27 % (20 to 33 %) and the leak past the projectile 9 % (5 to 12 %); 3 % (1 "
        "to 6 %) of the squared error remains unexplained."
    ) in sentences
    assert sentences.endswith("has not seen, 97 % of the error above the noise disappears.")
    path = (replace(verdicts.gun().path[0], fraction=-0.2),)
    assert "has not seen, the error is larger with the effects than without them." in summary(
        verdicts.gun(path=path)
    )
    path = (replace(verdicts.gun().path[0], fraction=0.0),)
    assert "has not seen, none of the error" in summary(verdicts.gun(path=path))


# --- parameters are shown in the units of the field, causes as lists ---
@pytest.mark.parametrize(("name", "unit", "value", "words"), [
    ("gun.valve_flow.opening_time_s", "s", 0.25, "opening time = 250 ms (225 to 275 ms)"),
    ("atmosphere_pa", "Pa", 96500.0, "atmosphere = 0.965 bar (0.868 to 1.062 bar)"),
    ("compliance_m_n", "m/N", 3.4e-8, "compliance = 0.0340 mm/kN (0.0306 to 0.0374 mm/kN)"),
    ("contact.viscous_loss.loss_s_m (0.4)", "s/m", 0.1, "loss (0.4) = 0.10 s/m (0.09 to 0.11 s/m)"),
    ("seal_share", "", 0.1, "seal share = 0.10 (0.09 to 0.11)"),
])  # fmt: skip
def test_parameters_are_shown_in_the_units_of_the_field(
    name: str, unit: str, value: float, words: str
) -> None:
    assert fitted_words(Fitted(name, value, unit, (0.9 * value, 1.1 * value))) == words


def test_value_that_the_part_cannot_have_is_marked_in_table_and_causes() -> None:
    drag = Fitted("drag_coefficient", 21.8, "", (20.0, 23.7))
    marked = "drag coefficient = 21.8 (20.0 to 23.7; outside its range, which ends at 5)"
    assert fitted_words(drag, "gun.barrel_loss") == marked
    at_end = fitted_words(replace(drag, value=5.0), "gun.barrel_loss")
    assert at_end.endswith("; at the end of its range, 5)")
    assert "range" not in fitted_words(replace(drag, value=2.0), "gun.barrel_loss")
    barrel = EffectShare("gun.barrel_loss", 0.9, 0.9, (0.8, 1.0), 0.9, 1, (drag,), named=True)
    verdict = verdicts.gun(effects=(barrel,))
    assert next(row[-1] for row in effect_rows(verdict)) == marked
    named = replace(drag, name="gun.barrel_loss.drag_coefficient")
    single, alternatives = (
        Cause(("gun.barrel_loss",), 0.9, (drag,)),
        Cause(("gun.valve_flow+gun.barrel_loss", "gun.valve_flow"), 0.9, (named,)),
    )
    assert all(
        any(marked in line for line in cause_lines(cause)) for cause in (single, alternatives)
    )


def test_parameters_are_shown_in_si_where_it_is_asked_for() -> None:
    with shown_in("si"):
        assert (
            fitted_words(Fitted("opening_time_s", 0.25, "s", (0.2, 0.3)))
            == "opening time = 0.25 s (0.20 to 0.30 s)"
        )


def test_causes_are_lists_of_effects_without_a_plus_sign() -> None:
    joint, _, other, agreement = verdicts.gun().causes
    assert cause_title(joint) == "3 effects together" and len(cause_lines(joint)) == 3
    assert cause_lines(joint)[0] == (
        "gun.valve_flow, the flow resistance of the valve: loss coefficient = 31 (27 to 36)"
    )
    assert cause_title(other) == "A cause that is not in the catalogue" and cause_lines(other) == []
    assert cause_title(agreement) == "Model and measurement agree"
    group = Cause(("gun.valve_flow+gun.blow_by", "gun.valve_flow"), 0.8, split=(0.7, 0.3))
    assert cause_lines(group) == [
        "In every answer: gun.valve_flow, the flow resistance of the valve",
        "Answer 1 (70 %): gun.blow_by, the leak past the projectile",
        "Answer 2 (30 %): no further effect",
    ]
    assert "+" not in "".join(cause_lines(group))


# --- names of uncertain numbers: each has one owner, and a slip of the pen is answered with the
# right name ----------
EVERY = [(stage, number) for stage, numbers in uncertain_numbers().items() for number in numbers]


@pytest.mark.parametrize(("stage", "number"), EVERY)
def test_every_number_is_known_with_and_without_its_stage(stage: str, number: str) -> None:
    assert full_name(number) == full_name(f"{stage}.{number}") == f"{stage}.{number}"


@pytest.mark.parametrize(("name", "answer"), [
    ("mass_bullet_kg", "the nearest is gun.bullet_mass_kg"),
    ("contact.travel", "the nearest is gun.travel_m"),
    ("q", r"there are gun\.tank_volume_m3, .*contact\.impactor_mass_kg"),
])  # fmt: skip
def test_a_slip_is_answered_with_the_nearest_or_all(name: str, answer: str) -> None:
    with pytest.raises(ValueError, match=f"no number '{name}'; {answer}"):
        full_name(name)


# --- the first sentences say what the verdict holds, in plain words and no more ---
def in_stages(*shares: float) -> Verdict:
    names = ("gun", "contact", "plate")
    stages = tuple(
        StageShare(name, share, (0.0, 1.0), 1.0) for name, share in zip(names, shares, strict=False)
    )
    return verdicts.gun(where=Where(stage=stages))


@pytest.mark.parametrize(("shares", "words"), [
    ((0.92, 0.08), "; most of it arises in the gun (92 %)."),
    ((0.45, 0.35, 0.2), "; it arises in the gun (45 %), the contact (35 %) and the plate (20 %)."),
    ((0.4, 0.6), "; most of it arises in the contact (60 %)."),
    ((), "times the measurement noise."),
])  # fmt: skip
def test_stage_is_named_as_clearly_as_the_shares_allow(
    shares: tuple[float, ...], words: str
) -> None:
    assert words in summary(in_stages(*shares))


def own_errors(*stages: tuple[str, float, tuple[float, float]]) -> Where:
    return Where(
        stage=tuple(
            StageShare(name, 0.5, (0.0, 1.0), own, own_ci90) for name, own, own_ci90 in stages
        )
    )


def test_stages_that_are_off_alike_are_told_as_a_near_tie() -> None:
    contact, gun, plate = (
        ("contact", 3.1, (2.6, 3.5)),
        ("gun", 3.0, (2.7, 3.4)),
        ("plate", 0.4, (0.1, 0.7)),
    )
    assert (
        "The contact and the gun are off by nearly the same (3.1 and 3 times their tolerances): "
        "these runs cannot rank them."
    ) in summary(verdicts.gun(where=own_errors(contact, gun, plate)))
    # 30.7 + 7.7 reaches 34.8, although 34.8 - 1.9 does not reach 30.7; 2.4 + 0.3 and 3.1 - 0.5 do
    # not meet in squares.
    assert "nearly the same" in summary(
        verdicts.gun(where=own_errors(("contact", 34.8, (32.9, 36.7)), ("gun", 30.7, (21.2, 38.4))))
    )
    for other in (plate, ("gun", 2.4, (2.1, 2.7))):
        assert "nearly the same" not in summary(verdicts.gun(where=own_errors(contact, other)))
    assert "its own error is 3.1 (2.6 to 3.5) tolerances." in "".join(
        where_lines(own_errors(contact))
    )


def test_stage_that_is_off_most_by_itself_is_told_where_another_has_the_larger_share() -> None:
    contact = StageShare("contact", 0.3, (0.2, 0.4), 35.0, (33.0, 37.0))
    gun = StageShare("gun", 0.7, (0.6, 0.8), 23.0, (17.0, 28.0))
    sentences = summary(verdicts.gun(where=Where(stage=(contact, gun))))
    assert (
        "; most of it arises in the gun (70 %). Given its measured input, "
        "the contact is off most (35 tol" in sentences
    )
    assert "off most" not in summary(
        verdicts.gun(where=Where(stage=(replace(contact, share=0.8), gun)))
    )


def test_cause_that_the_error_hardly_feels_is_told_with_where_it_shows() -> None:
    families = (
        FamilyGap("damping", 0.31, 0.01, 0.1, True),
        FamilyGap("spectrum", 0.32, 0.1, 0.5, False),
    )
    within = GapSize(
        "rms error of the shock response spectrum (dB)", 0.32, 0.1, 0.5, False, families
    )
    sentence = (
        "It hardly matters for the size of the error, which is within tolerance; "
        "it shows in the damping (3.1 times "
    )
    assert sentence in summary(verdicts.gun(gap=within))
    assert "hardly matters" not in summary(verdicts.gun())
    # A background beyond its tolerance is no finding, and is said to be one.
    rough = replace(within, families=(replace(families[0], before=0.14), families[1]))
    assert "agree within the errors that a simulator has without any effect: the model" in summary(
        replace(verdicts.none(), gap=rough)
    )
    assert "Model and measurement agree: the model" in summary(verdicts.none())


def test_unnamed_effects_and_credible_sets_are_told_as_one() -> None:
    valve, atmosphere, leak, dead = verdicts.gun().effects
    effects = (valve, replace(atmosphere, named=False), replace(leak, named=False), dead)
    sentences = summary(verdicts.gun(effects=effects))
    assert "the atmosphere" not in sentences
    assert (
        "effects that the data do not establish take 36 % away where they were fitted and 3 % (1 "
        "to 6 %) of the squared error remains unexplained" in sentences
    )
    barrel = EffectShare("gun.barrel_loss", 0.4, 0.1, (0.0, 0.6), 0.1, valve.credible_set)
    alike_two = verdicts.gun(effects=(replace(valve, share=0.51), atmosphere, barrel, leak))
    assert [len(own.effects) for own in alike_two.cause_sets] == [2, 1, 1]
    assert (
        "The flow resistance of the valve or the flow resistance of the barrel (which these runs "
        "cannot tell apart) causes 61 % of it, the atmosphere"
    ) in summary(alike_two)
    alike = ("gun.barrel_loss", "gun.sliding_friction", "gun.heat_exchange", "gun.dead_volume")
    others = tuple(replace(valve, effect=name, share=0.05, named=False) for name in alike)
    assert (
        "The flow resistance of the valve, the flow resistance of the barrel, the friction of the "
        "projectile in the barrel or 2 more (which these runs cannot tell apart) causes 81 % of it"
    ) in summary(verdicts.gun(effects=(valve, *others)))


def test_agreement_needs_no_effect_and_unknown_says_what_remains() -> None:
    sentences = summary(verdicts.none())
    assert sentences.startswith(
        "Model and measurement agree: the model error is 0.8 times the tolerance"
    )
    assert sentences.endswith("No effect is needed to explain it (97 %).")
    sentences = summary(verdicts.unknown())
    assert "most of it arises in the contact (80 %)" in sentences
    assert (
        "(unknown: 90 %): 55 % (40 to 80 %) of the squared error remains unexplained; the "
        "damping of the contact comes near" in sentences
    )
    assert "disappears" not in sentences
    sentences = summary(
        verdicts.gun(causes=(Cause(("unknown",), 0.7), Cause(("none",), 0.3)), unexplained=None)
    )
    assert (
        "explain only a part of it (unknown: 70 %). The flow resistance of the valve causes 61 %"
        in sentences
    )


@pytest.mark.parametrize(("cause", "words"), [
    (Cause(("gun.blow_by",), 0.9), "Most probably the leak past the projectile causes it (90 %)."),
    (
        Cause(("gun.blow_by+sensor.force_gain",), 0.9),
        "the leak past the projectile and the sensitivity of the force channel cause it together "
        "(90 %).",
    ),
    (
        Cause(("gun.valve_flow", "gun.barrel_loss"), 0.9),
        "it is the flow resistance of the valve or the flow resistance of the barrel, which these "
        "runs cannot tell apart (together 90 %).",
    ),
    (Cause(("gun.blow_by",), 0.3),
     "No cause stands out; the likeliest is the leak past the projectile (30 %)."),
])  # fmt: skip
def test_verdict_without_shares_is_told_by_its_causes(cause: Cause, words: str) -> None:
    whole = verdicts.verdict()
    assert words in summary(replace(whole, causes=(cause, *whole.causes[1:])))


def test_unknown_noise_is_left_out_and_fractions_are_held_out() -> None:
    sentences = summary(verdicts.gun(gap=GapSize("rms", 0.42, 0.0, 0.01, True)))
    assert sentences.startswith("The model error is 42 times the tolerance; ")
    nothing = summary(verdicts.gun(gap=GapSize("rms", float("nan"), float("nan"), 0.01, True)))
    assert nothing.startswith("The model error is of unknown size; ")
    nearest = [effect.effect for effect in nearest_effects(verdicts.unknown())]
    assert (
        nearest == ["contact.viscous_loss", "contact.plastic_yield"]
        and verdicts.gun().held_out_fraction == 0.97
    )
    assert (
        verdicts.verdict().held_out_fraction == 0.94
        and verdicts.verdict(shrinkage=()).held_out_fraction is None
    )
    sentences = summary(
        verdicts.gun(effects=verdicts.gun().effects[:1], unexplained=Unexplained(0.39, (0.3, 0.5)))
    )
    assert sentences.count("39 % (30 to 50 %) of the squared error remains unexplained") == 1


#: What no effect explains, in a share of the squared error and its interval, and whether it is a
#: part of that error at all.
REMAINDERS = (
    (0.0, (-0.4, 0.38), True),
    (0.004, (-0.38, 0.40), True),
    (0.55, (0.4, 1.3), True),
    (1.0, (0.7, 1.6), True),
    (1.3, (0.9, 2.1), False),
    (2.837, (0.679, 8.414), False),
)


@pytest.mark.parametrize(("share", "ci90", "is_part"), REMAINDERS)
@pytest.mark.parametrize("verdict", [verdicts.unknown(), verdicts.gun()], ids=["unknown", "causes"])
def test_what_remains_is_a_part_of_the_squared_error_or_said_in_words(
    verdict: Verdict, share: float, ci90: tuple[float, float], is_part: bool
) -> None:
    sentences = summary(replace(verdict, unexplained=Unexplained(share, ci90)))
    (remains,) = [part for part in re.split(r"[;:.] ", sentences) if "unexplained" in part]
    percents = [int(digits) for digits in re.findall(r"-?\d+(?=(?: to -?\d+)? %)", remains)]
    assert all(0 <= value <= 100 for value in percents)
    if is_part:
        assert percents and "of the squared error remains unexplained" in remains
    else:
        assert not percents and "the error is larger than without any" in remains


@pytest.mark.parametrize(("inclusion", "words"), [
    (0.999, "each acts with a probability of > 99 %,"),
    (0.97, "each acts with a probability of at least 97 %,"),
])  # fmt: skip
def test_near_certainty_is_not_said_to_be_at_least_more_than_itself(
    inclusion: float, words: str
) -> None:
    effects = tuple(replace(own, inclusion=inclusion) for own in verdicts.gun().effects[:3])
    made = verdicts.gun(effects=effects, causes=(Cause(("gun.valve_flow",), 0.9),))
    text = " ".join(sentence.text for sentence in headline(made))
    assert words in text and "at least >" not in text + summary(made)


@pytest.mark.parametrize(("share", "text", "note"), [
    (-0.33, "-33 %", "their effects hide a part of the error"),
    (0.12, "12 %", "explained by their effects"),
])  # fmt: skip
def test_a_negative_share_of_the_sensors_is_said_to_hide_a_part(
    share: float, text: str, note: str
) -> None:
    sensor = replace(verdicts.gun().effects[0], effect="sensor.force_gain", share=share)
    card = stage_cards(verdicts.gun(effects=(sensor,)))[-1]
    assert (card.text, card.note) == (text, note)


@pytest.mark.parametrize(
    "verdict",
    [verdicts.explored(), verdicts.gun(), verdicts.unknown(), verdicts.verdict()],
    ids=["explored", "gun", "unknown", "contact"],
)
def test_headline_waterfall_and_list_have_one_size(verdict: Verdict) -> None:
    size = verdict.gap.before / verdict.gap.tolerance
    assert f"is {times(size)} times the tolerance" in headline(verdict)[0].text
    assert (
        f"is {times(size)} times the tolerance" in list_row({"adopted": None}, verdict)["sentence"]
    )
    bars = waterfall_rows(verdict, path_levels(verdict))
    assert bars[0].end == pytest.approx(size, rel=1e-12)
    stages = [card.share for card in stage_cards(verdict)[:-1] if card.share is not None]
    assert not stages or sum(stages) == pytest.approx(1.0, abs=0.011)


# --- what to do next: two to five full sentences, and under unknown always an experiment ---
BARE = Where()
UNKNOWN_ALONE = replace(
    verdicts.unknown(),
    effects=(),
    unexplained=None,
    path=(),
    where=BARE,
    causes=(Cause(("unknown",), 1.0),),
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
    assert next_experiment(made) and 2 <= len(steps) <= 5
    for step in steps:
        assert step[0].isupper() and step.endswith(".")


@pytest.mark.parametrize("made", [verdicts.unknown(), UNKNOWN_ALONE], ids=["where", "nowhere"])
def test_unknown_has_an_experiment_and_a_measurement(made: Verdict) -> None:
    runs, measurement = next_experiment(made)
    assert runs.startswith("Fire three repetitions") and measurement.startswith("Measure ")
    assert not any("needed" in line for line in (runs, measurement))
    assert set(next_experiment(made)) <= set(recommendations(made))


def test_predicting_set_is_adopted_and_others_are_told_apart() -> None:
    command = "pyroshock diagnose spring --adopt gun.valve_flow,gun.back_pressure,gun.blow_by."
    assert recommendations(verdicts.gun())[0].endswith(command)
    assert (
        "pyroshock diagnose 'spring 2' --adopt"
        in recommendations(verdicts.gun(campaign="spring 2"))[0]
    )
    path = (replace(verdicts.gun().path[0], fraction=0.2),)  # does not predict
    assert recommendations(verdicts.gun(path=path))[0].startswith(
        "Do not adopt the flow resistance of the valve, "
    )
    (line,) = next_experiment(verdicts.verdict())
    assert line == (
        "Fire 4 runs at tank pressure 0.3 bar, bullet mass 1 kg and tip "
        "material steel: this separates the "
        "compliance of the insulating layer from the plate that gives way under the impact."
    )
    (line, *_) = next_experiment(verdicts.verdict(next_runs=()))
    assert line.startswith(
        "These runs cannot tell whether the compliance of the insulating layer or the plate that"
    )
    assert effect_check("contact.layer_compliance") in line


@pytest.mark.parametrize(("why", "runs", "line"), [
    (
        "separates gun.valve_flow from gun.barrel_loss only to 0.2 of the 4 standard deviations "
        "that it takes", 30,
        "Even 30 runs at tank pressure 0.9 bar would not separate the flow resistance of the "
        f"valve from the flow resistance of the barrel; measure {effect_check('gun.valve_flow')} "
        f"or {effect_check('gun.barrel_loss')} instead.",
    ),
    (
        "separates gun.valve_flow from gun.blow_by+gun.valve_flow only to 0.2 of the 4 standard "
        "deviations", 30,
        "Even 30 runs at tank pressure 0.9 bar would not separate the flow resistance of the valve "
        "from the leak past the projectile with the flow resistance of the valve; measure the "
        "clearance between projectile and barrel with a bore gauge instead.",
    ),
    (
        "shows whether gun.blow_by acts", 1,
        "Fire 1 run at tank pressure 0.9 bar: this shows whether the leak past the projectile "
        "acts.",
    ),
])  # fmt: skip
def test_run_that_cannot_decide_says_what_to_measure_instead(
    why: str, runs: int, line: str
) -> None:
    run = NextRun(why, {"tank_pressure_bar": 0.9}, runs)
    assert next_experiment(verdicts.verdict(next_runs=(run,))) == (line,)


def test_large_rest_says_where_it_lies_in_its_main_stage() -> None:
    where = verdicts.unknown().where
    steps = recommendations(verdicts.gun(unexplained=Unexplained(0.3, (0.2, 0.4)), where=where))
    assert any(
        "where striker = 254 mm" in step and "peak force of the contact falls" in step
        for step in steps
    )
    assert not any("striker" in step for step in recommendations(verdicts.gun(where=where)))
    contact = verdicts.unknown().where
    assert "in the force from 0.1 to 0.4 ms and in the force from 800 to 4000 Hz" in str(
        rest_sentence(verdicts.unknown())
    )
    gun = replace(
        contact,
        stage=(
            StageShare("gun", 0.9, (0.8, 1.0), 9.0),
            StageShare("contact", 0.1, (0.0, 0.2), 1.0),
        ),
    )
    assert "force from" not in str(rest_sentence(verdicts.unknown(where=gun)))


def test_ends_of_ranges_repetitions_and_nearest_effects_are_said() -> None:
    valve, *others = verdicts.gun().effects
    end = Fitted("loss_coefficient", 10000.0, "", (9000.0, 10000.0))
    steps = recommendations(verdicts.gun(effects=(replace(valve, parameters=(end,)), *others)))
    miss = (
        "The loss coefficient of the flow resistance of the valve is fitted as "
        "10000, beyond its range"
    )
    assert any(step.startswith(miss) and "not offered for adoption" in step for step in steps)
    assert not any("miss of the law" in step for step in recommendations(verdicts.gun()))
    note = (
        "floor assumed: nothing was repeated, the scatter of one run is the sensors' data sheets'"
    )
    assert any(
        step.startswith("Repeat three")
        for step in recommendations(verdicts.gun(assumptions=(note,)))
    )
    assert not any(step.startswith("Repeat three") for step in recommendations(verdicts.gun()))
    first = recommendations(verdicts.unknown())[0]
    assert "the damping of the contact, which takes 31 % of the error away" in first
    assert (
        "the plastic yield of tip or target 14 %; the effects of the path together take 38 %"
        in first
    )
    bare = replace(verdicts.unknown(), effects=(), path=(), unexplained=None)
    sentence = "The nearest answer of the catalogue is the flow resistance of the valve (8 %)."
    assert recommendations(bare)[0] == sentence
