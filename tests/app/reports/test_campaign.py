"""The report on a campaign tells what the store holds: counts, deviations and means that are known."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from pyroshock.app.common.nominal_velocity import with_predictions
from pyroshock.app.documents.document import Document, Paragraph, Table
from pyroshock.app.documents.page import html_of
from pyroshock.app.documents.pdf import pdf_of
from pyroshock.app.plan.planning import make_plan
from pyroshock.app.report.campaign import (
    MEASURED,
    PRESSURE,
    TRANSDUCER,
    VELOCITY,
    WRITTEN,
    achieved_settings,
    campaign_document,
    level_counts,
    plans_of,
    settings_section,
    status_counts,
)
from pyroshock.app.report.campaign_pulses import pulses_of, telling_factor
from pyroshock.doe.plans import discard_run, read_plan
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.impacts import Impact, Pulse, Shot
from pyroshock.schema.listings import iter_impacts, iter_shots
from pyroshock.schema.recordings import QualityFinding, Recording
from pyroshock.schema.session import Store
from sqlalchemy import select
from support.checks.well_formed import Page, needs_nothing
from support.records.campaigns import gun_campaign, write_runs
from support.stores.hammer_stores import CONFIGURATIONS, HITS, copied, filled_store, full_campaign, rows_of
from support.stores.stores import ingested, opened

RUNS, FIRED, REPETITIONS = 6, 4, 2
#: Achieved over planned: of the tank's pressure as written down, of the velocity.
FILLED, FAST = 1.02, 1.1


def rows_of_plan(store: Store) -> list[dict[str, object]]:
    """The first runs of the plan as a lab fires them."""
    with store.reading() as session:
        plan = read_plan(session, "spring")
    speeds, rows = {"low": 7.0, "medium": 14.0, "high": 22.0}, []
    for run in plan.runs[:FIRED]:
        settings = {key: level for key, level in run.row.items() if key != "velocity_level"}
        settings["tank_pressure_bar"] = str(FILLED * run.settings["tank_pressure_bar"])
        speed = FAST * speeds[run.row["velocity_level"]]
        for repetition in range(1, REPETITIONS + 1):
            rows.append({"run": run.run, "repetition": repetition, **settings, "measured_velocity_m_s": speed})
    return rows


@pytest.fixture(scope="module")
def planned(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A gun plan of six runs of which four were fired, with one discarded."""
    folder = tmp_path_factory.mktemp("planned")
    url = f"sqlite:///{folder / 'lab.db'}"
    with opened(url, create=True) as store:
        make_plan(store, "lhs", "spring", runs=RUNS, repetitions=REPETITIONS, seed=1)
        discard_run(store, "spring", RUNS, "the anvil <b>broke</b>")
        rows = rows_of_plan(store)
    campaign = gun_campaign(folder / "spring", name="spring")
    write_runs(campaign, rows)
    ingested(url, campaign)
    return url


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("filled")
    return filled_store(folder, full_campaign(folder / "hits", "hits"))


@pytest.fixture
def hits(filled: Path, tmp_path: Path) -> Iterator[Store]:
    """A store of four configurations with five pulses each, that a test may change."""
    with opened(copied(filled, tmp_path)) as store:
        yield store


def document(store: Store, name: str) -> Document:
    with store.reading() as session:
        return campaign_document(session, name)


def tables(found: Document) -> dict[str, Table]:
    blocks = [block for section in found.sections for block in section.blocks]
    return {block.caption: block for block in blocks if isinstance(block, Table)}


def told(found: Document) -> str:
    blocks = [block for section in found.sections for block in section.blocks]
    return " ".join(block.text for block in blocks if isinstance(block, Paragraph))


