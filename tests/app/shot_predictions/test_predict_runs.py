"""Runs of a plan are predicted before they are shot, by the command, the library and the page;
what cannot be predicted is said, and what is shot is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from pyroshock.app.common.errors import InvalidValueError, NotFoundError
from pyroshock.app.library.experiment_store import ExperimentStore
from pyroshock.app.operations.plan.planning import make_plan
from pyroshock.app.operations.shot_predictions import predict_runs
from pyroshock.app.operations.shot_predictions.predict_runs import PLAN_PREDICT
from pyroshock.doe.plans import discard_run, read_plan
from pyroshock.doe.sheet import sheet_of
from pyroshock.schema.audit import AuditRow
from pyroshock.schema.campaign_counts import recount
from pyroshock.schema.campaigns import PlannedRun
from pyroshock.schema.impacts import Shot
from pyroshock.schema.person_roles import OPERATOR
from pyroshock.schema.recordings import Recording
from pyroshock.schema.run_predictions import QUANTITIES, RunPrediction, lower_of, upper_of
from pyroshock.schema.transfer.export import export_campaign
from pyroshock.schema.transfer.merging import import_file
from sqlalchemy import delete, select, update
from sqlalchemy.orm import undefer
from support.processes.web_client import window
from support.records.campaigns import gun_campaign
from support.stores.planned_runs import find_fault, record_run
from support.stores.stores import ingested, opened, refusal, run_pyroshock

PLAN = "summer"


@pytest.fixture
def url(quick_twins: Path) -> str:
    """A store with three shots of a gun and a plan of five runs that nobody has shot."""
    address = f"sqlite:///{quick_twins / 'lab.db'}"
    ingested(address, gun_campaign(quick_twins / "folder", name="shots"))
    with opened(address) as store:
        make_plan(store, "lhs", PLAN, runs=5, repetitions=2, seed=1)
    return address


def stored(url: str) -> dict[int, list[RunPrediction]]:
    """Predictions by run, the oldest first."""
    rows: dict[int, list[RunPrediction]] = {}
    with opened(url) as store, store.reading() as session:
        query = select(PlannedRun.run, RunPrediction).join(
            PlannedRun, RunPrediction.planned_run_id == PlannedRun.id
        )
        read_at_once = (undefer(RunPrediction.drawn), undefer(RunPrediction.spectra))
        query = query.options(*read_at_once).order_by(RunPrediction.id)
        for run, row in session.execute(query):
            rows.setdefault(run, []).append(row)
    return rows


def shoot(url: str, run: int, velocity_m_s: float, repetition: int = 1) -> None:
    with opened(url) as store:
        record_run(
            store,
            PLAN,
            run,
            (repetition,),
            measured_velocity_m_s=velocity_m_s,
            velocity_source="laser",
        )


def predict(url: str, **values: Any) -> Any:
    with opened(url) as store:
        return ExperimentStore(store, url).plan.predict(PLAN, progress=False, **values)


def predictions(url: str) -> Any:
    with opened(url) as store:
        return ExperimentStore(store, url).plan.predictions(PLAN)


def test_all_quantities_of_all_open_runs_are_stored_with_their_bands(url: str) -> None:
    printed = json.loads(
        run_pyroshock("plan", "predict", PLAN, "--contact", "hertz", "--json", "--db", url).stdout
    )
    assert [row["run"] for row in printed["predicted"]] == [1, 2, 3, 4, 5]
    for (row,), shown in zip(stored(url).values(), printed["predicted"], strict=True):
        for quantity in QUANTITIES:
            lower, median, upper = (
                getattr(row, name) for name in (lower_of(quantity), quantity, upper_of(quantity))
            )
            assert 0 < lower <= median <= upper and shown[quantity] == median
            draws = row.drawn[quantity]
            assert draws == sorted(draws) and draws[0] <= lower and upper <= draws[-1]
        assert set(row.drawn) > {*QUANTITIES, "peak_acceleration_1_m_s2"}
        assert row.spectra is not None
        assert set(row.spectra["sensors"]) == {"acceleration_1", "acceleration_2"}
        lines = len(row.spectra["frequency_hz"])
        assert all(
            len(curve) == lines
            for band in row.spectra["sensors"].values()
            for curve in band.values()
        )
        assert (row.campaign, row.draws, row.seed, row.adopted) == ("shots", 64, 0, [])
        assert row.models["contact"].startswith("hertz") and "gun" in row.models
        assert row.options == {"contact": "hertz"}
        assert row.settings["run"] and "tank_pressure_bar" in row.settings


def test_without_a_contact_model_the_velocity_alone_is_predicted_and_that_is_said(
    url: str,
) -> None:
    answer = run_pyroshock("plan", "predict", PLAN, "--runs", "2-3", "--db", url)
    assert "no contact model is in use for the gun" in answer.output
    rows = stored(url)
    assert list(rows) == [2, 3]
    for (row,) in rows.values():
        assert row.velocity_m_s is not None and row.contact_time_s is row.peak_force_n is None
        assert list(row.drawn) == ["velocity_m_s"] and row.spectra is None
        assert list(row.models) == ["gun"]
        assert any("no contact model is in use" in remark for remark in row.remarks)


def test_run_that_is_shot_or_discarded_is_refused(url: str) -> None:
    shoot(url, 2, 9.0)
    with opened(url) as store:
        discard_run(store, PLAN, 4, "tip broke")
    message = refusal("plan", "predict", PLAN, "--runs", "1,2", "--db", url)
    assert "run 2: it is shot (stored " in message
    assert "a prediction is made before the shot" in message
    assert "run 4: it is discarded" in refusal("plan", "predict", PLAN, "--runs", "4", "--db", url)
    assert "has no run 77" in refusal("plan", "predict", PLAN, "--runs", "77", "--db", url)
    assert stored(url) == {}
    assert [row["run"] for row in predict(url).rows] == [1, 3, 5]
    for run in (1, 3, 5):
        shoot(url, run, 9.0)
    with pytest.raises(InvalidValueError, match="has no run to predict"):
        predict(url)


@pytest.mark.parametrize("runs", ["3-1", "1;2", "a", "1-", "0-2000000"])
def test_list_of_runs_that_cannot_be_read_is_refused(url: str, runs: str) -> None:
    with pytest.raises(InvalidValueError, match="runs is "):
        predict(url, runs=runs)


def test_run_that_is_shot_while_it_is_predicted_gets_no_prediction(url: str) -> None:
    """Between the work and the storing of its result another process stores the shot."""
    step = PLAN_PREDICT.keep
    assert step is not None

    def keep(draft: Any, laboratory: Any) -> Any:
        shoot(url, 3, 9.0)
        return predict_runs._keep(draft, laboratory)

    object.__setattr__(PLAN_PREDICT, "keep", keep)
    try:
        answer = predict(url)
    finally:
        object.__setattr__(PLAN_PREDICT, "keep", step)
    assert [row["run"] for row in answer.rows] == [1, 2, 4, 5]
    assert answer.refused[3].startswith("it is shot")
    assert list(stored(url)) == [1, 2, 4, 5]


def test_made_again_the_newest_before_the_shot_counts(url: str) -> None:
    predict(url, runs="1")
    predict(url, runs="1", contact="hertz", seed=3)
    shoot(url, 1, 9.0)
    first, second = stored(url)[1]
    assert first.made_at < second.made_at
    (forecast,) = predictions(url).forecasts
    assert forecast.made_at == second.made_at and "contact: hertz" in forecast.model_words


def test_shots_are_compared_in_units_in_band_widths_and_by_rank(url: str) -> None:
    predict(url, runs="1-2")
    (row,) = stored(url)[1]
    assert row.velocity_m_s is not None and row.velocity_lower_m_s is not None
    assert row.velocity_upper_m_s is not None
    shoot(url, 1, row.velocity_upper_m_s)
    shoot(url, 1, 3 * row.velocity_upper_m_s, repetition=2)
    shoot(url, 2, 9.0)
    with opened(url) as store:
        find_fault(store, PLAN, 2, 1)
    shoot(url, 5, 9.0)  # of a run that nobody predicted
    answer = predictions(url)
    frame = answer.to_frame()
    width = row.velocity_upper_m_s - row.velocity_lower_m_s
    first, second, third = frame.to_dict("records")
    assert (first["run"], first["repetition"], first["inside"]) == (1, 1, True)
    assert first["difference"] == pytest.approx(row.velocity_upper_m_s - row.velocity_m_s)
    assert first["difference_in_bands"] == pytest.approx(first["difference"] / width)
    draws = row.drawn["velocity_m_s"]
    assert second["rank"] == pytest.approx((len(draws) + 0.5) / (len(draws) + 1))
    assert not second["inside"] and frame.attrs["units"] is not None
    # the check rejects the force of the third, and not its velocity
    assert (third["run"], third["quantity"]) == (2, "velocity_m_s")
    assert (answer.left_out, answer.unpredicted) == (0, 1)
    (test,) = answer.tests
    assert (test.shots, test.runs, test.inside) == (3, 2, 1 + third["inside"])
    (sentence,) = answer.sentences()
    verb = "lies" if test.inside == 1 else "lie"
    band = "the 90 % band of the impact velocity"
    assert str(sentence).startswith(f"Of 3 shots, {test.inside} {verb} in {band}")
    assert "too few shots" in str(sentence)
    cells = {str(cell) for line in answer.test_rows() for cell in line.values()}
    assert {number.cell for number in sentence.numbers} <= cells
    with pytest.raises(NotFoundError, match="velocity_m_s"):
        answer.plot(quantity="peak_force_n")
    printed = run_pyroshock("plan", "predictions", PLAN, "--db", url).output
    assert str(sentence) in printed


def test_predicted_velocity_and_rank_are_drawn_by_explore(url: str) -> None:
    predict(url, runs="1")
    (row,) = stored(url)[1]
    assert row.velocity_upper_m_s is not None
    shoot(url, 1, 2 * row.velocity_upper_m_s)
    with opened(url) as store:
        answer = ExperimentStore(store, url).explore(
            subject="shots", x="expected_velocity_m_s", y="velocity_rank"
        )
    columns = answer.rows.columns
    draws = len(row.drawn["velocity_m_s"])
    # three shots of another campaign have no prediction
    assert list(columns["expected_velocity_m_s"].values) == [None] * 3 + [row.velocity_m_s]
    assert columns["velocity_rank"].values[3] == pytest.approx((draws + 0.5) / (draws + 1))


def test_sheet_says_what_is_expected(url: str, tmp_path: Path) -> None:
    with opened(url) as store, store.reading() as session:
        empty_sheet = sheet_of(read_plan(session, PLAN))
    predict(url, runs="1-4", contact="hertz")
    with opened(url) as store, store.reading() as session:
        plan = read_plan(session, PLAN)
    sheet = sheet_of(plan)
    labels = ("expected velocity (m/s)", "expected contact time (ms)", "expected peak force (kN)")
    assert (empty_sheet.expected, sheet.expected) == (0, 3)
    assert sheet.setting_labels == empty_sheet.setting_labels
    for run, row, old in zip(plan.runs, sheet.rows, empty_sheet.rows, strict=True):
        assert sheet.settings_of(row) == empty_sheet.settings_of(old)
        assert row.cells[-4:] == old.cells[-4:]
        if run.run == 5:
            assert sheet.expected_of(row) == []
            continue
        assert tuple(label for label, _ in sheet.expected_of(row)) == labels
        median, lower, _ = run.expected["peak_force_n"]
        words = dict(sheet.expected_of(row))["expected peak force (kN)"]
        assert words.startswith(f"{median / 1e3:.3g} ({lower / 1e3:.3g}–")
    run_pyroshock("plan", "sheet", PLAN, "--out", tmp_path / "sheet.html", "--db", url)
    text = (tmp_path / "sheet.html").read_text(encoding="utf-8")
    assert labels[0] in text and "predicted before the shot" in text


def test_change_has_its_audit_row_and_its_role(url: str) -> None:
    predict(url, runs="1")
    with opened(url) as store, store.reading() as session:
        row = session.scalars(select(AuditRow).order_by(AuditRow.id.desc())).first()
    assert row is not None
    assert (row.operation, row.subject, row.request["runs"]) == ("plan-predict", PLAN, "1")
    assert PLAN_PREDICT.needed_role == OPERATOR


def test_predictions_travel_with_the_campaign_that_shot_the_plan(url: str, tmp_path: Path) -> None:
    predict(url, runs="1-2")
    shoot(url, 1, 9.0)
    with opened(url) as store:
        record_run(store, PLAN, 2, (1,))
        # recordings of the support's shots have no channel, which no export takes
        with store.writing() as session:
            session.execute(update(Shot).values(recording_id=None))
            session.execute(delete(Recording))
            recount(session)
        exported = predictions(url)
        export_campaign(store, PLAN, tmp_path / "plan.pyroshock")
    second_url = f"sqlite:///{tmp_path / 'other.db'}"
    with opened(second_url, create=True) as store:
        added = import_file(store, tmp_path / "plan.pyroshock").added
        assert added["run_predictions"] == 2
        assert import_file(store, tmp_path / "plan.pyroshock").added == {}
    imported = predictions(second_url)
    assert [row.as_json() for row in imported.forecasts] == [
        row.as_json() for row in exported.forecasts
    ]
    assert [shot.quantities for shot in imported.shots] == [
        shot.quantities for shot in exported.shots
    ]


def test_pages_show_the_prediction_beside_the_plan_and_its_sheet(url: str) -> None:
    predict(url, runs="1-2", contact="hertz")
    with window(url) as (client, _):
        page = client.get(f"/plans/{PLAN}").text
        assert "2 runs of plan summer are predicted, and none of them is shot." in page
        assert 'id="to-predict"' in page and "contact: hertz" in page
        sheet = client.get(f"/plans/{PLAN}/sheet?run=1").text
        assert 'id="expected"' in sheet and "expected peak force (kN)" in sheet
        form = client.get(f"/ask/plan-predict?name={PLAN}").text
        assert f'value="{PLAN}"' in form
    (row,) = stored(url)[1]
    assert row.velocity_m_s is not None
    shoot(url, 1, row.velocity_m_s)
    with window(url) as (client, _):
        page = client.get(f"/plans/{PLAN}").text
    assert "Of 1 shot, 1 lies in the 90 % band of the impact velocity" in page
    assert 'id="band-tests"' in page and 'id="predicted"' in page
