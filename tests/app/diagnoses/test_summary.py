"""The first sentences of a report say what the verdict holds, in plain words and no more."""

from __future__ import annotations

from dataclasses import replace

import pytest
from pyroshock.app.diagnose.summary import held_out_fraction, named_groups, nearest_effects, summary
from pyroshock.diagnosis.verdict import Cause, EffectShare, GapSize, StageShare, Unexplained, Verdict, Where
from support.records import verdicts


def in_stages(*shares: float) -> Verdict:
    names = ("gun", "contact", "plate")
    stages = tuple(StageShare(name, share, (0.0, 1.0), 1.0) for name, share in zip(names, shares, strict=False))
    return verdicts.gun(where=Where(stage=stages))


def test_size_shares_and_what_the_fit_has_not_seen_are_told() -> None:
    sentences = summary(verdicts.gun())
    assert sentences.startswith(
        "The model error is 42 times the tolerance and 99 times the measurement noise; it arises in the gun."
    )
    assert (
        "The flow resistance of the valve causes 61 % of it (52 to 68 %), the atmosphere ahead of the projectile 27 % "
        "(20 to 33 %) and the leak past the projectile 9 % (5 to 12 %); 3 % (1 to 6 %) remains unexplained."
    ) in sentences
    assert sentences.endswith("has not seen, 97 % of the error above the noise disappears.")
    path = (replace(verdicts.gun().path[0], fraction=-0.2),)
    assert "has not seen, none of the error" in summary(verdicts.gun(path=path))


@pytest.mark.parametrize(
    ("shares", "words"),
    [
        ((0.92, 0.08), "; most of it arises in the gun (92 %)."),
        ((0.45, 0.35, 0.2), "; it arises in the gun (45 %), the contact (35 %) and the plate (20 %)."),
        ((0.4, 0.6), "; most of it arises in the contact (60 %)."),
        ((), "times the measurement noise."),
    ],
)
def test_stage_is_named_as_clearly_as_the_shares_allow(shares: tuple[float, ...], words: str) -> None:
    assert words in summary(in_stages(*shares))


def test_unnamed_effects_and_credible_sets_are_told_as_one() -> None:
    valve, atmosphere, leak, dead = verdicts.gun().effects
    effects = (valve, replace(atmosphere, named=False), replace(leak, named=False), dead)
    told = summary(verdicts.gun(effects=effects))
    assert "the atmosphere" not in told
    assert "effects that the data do not establish account for 36 % and 3 % (1 to 6 %) remains unexplained" in told
    valve, atmosphere, leak, _ = verdicts.gun().effects
    barrel = EffectShare("gun.barrel_loss", 0.4, 0.1, (0.0, 0.6), 0.1, valve.credible_set)
    told = verdicts.gun(effects=(replace(valve, share=0.51), atmosphere, barrel, leak))
    assert [len(group) for group in named_groups(told)] == [2, 1, 1]
    assert (
        "The flow resistance of the valve or the flow resistance of the barrel (the data cannot say which) together "
        "cause 61 % of it, the atmosphere"
    ) in summary(told)
    valve = verdicts.gun().effects[0]
    alike = ("gun.barrel_loss", "gun.sliding_friction", "gun.heat_exchange", "gun.dead_volume")
    others = tuple(replace(valve, effect=name, share=0.05, named=False) for name in alike)
    assert (
        "The flow resistance of the valve, the flow resistance of the barrel, the friction of the projectile in the "
        "barrel or 2 more (the data cannot say which) together cause 81 % of it"
    ) in summary(verdicts.gun(effects=(valve, *others)))


def test_agreement_needs_no_effect_and_unknown_says_what_remains() -> None:
    told = summary(verdicts.none())
    assert told.startswith("Model and measurement agree: the model error is 0.8 times the tolerance")
    assert told.endswith("No effect is needed to explain it (97 %).")
    told = summary(verdicts.unknown())
    assert "most of it arises in the contact (80 %)" in told
    assert "(unknown: 90 %): 55 % (40 to 80 %) of it remains unexplained; the damping of the contact comes near" in told
    assert "disappears" not in told
    told = summary(verdicts.gun(causes=(Cause(("unknown",), 0.7), Cause(("none",), 0.3)), unexplained=None))
    assert "explain only a part of it (unknown: 70 %). The flow resistance of the valve causes 61 %" in told


@pytest.mark.parametrize(
    ("cause", "words"),
    [
        (Cause(("gun.blow_by",), 0.9), "Most probably the leak past the projectile causes it (90 %)."),
        (
            Cause(("gun.blow_by+sensor.force_gain",), 0.9),
            "the leak past the projectile and the sensitivity of the force channel cause it together (90 %).",
        ),
        (
            Cause(("gun.valve_flow", "gun.barrel_loss"), 0.9),
            "it is the flow resistance of the valve or the flow resistance of the barrel; these runs cannot tell which "
            "(together 90 %).",
        ),
        (Cause(("gun.blow_by",), 0.3), "No cause stands out; the likeliest is the leak past the projectile (30 %)."),
    ],
)
def test_verdict_without_shares_is_told_by_its_causes(cause: Cause, words: str) -> None:
    whole = verdicts.verdict()
    assert words in summary(replace(whole, causes=(cause, *whole.causes[1:])))


def test_unknown_noise_is_left_out_and_fractions_are_held_out() -> None:
    told = summary(verdicts.gun(gap=GapSize("rms", 0.42, 0.0, 0.01, True)))
    assert told.startswith("The model error is 42 times the tolerance; ")
    nothing = summary(verdicts.gun(gap=GapSize("rms", float("nan"), float("nan"), 0.01, True)))
    assert nothing.startswith("The model error is of unknown size; ")
    nearest = [effect.effect for effect in nearest_effects(verdicts.unknown())]
    assert nearest == ["contact.viscous_loss", "contact.plastic_yield"]
    assert held_out_fraction(verdicts.gun()) == 0.97
    assert held_out_fraction(verdicts.verdict()) == 0.94
    assert held_out_fraction(verdicts.verdict(shrinkage=())) is None
    told = summary(verdicts.gun(effects=verdicts.gun().effects[:1], unexplained=Unexplained(0.39, (0.3, 0.5))))
    assert told.count("39 % (30 to 50 %) remains unexplained") == 1
