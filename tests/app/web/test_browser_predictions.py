"""In a browser: what was predicted of a run before its shot stands on the page of the impact and of
the plan; runs are predicted from the page of a plan."""

from __future__ import annotations

import datetime as dt

import pytest
from pyroshock.app.operations.plan.planning import make_plan
from pyroshock.app.operations.shot_predictions.predicted_runs import plan_forecasts
from pyroshock.schema.campaigns import Plan, PlannedRun
from pyroshock.schema.impacts import Impact, Shot
from pyroshock.schema.run_predictions import RunPrediction
from sqlalchemy import func, select, update
from support.processes.browsers import Lab, at, drawn, ended, page_of, screenshot, wait_drawn
from support.stores.care_stores import run_prediction

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

MADE = dt.datetime(2026, 1, 5, 9, 30, tzinfo=dt.UTC)
MODEL = "gp@7"


@pytest.fixture(scope="module")
def impact(lab: Lab) -> int:
    """An impact of the rehearsal whose run was predicted before its shot; those of two further runs
    were predicted, too."""
    with lab.store.writing() as session:
        query = (
            select(Shot.planned_run_id, Shot.impact_id, Shot.measured_velocity_m_s)
            .where(
                Shot.planned_run_id.is_not(None),
                Shot.impact_id.is_not(None),
                Shot.measured_velocity_m_s.is_not(None),
            )
            .order_by(Shot.id)
        )
        chosen: dict[int, tuple[int, float]] = {}
        for run, number, velocity in session.execute(query):
            chosen.setdefault(run, (number, velocity))
        runs = list(chosen)[:3]
        for place, run in enumerate(runs):
            velocity = chosen[run][1] * (1.0 if place else 0.99)
            session.add(
                run_prediction(
                    run,
                    MADE,
                    campaign=None,
                    adopted=[],
                    models={"gun": "adiabatic", "contact": MODEL},
                    velocity_m_s=velocity,
                    velocity_lower_m_s=0.9 * velocity,
                    velocity_upper_m_s=1.1 * velocity,
                    drawn={
                        "velocity_m_s": [factor * velocity for factor in (0.9, 0.95, 1.05, 1.1)]
                    },
                    contact_time_s=None,
                    contact_time_lower_s=None,
                    contact_time_upper_s=None,
                    peak_force_n=None,
                    peak_force_lower_n=None,
                    peak_force_upper_n=None,
                    spectra={
                        "q": 10.0,
                        "frequency_hz": [100.0, 1000.0],
                        "sensors": {
                            "acceleration_1": {
                                "median": [1e3, 1e4],
                                "lower": [5e2, 5e3],
                                "upper": [2e3, 2e4],
                            }
                        },
                    },
                )
            )
        return chosen[runs[0]][0]


def test_impact_shows_what_was_predicted_before_with_model_and_time(browser, lab, impact):
    with lab.reading() as session:
        plan = session.scalar(
            select(Plan.name)
            .join(PlannedRun, PlannedRun.plan_id == Plan.id)
            .join(Shot, Shot.planned_run_id == PlannedRun.id)
            .where(Shot.impact_id == impact)
        )
    with page_of(browser, lab, width=1400) as page:
        at(page, f"/impacts/{impact}")
        words = page.inner_text("#prediction")
        assert f"contact: {MODEL}" in words and "2026-01-05 at 09:30 UTC" in words
        assert f"plan {plan}" in words
        heads = page.locator("#predicted thead th").all_inner_texts()
        (row,) = page.locator("#predicted tbody tr").all()
        cells = dict(
            zip(heads, [cell.inner_text() for cell in row.locator("td").all()], strict=True)
        )
        assert (cells["quantity"], cells["unit"], cells["in the band"]) == (
            "impact velocity", "m/s", "yes",
        )  # fmt: skip
        # the measured value is 1 / 0.99 of the median: two of four draws lie below
        assert float(cells["rank"]) == pytest.approx(2.5 / 5)
        measured, difference = float(cells["measured"]), float(cells["difference"])
        assert difference == pytest.approx(0.01 * measured, rel=0.02)
        assert float(cells["difference in band widths"]) == pytest.approx(0.01 / 0.198, rel=0.02)
        (band,) = [series for series in drawn(page, "spectrum") if "low" in series]
        assert band["x"] == [100.0, 1000.0]
        assert band["low"] == pytest.approx([5e2 / 9.80665, 5e3 / 9.80665], rel=1e-4)
        screenshot(page, "predicted-impact", 900)
        page.click("#prediction a")
        page.wait_for_url("**/plans/**")
        assert page.locator("#predictions").is_visible()


def test_numbers_of_the_sentence_of_the_plan_stand_in_its_table(browser, lab, impact):
    with lab.reading() as session:
        plan = session.scalar(
            select(Plan.name)
            .join(PlannedRun, PlannedRun.plan_id == Plan.id)
            .join(RunPrediction, RunPrediction.planned_run_id == PlannedRun.id)
        )
    with page_of(browser, lab) as page:
        at(page, f"/plans/{plan}")
        wait_drawn(page)
        answer = plan_forecasts(lab.store, plan)
        (sentence,) = answer.sentences()
        assert str(sentence) in page.locator(".band-test").all_inner_texts()
        cells = page.locator("#band-tests td").all_inner_texts()
        assert {number.cell for number in sentence.numbers} <= set(cells)
        bands = drawn(page, "bands-1")
        assert len(bands[0]["x"]) == answer.tests[0].shots
        screenshot(page, "predicted-plan", 900)


def test_prediction_made_after_the_shot_is_not_shown(browser, lab, impact):
    """Shots that were stored before the prediction was made: the page says nothing of it."""
    with lab.store.writing() as session:
        times = dict(iter(session.execute(select(Shot.id, Shot.stored_at))))
        session.execute(update(Shot).values(stored_at=MADE))
        session.execute(update(Impact).values(stored_at=MADE))
    try:
        with page_of(browser, lab) as page:
            at(page, f"/impacts/{impact}")
            assert page.locator("#prediction").count() == 0
    finally:
        with lab.store.writing() as session:
            later = max(times.values())
            session.execute(update(Shot).values(stored_at=later))
            session.execute(update(Impact).values(stored_at=later))


def test_runs_are_predicted_from_the_page_of_the_plan(browser, lab):
    make_plan(lab.store, "lhs", "spring", runs=3, repetitions=1, seed=4)
    with page_of(browser, lab) as page:
        at(page, "/plans/spring")
        page.click("#to-predict")
        page.wait_for_url("**/ask/plan-predict**")
        assert page.input_value("[name=name]") == "spring"
        page.fill("[name=runs]", "1-2")
        page.fill("[name=contact]", "hann")
        page.press("[name=runs]", "Enter")
        job = ended(page, 300)
        assert (job["state"], job["error"]) == ("done", None)
        page.click("#job-result")
        page.wait_for_url("**/plans/spring**")
        assert "2 runs of plan spring are predicted" in page.inner_text("#predictions")
        at(page, "/plans/spring/sheet?run=1")
        assert "expected velocity (m/s)" in page.inner_text("#expected")
    with lab.reading() as session:
        count = (
            select(func.count())
            .select_from(RunPrediction)
            .join(PlannedRun, RunPrediction.planned_run_id == PlannedRun.id)
        )
        assert session.scalar(count.join(Plan).where(Plan.name == "spring")) == 2
