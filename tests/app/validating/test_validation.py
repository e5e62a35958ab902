"""Shots are predicted by a twin that had not seen their configuration; and `validate` on the
command line."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from click.testing import Result
from pyroshock.app.common.model_registry import context_of, registry_of
from pyroshock.app.demo.demo import ingest_examples
from pyroshock.app.operations.faults import read
from pyroshock.app.operations.validate.request import ValidationRequest
from pyroshock.app.operations.validate.validation import (
    NOTHING,
    REFITTED,
    SEEN,
    UnseenContact,
    configuration_names,
    predicted_folds,
    run_validation,
)
from pyroshock.app.twins.building import TwinRequest, twin_of
from pyroshock.dataset.snapshot import build_snapshot, read_snapshot
from pyroshock.schema.impacts import Impact, Pulse
from pyroshock.training.fitting.session import train
from pyroshock.training.registry.contact_stage import RegisteredContact
from pyroshock.twin.chain import Twin
from pyroshock.twin.measured_shots import MeasuredShots
from pyroshock.twin.setting import THESIS, Setting
from pyroshock.validation.prediction_scores.quantity_score import ComparedValues
from sqlalchemy import select
from support.records.twin_parts import HalfSine
from support.stores.hammer_stores import copied, filled_store, full_campaign
from support.stores.registries import fresh_registry, without_figures
from support.stores.stores import opened, pyroshock


def hit(velocity: float) -> Setting:
    steel = THESIS["steel"]
    return Setting(0.5, steel, 0.045, steel, 0.01, 20.0, impact_velocity_m_s=velocity)


def shots_of(configuration: Sequence[int]) -> MeasuredShots:
    """Hits on a twin without a plate; what was measured is not looked at here."""
    n = len(configuration)
    return MeasuredShots(
        settings=tuple(hit(1.0 + 0.1 * row) for row in range(n)),
        configuration=np.array(configuration, dtype=np.intp),
        **{
            name: np.ones(n)
            for name in (
                "impact_velocity_m_s", "impact_velocity_u_m_s", "contact_time_s", "peak_force_n",
                "impulse_n_s",
            )
        },
        sensors=(),
        peak_acceleration_m_s2=np.zeros((n, 0)),
        frequency_hz=np.zeros(0),
        q=10.0,
        spectra_m_s2=np.zeros((n, 0, 0)),
    )  # fmt: skip


def folds_of(shots: MeasuredShots, folds: int = 5) -> tuple[int, list[list[int]], Any]:
    """How many folds, the configurations that each twin was made without, and the draws."""
    made: list[list[int]] = []

    def twin_without(configurations: Sequence[int], plate: str) -> Any:
        made.append(list(configurations))
        return SimpleNamespace(twin=Twin(HalfSine()))

    number, draws, missing = predicted_folds(
        shots, twin_without, ValidationRequest(campaign="x", folds=folds)
    )
    assert missing == []
    return number, made, draws


def test_every_configuration_is_left_out_once_and_shots_have_random_numbers_of_their_own() -> None:
    number, made, draws = folds_of(shots_of(np.repeat(np.arange(7), 3).tolist()))
    assert number == 5 and sorted(key for group in made for key in group) == list(range(7))
    assert list(draws) == list(range(21))
    number, made, _ = folds_of(shots_of([3, 3, 5, 8]))
    assert (number, sorted(made)) == (3, [[3], [5], [8]])
    number, made, draws = folds_of(shots_of([4, 4]))
    assert (number, made, len(draws)) == (0, [[4]], 2)
    _, _, draws = folds_of(shots_of([1, 1, 2]))
    ratio = draws[0].peak_force_n / draws[1].peak_force_n
    assert np.ptp(ratio) > 0.1

    def twin_without(configurations: Sequence[int], plate: str) -> Any:
        if 1 in configurations:
            raise ValueError("the bullet does not leave the barrel")
        return SimpleNamespace(twin=Twin(HalfSine()))

    _, draws, missing = predicted_folds(
        shots_of([1, 2]), twin_without, ValidationRequest(campaign="x")
    )
    assert list(draws) == [1] and missing == [
        "shot 1 is not predicted: the bullet does not leave the barrel"
    ]


@pytest.mark.parametrize(("wrong", "message"), [
    ({"folds": 1}, "folds is 1; expected a whole number from 2 to 1000"),
    ({"draws": 5}, "draws is 5; expected a whole number from 20 to 2000"),
    ({"seed": 99999999999}, "seed is 99999999999; expected a whole number from 0 to 2147483647"),
])  # fmt: skip
def test_too_few_folds_or_draws_are_refused(wrong: dict[str, int], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        read(ValidationRequest, {"campaign": "x", **wrong}, "python")


# --- on a store ---
@pytest.fixture(scope="module")
def hammer_store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("hammer")
    return filled_store(folder, full_campaign(folder / "spring"))


@pytest.fixture
def db(hammer_store: Path, quick_twins: Path) -> str:
    return copied(hammer_store, quick_twins)


def test_campaign_is_scored(db: str) -> None:
    with opened(db) as store:
        data, again = (
            run_validation(
                store, db, ValidationRequest(campaign="spring", contact="hertz")
            ).as_json()
            for _ in "ab"
        )
        with store.reading() as session:
            stored = sorted(session.scalars(select(Pulse.spline_peak_force_n)))
    assert data["quantities"] == again["quantities"] and data["failures"] == again["failures"]
    measured = sorted(shot["quantities"]["peak_force"]["measured"] for shot in data["shots"])
    assert measured == pytest.approx(stored)
    scores = {row["name"]: row for row in data["quantities"]}
    assert {"contact_time", "peak_force", "impulse"} <= scores.keys()
    assert "velocity" not in scores  # a hammer's velocity is given to the twin
    assert scores["peak_force"]["shots"] == 20 and scores["peak_force"]["configurations"] == 4
    assert (
        data["calibrated"] != data["verdict"].startswith("Not calibrated")
        and len(data["shots"]) == 20
    )


def test_campaign_without_a_shot_to_predict_says_why(
    db: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    reasons = tuple(f"run {run}, repetition 1: no mass of the impactor" for run in (1, 2))
    monkeypatch.setattr(
        "pyroshock.app.operations.validate.validation.campaign_shots",
        lambda *_: (shots_of([1]).take([]), reasons),
    )
    with opened(db) as store:
        with pytest.raises(LookupError, match="winter"):
            run_validation(store, db, ValidationRequest(campaign="winter"))
        with pytest.raises(ValueError, match=r"to compare with: no mass of the impactor \(2\)"):
            run_validation(store, db, ValidationRequest(campaign="spring"))


# --- registered models ---
@pytest.fixture
def with_model(db: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """The store's dataset and a linear model of it."""
    without_figures(monkeypatch)
    with opened(db) as store:
        build_snapshot(store, "pulses", ["spring"])
        registry = fresh_registry(tmp_path)
        train(
            registry,
            context_of(store, "pulses", registry, 0, "reduced"),
            ["linear"],
            ["repetitions"],
        )
    return db