def test_runs_and_levels_are_counted_by_state(planned: str) -> None:
    with opened(planned) as store:
        found = document(store, "spring")
        with store.reading() as session:
            (plan,) = plans_of(session, session.scalars(select(Campaign)).one())
    assert status_counts(plan) == {"planned": 1, "done": FIRED, "discarded": 1}
    (row,) = tables(found)["Runs by state."].rows
    assert list(row) == ["spring", "lhs", RUNS, FIRED, 1, 1, FIRED * REPETITIONS, (RUNS - 1) * REPETITIONS]
    assert found.facts["Planned runs"] == "4 done, 1 to do, 1 discarded"
    assert tables(found)["Discarded from plan spring."].rows == [[RUNS, "the anvil <b>broke</b>"]]
    with opened(planned) as store, store.reading() as session:
        plan = read_plan(session, "spring")
    counts = level_counts(plan)
    assert set(counts) == {(f.column, level) for f in plan.space.factors for level in f.levels}
    of_mass = [states for (column, _), states in counts.items() if column == "bullet_mass_kg"]
    assert sum(sum(states.values()) for states in of_mass) == RUNS
    assert sum(states["done"] for states in of_mass) == FIRED


def test_range_of_the_plan_has_a_row_for_each_part(tmp_path: Path) -> None:
    with opened(f"sqlite:///{tmp_path / 'lab.db'}", create=True) as store:
        plan = make_plan(store, "lhs", "ranged", runs=10, seed=1, ranges={"tank_pressure_bar": (1, 6, 0.1)})
    counts = {level: sum(c.values()) for (column, level), c in level_counts(plan).items() if "pressure" in column}
    assert counts == dict.fromkeys(["1 to 2", "2.1 to 3", "3.1 to 4", "4.1 to 5", "5.1 to 6"], 2)


