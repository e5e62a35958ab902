"""Campaigns of accelerations alone: what the store says of their impacts, and of the shocks that no
row stands for."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner
from pyroshock.app.doors.command_line.main import main
from pyroshock.ingest.extraction.settings import ExtractionSettings
from pyroshock.ingest.load import ingest_folder
from pyroshock.ingest.storing.reextraction import reextract
from pyroshock.schema.conditions import Condition
from pyroshock.schema.impacts import ChannelFigures, Impact
from pyroshock.schema.integrity.checking import checks, iter_findings
from pyroshock.schema.listings import iter_impacts
from pyroshock.schema.recordings import QualityFinding, RecordedChannel
from pyroshock.schema.session import Writer, open_store
from sqlalchemy import delete, select
from support.records.campaigns import hammer_campaign, write_folder
from support.stores.stores import statements

RATE = 20_000.0
TOML = """
[campaign]
name = "{name}"
kind = "hammer"
date = "2026-03-02"
"""


def pulses(peaks_m_s2, duration_s=2e-3, every_s=0.3, noise=0.2, seed=1):
    """Half sines, the first after 0.1 s."""
    time = np.arange(round((0.1 + every_s * len(peaks_m_s2)) * RATE)) / RATE
    x = np.random.default_rng(seed).normal(size=time.size) * noise
    for i, peak in enumerate(peaks_m_s2):
        phase = (time - 0.1 - i * every_s) / duration_s
        x += np.where((phase > 0) & (phase < 1), peak * np.sin(np.pi * phase), 0.0)
    return x


def campaign(folder, recordings, runs, name="drops", channels=("acc",)):
    """A folder of .npz recordings: `recordings` file -> channel -> record in m/s2; `runs`: each
    row's recording."""
    declared = "".join(
        f'[channels.{c}]\nquantity = "acceleration"\nunit = "m/s2"\nposition = "{c}"\n'
        for c in channels
    )
    rows = [
        "run,repetition,tip_material,recording",
        *(f"{i},1,steel,{file}" for i, file in enumerate(runs, 1)),
    ]
    recorded = {file: {"fs": RATE, **records} for file, records in recordings.items()}
    return write_folder(folder, TOML.format(name=name) + declared, rows, recorded)


def figures(store, channel=None):
    """Rows of figures in the order of runs."""
    with store.reading() as session:
        query = (
            select(ChannelFigures)
            .join(Impact)
            .join(RecordedChannel)
            .order_by(Impact.run, RecordedChannel.name)
        )
        return list(
            session.scalars(
                query if channel is None else query.where(RecordedChannel.name == channel)
            )
        )


def listed(store, *where):
    with store.reading() as session:
        return list(iter_impacts(session, "drops", where))


def findings(store):
    with store.reading() as session:
        return {(f.check, f.severity): f for f in session.scalars(select(QualityFinding))}


def test_row_is_the_whole_recording(any_store, tmp_path):
    ingest_folder(
        any_store,
        campaign(tmp_path / "c", {"1.npz": {"acc": pulses([500.0, 200.0])}}, ["1.npz"]),
        jobs=1,
    )
    (row,) = figures(any_store)
    assert row.peak_acceleration_m_s2 == pytest.approx(500.0, rel=0.01)
    assert row.peak_time_s == pytest.approx(0.101, abs=2e-4)
    assert row.pulse_duration_s == pytest.approx(0.936 * 2e-3, rel=0.02)
    assert row.velocity_change_m_s == pytest.approx(2 * 500 * 2e-3 / np.pi, rel=0.01)
    assert row.record_velocity_change_m_s == pytest.approx(2 * 700 * 2e-3 / np.pi, rel=0.02)
    assert row.largest


