"""Ranks and bands of predictions against numbers by hand and another implementation; which
prediction counts, by the stored times."""

from __future__ import annotations

import datetime as dt

import numpy as np
import pytest
from pyroshock.app.common.run_forecasts import (
    BandComparison,
    ForecastBand,
    band_of,
    forecast_of_impact,
    forecasts_of,
    hits_of_runs,
    key_of_peak,
    quantity_label,
)
from pyroshock.doe.plan_deletion import delete_plan
from pyroshock.doe.space import shipped_factors
from pyroshock.ingest.load import ingest_folder
from pyroshock.ingest.storing.corrections import correct_facts
from pyroshock.schema.campaigns import Configuration, Plan, PlannedRun
from pyroshock.schema.configurations import configuration_ids
from pyroshock.schema.impacts import Impact, Shot
from pyroshock.schema.integrity.checking import checks, iter_findings
from pyroshock.schema.provenance import Tombstone
from pyroshock.schema.removal.part import campaign_part
from pyroshock.schema.removal.removing import remove
from pyroshock.schema.run_predictions import (
    LONG_AGO,
    RunPrediction,
    counting_predictions,
    first_hits,
    late_predictions,
)
from pyroshock.schema.session import Store
from pyroshock.validation.prediction_scores.quantity_score import ComparedValues
from sqlalchemy import func, select, update
from sqlalchemy.exc import IntegrityError
from support.stores.care_stores import run_prediction
from support.stores.planned_runs import find_fault, record_run
from support.stores.stores import opened

MORNING = dt.datetime(2026, 3, 2, 8, tzinfo=dt.UTC)
NOON = dt.datetime(2026, 3, 2, 12, tzinfo=dt.UTC)
EVENING = dt.datetime(2026, 3, 2, 18, tzinfo=dt.UTC)
PLAN = "summer"


# --- numbers


@pytest.mark.parametrize(
    ("measured", "rank"),
    [
        (0.0, 0.5 / 5),  # below all four draws: the middle of the first of five intervals
        (2.5, 2.5 / 5),
        (2.0, 2.0 / 5),  # one draw below, one equal that counts by half, half an interval
        (9.0, 4.5 / 5),
    ],
)
def test_rank_by_hand(measured: float, rank: float) -> None:
    band = ForecastBand("velocity_m_s", 2.5, 1.0, 4.0, (1.0, 2.0, 3.0, 4.0))
    assert band.rank_of(measured) == pytest.approx(rank, abs=1e-15)


def test_band_of_twenty_draws_by_hand() -> None:
    """Place k of n stands at (k - 0.5) / n: 5 % of 20 is between the first and the second."""
    band = band_of("velocity_m_s", [float(draw) for draw in range(20, 0, -1)])
    assert (band.lower, band.median, band.upper) == (1.5, 10.5, 19.5)
    assert band.draws == tuple(map(float, range(1, 21)))
    single = band_of("velocity_m_s", [3.0])
    assert (single.lower, single.median, single.upper) == (3.0, 3.0, 3.0)


def test_ranks_and_bands_are_those_of_the_validation() -> None:
    rng = np.random.default_rng(3)
    draws, measured = rng.lognormal(size=(64, 30)), rng.lognormal(size=30)
    draws[5, 7] = measured[7]
    values = ComparedValues.of(draws, measured)
    for column in range(30):
        band = band_of("peak_force_n", draws[:, column].tolist())
        comparison = BandComparison(band, float(measured[column]))
        assert comparison.rank == pytest.approx(values.rank[column], rel=1e-12)
        assert (band.lower, band.median, band.upper) == pytest.approx(
            (values.low90[column], values.median[column], values.high90[column]), rel=1e-12
        )
        assert comparison.inside == values.inside90[column]


def test_difference_in_band_widths() -> None:
    band = ForecastBand("velocity_m_s", 10.0, 8.0, 12.0, (8.0, 10.0, 12.0))
    comparison = BandComparison(band, 13.0)
    assert (comparison.difference, comparison.difference_in_bands, comparison.inside) == (
        3.0, 0.75, False,
    )  # fmt: skip
    assert BandComparison(ForecastBand("velocity_m_s", 1.0, 1.0, 1.0, (1.0,)), 2.0).as_json()[
        "difference_in_bands"
    ] is None  # fmt: skip


def test_quantities_have_the_words_of_people() -> None:
    assert quantity_label("velocity_m_s") == "impact velocity"
    assert quantity_label(key_of_peak("acceleration_1")) == "peak acceleration_1"


# --- which prediction counts


