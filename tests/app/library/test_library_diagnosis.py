"""Diagnosis from Python: the report of `pyroshock diagnose --json` as frames, and its effects in
the twin."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import pyroshock as ps
import pytest
from pyroshock.app.operations.diagnose import diagnosing
from pyroshock.app.operations.diagnose.service import GapDiagnosis
from pyroshock.diagnosis.verdict import Cause, EffectShare, PathStep, Unexplained, Verdict
from support.records import verdicts
from support.stores.stores import pyroshock

FIRST_SHOTS = str(files("pyroshock") / "examples" / "first-shots")


@pytest.fixture
def store(spring_lab: Path, notebook: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """A copy of the store; every diagnosis is a made-up one."""
    monkeypatch.setattr(
        diagnosing, "run_diagnosis", lambda store, db, asked, progress=None: made_up()
    )
    shutil.copy(spring_lab / "lab.db", tmp_path)
    with ps.open(tmp_path / "lab.db", create=False) as store:
        yield store


def test_diagnosis_of_shots_is_that_of_the_command(notebook: None) -> None:
    with ps.open("lab.db") as store:
        store.ingest(FIRST_SHOTS, progress=False)
        report = store.diagnose("first-shots", progress=False)
        printed = json.loads(
            pyroshock("diagnose", "first-shots", "--db", store.url, "--json").stdout
        )
        assert {**json.loads(json.dumps(report.to_json())), "seconds": 0} == {
            **printed,
            "seconds": 0,
        }
        effects = report.effects
        assert effects["share"].is_monotonic_decreasing and effects["share"].sum() <= 1.0 + 1e-9
        assert report.fraction == (printed["path"][-1]["fraction"] if printed["path"] else None)
        name, fitted = next(iter(report.fitted.items()))
        twin = store.twin(campaign="first-shots", effects=fitted)
        assert name.split("+")[0].split(".")[1] in " ".join(twin.models.values())
        with pytest.raises(
            ps.InvalidValueError, match=r"adopting gun.valve_flow needs a campaign of the store"
        ):
            store.diagnose(FIRST_SHOTS, adopt="gun.valve_flow", progress=False)


def made_up() -> Verdict:
    return verdicts.verdict(
        effects=(
            EffectShare("contact.layer_compliance", 0.98, 0.9, (0.8, 0.95), 0.9, 1, named=True),
            EffectShare("gun.valve_flow", 0.1, 0.05, (0.0, 0.1), 0.0),
        ),
        unexplained=Unexplained(0.05, (0.0, 0.1)),
        path=(PathStep("contact.layer_compliance", 0.011, 0.94),),
    )


@pytest.fixture
def report(store: ps.ExperimentStore) -> GapDiagnosis:
    return store.diagnose("spring", progress=False)


def test_report_is_that_of_the_command_line_in_frames_and_is_kept(
    store: ps.ExperimentStore, report: GapDiagnosis
):
    table = store.diagnoses(campaign="spring")
    assert (
        table["id"].tolist() == [report.number]
        and not table["restricted"].any()
        and report.number is not None
    )
    result = pyroshock("diagnose", "spring", "--db", store.url, "--json")
    assert report.to_json() == json.loads(result.stdout) and report.gap == report.to_json()["gap"]
    effects = report.effects
    assert effects["effect"].tolist() == ["contact.layer_compliance", "gun.valve_flow"]
    assert list(effects.loc[0, ["probability", "share", "share_low", "share_high"]]) == [
        0.98,
        0.9,
        0.8,
        0.95,
    ]
    assert report.stages["share"].tolist() == [0.97, 0.03]
    assert report.path["fraction"].tolist() == [0.94] and report.fraction == 0.94
    assert report.shrinkage["after"].tolist() == [0.011, 0.02]
    assert report.causes["probability"].sum() == pytest.approx(1.0)
    assert report.sentence.startswith("The model error is 4.1 times the tolerance")
    assert report.sentence in report._repr_html_() and report.fitted[
        "contact.layer_compliance"
    ] == (verdicts.LAYER,)
    axes = report.plot()
    assert {label.get_text() for label in axes.get_yticklabels()} == set(effects["effect"])
    assert axes.get_xlabel().startswith("share of the squared gap")
    assert store.diagnosis(report.number).to_json() == report.to_json()
    with pytest.raises(ps.NotFoundError, match="no diagnosis 99"):
        store.diagnosis(99)
    assert GapDiagnosis(verdicts.verdict()).fraction == 0.94
    assert GapDiagnosis(verdicts.verdict(shrinkage=())).fraction is None


def test_diagnosed_effect_acts_in_the_twin_and_from_its_adoption_on(
    store: ps.ExperimentStore, report: GapDiagnosis
):
    nominal = store.twin(campaign="spring", contact="hertz", frequencies="200:400:3")
    soft = nominal.with_effects(report)
    also = store.twin(campaign="spring", contact="hertz", frequencies="200:400:3", effects=report)
    peaks = [twin.predict(velocity=5.0, draws=0).peak_force.mean for twin in (nominal, soft, also)]
    assert peaks[1] == peaks[2] < peaks[0]  # a compliant layer below the tip
    assert soft.request.effects == report.fitted["contact.layer_compliance"]
    before = store.twin(campaign="spring", contact="hertz", frequencies="200:400:3")
    adopted = store.adopt(report, effect="contact.layer_compliance")
    assert adopted.version is not None and adopted.version.version == 1
    after = store.twin(campaign="spring", contact="hertz", frequencies="200:400:3")
    without = store.twin(campaign="spring", contact="hertz", frequencies="200:400:3", adopted=False)
    peaks = [
        twin.predict(velocity=5.0, draws=0).peak_force.mean for twin in (before, after, without)
    ]
    assert peaks[1] < peaks[0] == peaks[2]
    assert store.diagnoses()["adopted"].tolist() == ["version 1: contact.layer_compliance"]
    with pytest.raises(ps.NotFoundError, match=r"no fit of 'gun\.blow_by'; it has: contact"):
        store.adopt(report, effect="gun.blow_by")
    with pytest.raises(ps.InvalidValueError, match="ingest it"):
        store.adopt(replace(report, number=None))
    unknown = replace(report, verdict=verdicts.verdict(causes=(Cause(("unknown",), 1.0),)))
    with pytest.raises(ps.InvalidValueError, match="is unknown, which has no effect to add"):
        store.twin(campaign="spring", frequencies="200:400:3", effects=unknown)