def test_listing_has_the_channel_with_the_largest_peak(any_store, tmp_path):
    records = {"a": pulses([100.0]), "b": pulses([-400.0]), "c": np.zeros(8000)}
    ingest_folder(
        any_store, campaign(tmp_path / "c", {"1.npz": records}, ["1.npz"], channels="abc"), jobs=1
    )
    assert [row.largest for row in figures(any_store)] == [False, True]  # c never moved
    (impact,) = listed(any_store)
    assert impact["peak_acceleration_m_s2"] == pytest.approx(400.0, rel=0.01)
    assert impact["velocity_change_m_s"] == pytest.approx(-2 * 400 * 2e-3 / np.pi, rel=0.01)
    assert impact["peak_force_n"] is None
    assert list(impact)[-4:] == [
        "quality",
        "peak_acceleration_m_s2",
        "pulse_duration_s",
        "velocity_change_m_s",
    ]


def test_shocks_are_those_of_the_rows_in_time_order(any_store, tmp_path):
    made = [500.0, 300.0, 900.0]
    ingest_folder(
        any_store, campaign(tmp_path / "c", {"1.npz": {"acc": pulses(made)}}, ["1.npz"] * 3), jobs=1
    )
    assert [row.peak_acceleration_m_s2 for row in figures(any_store)] == pytest.approx(
        made, rel=0.01
    )
    assert [row.peak_time_s for row in figures(any_store)] == pytest.approx(
        [0.101, 0.401, 0.701], abs=2e-4
    )
    velocities = [row.record_velocity_change_m_s for row in figures(any_store)]
    assert velocities == pytest.approx([2 * peak * 2e-3 / np.pi for peak in made], abs=0.02)


def test_shocks_beyond_the_rows_are_named(any_store, tmp_path):
    made = [500.0, 100.0, 900.0]
    ingest_folder(
        any_store, campaign(tmp_path / "c", {"1.npz": {"acc": pulses(made)}}, ["1.npz"] * 2), jobs=1
    )
    assert [row.peak_acceleration_m_s2 for row in figures(any_store)] == pytest.approx(
        [500.0, 900.0], rel=0.01
    )
    finding = findings(any_store)["shock-without-row", "note"]
    assert finding.evidence["left_out"][0]["peak_acceleration_m_s2"] == pytest.approx(
        100.0, rel=0.02
    )
    assert finding.evidence["left_out"][0]["time_s"] == pytest.approx(0.401, abs=2e-4)
    large = campaign(
        tmp_path / "d",
        {"1.npz": {"acc": pulses([500.0, 450.0, 900.0])}},
        ["1.npz"] * 2,
        name="large",
    )
    ingest_folder(any_store, large, jobs=1)
    assert ("shock-without-row", "warning") in findings(any_store)


def test_row_without_a_shock_leaves_all_without_figures(any_store, tmp_path):
    report = ingest_folder(
        any_store,
        campaign(tmp_path / "c", {"1.npz": {"acc": pulses([500.0])}}, ["1.npz"] * 2),
        jobs=1,
    )
    assert (report.impacts, figures(any_store)) == (2, [])
    assert findings(any_store)["row-without-shock", "warning"].evidence == {"shocks": 1, "rows": 2}


def test_ringing_between_shocks_makes_none_of_its_own(any_store, tmp_path):
    time = np.arange(round(1.5 * RATE)) / RATE
    x = np.random.default_rng(2).normal(size=time.size) * 0.1
    for begin, peak in ((0.2, 800.0), (0.8, 500.0)):
        after = np.clip(time - begin, 0, None)
        x += peak * np.exp(-after / 0.08) * np.sin(2 * np.pi * 400 * after)
    ingest_folder(any_store, campaign(tmp_path / "c", {"1.npz": {"acc": x}}, ["1.npz"] * 2), jobs=1)
    assert [row.peak_time_s for row in figures(any_store)] == pytest.approx(
        [0.2006, 0.8006], abs=2e-4
    )


