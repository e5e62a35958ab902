"""Snapshots of small campaigns of known pulses: what enters, what is left out, and that frozen
means frozen."""

from __future__ import annotations

import hashlib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from pyroshock.dataset.build_table import IMPACT_DIGITS
from pyroshock.dataset.catalog import list_snapshots
from pyroshock.dataset.predictors import parse, shipped
from pyroshock.dataset.snapshot import (
    SnapshotError,
    build_snapshot,
    raw_files,
    read_snapshot,
    trace,
)
from pyroshock.schema.benches import Material
from pyroshock.schema.impacts import DatasetSnapshot, ExtractionSettingsRow, Impact, Pulse
from pyroshock.schema.recordings import QualityFinding, RecordedChannel
from pyroshock.schema.session import count_rows
from sqlalchemy import delete, select, update
from sqlalchemy.exc import IntegrityError
from support.records.campaigns import blows, gun_campaign, with_cell
from support.records.pulse_tables import MATERIALS
from support.stores.hammer_stores import (
    HITS,
    copied,
    filled_store,
    full_campaign,
    rows_of,
    velocity,
)
from support.stores.stores import ingested, opened, pyroshock


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    root = tmp_path_factory.mktemp("campaigns")
    return {
        "spring": full_campaign(root / "spring"),
        "autumn": full_campaign(root / "autumn", "autumn", recordings=2, seed=2),
        "shots": gun_campaign(root / "shots", name="shots"),
    }


