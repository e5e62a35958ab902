"""Sets of effects that these runs cannot tell apart are named alike wherever a cause is named."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.app.common.number_format import percent
from pyroshock.app.documents.document import Table
from pyroshock.app.operations.diagnose.page_parts import list_row, parts_of
from pyroshock.app.operations.diagnose.report import (
    EFFECT_COLUMNS,
    GAIN,
    effect_rows,
    page,
    sections,
    verdict_of,
)
from pyroshock.app.operations.diagnose.report_charts import path_rows, share_rows
from pyroshock.app.operations.diagnose.service import GapDiagnosis
from pyroshock.app.operations.diagnose.statements import drawn_effects, is_unknown, summary
from pyroshock.app.operations.diagnose.stored import verdict_from_json, verdict_to_json
from pyroshock.app.operations.diagnose.texts import (
    next_experiment,
    recommendations,
    shrinkage_line,
)
from pyroshock.app.operations.diagnose.wording import (
    ALIKE,
    effect_subject,
    set_name,
    single_effects,
)
from pyroshock.app.twins.adopted_effects import offered
from pyroshock.diagnosis.verdict import (
    NONE,
    OTHERS,
    UNKNOWN,
    AveragedEffects,
    Cause,
    EffectSet,
    EffectShare,
    Fitted,
    PathStep,
    SettledBy,
    Unexplained,
    Verdict,
    WeightedEffects,
    stage_figure,
)
from pyroshock.twin.effects import catalogue, effect
from support.records import verdicts

VALVE = effect("gun.valve_flow", steady_loss_coefficient=21.9)
BORE = effect("gun.barrel_loss", drag_coefficient=3.0)
NAMES = ("gun.barrel_loss", "gun.valve_flow")
SUBJECTS = "the flow resistance of the barrel or the flow resistance of the valve"


def alike(**changed: object) -> Verdict:
    """Valve or bore, which the runs cannot tell apart, and a leak that is established."""
    drag, loss = (
        Fitted("drag_coefficient", 3.0, "", (2.7, 3.3)),
        Fitted("steady_loss_coefficient", 21.9, "", (20, 24)),
    )
    whole = verdicts.gun(
        causes=(
            Cause((f"{NAMES[0]}+gun.blow_by", f"{NAMES[1]}+gun.blow_by"), 0.84, (), (0.52, 0.48)),
            Cause((UNKNOWN,), 0.1),
            Cause((NONE,), 0.06),
        ),
        effects=(
            EffectShare(NAMES[0], 0.54, 0.4, (0.0, 0.9), 0.7, 1, (drag,), named=True),
            EffectShare(NAMES[1], 0.47, 0.37, (0.0, 0.9), 0.69, 1, (loss,), named=True),
            EffectShare("gun.blow_by", 0.97, 0.17, (0.1, 0.2), 0.2, 2, named=True),
            EffectShare("gun.dead_volume", 0.12, 0.03, (0.0, 0.1), 0.0),
        ),
        sets=(
            EffectSet(NAMES, 0.98, 0.77, (0.7, 0.84), 0.71),
            EffectSet(("gun.blow_by",), 0.97, 0.17, (0.1, 0.2), 0.2),
        ),
        unexplained=Unexplained(0.03, (0.01, 0.06)),
        path=(
            PathStep(" or ".join(NAMES), 0.12, 0.72),
            PathStep("gun.blow_by", 0.05, 0.89),
            PathStep(OTHERS, 0.0126, 0.97),
        ),
        averaged=AveragedEffects(
            (
                WeightedEffects(0.53, (BORE, verdicts.LEAK), 0.06),
                WeightedEffects(0.47, (VALVE, verdicts.LEAK), 0.055),
            ),
            0.05,
        ),
        fits={
            "gun.barrel_loss+gun.blow_by": (BORE, verdicts.LEAK),
            "gun.valve_flow+gun.blow_by": (VALVE, verdicts.LEAK),
        },
    )
    return replace(whole, **changed)


def test_set_is_named_once_and_alike_everywhere() -> None:
    name = f"{SUBJECTS} ({ALIKE})"
    assert set_name(NAMES) == name
    verdict = alike()
    assert f"{name.capitalize()[0]}{name[1:]} causes 77 % of it (70 to 84 %)" in summary(verdict)
    assert summary(verdict).endswith(
        "97 % of the error above the noise disappears."
    )  # where the path ends
    rows = [dict(zip(EFFECT_COLUMNS, row, strict=True)) for row in effect_rows(verdict)]
    assert [row["effect"] for row in rows[:4]] == [" or ".join(NAMES), *NAMES, "gun.blow_by"]
    assert [row["cause"] for row in rows[:5]] == ["yes", "in set 1", "in set 1", "yes", "no"]
    assert (rows[0]["name"], rows[0]["share"], rows[0]["90 % interval"]) == (
        name,
        "77 %",
        "70 to 84 %",
    )
    short = SUBJECTS.replace("the flow", "flow")
    assert [row.name for row in path_rows(verdict)][1:4] == [
        f"+ {short}", "+ leak past the projectile", "+ effects that are not established"
    ]  # fmt: skip
    assert [row.name for row in share_rows(verdict)][:2] == [short, "leak past the projectile"]
    listed = list_row({"adopted": None}, verdict)["causes"].replace("\u00a0", " ")
    assert listed == f"{name.removeprefix('the ')} 77 %, leak past the projectile 17 %"
    assert name in page(verdict)
    assert GapDiagnosis(verdict).sets["effects"].tolist() == [" or ".join(NAMES), "gun.blow_by"]
    assert GapDiagnosis(verdict).path["fraction"].iloc[-1] == verdict.held_out_fraction == 0.97
    parts = parts_of(verdict)
    assert parts.rows[0][0] == " or ".join(NAMES)
    assert parts.adoptable["gun.barrel_loss/gun.valve_flow+gun.blow_by"] == (
        "the mean of gun.barrel_loss and gun.valve_flow, with gun.blow_by"
    )


def test_mean_of_a_set_is_offered_and_its_channel_is_named() -> None:
    steps = recommendations(alike())
    command = "pyroshock diagnose spring --adopt gun.barrel_loss/gun.valve_flow,gun.blow_by."
    assert steps[0].startswith("Adopt the mean of what these sets of effects predict") and steps[
        0
    ].endswith(command)
    assert steps[1].startswith(
        f"These runs cannot tell whether {SUBJECTS} acts; to decide, measure the velocity at"
    )
    first, second = alike().sets
    settled = alike(sets=(replace(first, settled_by=SettledBy("tank_pressure", 9.1)), second))
    line = (
        f"To tell whether {SUBJECTS} acts, record the tank pressure: it would tell them apart by "
        "9.1 standard deviations of its noise."
    )
    assert recommendations(settled)[1] == line and line in next_experiment(settled)


def test_fit_that_no_part_has_is_said_and_not_offered() -> None:
    rows = alike().effects
    bore = replace(rows[0], parameters=(Fitted("drag_coefficient", 21.7, "", (19.8, 23.7)),))
    whole = alike().averaged
    assert whole is not None
    verdict = alike(
        effects=(bore, *rows[1:]),
        averaged=AveragedEffects((replace(whole.choices[1], weight=1.0),), 0.055),
    )
    steps = recommendations(verdict)
    assert steps[0].endswith("--adopt gun.valve_flow,gun.blow_by.")
    assert any(
        "21.7, beyond its range, which ends at 5: this is a miss of the law" in step
        for step in steps
    )
    nothing = recommendations(alike(averaged=None))[0]
    assert nothing.startswith(f"Do not adopt {SUBJECTS}") and nothing.endswith(
        "that the parts can have."
    )
    assert offered(alike(averaged=None)) is None


def test_established_effect_of_a_small_error_is_said_to_hardly_matter() -> None:
    damping = EffectSet(("plate.damping",), 0.99, 0.9, (0.8, 1.0), 0.5)
    sentences = summary(replace(verdicts.none(), sets=(damping,)))
    assert sentences.endswith(
        "The damping of the plate acts with a probability of 99 %, and "
        "hardly matters for this error."
    )


def test_larger_sets_are_offered_where_the_smaller_ones_have_no_possible_values() -> None:
    verdict = alike(averaged=AveragedEffects((WeightedEffects(1.0, (VALVE,), 0.09),), 0.09))
    best = offered(verdict)
    assert best is not None and best.name == "gun.valve_flow"
    step = recommendations(verdict)[0]
    assert step.startswith(
        f"Adopt {effect_subject('gun.valve_flow')}, and not {effect_subject('gun.blow_by')}: "
    )
    assert step.endswith("--adopt gun.valve_flow.")


def test_report_and_kept_diagnosis_keep_the_sets() -> None:
    report, details = verdict_to_json(alike())
    assert report["sets"][0] == {
        "effects": list(NAMES), "inclusion": 0.98, "share": 0.77, "ci90": [0.7, 0.84],
        "held_out_gain": 0.71,
        "settled_by": None,
    }  # fmt: skip
    kept_verdict = verdict_from_json(report, details)
    assert (kept_verdict.sets, kept_verdict.averaged, kept_verdict.path) == (
        alike().sets,
        alike().averaged,
        alike().path,
    )
    assert summary(verdict_of(report)) == summary(alike())
    settled = replace(alike().sets[0], settled_by=SettledBy("tank_pressure", 9.1))
    assert verdict_from_json(*verdict_to_json(alike(sets=(settled,)))).sets == (settled,)


def random_verdict(seed: int) -> Verdict:
    """Sets, shares and answers at random, also such as do not agree with each other."""
    rng = np.random.default_rng(seed)
    names = [name for name in catalogue() if name.startswith(("gun.", "sensor.p", "sensor.v"))]
    rng.shuffle(names)
    sizes = [int(size) for size in rng.choice([1, 1, 1, 2, 3], rng.integers(0, 4))]
    shares = rng.dirichlet(np.ones(len(names) + 1))
    effects = [
        EffectShare(name, float(rng.uniform()), float(share), (0.0, 1.0), float(rng.normal()))
        for name, share in zip(names, shares, strict=False)
    ]
    sets, at = [], 0
    for size in sizes:
        members, at = effects[at : at + size], at + size
        share = float(sum(row.share for row in members))
        sets.append(EffectSet(tuple(row.effect for row in members), 0.9, share, (0.0, 1.0), 0.5))
    sets.sort(key=lambda own: -own.share)
    number = {name: i for i, own in enumerate(sets, start=1) for name in own.effects}
    effects = [
        replace(row, credible_set=number.get(row.effect), named=row.effect in number)
        for row in effects
    ]
    first = [
        "+".join(rng.choice(names, rng.integers(1, 4), replace=False))
        for _ in range(rng.integers(1, 4))
    ]
    answers = [(NONE,), (UNKNOWN,), tuple(dict.fromkeys(first)), tuple(dict.fromkeys(first))]
    cause = Cause(answers[rng.integers(len(answers))], 0.7)
    others = [Cause((name,), 0.15) for name in (NONE, UNKNOWN) if cause.effects != (name,)]
    return verdicts.gun(
        causes=(cause, *others),
        effects=tuple(sorted(effects, key=lambda row: -row.share)),
        sets=tuple(sets),
        unexplained=Unexplained(float(shares[-1]), (0.0, 1.0)),
        path=tuple(PathStep(own.name, 0.1, 0.8) for own in sets),
        averaged=None,
        fits={},
    )


@pytest.mark.parametrize("seed", range(60))
def test_headline_never_contradicts_the_table(seed: int) -> None:
    verdict = random_verdict(seed)
    sentences = summary(verdict)
    rows = [dict(zip(EFFECT_COLUMNS, row, strict=True)) for row in effect_rows(verdict)]
    words = {str(row["effect"]): row["cause"] for row in rows}
    # No effect of the first answer is "no" in the table.
    if verdict.first.effects[0] not in (NONE, UNKNOWN):
        assert all(words[name] != "no" for name in single_effects(verdict.first.effects))
    # The first name of the headline is that of the first set of the table, of the charts and of the
    # path.
    sets = [row for row in rows if row["cause"] == "yes"]
    if verdict.sets and not is_unknown(verdict):
        subject = set_name(verdict.sets[0].effects)
        places = {row["name"]: sentences.lower().find(str(row["name"]).lower()) for row in sets}
        assert places[subject] == min(places.values()) >= 0
        assert sets[0]["name"] == rows[0]["name"] == subject
        assert path_rows(verdict)[1].name.startswith(
            f"+ {effect_subject(verdict.sets[0].effects[0])[4:]}"
        )
        assert share_rows(verdict)[0].name.startswith(
            effect_subject(verdict.sets[0].effects[0])[4:]
        )
    # Every set has one row that says yes, and each of its effects is in it; every effect has one
    # row.
    assert len(sets) == len(verdict.sets)
    for number, own in enumerate(verdict.sets, start=1):
        expected = "yes" if len(own.effects) == 1 else f"in set {number}"
        assert all(words[name] == expected for name in own.effects)
    assert {row.effect for row in verdict.effects} <= set(words)
    assert len(rows) == len(verdict.effects) + sum(len(own.effects) > 1 for own in verdict.sets) + 1
    # The advice names no effect for adoption that is neither a cause nor in the first answer.
    assert recommendations(verdict)


def test_pictures_say_which_effects_they_are_drawn_with() -> None:
    def said(verdict: Verdict, *drawn: tuple[str, ...]) -> str:
        return drawn_effects(
            replace(verdict, pictures=replace(verdict.pictures, drawn_effects=drawn))
        )

    valve, barrel = (effect_subject(name) for name in ("gun.valve_flow", "gun.barrel_loss"))
    assert (
        said(verdicts.gun(), ("gun.valve_flow",))
        == f"The model with effects has {valve}, fitted to all runs."
    )
    mean = said(verdicts.gun(), ("gun.valve_flow",), ("gun.barrel_loss",))
    assert "the mean of 2 predictions" in mean and f"with {valve} or with {barrel}." in mean
    assert said(verdicts.unknown(), ("gun.valve_flow",)).endswith(
        "The data do not establish them as causes."
    )
    assert said(verdicts.gun()) == ""
    verdict = verdicts.gun()
    verdict = replace(
        verdict, pictures=replace(verdict.pictures, drawn_effects=(("gun.valve_flow",),))
    )
    assert drawn_effects(verdict) in page(verdict) and "first cause" not in page(verdict)
    assert verdict_from_json(*verdict_to_json(verdict)).pictures.drawn_effects == (
        ("gun.valve_flow",),
    )


def test_figures_of_what_was_not_seen_have_their_units() -> None:
    verdict = verdicts.gun()
    more = {
        **verdict.shrinkage[0].more,
        stage_figure("gun"): (42.0, 1.26),
        "rms of gun": (0.42, 0.0126),
    }
    (section,) = [
        section_of_page
        for section_of_page in sections(
            replace(verdict, shrinkage=(replace(verdict.shrinkage[0], more=more),))
        )
        if section_of_page.title == "On configurations that the fit has not seen"
    ]
    (table,) = [block for block in section.blocks if isinstance(block, Table)]
    rows = {str(row[0]): tuple(row[1:3]) for row in table.rows}
    assert rows == {
        verdict.gap.metric: (0.42, 0.0126),
        f"{verdict.gap.metric}, with a learned correction of the rest": (0.42, 0.0085),
        "rms error of the gun (in tolerances)": (42.0, 1.26),
        "rms error of the gun alone, in the unit of the first row": (0.42, 0.0126),
    }


def test_line_and_table_of_what_was_not_seen_name_the_sets_of_the_report() -> None:
    """And not those that each fold chose."""
    nominal_verdict = verdicts.gun()
    entry = replace(nominal_verdict.shrinkage[0], effects=("gun.barrel_loss",))
    alike = "gun.valve_flow or gun.barrel_loss"
    path = (PathStep(alike, 0.05, 0.88), PathStep(OTHERS, entry.after, 0.97))
    verdict = replace(nominal_verdict, path=path, shrinkage=(entry,))
    assert shrinkage_line(entry, verdict).startswith(
        f"{alike}, and {OTHERS}: 0.42 before, 0.0126 after, held out by"
    )
    assert list(GapDiagnosis(verdict).shrinkage["effects"]) == [f"{alike}, and {OTHERS}"]
    assert verdict.as_json()["shrinkage"][0]["effects"] == ["gun.barrel_loss"]
    many = replace(verdict, path=path * 2)
    assert shrinkage_line(entry, many).startswith("All 4 steps of the path: ")
    older = replace(verdict, path=())
    assert shrinkage_line(entry, older).startswith("gun.barrel_loss: ")
    assert shrinkage_line(replace(entry, effects=()), older).startswith("No effect: ")


def test_gain_in_the_table_is_not_called_as_the_fraction_of_the_path() -> None:
    """A set takes 99 % after the nominal model and 58 % beside effects that take its place: the
    table says which."""
    verdict = verdicts.gun(path=(PathStep("gun.valve_flow", 0.0126, 0.97),))
    assert (
        percent(verdict.effects[0].held_out_gain) == "58 %"
        and percent(verdict.path[0].fraction) == "97 %"
    )
    html = page(verdict)
    assert f">{GAIN}<" in html and ">held out<" not in html and GAIN in EFFECT_COLUMNS
    assert "adds the first effect to the nominal model" in html