@pytest.fixture
def store(database_url: str):
    with opened(database_url, create=True) as store:
        with store.writing() as session:
            plan = Plan(name=PLAN, kind="gun", factors=shipped_factors("gun"), method="import")
            session.add(plan)
            session.flush()
            (configuration,) = configuration_ids(session, [[]])
            for run in (1, 2, 3):
                session.add(
                    PlannedRun(
                        plan_id=plan.id, run=run, position=run, repetitions=2, settings={},
                        configuration_id=configuration, treatment={},
                    )
                )  # fmt: skip
        yield store


def run_keys(store: Store) -> dict[int, int]:
    with store.reading() as session:
        return dict(iter(session.execute(select(PlannedRun.run, PlannedRun.id))))


def predict(store: Store, run: int, made_at: dt.datetime, **values) -> None:
    key = run_keys(store)[run]
    with store.writing() as session:
        session.add(run_prediction(key, made_at, **values))


def shoot(store: Store, run: int, stored_at: dt.datetime, repetitions=(1,), **values) -> None:
    record_run(store, PLAN, run, repetitions, stored_at, **values)


def counting(store: Store) -> dict[int, dt.datetime]:
    """When the prediction that counts of each run was made."""
    keys = {key: run for run, key in run_keys(store).items()}
    with store.reading() as session:
        rows = counting_predictions(session, keys)
        return {keys[key]: row.made_at for key, row in rows.items()}


def findings(store: Store) -> list[str]:
    """What `db check` finds, but for the recordings of `record_run`, which have no channel."""
    with store.engine.connect() as connection:
        whole = (finding.what for finding in iter_findings(connection, checks(fast=True)))
        return [what for what in whole if "without any channel" not in what]


def test_newest_prediction_before_the_first_shot_counts(store: Store) -> None:
    for made_at in (NOON, MORNING, EVENING):
        predict(store, 1, made_at)
    assert counting(store) == {1: EVENING}
    shoot(store, 1, NOON + dt.timedelta(hours=1))
    shoot(store, 1, EVENING + dt.timedelta(hours=1), repetitions=(2,))
    assert counting(store) == {1: NOON}
    with store.reading() as session:
        late = late_predictions(session, run_keys(store).values())
        assert [row.made_at for row in late] == [EVENING]


def test_prediction_made_after_the_shot_is_never_shown_as_before_and_is_a_finding(
    store: Store,
) -> None:
    shoot(store, 1, NOON, measured_velocity_m_s=1.5, velocity_source="laser")
    predict(store, 1, NOON)  # at the same instant: not before
    predict(store, 1, EVENING)
    assert counting(store) == {}
    with store.reading() as session:
        assert forecasts_of(session, run_keys(store).values()) == {}
    (first, second) = findings(store)
    assert first.startswith("predictions: table run_predictions, row 1, plan summer, run 1: ")
    assert "it was not made before the shot" in first and EVENING.isoformat() in second


def test_shots_of_unknown_time_are_older_than_every_prediction(store: Store) -> None:
    shoot(store, 1, NOON)
    with store.writing() as session:
        session.execute(update(Shot).values(stored_at=None))
    predict(store, 1, MORNING)
    assert counting(store) == {}
    with store.reading() as session:
        assert first_hits(session, run_keys(store).values()) == {run_keys(store)[1]: LONG_AGO}
    assert len(findings(store)) == 1


def test_store_with_predictions_before_the_shots_is_whole(store: Store) -> None:
    predict(store, 1, MORNING)
    predict(store, 2, MORNING)
    shoot(store, 1, NOON)
    assert findings(store) == []


def test_altered_time_of_a_prediction_is_a_finding(store: Store) -> None:
    shoot(store, 1, NOON)
    predict(store, 1, EVENING)
    with store.engine.begin() as connection:
        connection.exec_driver_sql(
            "UPDATE run_predictions SET made_at = '2026-03-02 08:00:00.000000'"
        )
    assert counting(store) == {1: MORNING}  # the hash of the row tells, as of any other
    (finding,) = findings(store)
    assert finding.startswith("rows: ") and "the row was altered" in finding


def test_run_that_was_shot_once_stays_shot_when_its_campaign_is_deleted(store: Store) -> None:
    predict(store, 1, MORNING)
    shoot(store, 1, NOON)
    with store.writing() as session:
        remove(session, campaign_part(session, PLAN), "wrong sensor")
    with store.reading() as session:
        (stone,) = session.scalars(select(Tombstone))
        assert stone.stood_on["shot"] == [{"plan": PLAN, "run": 1, "stored_at": NOON.isoformat()}]
        assert first_hits(session, run_keys(store).values()) == {run_keys(store)[1]: NOON}
        assert session.scalar(select(func.count()).select_from(RunPrediction)) == 1
    predict(store, 1, EVENING)
    assert counting(store) == {1: MORNING}
    shoot(store, 1, EVENING + dt.timedelta(hours=2))  # shot again, after the late prediction
    assert counting(store) == {1: MORNING}