def contact_of(store: Any, db: str) -> RegisteredContact:
    contact = twin_of(store, db, TwinRequest(campaign="spring", contact="linear@1")).twin.contact
    assert isinstance(contact, RegisteredContact)
    return contact


def test_model_is_refitted_without_configurations_and_the_output_says_so(with_model: str) -> None:
    with opened(with_model) as store:
        contact, table = contact_of(store, with_model), read_snapshot(store, "pulses").table
        left_out = np.unique(table.configuration)[:1]
        with store.reading() as session:
            keys = sorted(set(session.scalars(select(Impact.configuration_id))))
            (key,) = [
                key for key in keys if configuration_names(session, [key]) == {str(left_out[0])}
            ]
        refitted, seen = UnseenContact(store, with_model, contact).without([key])
        trained_on = registry_of(with_model).held_out(contact.registered.version).trained_on
    assert seen == REFITTED
    kept = table.take(np.isin(table.key, trained_on) & (table.configuration != left_out[0]))
    expected = contact.registered.model.refit(kept, np.random.default_rng(0)).predict(table.inputs)
    found = refitted.registered.model.predict(table.inputs)
    np.testing.assert_allclose(found.force_n, expected.force_n)
    assert not np.allclose(found.force_n, contact.registered.model.predict(table.inputs).force_n)
    with opened(with_model) as store:
        validation = run_validation(
            store, with_model, ValidationRequest(campaign="spring", contact="linear@1")
        )
    assert (
        "models:/linear/1 was refitted without the configurations of each fold" in validation.seen
    )


