"""What a diagnosis says never contradicts its numbers, whatever the report: each claim has its
evidence, each number stands in a cell of a table, and opposite claims are never both made."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pyroshock.app.operations.diagnose.report import verdict_of
from pyroshock.app.operations.diagnose.service import GapDiagnosis
from pyroshock.app.operations.diagnose.statements import CAUSE, FITTED_ONLY, is_unknown
from pyroshock.app.operations.diagnose.wording import effect_subject, set_name, single_effects
from pyroshock.app.operations.operation import Lines, ResultTable
from pyroshock.app.operations.sentence import Sentence, UnfoundedSentenceError
from pyroshock.diagnosis.verdict import LEAST_FRACTION, OTHERS, EffectSet, Verdict
from pyroshock.twin.effects import catalogue
from support.records import verdicts
from support.stores.stores import run_pyroshock

NAMES = tuple(name for name in catalogue() if name.startswith(("gun.", "contact.", "sensor.f")))
#: Numbers that are part of a name or of the method, and no number of the report.
STATED = ("90 % interval", "pulse width at 10 % of the peak")
#: Values around every threshold of the wording, and any other.
SHARES = st.one_of(
    st.sampled_from([0.0, 0.001, 0.004, 0.006, 0.019, 0.021, 0.15, 0.5, 0.89, 0.996, 1.0]),
    st.floats(-0.5, 1.2, allow_nan=False),
)
PROBABILITIES = st.floats(0.0, 1.0, allow_nan=False)
SIZES = st.floats(1e-3, 10.0, allow_nan=False)


@st.composite
def intervals(draw: st.DrawFn) -> list[float]:
    return sorted([draw(SHARES), draw(SHARES)])


@st.composite
def reports(draw: st.DrawFn) -> dict[str, Any]:
    """A report of the contract's shape whose parts need not agree with each other."""
    names = list(draw(st.permutations(NAMES)))[: draw(st.integers(1, 8))]
    split = draw(st.integers(0, min(4, len(names))))
    sets = _sets(draw, names[:split])
    causes = _causes(draw, names)
    gap = {
        "metric": "rms error",
        "before": draw(SIZES),
        "noise_floor": draw(SIZES),
        "tolerance": draw(SIZES),
        "beyond_noise": draw(st.booleans()),
        "families": [
            {
                "family": family,
                "before": draw(SIZES),
                "noise_floor": draw(SIZES),
                "tolerance": draw(SIZES),
                "beyond_noise": draw(st.booleans()),
            }
            for family in draw(st.sampled_from([(), ("velocity",), ("velocity", "damping")]))
        ],
    }
    steps = [" or ".join(own["effects"]) for own in sets] + draw(st.sampled_from([[], [OTHERS]]))
    path = [{"added": step, "after": draw(SIZES), "fraction": draw(SHARES)} for step in steps]
    return {
        "campaign": "spring",
        "simulator": "gun:adiabatic | contact:hertz",
        "gap": gap,
        "where": {
            "stage": [
                {"name": name, "share": draw(SHARES), "ci90": draw(intervals()),
                 "own": draw(SIZES), "own_ci90": draw(st.none() | intervals())}
                for name in draw(st.sampled_from([(), ("gun",), ("gun", "contact")]))
            ],
            "factors": [], "time": [], "frequency": [], "drift": [],
        },
        "causes": causes,
        "shrinkage": draw(st.lists(_shrinkage(), max_size=1)),
        "effects": _effects(draw, names, sets) if draw(st.booleans()) or sets else [],
        "unexplained": draw(
            st.none() | st.fixed_dictionaries({"share": SHARES, "ci90": intervals()})
        ),
        "sets": sets,
        "path": path if draw(st.booleans()) else [],
        "next_runs": draw(st.sampled_from([[], [
            {"why": f"separates {names[0]} from {names[-1]}",
             "settings": {"tank_pressure_bar": 0.3, "tip_material": "steel"}, "runs_needed": 4},
        ]])),
        "assumptions": [],
        "seconds": 1.0,
    }  # fmt: skip


def _sets(draw: st.DrawFn, names: list[str]) -> list[dict[str, Any]]:
    groups: list[list[str]] = []
    for name in names:
        if groups and draw(st.booleans()):
            groups[-1].append(name)
        else:
            groups.append([name])
    sets = [
        {"effects": group, "inclusion": draw(PROBABILITIES), "share": draw(SHARES),
         "ci90": draw(intervals()), "held_out_gain": draw(SHARES), "settled_by": draw(
            st.none() | st.fixed_dictionaries({"channel": st.just("tank_pressure"),
                                               "d_prime": SIZES}))}
        for group in groups
    ]  # fmt: skip
    return sorted(sets, key=lambda own: -own["share"])


