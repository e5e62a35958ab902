"""Every effect and every observable has words of the test bench."""

from __future__ import annotations

import pytest
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


def test_names_are_those_of_the_catalogue() -> None:
    assert set(EFFECT_SUBJECTS) == set(EFFECT_CHECKS) == set(catalogue())


def test_no_two_effects_share_a_name() -> None:
    assert len(set(EFFECT_SUBJECTS.values())) == len(EFFECT_SUBJECTS)


@pytest.mark.parametrize("identity", list(catalogue()))
def test_names_are_words_and_no_ids(identity: str) -> None:
    for words in (effect_subject(identity), effect_check(identity)):
        assert words and "_" not in words and "." not in words


@pytest.mark.parametrize("name", ["ln_velocity", *(item.name for item in OBSERVABLES)])
def test_features_have_physical_labels(name: str) -> None:
    label = observable_label(name)
    assert "_" not in label.text and not label.text.startswith("ln ")
    assert label.relative == name.startswith("ln_")


def test_observables_of_a_plate_have_physical_labels() -> None:
    names = [item.name for item in PlateObservables(played([])).observables]
    labels = {name: observable_label(name) for name in names}
    assert len({label.text for label in labels.values()}) == len(names)
    for name, label in labels.items():
        assert "_" not in label.text and "ln " not in label.text, name
        assert label.relative == ("ln " in name), name


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("ln_width_tenth", "pulse width at 10 % of the peak"),
        ("ln damping of the mode at 412 Hz", "damping of the mode at 412 Hz"),
        ("acceleration_1 spectrum at 400 Hz", "shock response spectrum at 400 Hz, acceleration 1"),
        ("acceleration_2 ln amplitude of the mode at 412 Hz", "amplitude of the mode at 412 Hz, acceleration 2"),
        ("left rest from 2 to 5 ms", "level at rest from 2 to 5 ms over the peak, left"),
        ("left delay", "delay over the contact time, left"),
        ("a_new_one", "a new one"),
    ],
)
def test_labels(name: str, text: str) -> None:
    assert observable_label(name).text == text


def test_sentences_get_labels() -> None:
    assert with_labels("contact: measured less simulated ln_peak rises by 0.1") == (
        "contact: measured less simulated peak force rises by 0.1"
    )
