"""Whatever is wrong in a store is found, and named with what to do; nothing else is."""

from __future__ import annotations

import sqlite3
from contextlib import closing

import pytest
from pyroshock.schema.integrity.checking import checks, iter_findings
from pyroshock.schema.listings import get_campaign_id
from support.stores.care_stores import GUN, HAMMER, execute, flip
from support.stores.hammer_stores import url_of
from support.stores.stores import opened

FIRST = "recordings/test-01.npz"


def found(url, campaign=None, *, fast=False):
    """(check, place as text, message) of each finding."""
    with opened(url) as store, store.reading() as session:
        key = None if campaign is None else get_campaign_id(session, campaign)
        findings = list(
            iter_findings(
                session.connection(), checks(fast=fast, of_a_campaign=key is not None), key
            )
        )
    assert all(each.advice for each in findings)
    return [
        (each.check, " ".join(map(str, each.place.values())), each.message) for each in findings
    ]


def holds(findings, check, place, words):
    return any(each == check and where == place and words in said for each, where, said in findings)


#: Statement -> check, place and words of what it does to either engine's store.
DAMAGES = {
    "DELETE FROM series_chunks WHERE channel_id = 2 AND number = 0":
        ("series", f"{HAMMER} {FIRST} acceleration_1 0", "chunk 0 is missing"),
    "UPDATE channels SET sha256 = :other WHERE id = 3":
        ("series", f"{HAMMER} recordings/test-02.mat force", "its samples have the SHA-256"),
    "UPDATE pulses SET current = false WHERE impact_id = 4":
        ("counts", f"{HAMMER} 1 4", "not one of them in use"),
    "UPDATE pulses SET spline_peak_force_n = 1 WHERE id = 7":
        ("pulses", f"{HAMMER} 2 2 7", "its fine force peaks at"),
    "UPDATE pulses SET peak_force_n = peak_force_n * 1.001 WHERE id = 8":
        ("rows", f"{HAMMER} {HAMMER} recordings/test-02.mat 2 3 pulses 8", "the row was altered"),
    "UPDATE impacts SET impact_velocity_m_s = impact_velocity_m_s + 0.001 WHERE id = 2":
        ("rows", f"{HAMMER} {HAMMER} {FIRST} 1 2 impacts 2", "the row was altered"),
    "UPDATE shots SET tank_pressure_pa = tank_pressure_pa * 2 WHERE repetition = 1 AND run = 2":
        ("rows", f"{GUN} 2 1 shots 2", "the row was altered"),
    "UPDATE configurations SET fingerprint = 'x' WHERE id = 1":
        ("fingerprints", "configurations 1", "its row says x"),
    "UPDATE guns SET travel_m = 2":
        ("fingerprints", "guns 1", "its content has the fingerprint"),
    "UPDATE modes SET damping_ratio = 0.5 WHERE number = 2":
        ("fingerprints", "modal_tables 1", "its content has the fingerprint"),
    "UPDATE impacts SET recording_id = 3 WHERE id = 9":
        ("counts", f"{HAMMER} 2 4", "a recording of another campaign"),
    "UPDATE recordings SET status = 'set aside', reason = 'r' WHERE id = 3":
        ("counts", "autumn recordings/test-01.npz", "set aside has channels"),
}  # fmt: skip


def test_each_damage_is_found_at_its_place_and_a_sound_store_sound(care_store):
    assert found(care_store) == found(care_store, fast=True) == found(care_store, HAMMER) == []
    for statement in DAMAGES:
        execute(care_store, statement, **({"other": "0" * 64} if ":other" in statement else {}))
    flip(care_store, "series_chunks", "frame", "channel_id = 1 AND number = 1", 40)
    flip(care_store, "pulses", "fine_force_n", "id = 3", -9)
    findings = found(care_store)
    flipped = [
        ("series", f"{HAMMER} {FIRST} force 1", "its checksum is another"),
        ("pulses", f"{HAMMER} 1 3 3", "its checksum is another"),
    ]
    missed = [each for each in (*DAMAGES.values(), *flipped) if not holds(findings, *each)]
    assert missed == []
    # Each row that was altered is named once more by its own hash; one chunk was deleted, and is no
    # row.
    altered_rows = {(place, said) for check, place, said in findings if check == "rows"}
    assert len(altered_rows) == len(DAMAGES) + len(flipped) - 1
    assert (
        len([check for check, _, _ in findings if check != "rows"])
        == len(DAMAGES) + len(flipped) - 3
    )