def _effects(draw: st.DrawFn, names: list[str], sets: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Rows of effects; that of an effect that is a set of one has the numbers of the set."""
    alone = {own["effects"][0]: own for own in sets if len(own["effects"]) == 1}
    rows = [
        {
            "effect": name,
            "inclusion": draw(PROBABILITIES),
            "share": draw(SHARES),
            "ci90": draw(intervals()),
            "held_out_gain": draw(SHARES),
            "credible_set": None,
            "parameters": [],
            **{key: value for key, value in alone.get(name, {}).items() if key in _OF_EFFECTS},
        }
        for name in names
    ]
    return sorted(rows, key=lambda row: -row["share"])


_OF_EFFECTS = ("inclusion", "share", "ci90", "held_out_gain")


def _causes(draw: st.DrawFn, names: list[str]) -> list[dict[str, Any]]:
    joint = "+".join(names[: draw(st.integers(1, len(names)))])
    entries = [["none"], ["unknown"], [joint]]
    entries += [[names[0], names[-1]]] if len(names) > 1 else []
    weights = [draw(st.floats(0.001, 1.0)) for _ in entries]
    rows = [
        {"effects": effects, "probability": weight / sum(weights)}
        for effects, weight in zip(entries, weights, strict=True)
    ]
    return sorted(rows, key=lambda row: -row["probability"])


@st.composite
def _shrinkage(draw: st.DrawFn) -> dict[str, Any]:
    return {
        "effects": [], "held_out_by": "configuration", "before": draw(SIZES), "after": draw(SIZES),
        "fraction": draw(SHARES), "ci90": draw(st.none() | intervals()), "more": {},
    }  # fmt: skip


def cells(diagnosis: GapDiagnosis) -> set[str]:
    return {
        str(value)
        for part in diagnosis.tables()
        if isinstance(part, ResultTable)
        for row in part.rows
        for value in row.values()
    }


def places_of(diagnosis: GapDiagnosis) -> set[str]:
    """Names of places, in which numbers may stand."""
    return {
        str(row["place"])
        for part in diagnosis.tables()
        if isinstance(part, ResultTable)
        for row in part.rows
        if "place" in row
    }


def said(diagnosis: GapDiagnosis) -> Iterator[Sentence]:
    """The first sentences, and those of the parts that are made of sentences."""
    yield from diagnosis.sentences()
    for part in diagnosis.tables():
        if isinstance(part, Lines):
            yield from (line for line in part.sentences if isinstance(line, Sentence))


def check_report(report: Mapping[str, Any]) -> None:
    verdict = verdict_of(report)
    diagnosis = GapDiagnosis(verdict)
    in_tables = cells(diagnosis)
    for sentence in said(diagnosis):
        assert sentence.rule is None or sentence.rule.allows(**sentence.evidence)
        remaining = sentence.text
        for number in sentence.numbers:
            assert number.cell in in_tables, (sentence.text, number)
            own = rf"(?<![\d.]){re.escape(str(number))}"
            remaining, shown = re.subn(own, "", remaining, count=1)
            assert shown, (sentence.text, number)
        places = sorted(places_of(diagnosis), key=len, reverse=True)
        for words in (*places, *STATED, "ISO 7626-5"):
            remaining = remaining.replace(words, "")
        remaining = re.sub(r"or \d+ more \(", "", remaining)  # effects of a set
        digits = re.findall(r"(?<![\w.-])\d[\d.]*", re.sub(r"pyroshock diagnose .*", "", remaining))
        assert not digits, (sentence.text, digits)
    check_claims(verdict, diagnosis)


def check_claims(verdict: Verdict, diagnosis: GapDiagnosis) -> None:
    sentences = diagnosis.sentences()
    text = " ".join(sentence.text for sentence in sentences)
    # What is called a cause is gone where it was not fitted, and the path says so.
    called = [own for own in verdict.cause_sets if names_as_cause(text, own)]
    for own in called:
        evidence = verdict.held_out(own)
        assert evidence.gain >= LEAST_FRACTION
        steps = [step for step in verdict.path if set(step.effects) == set(own.effects)]
        assert all(step.fraction >= LEAST_FRACTION for step in steps)
        interval = verdict.held_out_interval
        assert interval is None or interval[0] > 0
        assert "none of the error above the noise disappears" not in text or steps
    # No set is called a cause and none in one breath.
    denied = [item for item in sentences if item.rule is FITTED_ONLY]
    assert not any(
        sentence.text.lower().startswith(set_name(own.effects).lower())
        for sentence in denied
        for own in called
    )
    # The first cause of the headline is the first row of the table.
    causes = [sentence for sentence in sentences if sentence.rule is CAUSE]
    if verdict.effects and called and " causes " in causes[0].text:
        first = verdict.cause_sets[0]
        assert causes[0].text.lower().startswith(set_name(first.effects).lower())
    # What cannot be told apart is a set, or an entry, of several.
    for words in re.findall(r"([^.;]+) \(?which these runs cannot tell apart", text):
        assert " or " in words
    # One probability of one set, unless it says what each is of.
    if called and set(single_effects(verdict.first.effects)) == {
        name for own in verdict.cause_sets for name in own.effects
    }:
        shown = {
            number.cell
            for sentence in sentences
            for number in sentence.numbers
            if number.key == "probability"
        }
        assert len(shown) <= 1 or "the whole answer has a probability of" in text
    if is_unknown(verdict) and not verdict.cause_sets:
        assert " causes " not in text.replace("catalogue has every cause", "")


def names_as_cause(text: str, own: EffectSet) -> bool:
    return f"{set_name(own.effects)} causes".lower() in text.lower() or any(
        f"{effect_subject(name)} causes" in text
        for name in own.effects[:1]
        if len(own.effects) == 1
    )


@settings(max_examples=80, deadline=None, suppress_health_check=list(HealthCheck))
@given(reports())
def test_no_report_makes_the_words_contradict_the_numbers(report: dict[str, Any]) -> None:
    check_report(report)


@pytest.mark.parametrize("name", ["verdict", "gun", "unknown", "none"])
def test_made_up_diagnoses_speak_of_their_own_numbers(name: str) -> None:
    check_report(getattr(verdicts, name)().as_json())


def test_the_diagnosis_of_the_shots_that_ship_does_not_contradict_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    folder = files("pyroshock") / "examples" / "first-shots"
    check_report(json.loads(run_pyroshock("diagnose", str(folder), "--json").stdout))


def test_a_share_where_it_was_fitted_is_no_cause_where_nothing_disappears() -> None:
    """A report that said "causes 89 % of it" above a path with less than 1 % gone."""
    report = verdicts.gun().as_json()
    report["sets"] = [
        {"effects": ["gun.valve_flow"], "inclusion": 0.998, "share": 0.89, "ci90": [0.8, 0.95],
         "held_out_gain": 0.002, "settled_by": None}
    ]  # fmt: skip
    report["path"] = [{"added": "gun.valve_flow", "after": 0.419, "fraction": 0.002}]
    verdict = verdict_of(report)
    text = GapDiagnosis(verdict).sentence
    assert "causes 89 %" not in text and verdict.cause_sets == ()
    assert (
        "The flow resistance of the valve takes 89 % of it away in the runs that the model was "
        "fitted to, but none of it disappears on configurations that the fit has not seen: this is "
        "not established as a cause."
    ) in text


def test_two_probabilities_of_one_set_say_what_each_is_of() -> None:
    report = verdicts.gun().as_json()
    report["sets"] = [
        {"effects": ["gun.valve_flow"], "inclusion": 0.998, "share": 0.89, "ci90": [0.8, 0.95],
         "held_out_gain": 0.8, "settled_by": None}
    ]  # fmt: skip
    report["causes"] = [
        {"effects": ["gun.valve_flow"], "probability": 0.9},
        {"effects": ["none"], "probability": 0.1},
    ]
    assert (
        "This acts with a probability of > 99 %, if the catalogue has every cause; that this is "
        "the whole answer has a probability of 90 %."
    ) in GapDiagnosis(verdict_of(report)).sentence


def test_a_cause_without_its_evidence_cannot_be_said() -> None:
    evidence = verdicts.gun().held_out(verdicts.gun().cause_sets[0])
    assert Sentence("It causes it.", (), CAUSE, {"evidence": (evidence,)}).text
    with pytest.raises(UnfoundedSentenceError):
        Sentence("It is none.", (), FITTED_ONLY, {"evidence": (evidence,)})