def test_model_that_had_not_seen_them_stays_and_one_without_its_pulses_is_called_seen(
    with_model: str, monkeypatch
):
    def gone(*_: object) -> None:
        raise LookupError("no dataset")

    with opened(with_model) as store:
        contact = contact_of(store, with_model)
        assert UnseenContact(store, with_model, contact).without([]) == (contact, NOTHING)
        monkeypatch.setattr("pyroshock.app.operations.validate.validation.read_snapshot", gone)
        assert UnseenContact(store, with_model, contact).without([1]) == (contact, SEEN)


# --- the command: the JSON that scripts rely on, the verdict in words, the exit code ---
@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("lab")
    store = filled_store(folder, full_campaign(folder / "spring"))
    with opened(f"sqlite:///{store}") as opened_store:
        ingest_examples(opened_store)
    return store


@pytest.fixture
def validate_lab(filled: Path, quick_twins: Path):
    """Gives the command line over a copy of a store with a hammer's campaign and the thesis's five
    shots."""
    url = copied(filled, quick_twins)
    return lambda *words: pyroshock("validate", *words, "--db", url)


def data_of(result: Result) -> dict:  # JSON
    assert result.exit_code in (0, 1), result.stderr
    return json.loads(result.stdout)


def test_json_is_the_contract_of_a_hammers_campaign_and_of_the_thesis(
    validate_lab, tmp_path: Path
) -> None:
    page = tmp_path / "validation.html"
    data = data_of(validate_lab("spring", "--contact", "hertz", "--json", "--out", str(page)))
    text = page.read_text(encoding="utf-8")
    for words in ("Validation", "peak force", "Ranks of the measured values", "<svg"):
        assert words in text
    assert {"quantities", "failures", "verdict", "seen"} <= data.keys()
    keys = {
        "name",
        "unit",
        "shots",
        "coverage50",
        "coverage90",
        "coverage90_ci95",
        "crps",
        "median_abs_error",
    }
    for row in data["quantities"]:
        assert keys <= row.keys()
        assert 0 <= row["coverage90_ci95"][0] <= row["coverage90"] <= row["coverage90_ci95"][1] <= 1
    for failure in data["failures"]:
        assert {"rule", "quantity", "bias"} <= failure.keys()
    data = data_of(validate_lab("first-shots", "--json"))
    (velocity,) = data["quantities"]
    assert (velocity["name"], velocity["shots"], velocity["configurations"]) == ("velocity", 5, 5)
    assert data["folds"] == 5
    assert data["verdict"].startswith(
        "Too little to judge the 90 % bands, 5 shots of 5 configurations"
    )
    assert "from 4 independent values at most, and 13 are needed" in data["verdict"]
    result = validate_lab("winter")
    assert result.exit_code == 2 and result.stderr.count("\n") == 1 and "winter" in result.stderr


def test_a_report_that_cannot_be_written_is_refused_before_the_work(
    validate_lab, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(
        "pyroshock.app.operations.validate.service.validate_twin",
        lambda *_: pytest.fail("worked before"),
    )
    result = validate_lab("spring", "--out", str(tmp_path / "page.docx"))
    assert (
        result.exit_code == 2
        and ".html or .pdf" in result.stderr
        and result.stderr.count("\n") == 1
    )


def test_text_says_verdict_first_and_not_calibrated_is_exit_code_1(
    validate_lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    result = validate_lab("first-shots")
    assert result.exit_code == 0 and result.stdout.startswith("Too little to judge")
    assert "inside 90 % band" in result.stdout
    monkeypatch.setattr(
        ComparedValues, "inside90", property(lambda self: np.zeros(len(self), dtype=bool))
    )
    result = validate_lab("first-shots")
    assert result.exit_code == 1 and result.stdout.startswith(
        "Not calibrated: the 90 % bands hold only 0 % of the measured values of impact velocity."
    )
