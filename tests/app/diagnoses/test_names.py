"""Names of effects, observables and numbers: in words of the test bench, and what a slip of the pen is answered."""

from __future__ import annotations

import pytest
from pyroshock.app.diagnose.request import considered_effects, full_name, restriction_sentences, uncertain_numbers
from pyroshock.app.diagnose.wording import (
    EFFECT_CHECKS,
    EFFECT_SUBJECTS,
    effect_check,
    effect_subject,
    observable_label,
    with_labels,
)
from pyroshock.diagnosis.observables.contact.features import OBSERVABLES
from pyroshock.diagnosis.observables.plate.stage import PlateObservables
from pyroshock.twin.effects import catalogue
from support.records.plate_records import played

# --- every effect and every observable has words of the test bench --------------------------------------------------


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
        "acceleration_2 ln amplitude of the mode at 412 Hz": "amplitude of the mode at 412 Hz, acceleration 2",
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
    assert "_" not in label.text and not label.text.startswith("ln ")
    assert label.relative == name.startswith("ln_")


# --- `--with` and `--without`: which effects are left, what a report says of it, and what is refused ----------------

GUN = ("gun.back_pressure", "gun.blow_by", "gun.valve_flow", "sensor.velocity_gain")


@pytest.mark.parametrize(
    ("only", "without", "effects"),
    [
        ((), (), GUN),
        (("gun.valve_flow", "gun.blow_by"), (), ("gun.blow_by", "gun.valve_flow")),
        ((), ("gun.blow_by",), ("gun.back_pressure", "gun.valve_flow", "sensor.velocity_gain")),
        (("gun.valve_flow", "gun.blow_by"), ("gun.blow_by",), ("gun.valve_flow",)),
    ],
)
def test_effects_that_are_left(only, without, effects) -> None:
    assert considered_effects("spring", GUN, only, without) == effects


@pytest.mark.parametrize(
    ("only", "without", "kind", "message"),
    [
        ("gun.magic", (), LookupError, "--with 'gun.magic': the catalogue has no such effect; it has gun.back_p"),
        ((), "plate.damping", ValueError, "--without plate.damping: the channels of spring cannot show this effect; "
         "they can show gun.back_pressure"),
        ("gun.blow_by", "gun.blow_by", ValueError, "leave no effect to consider for spring"),
    ],
)  # fmt: skip
def test_effects_that_cannot_be_considered_are_named(only, without, kind, message) -> None:
    with pytest.raises(kind, match=message):
        considered_effects("spring", GUN, (only,) if only else (), (without,) if without else ())


def test_each_restriction_has_its_sentence() -> None:
    assert restriction_sentences() == ()
    only, without = restriction_sentences(("gun.blow_by",), ("gun.valve_flow", "gun.back_pressure"))
    assert "only gun.blow_by" in only
    assert "not consider gun.valve_flow, gun.back_pressure" in without


# --- names of uncertain numbers: each has one owner, and a slip of the pen is answered with the right name ----------

EVERY = [(stage, number) for stage, numbers in uncertain_numbers().items() for number in numbers]


@pytest.mark.parametrize(("stage", "number"), EVERY)
def test_every_number_is_known_with_and_without_its_stage(stage: str, number: str) -> None:
    assert full_name(number) == full_name(f"{stage}.{number}") == f"{stage}.{number}"


@pytest.mark.parametrize(
    ("name", "answer"),
    [
        ("mass_bullet_kg", "the nearest is gun.bullet_mass_kg"),
        ("contact.travel", "the nearest is gun.travel_m"),
        ("q", r"there are gun\.tank_volume_m3, .*contact\.impactor_mass_kg"),
    ],
)
def test_a_slip_is_answered_with_the_nearest_or_all(name: str, answer: str) -> None:
    with pytest.raises(ValueError, match=f"no number '{name}'; {answer}"):
        full_name(name)
