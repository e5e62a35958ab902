"""Sentences of a diagnosis say what it found, and no more."""

from __future__ import annotations

from dataclasses import replace

import pytest
from pyroshock.app.reports.sentences import (
    effect_title,
    next_run_line,
    number,
    percent,
    shrinkage_line,
    verdict_sentence,
    where_lines,
)
from pyroshock.diagnosis.verdict import Cause
from pyroshock.twin.effects import catalogue
from support.records import verdicts


def with_first(*effects: str, probability: float = 0.9) -> str:
    whole = verdicts.verdict()
    return verdict_sentence(replace(whole, causes=(Cause(effects, probability), *whole.causes[1:])))


def test_agreement_is_said_to_be_one() -> None:
    assert "measurement and simulator agree" in verdict_sentence(verdicts.none())


def test_unknown_names_the_stage_and_no_effect() -> None:
    told = with_first("unknown")
    assert "in the contact stage" in told and "no effect of the catalogue" in told


def test_group_is_told_as_one() -> None:
    told = verdict_sentence(verdicts.verdict())
    assert "contact.layer_compliance, contact.plate_compliance, which these runs cannot tell apart" in told
    assert "together 93 %" in told and "shrinks by 94 %" in told


def test_two_causes_act_together() -> None:
    assert "gun.blow_by and sensor.force_gain together" in with_first("gun.blow_by+sensor.force_gain")


def test_weak_first_answer_is_not_called_probable() -> None:
    assert "no cause stands out" in with_first("gun.blow_by", probability=0.3)


def test_nothing_to_shrink_is_said() -> None:
    assert shrinkage_line(verdicts.verdict().shrinkage[1]).endswith("no gap to shrink")


def test_next_experiment_names_runs_and_settings() -> None:
    told = next_run_line(verdicts.verdict().next_runs[0])
    assert told.startswith("4 runs at tank_pressure_bar = 0.3, bullet_mass_kg = 1, tip_material = steel: separates")


def test_every_place_has_its_line() -> None:
    assert len(list(where_lines(verdicts.verdict().where))) == 6


@pytest.mark.parametrize("identity", list(catalogue()))
def test_every_effect_has_a_title(identity: str) -> None:
    assert effect_title(identity).startswith(f"{identity}: ")


@pytest.mark.parametrize(
    ("share", "told"), [(1.0, "100 %"), (0.999, "> 99 %"), (0.93, "93 %"), (0.001, "< 1 %"), (0.0, "0 %")]
)
def test_near_certainty_is_not_certainty(share: float, told: str) -> None:
    assert percent(share) == told


@pytest.mark.parametrize(
    ("value", "told"), [(4000.0, "4000"), (0.0123456, "0.0123"), (2.9e7, "2.9e+07"), (3.4e-8, "3.4e-08")]
)
def test_numbers_have_three_digits(value: float, told: str) -> None:
    assert number(value) == told