@pytest.mark.slow
def test_a_campaign_is_looked_at_alone_and_fast_counts_chunks_and_reads_none(care_store):
    execute(care_store, "DELETE FROM series_chunks WHERE channel_id = 2 AND number = 2")
    place = f"{HAMMER} {FIRST} acceleration_1"
    assert found(care_store, GUN) == []
    assert found(care_store, HAMMER) == [("series", f"{place} 2", "channel 2: chunk 2 is missing")]
    flip(care_store, "series_chunks", "frame", "channel_id = 1 AND number = 1", 40)
    assert found(care_store, fast=True) == [("series", place, "2 chunks; expected 3")]


@pytest.mark.slow
def test_a_counter_behind_its_keys_is_found(care_copy, postgres_database):
    from support.stores.care_stores import copied

    copied(care_copy, postgres_database)
    execute(postgres_database, "SELECT setval('impacts_id_seq', 3)")
    assert found(postgres_database, fast=True) == [
        ("sequences", "impacts", "the counter stands at 3, the largest key is 11")
    ]


#: Of SQLite alone, where keys and types are a program's good will.
LOOSE = {
    "DELETE FROM materials WHERE id = 1": (
        "references",
        "plates 1",
        "material_id is 1, and materials has no such row",
    ),
    "UPDATE shots SET campaign_id = 77 WHERE id = 1": (
        "references",
        "shots 1",
        "campaign_id is 77, and campaigns has",
    ),
    "UPDATE pulses SET contact_time_s = 'long' WHERE id = 1": (
        "values",
        "pulses",
        "1 rows hold no number in contact",
    ),
    "UPDATE diagnoses SET report = '{' WHERE id = 1": (
        "values",
        "diagnoses",
        "1 rows hold no json in report",
    ),
    "UPDATE campaigns SET date = 'monday' WHERE id = 1": (
        "values",
        "campaigns",
        "1 rows hold no day in date",
    ),
    "UPDATE plans SET name = 'a' || char(0) WHERE id = 1": (
        "values",
        "plans",
        "1 rows hold no text in name",
    ),
    "DROP INDEX ix_channels_sha256": ("tables", "channels", "index ix_channels_sha256 is missing"),
    "DROP TABLE mode_shapes": ("tables", "mode_shapes", "the table is missing"),
}


def test_a_file_written_without_rules_is_seen_through(care_copy):
    execute(care_copy, *LOOSE, keys=False)
    findings = found(care_copy, fast=True)
    missed = [expected for expected in LOOSE.values() if not holds(findings, *expected)]
    assert missed == []
    # A check that stumbles over the lost table keeps no other from being made.
    assert [check for check, _, said in findings if "could not be looked at" in said] == [
        "fingerprints"
    ]


def test_torn_pages_are_found(care_source, tmp_path):
    content = bytearray((care_source / "lab.db").read_bytes())
    with closing(sqlite3.connect(care_source / "lab.db")) as connection:
        (page,) = connection.execute(
            "SELECT rootpage FROM sqlite_master WHERE name = 'ix_recordings_sha256'"
        ).fetchone()
    size = int.from_bytes(content[16:18], "big")
    content[(page - 1) * size + 8 : page * size] = b"\xa5" * (size - 8)
    (tmp_path / "torn.db").write_bytes(content)
    findings = found(url_of(tmp_path / "torn.db"), fast=True)
    assert any(check == "database" for check, _, _ in findings)


@pytest.mark.slow
@pytest.mark.parametrize("dtype", ["O", "<U9", "f8,f8", "x"])
def test_a_series_of_no_numbers_is_never_decoded(care_copy, dtype):
    execute(care_copy, "UPDATE channels SET dtype = :dtype WHERE id = 1", dtype=dtype)
    ((check, place, said),) = [
        finding for finding in found(care_copy, HAMMER) if finding[0] != "rows"
    ]
    assert (check, place) == ("series", f"{HAMMER} {FIRST} force")
    assert repr(dtype)[:40] in said