@pytest.fixture(scope="module")
def filled(folders, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return filled_store(tmp_path_factory.mktemp("filled"), *folders.values())


@pytest.fixture
def url(filled, tmp_path) -> str:
    return copied(filled, tmp_path)


@pytest.fixture
def store(url):
    with opened(url) as store:
        yield store


def built(store, *campaigns: str, name: str = "d", **given):
    return build_snapshot(store, name, campaigns or ("spring",), **given)


def left_out(made) -> dict[str, int]:
    return {row["reason"]: row["impacts"] for row in made.snapshot.definition["left_out"]}


def only(session, query):
    return session.scalars(query).first()


def test_table_holds_what_was_recorded(store):
    table = built(store).snapshot.table
    assert (len(table), table.x.shape) == (4 * HITS, (4 * HITS, 13))
    peaks = [blow.peak_n for run in range(1, 5) for blow in blows(run, HITS)]
    assert np.allclose(table.peak_force_n, peaks, rtol=5e-3)
    expected = [velocity(run, i) for run in range(1, 5) for i in range(1, HITS + 1)]
    assert table.column("impact_velocity").tolist() == expected
    assert np.all(table.impactor_mass_kg == 0.32) and np.all(table.plate_thickness_m == 0.01)
    assert table.target_material[::HITS].tolist() == ["aluminum", "steel", "aluminum", "steel"]
    assert table.column("plate_density")[::HITS].tolist() == [2700.0, 7800.0, 2700.0, 7800.0]
    assert table.column("anvil_material")[::HITS].tolist() == [0, 2, 1, 2]
    assert table.column("tip_youngs_modulus")[HITS] == MATERIALS["delrin"][0]
    # Runs 2 and 4 differ in the impact position only, which no predictor sees.
    assert len({*table.configuration}) == 4
    assert table.treatment[HITS] == table.treatment[3 * HITS] != table.treatment[0]
    assert len({*table.treatment}) == 3


def test_snapshot_reads_back_equal(store, folders):
    made = built(store).snapshot
    for name in ("d", made.hash, made.hash[:8]):
        read = read_snapshot(store, name)
        assert (read.name, read.hash, read.definition) == ("d", made.hash, made.definition)
        assert np.array_equal(read.table.x, made.table.x)
        assert np.array_equal(read.table.force_n, made.table.force_n)
        assert read.table.key.tolist() == made.table.key.tolist()
    snapshot = built(store, "spring", "autumn", name="both").snapshot
    with store.reading() as session:
        files = raw_files(session, snapshot)
    assert [(row["campaign"], row["pulses"]) for row in files] == [("autumn", HITS)] * 2 + [
        ("spring", HITS)
    ] * 4
    for row in files:
        content = (folders[row["campaign"]] / row["recording"]).read_bytes()
        assert row["sha256"] == hashlib.sha256(content).hexdigest()


def test_hash_is_the_same_in_another_store(folders, url, database_url):
    """Filled in another order, so with other keys, and on another engine."""
    for name in ("autumn", "shots", "spring"):
        ingested(database_url, folders[name])
    with opened(url) as here, opened(database_url) as there:
        a, b = (
            built(here, "spring", "autumn").snapshot,
            built(there, "autumn", "spring", name="other").snapshot,
        )
        assert a.table.pulse_id.tolist() != b.table.pulse_id.tolist()
        assert a.hash == b.hash
        assert read_snapshot(there, "other").table.key.tolist() == a.table.key.tolist()


def test_hash_tells_content_apart_and_own_predictors_are_kept(store):
    hashes = {
        built(store, *names, name="-".join(names)).snapshot.hash
        for names in (["spring"], ["autumn"])
    }
    hashes.add(built(store, "autumn", "spring", name="both").snapshot.hash)
    assert len(hashes) == 3
    chosen = own('name = "position"\nfrom = "factor.impact_position"\nlevels = ["#1", "#2"]')
    snapshot = built(store, predictors=chosen).snapshot
    assert snapshot.table.x[::HITS, 0].tolist() == [0, 0, 0, 1]
    assert read_snapshot(store, "d").predictors == chosen


def test_same_content_adds_nothing_and_keeps_its_first_name(store):
    first = built(store)
    before = count_rows(store)
    again = built(store)
    assert first.added and not again.added
    assert again.snapshot.hash == first.snapshot.hash
    assert count_rows(store) == before
    again = built(store, name="other", quality="none")
    assert (again.snapshot.name, again.added) == ("d", False)
    assert again.snapshot.definition["quality"] == "reject"
    with pytest.raises(
        SnapshotError, match=r"dataset 'd' is frozen with other content.*under another name"
    ):
        built(store, "autumn")


@pytest.mark.parametrize("name", ["", " d", "a\nb", "x" * 201])
def test_name_is_one_short_line(store, name):
    with pytest.raises(SnapshotError, match="expected one line of at most 200"):
        built(store, name=name)


def test_two_at_once_make_one_snapshot(url):
    def build(_: int):
        with opened(url) as store:
            return built(store)

    with ThreadPoolExecutor(2) as pool:
        both = list(pool.map(build, range(2)))
    assert sorted(made.added for made in both) == [False, True]
    assert both[0].snapshot.hash == both[1].snapshot.hash


def test_reextraction_leaves_a_snapshot_as_it_is(url, store):
    old = built(store).snapshot
    assert pyroshock("extract", "spring", "--threshold", "0.1", "--db", url).exit_code == 0
    assert (
        read_snapshot(store, "d").table.contact_time_s.tolist() == old.table.contact_time_s.tolist()
    )
    with pytest.raises(SnapshotError, match="frozen with other content"):
        built(store)
    new = built(store, name="e").snapshot
    assert np.all(new.table.contact_time_s < old.table.contact_time_s)
    assert [key[:IMPACT_DIGITS] for key in new.table.key] == [
        key[:IMPACT_DIGITS] for key in old.table.key
    ]
    assert not {*new.table.key} & {*old.table.key}
    (fingerprint,) = old.definition["extractions"]
    assert built(store, name="f", extraction=fingerprint[:12]).snapshot.name == "d"


def test_corrected_material_leaves_a_snapshot_as_it_is(store):
    old = built(store).snapshot
    with store.writing() as session:
        session.execute(
            update(Material).where(Material.name == "steel").values(youngs_modulus_pa=210e9)
        )
    assert read_snapshot(store, "d").table.x.tolist() == old.table.x.tolist()
    assert built(store, name="e").snapshot.hash != old.hash


@pytest.mark.parametrize(
    "change", [{"impact_velocity_m_s": 0.77}, {"impact_velocity_m_s": 0.0}, {"repetition": 99}]
)
def test_changed_row_is_noticed(store, change):
    built(store)
    with store.writing() as session:
        key = session.scalars(select(Impact.id).order_by(Impact.run, Impact.repetition)).first()
        session.execute(update(Impact).where(Impact.id == key).values(**change))
    with pytest.raises(SnapshotError, match=r"dataset 'd'.*changed since; restore the store"):
        read_snapshot(store, "d")


def test_used_pulse_cannot_be_deleted_nor_a_newer_format_read(store):
    made = built(store).snapshot
    with pytest.raises(IntegrityError), store.writing() as session:
        session.execute(delete(Pulse).where(Pulse.id == int(made.table.pulse_id[0])))
    with store.writing() as session:
        row = only(session, select(DatasetSnapshot))
        row.definition = {**row.definition, "format": 2}
    with pytest.raises(SnapshotError, match="format 2, this software reads 1: update pyroshock"):
        read_snapshot(store, "d")


def test_what_makes_no_snapshot_is_refused_by_name(store):
    built(store)
    with pytest.raises(LookupError, match="no dataset 'x' in the store; there: d"):
        read_snapshot(store, "x")
    with pytest.raises(ValueError, match="no usable pulse in shots: "):
        built(store, "shots")
    with pytest.raises(
        ValueError, match=r"for campaigns of kind 'hammer', not shots: gun; .*--predictors gun"
    ):
        built(store, "shots", predictors=shipped("hammer"))
    with pytest.raises(ValueError, match="campaigns of two kinds"):
        built(store, "shots", "spring")
    with pytest.raises(LookupError, match="no campaign 'winter'"):
        built(store, "winter")
    with store.reading() as session:
        fingerprint = session.scalar(select(ExtractionSettingsRow.fingerprint))
    with pytest.raises(
        LookupError, match=f"no extractions 'beef' in the store; there: {fingerprint[:12]}"
    ):
        built(store, extraction="beef")
    with pytest.raises(
        LookupError,
        match="predictor t: no factor 'temperature' in the store; known: anvil_material",
    ):
        built(store, predictors=own('name = "t"\nunit = "K"\nfrom = "factor.temperature"'))


def finding(
    store,
    severity: str,
    *,
    impact: bool = False,
    quantity: str | None = "force",
    check: str = "clipping",
):
    """A finding on the first impact of run 2, or on its recording's channel, or on the
    recording."""
    with store.writing() as session:
        hit = session.scalars(
            select(Impact).where(Impact.run == 2).order_by(Impact.repetition)
        ).first()
        channel = session.scalars(
            select(RecordedChannel).where(RecordedChannel.recording_id == hit.recording_id)
        ).first()
        if quantity not in (None, "force"):
            channel.quantity = quantity
            channel.position = "hammer"
        session.add(
            QualityFinding(
                recording_id=hit.recording_id,
                channel_id=channel.id if quantity else None,
                impact_id=hit.id if impact else None,
                check=check,
                severity=severity,
                message="made up",
                evidence={},
            )
        )


@pytest.mark.parametrize(
    ("severity", "impact", "quantity", "rule", "gone"),
    [
        ("reject", True, "force", "reject", 1),
        ("reject", False, "force", "reject", HITS),
        ("reject", False, None, "reject", HITS),
        (
            "reject",
            False,
            "acceleration",
            "reject",
            0,
        ),  # the velocity was reported, not integrated from it
        ("reject", True, "force", "none", 0),
        ("warning", True, "force", "reject", 0),
        ("warning", True, "force", "warning", 1),
        ("reject", True, "force", "warning", 1),
        ("note", True, "force", "warning", 0),
    ],
)
def test_verdicts_are_obeyed(store, severity, impact, quantity, rule, gone):
    finding(store, severity, impact=impact, quantity=quantity)
    made = built(store, quality=rule)
    assert len(made.snapshot.table) == 4 * HITS - gone
    assert left_out(made) == ({f"quality: clipping ({severity})": gone} if gone else {})


def test_velocity_from_a_rejected_accelerometer_is_left_out(store):
    finding(store, "reject", quantity="acceleration")
    with store.writing() as session:
        session.execute(update(Impact).where(Impact.run == 2).values(velocity_source="integrated"))
    assert left_out(built(store)) == {"quality: clipping (reject)": HITS}


def test_worst_verdict_is_the_one_told(store):
    finding(store, "warning", impact=True, check="aaa")
    finding(store, "reject", impact=True)
    assert left_out(built(store, quality="warning")) == {"quality: clipping (reject)": 1}
    with pytest.raises(
        ValueError, match="quality rule is 'strict'; expected one of reject, warning, none"
    ):
        built(store, quality="strict")


def test_missing_values_are_told_by_name(tmp_path):
    rows = with_cell(with_cell(rows_of(2), "impact_velocity_m_s", "", 0), "insulator", "", 6)
    rows = with_cell(with_cell(rows, "anvil_material", "delrin", 8), "impact_velocity_m_s", "0", 9)
    folder = full_campaign(tmp_path / "c", recordings=2, rows=rows)
    ingested(f"sqlite:///{tmp_path / 's.db'}", folder)
    with opened(f"sqlite:///{tmp_path / 's.db'}") as store:
        made = built(store)
    assert len(made.snapshot.table) == 2 * HITS - 4
    assert left_out(made) == {
        "no impact_velocity": 1,
        "no insulator": 1,
        "anvil_material is delrin; levels are none, aluminum, steel": 1,
        "an impact velocity of zero": 1,
    }


def test_other_number_of_points_is_left_out(url, store):
    assert pyroshock("extract", "spring", "--points", "30", "--db", url).exit_code == 0
    with pytest.raises(
        ValueError, match=r"no usable pulse in spring: 20 with a force of 30 points; expected 20"
    ):
        built(store)


def test_record_in_two_campaigns_counts_once(folders, tmp_path):
    twin = full_campaign(tmp_path / "twin", "twin")
    ingested(f"sqlite:///{tmp_path / 's.db'}", folders["spring"], twin)
    with opened(f"sqlite:///{tmp_path / 's.db'}") as store:
        made = built(store, "spring", "twin")
    assert left_out(made) == {"the same contact of the same record as another impact": 4 * HITS}
    assert {*made.snapshot.table.campaign} == {"spring"}


def own(entry: str):
    return parse(f'name = "mine"\nkind = "hammer"\n[[predictors]]\n{entry}')


def test_trace_leads_to_the_raw_file(store, folders):
    snapshot = built(store).snapshot
    row = 2 * HITS + 3
    with store.reading() as session:
        found = trace(session, snapshot, str(snapshot.table.key[row])[:10])
    content = (folders["spring"] / found.recording).read_bytes()
    assert found.recording_sha256 == hashlib.sha256(content).hexdigest()
    assert (found.campaign, found.run, found.repetition) == ("spring", 3, 4)
    blow = blows(3, HITS)[3]
    assert (found.start_s, found.end_s) == pytest.approx(
        (blow.start_s, blow.start_s + blow.width_s), abs=1e-4
    )
    assert found.extraction_settings["points"] == 20


def test_listing(store):
    made = built(store, "spring", "autumn").snapshot
    with store.reading() as session:
        (row,) = list_snapshots(session)
    assert (row["name"], row["hash"], row["pulses"]) == ("d", made.hash, 6 * HITS)
    assert (row["campaigns"], row["predictors"], row["quality"]) == (
        ["autumn", "spring"],
        "hammer",
        "reject",
    )


@pytest.mark.parametrize("key", ["", "f", "zzzz"])
def test_unknown_key_is_refused(store, key):
    snapshot = built(store).snapshot
    with (
        store.reading() as session,
        pytest.raises(LookupError, match="no pulses of dataset 'd' have the key"),
    ):
        trace(session, snapshot, key)