def test_bands_are_ordered_and_a_making_is_stored_once(store: Store) -> None:
    predict(store, 1, MORNING)
    with pytest.raises(IntegrityError):
        predict(store, 1, MORNING)
    with pytest.raises(IntegrityError):
        predict(store, 2, MORNING, velocity_lower_m_s=2.0)
    with pytest.raises(IntegrityError):
        predict(store, 2, MORNING, velocity_upper_m_s=None)


def test_plan_goes_with_its_predictions(store: Store) -> None:
    predict(store, 1, MORNING)
    assert delete_plan(store, PLAN) == 3
    with store.reading() as session:
        assert session.scalar(select(func.count()).select_from(RunPrediction)) == 0


def test_measured_values_are_compared_with_the_quantities_that_were_predicted(
    store: Store,
) -> None:
    predict(store, 1, MORNING)
    with store.writing() as session:
        key = session.scalar(select(Configuration.id))
    shoot(
        store, 1, NOON, measured_velocity_m_s=1.55, velocity_source="laser",
    )  # fmt: skip
    with store.writing() as session:
        shot = session.scalars(select(Shot)).one()
        impact = Impact(
            campaign_id=shot.campaign_id, run=1, repetition=1, configuration_id=key,
            planned_run_id=shot.planned_run_id, stored_at=NOON,
        )  # fmt: skip
        session.add(impact)
        session.flush()
        shot.impact_id = impact.id
        number = impact.id
    with store.reading() as session:
        predicted = forecast_of_impact(session, number)
        assert predicted is not None
        forecast, (comparison,) = predicted
        (hit,) = hits_of_runs(session, run_keys(store).values())
    assert (forecast.plan, forecast.run, forecast.made_at) == (PLAN, 1, MORNING)
    assert "contact: tree@1" in forecast.words and "2026-03-02 at 08:00 UTC" in forecast.words
    assert dict(hit.values) == {"velocity_m_s": 1.55}
    # draws 1.4, 1.5, 1.5, 1.6: three lie below
    assert (comparison.rank, comparison.inside) == (pytest.approx(3.5 / 5), True)
    with store.reading() as session:
        assert forecast_of_impact(session, number + 1) is None


def test_rejected_impact_of_a_hammer_is_no_measurement_and_a_rejected_shot_keeps_its_velocity(
    store: Store,
) -> None:
    shoot(store, 1, NOON, measured_velocity_m_s=1.5, velocity_source="laser")
    find_fault(store, PLAN, 1, 1)
    with store.reading() as session:
        (hit,) = hits_of_runs(session, run_keys(store).values())
    assert (hit.rejected, dict(hit.values)) == (False, {"velocity_m_s": 1.5})
    with store.writing() as session:
        session.execute(update(Plan).values(kind="hammer"))
        session.execute(update(Shot).values(planned_run_id=None))
    record_run(store, PLAN, 2, (1,), NOON, impact_velocity_m_s=1.5, velocity_source="integrated")
    record_run(store, PLAN, 2, (2,), NOON, impact_velocity_m_s=1.6, velocity_source="reported")
    find_fault(store, PLAN, 2, 2)
    with store.reading() as session:
        first, second = hits_of_runs(session, run_keys(store).values())
    # a velocity that was integrated is none before contact, which is what is predicted
    assert (first.rejected, dict(first.values)) == (False, {})
    assert (second.rejected, dict(second.values)) == (True, {"velocity_m_s": 1.6})


def test_corrected_fact_leaves_the_time_of_the_shot(database_url: str, tmp_path) -> None:
    """A correction gives the row another writer, who began after the prediction; the shot stays
    the older one."""
    from support.records.campaigns import gun_campaign

    with opened(database_url, create=True) as store:
        ingest_folder(store, gun_campaign(tmp_path / "gun", 1))
    with opened(database_url) as store:
        with store.reading() as session:
            (stored_at,) = session.scalars(select(Shot.stored_at))
        with store.writing() as session:
            correct_facts(store, session, "gun", {"tip_material": "steel"}, "another tip", [1])
        with store.reading() as session:
            (shot,) = session.scalars(select(Shot))
            assert shot.stored_at == stored_at is not None
