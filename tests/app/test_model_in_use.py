"""The model in use for a kind of bench, and a twin of a hammer's campaign, which has no gun."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result
from pyroshock.app.doors.command_line.operation_command import command_of
from pyroshock.app.operations.faults import read
from pyroshock.app.operations.predict.predict import PREDICT
from pyroshock.app.operations.predict.request import PredictionRequest
from pyroshock.app.twins import building as twins
from pyroshock.app.twins.learning import (
    bench_kind_of,
    model_in_use,
    training_campaigns,
    velocity_kind_of,
)
from pyroshock.dataset.domain import Domain
from pyroshock.dataset.snapshot import build_snapshot
from pyroshock.schema.impacts import BEFORE_CONTACT, INTEGRATED, TARGET_MOTION_ADDED
from pyroshock.training.models.analytic import Analytic
from pyroshock.training.registry.records import Cost, DatasetName, RegisteredModel, Version
from support.records.campaigns import gun_campaign
from support.records.pulse_tables import PREDICTORS, pulse_table
from support.stores.hammer_stores import full_campaign
from support.stores.stores import ingested, opened, pyroshock

predict = command_of(PREDICT)
WHEN = datetime(2026, 1, 1, tzinfo=UTC)
FEW = ("--frequencies", "200:800:3", "--draws", "8")
STRIKE = ("--campaign", "hammer", "--velocity", "1.5m/s", "--tip", "delrin", "--tip-radius", "30mm")


def version(
    name: str, dataset: DatasetName, champion_of: str | None = None, promoted_at: str = ""
) -> Version:
    ids = ("key", "run", "0" * 64)
    promoted = {"champion_of": champion_of, "promoted_at": promoted_at}
    return Version(name, 1, dataset, "repetitions", 0, {}, Cost(1.0, 1.0), *ids, WHEN, **promoted)


def dataset(predictor_set: str = "hammer", *kinds: str, digest: str = "5" * 64) -> DatasetName:
    return DatasetName("spring", digest, predictor_set, *kinds)


def registry(*versions: Version) -> Any:
    """Every version is Hertz' law, fitted to the hammer's predictors."""
    table = pulse_table(np.random.default_rng(0), repetitions=2)
    model = Analytic("hertz").fit(table, np.random.default_rng(0))
    return SimpleNamespace(
        versions=lambda: list(versions),
        load=lambda chosen: RegisteredModel(
            chosen, model, PREDICTORS, Domain.of(table), {"pulses": len(table)}
        ),
    )


def test_kind_of_the_bench_and_the_last_promotion_decide() -> None:
    hammer, gun = (
        version("tree", dataset("hammer"), "hammer", "2026-01-02"),
        version("gp", dataset("gun"), "gun"),
    )
    for kind, expected in (("hammer", hammer), ("gun", gun), ("drop", None)):
        assert (
            model_in_use(None, registry(hammer, gun, version("svr", dataset("hammer"))), kind)
            is expected
        )
    shipped = version("tree", dataset("hammer"), "hammer", "2026-01-02")
    own = version("svr", dataset("our-hammer", "hammer"), "our-hammer", "2026-01-03")
    assert model_in_use(None, registry(shipped, own), "hammer") is own
    assert (
        model_in_use(None, registry(replace(shipped, promoted_at="2026-01-04"), own), "hammer").name
        == "tree"
    )
    assert bench_kind_of(None, version("gp", dataset("theirs"), "theirs")) is None


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("filled")
    hammer = full_campaign(place / "hammer", name="hammer")
    ingested(f"sqlite:///{place / 'lab.db'}", gun_campaign(place / "gun", name="gun"), hammer)
    return place / "lab.db"


@pytest.fixture
def lab(filled: Path, quick_twins: Path) -> str:
    return f"sqlite:///{shutil.copy(filled, quick_twins)}"


@pytest.fixture
def asked(lab: str) -> Callable[..., Result]:
    return lambda *words: CliRunner().invoke(predict, [*words, *FEW, "--db", lab])


def told(result: Result) -> Any:
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout)


def test_store_tells_what_an_older_model_does_not(lab: str) -> None:
    with opened(lab) as store:
        built = build_snapshot(store, "spring", ["hammer"]).snapshot
        old = version("tree", dataset("theirs", digest=built.hash))
        with store.reading() as session:
            assert bench_kind_of(session, old) == "hammer" and training_campaigns(session, old) == (
                "hammer",
            )
            assert velocity_kind_of(session, old) == built.definition["velocity"]["kind"]
            gone = version("tree", dataset("theirs"))
            assert (velocity_kind_of(session, gone), training_campaigns(session, gone)) == (
                BEFORE_CONTACT,
                (),
            )
            stated = version("tree", dataset("hammer", "hammer", TARGET_MOTION_ADDED))
            assert velocity_kind_of(session, stated) == TARGET_MOTION_ADDED


def test_hammers_campaign_needs_a_velocity_and_is_struck_with_its_hammer(
    asked, lab, tmp_path, monkeypatch
):
    refused = asked("--campaign", "hammer")
    assert (
        refused.exit_code != 0
        and "give the impact velocity, such as --velocity 1.5m/s" in refused.stderr
    )
    refused = asked(*STRIKE, "--effect", "gun.back_pressure")
    assert "has no gun" in refused.stderr
    spec = tmp_path / "spec.csv"
    spec.write_text("frequency_hz,level_g\n100,10\n1000,100\n", encoding="utf-8")
    refused = pyroshock("tune", "--target", spec, "--campaign", "hammer", "--db", lab)
    assert "has no gun, whose settings are searched" in refused.stderr
    champion = version("tree", dataset("hammer", "hammer", INTEGRATED), "hammer", "2026-01-02")
    monkeypatch.setattr(twins, "_registry", lambda _: registry(champion))
    result = asked(*STRIKE, "--contact", "registered", "--json")
    found = told(result)
    assert (
        found["models"]["gun"] == "none" and found["models"]["contact"] == "models:/tree@champion"
    )
    assert found["velocity_m_s"]["mean"] == 1.5
    assert "tree@1 takes velocities integrated to the peak of the force" in result.stderr
    heavy = told(asked(*STRIKE, "--bullet-mass", "0.64kg", "--json"))
    assert (
        found["impulse_n_s"]["mean"] < 0.6 * heavy["impulse_n_s"]["mean"]
    )  # the hammer has 0.32 kg
    assert (
        "no model is in use for the gun"
        in asked("--campaign", "gun", "--contact", "registered").stderr
    )


def test_ignored_factor_is_an_error_and_a_table_gives_every_predictor(asked, monkeypatch, tmp_path):
    champion = version("tree", dataset("hammer", "hammer", BEFORE_CONTACT), "hammer")
    monkeypatch.setattr(twins, "_registry", lambda _: registry(champion))
    told(asked(*STRIKE, "--boundary-conditions", "fixed", "--json"))
    by_law = (*STRIKE, "--contact", "hertz")
    told(asked(*by_law, "--boundary-conditions", "free", "--json"))
    for words, message in (
        (
            (*by_law, "--boundary-conditions", "fixed"),
            "boundary_conditions = fixed: no stage of this twin uses it",
        ),
        (
            (*STRIKE, "--factor", "humidity=0.4"),
            "the predictors of models:/tree@champion are tip_radius, ",
        ),
        (
            (*STRIKE, "--factor", "plate_mass_kg=9"),
            "plate_mass_kg = 9.0: no stage of this twin uses it",
        ),
        ((*STRIKE, "--factor", "tip_radius=9"), "tip_radius has an option of its own"),
        ((*STRIKE, "--factor", "humidity"), "expected NAME=VALUE"),
    ):
        assert message in asked(*words).stderr
    champion = version("tree", dataset("hammer", "hammer", BEFORE_CONTACT), "hammer")
    monkeypatch.setattr(twins, "_registry", lambda _: registry(champion))
    table = tmp_path / "shots.csv"
    head = "run,impact_velocity_m_s,tip_material,tip_radius_mm,boundary_conditions,hammer_speed"
    table.write_text(
        f"{head},recording,comment\n1,1.5,delrin,30,fixed,high,a.lvm,good\n"
        "2,1.5,delrin,30,free,high,a.lvm,good\n"
    )
    of_table = ("--campaign", "hammer", "--shots", str(table))
    assert len(told(asked(*of_table, "--json"))) == 2
    assert (
        "run 1: boundary_conditions = fixed: no stage"
        in asked(*of_table, "--contact", "hertz").stderr
    )
    for column, message in (
        ("boundry_conditions", "it resembles the column boundary_conditions"),
        ("travel_m", "travel_m = 1: no stage of this twin uses it"),
    ):
        table.write_text(
            f"run,impact_velocity_m_s,tip_material,tip_radius_mm,{column}\n1,1.5,delrin,30,1\n"
        )
        assert message in asked(*of_table).stderr


def test_question_of_the_web_gives_every_predictor() -> None:
    given = {"boundary_conditions": "fixed", "factor": ["plate_mass_kg=9", "lot=B"]}
    shot = read(PredictionRequest, given, "network")
    assert (shot.boundary_conditions, shot.factor) == ("fixed", {"plate_mass_kg": 9.0, "lot": "B"})
    assert shot.bullet_mass_kg is None