def test_accelerations_beside_a_force_are_measured_about_its_contacts(any_store, tmp_path):
    folder = hammer_campaign(tmp_path / "c", 1, 3, name="drops")
    toml = folder / "campaign.toml"
    toml.write_text(
        toml.read_text()
        + '[channels.acc]\nquantity = "acceleration"\nunit = "m/s2"\nposition = "x"\n'
    )
    (path,) = folder.glob("recordings/*")
    loaded = dict(np.load(path))
    np.savez(path, **loaded, acc=-0.5 * loaded["force"])
    ingest_folder(any_store, folder, jobs=1)
    rows = listed(any_store)
    assert [row["peak_acceleration_m_s2"] for row in rows] == pytest.approx(
        [0.5 * row["peak_force_n"] for row in rows], rel=1e-3
    )
    assert all(row.signed_peak_acceleration_m_s2 < 0 for row in figures(any_store))
    peaks = sorted(row["peak_acceleration_m_s2"] for row in rows)
    above = listed(any_store, Condition("peak_acceleration_m_s2", ">", peaks[0] + 1e-3))
    assert sorted(row["peak_acceleration_m_s2"] for row in above) == peaks[1:]
    assert listed(any_store, Condition("pulse_duration_s", ">", 1.0)) == []


def test_figures_cost_one_statement(any_store, tmp_path):
    asked = []
    for name, records in (("none", {"acc": np.zeros(4000)}), ("some", {"acc": pulses([500.0])})):
        first = campaign(tmp_path / f"{name}-1", {"1.npz": records}, ["1.npz"], name=f"{name}-1")
        ingest_folder(any_store, first, jobs=1)
        again = campaign(tmp_path / f"{name}-2", {"1.npz": records}, ["1.npz"], name=f"{name}-2")
        with statements(any_store) as statements_run:
            ingest_folder(any_store, again, jobs=1)
        asked.append([s for s in statements_run if "INTO channel_figures" in s])
    assert [len(some) for some in asked] == [0, 1]


def test_altered_figure_is_found(any_store, tmp_path):
    ingest_folder(
        any_store, campaign(tmp_path / "c", {"1.npz": {"acc": pulses([500.0])}}, ["1.npz"]), jobs=1
    )

    def unsound():
        with any_store.reading() as session:
            return [
                (f.check, f.place.get("channel"))
                for f in iter_findings(session.connection(), checks())
            ]

    assert unsound() == []
    with any_store.engine.begin() as connection:
        connection.exec_driver_sql("UPDATE channel_figures SET pulse_duration_s = 1.0")
    assert unsound() == [("rows", "acc")]


def test_extraction_measures_what_an_older_store_lacks(any_store, tmp_path):
    folder = campaign(tmp_path / "c", {"1.npz": {"acc": pulses([500.0, 300.0])}}, ["1.npz"] * 2)
    ingest_folder(any_store, folder, jobs=1)

    def measured():
        return [
            (row.peak_acceleration_m_s2, row.pulse_duration_s, row.srs_maximax_m_s2)
            for row in figures(any_store)
        ]

    before = measured()
    with any_store.writing() as session:
        session.execute(delete(ChannelFigures))
    report = reextract(any_store, "drops", ExtractionSettings())
    assert (report.measured, report.skipped) == (2, [])
    assert measured() == before


def test_export_show_and_deletion_know_them(sqlite_url, tmp_path):
    folder = campaign(tmp_path / "c", {"1.npz": {"acc": pulses([500.0])}}, ["1.npz"])

    def run(*words):
        result = CliRunner().invoke(main, [*words, "--db", sqlite_url])
        assert result.exit_code == 0, result.output
        return result.stdout

    run("ingest", str(folder))
    shown = json.loads(run("show", "1", "--json"))
    (channel,) = shown["channel_figures"]
    assert (channel["channel"], channel["srs_peak_frequency_hz"]) == (
        "acc",
        pytest.approx(640.0, rel=0.51),
    )
    run("export", "channel-figures", "--out", str(tmp_path / "f.csv"))
    header, row = (tmp_path / "f.csv").read_text().splitlines()
    exported = dict(zip(header.split(","), row.split(","), strict=True))
    assert float(exported["peak_acceleration_m_s2"]) == pytest.approx(500.0, rel=0.01)
    assert exported["tip_material"] == "steel"
    run("campaigns", "delete", "drops", "--reason", "a test")
    with open_store(sqlite_url, Writer("test", "0")) as any_store:
        assert figures(any_store) == []
