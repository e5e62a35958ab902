"""The report on a campaign tells what the store holds: counts, deviations and means that are
known."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pyroshock.app.common.nominal_velocity import with_predictions
from pyroshock.app.common.number_format import signed_percent
from pyroshock.app.common.quantities import shown_in
from pyroshock.app.documents.document import (
    Bullets,
    Cell,
    ChartRow,
    Document,
    Paragraph,
    Table,
)
from pyroshock.app.documents.page import html_of
from pyroshock.app.documents.pdf import pdf_of
from pyroshock.app.figures.figure import Plot
from pyroshock.app.operations.ingest.planned_achieved import planned_achieved_rows
from pyroshock.app.operations.report.campaign import campaign_document
from pyroshock.app.operations.report.campaign_pulses import pulses_of, telling_factor
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.impacts import ChannelFigures, Impact, Pulse, Shot
from pyroshock.schema.listings import iter_impacts, iter_shots
from pyroshock.schema.recordings import QualityFinding, RecordedChannel, Recording
from pyroshock.schema.session import Store
from sqlalchemy import select
from support.checks.well_formed import Page, needs_nothing
from support.records.campaigns import gun_campaign
from support.stores.hammer_stores import CONFIGURATIONS, HITS, full_campaign, rows_of
from support.stores.report_stores import FIRED, REPETITIONS, RUNS
from support.stores.stores import ingested, opened


def document(store: Store, name: str) -> Document:
    with store.reading() as session:
        return campaign_document(session, name)


def tables(content: Document) -> dict[str, Table]:
    blocks = [block for section in content.sections for block in section.blocks]
    return {block.caption: block for block in blocks if isinstance(block, Table)}


def achieved_table(content: Document) -> Table:
    return next(
        table
        for caption, table in tables(content).items()
        if caption.startswith("Runs and recordings")
    )


def bullets(content: Document) -> list[str]:
    blocks = [block for section in content.sections for block in section.blocks]
    return [line for block in blocks if isinstance(block, Bullets) for line in block.lines]


def figures(content: Document) -> list[Plot]:
    blocks = [block for section in content.sections for block in section.blocks]
    return [figure for block in blocks if isinstance(block, ChartRow) for figure in block.figures]


def told(content: Document) -> str:
    blocks = [block for section in content.sections for block in section.blocks]
    return " ".join(block.text for block in blocks if isinstance(block, Paragraph))


def test_runs_are_counted_by_state_and_a_discarded_one_has_its_reason(planned: str) -> None:
    with opened(planned) as store:
        content = document(store, "spring")
    assert (
        f"Plan spring (lhs): {FIRED} of {RUNS} runs are done, 1 still to do, 1 discarded; "
        f"{FIRED * REPETITIONS} of {(RUNS - 1) * REPETITIONS} repetitions are recorded."
    ) in told(content)
    assert bullets(content) == [f"Run {RUNS} of plan spring is discarded: the anvil <b>broke</b>."]
    table = achieved_table(content)
    of_mass = [
        dict(zip(table.columns, row, strict=True))
        for row in table.rows
        if row[0] == "bullet mass (kg)"
    ]
    assert sum(int(row["done"]) for row in of_mass) == FIRED
    assert sum(int(row["shots"]) for row in of_mass) == FIRED * REPETITIONS


def test_a_factor_of_many_levels_has_one_row(tmp_path: Path) -> None:
    levels = [
        {
            "factor": "tank_pressure_pa",
            "level": 1e5 * i,
            "planned": 1,
            "done": 2,
            "discarded": 0,
            "shots": 3,
            "impacts": 0,
        }
        for i in range(1, 13)
    ]
    (row,) = planned_achieved_rows(levels, [])
    assert (row["level"], row["planned"], row["done"], row["shots"]) == (
        "1 to 12 (12 levels)",
        12,
        24,
        36,
    )
    assert len(planned_achieved_rows(levels[:8], [])) == 8


def test_planned_and_achieved_settings_stand_in_one_table(planned: str) -> None:
    with opened(planned) as store:
        with store.writing() as session:
            for shot in session.scalars(select(Shot)):
                shot.recorded_pressure_pa = 0.99 * shot.tank_pressure_pa
                shot.recorded_pressure_u_pa = 100.0
        content = document(store, "spring")
    table = achieved_table(content)
    deviations: dict[Cell, set[Cell]] = {}
    for row in table.rows:
        deviations.setdefault(row[0], set()).add(row[list(table.columns).index("mean deviation")])
    assert deviations["tank pressure (bar)"] <= {"+2.0 %", "–", None}
    assert deviations["recorded pressure (bar)"] == {"+1.0 %"} and deviations[
        "impact velocity (m/s)"
    ] == {"+10.0 %"}
    assert deviations["bullet mass (kg)"] == {"0.0 %"}
    charts = {figure.title for figure in figures(content)}
    assert {
        "Recorded pressure, achieved against planned",
        "Impact velocity, achieved against planned",
    } <= charts
    assert "Bullet mass, achieved against planned" not in charts  # nothing differs


def test_pressure_of_a_shot_without_a_plan_is_beside_the_one_set(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    ingested(url, gun_campaign(tmp_path / "gun"))
    with opened(url) as store:
        with store.writing() as session:
            session.scalars(select(Shot)).first().recorded_pressure_pa = 33_000.0
        content = document(store, "gun")
    off = signed_percent(33 / 25 - 1)
    assert f"differs from the one that was set by {off} on average and {off} at most (run" in told(
        content
    )


def test_shots_are_told_beside_the_nominal_gun(planned: str) -> None:
    with opened(planned) as store:
        content = document(store, "spring")
        with store.reading() as session:
            shots = list(with_predictions(session, iter_shots(session, "spring")))
    off = np.array([s["measured_velocity_m_s"] / s["predicted_velocity_m_s"] - 1 for s in shots])
    assert f"nominal gun by {signed_percent(off.mean())} on average" in told(content)
    by_setting = tables(content)["Mean ± standard deviation over the shots of a setting."]
    assert sum(int(row[2]) for row in by_setting.rows) == len(shots)
    assert "Each shot, with the standard uncertainty of its velocity." not in tables(content)


def test_shots_that_were_not_repeated_are_listed_with_their_uncertainty(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    ingested(url, gun_campaign(tmp_path / "gun"))
    with opened(url) as store:
        with store.writing() as session:
            for number, shot in enumerate(session.scalars(select(Shot))):
                shot.tank_pressure_pa = 1e5 + 1e4 * number
                shot.measured_velocity_m_s, shot.measured_velocity_u_m_s = 13.8, 0.19
        content = document(store, "gun")
    shots = tables(content)["Each shot, with the standard uncertainty of its velocity."]
    assert {row[list(shots.columns).index("measured velocity (m/s)")] for row in shots.rows} == {
        "13.80 ± 0.19"
    }


def test_pulses_are_grouped_by_configuration_and_the_report_is_written_both_ways(
    hits: Store,
) -> None:
    with hits.reading() as session:
        pulses, rows = pulses_of(session, "hits"), list(iter_impacts(session, "hits"))
        points = session.scalars(
            select(Pulse.force_points_n).where(Pulse.current).order_by(Pulse.impact_id)
        ).all()
    assert [len(group) for group in pulses.groups] == [HITS] * len(CONFIGURATIONS)
    first = pulses.groups[0]
    own = [i for i, row in enumerate(rows) if row["run"] == 1]
    assert first.figures["peak_force_n"].tolist() == [rows[i]["peak_force_n"] for i in own]
    assert first.force_n == pytest.approx(np.mean([points[i] for i in own], axis=0))
    assert first.spread_n == pytest.approx(np.std([points[i] for i in own], axis=0, ddof=1))
    assert set(pulses.varied) == {
        "anvil_material", "insulator", "tip_material", "tip_radius_m", "boundary_conditions",
        "impact_position"
    }  # fmt: skip
    assert (pulses.rejected, pulses.without) == (0, 0)
    assert telling_factor(type(pulses)(pulses.groups * 3, 0, 0)) in pulses.varied
    assert telling_factor(type(pulses)(pulses.groups[:1], 0, 0)) is None
    content = tables(document(hits, "hits"))[
        "Mean ± standard deviation over the pulses of a configuration."
    ]
    cells = dict(zip(content.columns, content.rows[0], strict=True))
    # 0.61 to 0.65 m/s in the first run, in steps of 0.01
    assert (cells["impact velocity (m/s)"], cells["tip radius (mm)"]) == ("0.630 ± 0.016", "30")
    assert "peak force (kN)" in cells and "contact time (ms)" in cells
    with shown_in("si"):
        assert "peak force (N)" in tables(document(hits, "hits"))[content.caption].columns
    report = document(hits, "hits")
    assert needs_nothing(Page(html_of(report))) and pdf_of(report) == pdf_of(document(hits, "hits"))
    with pytest.raises(LookupError, match="known: hits"):
        document(hits, "autumn")


def test_rejected_pulses_and_recordings_set_aside_are_told(hits: Store) -> None:
    with hits.writing() as session:
        impact = session.scalars(select(Impact).order_by(Impact.id)).first()
        assert impact is not None and impact.recording_id is not None
        finding = QualityFinding(
            recording_id=impact.recording_id, impact_id=impact.id, check="double-hit",
            severity="reject",
            message="two blows <script>", evidence={},
        )  # fmt: skip
        session.add(finding)
        torn = {"path": "recordings/torn.mat", "status": "set aside", "reason": "it ends early"}
        key = session.scalars(select(Campaign.id)).one()
        session.add(Recording(campaign_id=key, sha256="0" * 64, size_bytes=1, format="mat", **torn))
    content = document(hits, "hits")
    aside = tables(content)["Recordings that could not be read and were set aside."]
    assert list(aside.rows) == [["recordings/torn.mat", "it ends early"]]
    assert "Impacts that are left out: 1 rejected." in told(content)
    table = tables(content)["Mean ± standard deviation over the pulses of a configuration."]
    assert [row[list(table.columns).index("pulses")] for row in table.rows] == [
        HITS - 1,
        HITS,
        HITS,
        HITS,
    ]
    findings = tables(content)["Findings of the quality checks by cause, the most serious first."]
    cause, severity, number, _, impacts, example, action = findings.rows[0]
    assert (cause, severity, number, impacts) == ("The hammer touched twice", "reject", 1, "1")
    assert (
        example == "run 1, repetition 1: two blows <script>"
        and action == "Leave the impact out, or repeat it."
    )
    assert content.lead.endswith(
        "cause: the hammer touched twice (run 1). Leave the impact out, or repeat it."
    )
    assert (
        "1 is rejected" in content.lead and "1 could not be read and was set aside" in content.lead
    )
    assert content.sections[0].title == "Quality"


def test_the_worst_of_many_findings_is_the_example(hits: Store) -> None:
    assert (
        document(hits, "hits").lead
        == "All 4 recordings are accepted. No recording has to be repeated."
    )
    with hits.writing() as session:
        recording = session.scalars(select(Recording).order_by(Recording.id)).first()
        assert recording is not None
        path = recording.path
        for number, ratio in enumerate((2.0, 9.0, 3.0)):
            session.add(
                QualityFinding(
                    recording_id=recording.id, check="velocity", severity="warning",
                    message=f"number {number}",
                    evidence={"velocity_ratio": ratio},
                )
            )  # fmt: skip
    content = document(hits, "hits")
    assert content.lead.startswith(
        "All 4 recordings are accepted; 1 of the accepted recordings has warnings. The most"
    )
    row = tables(content)["Findings of the quality checks by cause, the most serious first."].rows[
        0
    ]
    assert (row[2], row[5]) == (3, f"{path}: number 1")


def test_more_configurations_than_colours_are_told_by_a_factor(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    rows = [{**row, "batch": f"b{row['run']}"} for row in rows_of(10)]
    ingested(url, full_campaign(tmp_path / "many", "many", recordings=10, rows=rows))
    with opened(url) as store:
        text = html_of(document(store, "many"))
        with store.reading() as session:
            assert len(pulses_of(session, "many").groups) == 10
    assert "<h3>Mean pulses by " in text and "configurations are not listed" not in text


_CHANNEL_NUMBERS = ("signed_peak_acceleration_m_s2", "peak_time_s", "pulse_start_s",
"pulse_duration_s",
                    "effective_duration_s", "energy_duration_s", "velocity_change_m_s",
                    "record_velocity_change_m_s")  # fmt: skip


def test_only_factors_tell_configurations_apart(hits: Store) -> None:
    """Figures of the channels are measured: they make no configuration of each impact."""
    with hits.writing() as session:
        for number, impact in enumerate(session.scalars(select(Impact)).all()):
            channel = session.scalars(
                select(RecordedChannel.id).where(
                    RecordedChannel.recording_id == impact.recording_id
                )
            ).first()
            numbers = dict.fromkeys(_CHANNEL_NUMBERS, 0.01) | {
                "peak_acceleration_m_s2": 100.0 + number
            }
            spectrum = {"srs_frequency_hz": [10.0], "srs_maximax_m_s2": [1.0]}
            session.add(
                ChannelFigures(
                    impact_id=impact.id, channel_id=channel, largest=True, **numbers, **spectrum
                )
            )
    with hits.reading() as session:
        assert len({row["peak_acceleration_m_s2"] for row in iter_impacts(session, "hits")}) > len(
            CONFIGURATIONS
        )
        assert [len(group) for group in pulses_of(session, "hits").groups] == [HITS] * len(
            CONFIGURATIONS
        )


def test_empty_campaign_has_a_report_too(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    ingested(url, gun_campaign(tmp_path / "gun"))
    with opened(url) as store:
        with store.writing() as session:
            for shot in session.scalars(select(Shot)):
                session.delete(shot)
        content = document(store, "gun")
    assert content.lead == "The campaign has no recordings, so that nothing could be checked."
    assert pdf_of(content).startswith(b"%PDF")