def test_pressure_of_a_shot_without_a_plan_is_beside_the_one_set(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    ingested(url, gun_campaign(tmp_path / "gun"))
    with opened(url) as store:
        with store.writing() as session:
            session.scalars(select(Shot)).first().recorded_pressure_pa = 33_000.0
        with store.reading() as session:
            (found,) = achieved_settings(session, session.scalars(select(Campaign)).one(), ())
    assert (found.key, found.source, found.off.tolist()) == (PRESSURE, TRANSDUCER, [pytest.approx(33 / 25 - 1)])


def test_shots_and_achieved_settings_are_told_beside_model_and_plan(planned: str) -> None:
    with opened(planned) as store:
        found = document(store, "spring")
        with store.reading() as session:
            shots = list(with_predictions(session, iter_shots(session, "spring")))
    off = 100 * np.array([s["measured_velocity_m_s"] / s["predicted_velocity_m_s"] - 1 for s in shots])
    assert f"{off.mean():+.1f} % in the mean, {np.sqrt(np.mean(off**2)):.1f} % rms" in told(found)
    each = tables(found)["Each shot, with the standard uncertainty of its velocity."]
    assert [row[-1] for row in each.rows] == pytest.approx(off.tolist(), abs=0.006)
    by_setting = next(table for caption, table in tables(found).items() if caption.startswith("By setting"))
    assert sum(int(row[2]) for row in by_setting.rows) == len(shots)
    with opened(planned) as store:
        with store.writing() as session:
            for shot in session.scalars(select(Shot)):
                shot.recorded_pressure_pa = 0.99 * shot.tank_pressure_pa
                shot.recorded_pressure_u_pa = 100.0
        with store.reading() as session:
            campaign = session.scalars(select(Campaign)).one()
            achieved = {(a.key, a.source): a for a in achieved_settings(session, campaign, plans_of(session, campaign))}
    assert achieved[PRESSURE, WRITTEN].off == pytest.approx(np.full(FIRED * REPETITIONS, FILLED - 1))
    assert achieved[PRESSURE, TRANSDUCER].off == pytest.approx(np.full(FIRED * REPETITIONS, 0.99 * FILLED - 1))
    assert achieved[VELOCITY, MEASURED].off == pytest.approx(np.full(FIRED * REPETITIONS, FAST - 1))
    assert np.all(achieved["bullet_mass_kg", WRITTEN].off == 0)
    (table, _) = settings_section(list(achieved.values())).blocks
    assert isinstance(table, Table)
    pressure = next(row for row in table.rows if row[:2] == ["tank pressure", WRITTEN])
    assert pressure[2:6] == [FIRED * REPETITIONS, pytest.approx(2.0), pytest.approx(2.0), pytest.approx(2.0)]


def test_pulses_are_grouped_by_configuration_and_the_report_is_written_both_ways(hits: Store) -> None:
    with hits.reading() as session:
        pulses, rows = pulses_of(session, "hits"), list(iter_impacts(session, "hits"))
        points = session.scalars(select(Pulse.force_points_n).where(Pulse.current).order_by(Pulse.impact_id)).all()
    assert [len(group) for group in pulses.groups] == [HITS] * len(CONFIGURATIONS)
    first = pulses.groups[0]
    own = [i for i, row in enumerate(rows) if row["run"] == 1]
    assert first.figures["peak_force_n"].tolist() == [rows[i]["peak_force_n"] for i in own]
    assert first.force_n == pytest.approx(np.mean([points[i] for i in own], axis=0))
    assert first.spread_n == pytest.approx(np.std([points[i] for i in own], axis=0, ddof=1))
    assert set(pulses.varied) == {
        "anvil_material", "insulator", "tip_material", "tip_radius_m", "boundary_conditions", "impact_position"
    }  # fmt: skip
    assert (pulses.rejected, pulses.without) == (0, 0)
    assert telling_factor(type(pulses)(pulses.groups * 3, 0, 0)) in pulses.varied
    assert telling_factor(type(pulses)(pulses.groups[:1], 0, 0)) is None
    found = tables(document(hits, "hits"))["Mean ± standard deviation over the pulses of a configuration."]
    cells = dict(zip(found.columns, found.rows[0], strict=True))
    # 0.61 to 0.65 m/s in the first run, in steps of 0.01
    assert (cells["impact velocity (m/s)"], cells["tip radius (mm)"]) == ("0.630 ± 0.016", 30)
    report = document(hits, "hits")
    assert needs_nothing(Page(html_of(report))) and pdf_of(report) == pdf_of(document(hits, "hits"))
    with pytest.raises(LookupError, match="known: hits"):
        document(hits, "autumn")


def test_rejected_pulses_and_recordings_set_aside_are_told(hits: Store) -> None:
    with hits.writing() as session:
        impact = session.scalars(select(Impact).order_by(Impact.id)).first()
        assert impact is not None and impact.recording_id is not None
        finding = QualityFinding(
            recording_id=impact.recording_id, impact_id=impact.id, check="double-hit", severity="reject",
            message="two blows <script>", evidence={},
        )  # fmt: skip
        session.add(finding)
        torn = {"path": "recordings/torn.mat", "status": "set aside", "reason": "it ends early"}
        key = session.scalars(select(Campaign.id)).one()
        session.add(Recording(campaign_id=key, sha256="0" * 64, size_bytes=1, format="mat", **torn))
    found = document(hits, "hits")
    aside = tables(found)["Recordings that were set aside."]
    assert list(aside.rows) == [["recordings/torn.mat", "it ends early"]] and "Left out: 1 rejected." in told(found)
    table = tables(found)["Mean ± standard deviation over the pulses of a configuration."]
    assert [row[list(table.columns).index("pulses")] for row in table.rows] == [HITS - 1, HITS, HITS, HITS]
    (doubt,) = [row for row in tables(found)["Rejects and warnings."].rows if row[0] == "reject"]
    assert doubt[1:] == ["double-hit", "recordings/test-01.npz", 1, 1, "two blows <script>"]
    assert ["reject", "double-hit", None, 1] in tables(found)["Findings by check."].rows


def test_more_configurations_than_colours_are_told_by_a_factor(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    rows = [{**row, "batch": f"b{row['run']}"} for row in rows_of(10)]
    ingested(url, full_campaign(tmp_path / "many", "many", recordings=10, rows=rows))
    with opened(url) as store:
        text = html_of(document(store, "many"))
        with store.reading() as session:
            assert len(pulses_of(session, "many").groups) == 10
    assert "Mean pulses by configuration, in the colour of the" in text


def test_empty_campaign_has_a_report_too(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    ingested(url, gun_campaign(tmp_path / "gun"))
    with opened(url) as store:
        with store.writing() as session:
            for shot in session.scalars(select(Shot)):
                session.delete(shot)
        found = document(store, "gun")
    assert [section.title for section in found.sections] == [
        "Design coverage", "Achieved against planned settings", "Quality"
    ]  # fmt: skip
    assert pdf_of(found).startswith(b"%PDF")
