"""`runs discard` and `runs replace`: one recording goes or is replaced, and an ingest brings nothing back unasked."""

from __future__ import annotations

import json
import shutil
import threading

import numpy as np
import pytest
from pyroshock.app.ingest.removal import discard_recording
from pyroshock.dataset.snapshot import SnapshotError, read_snapshot
from pyroshock.schema.campaigns import PlannedRun
from pyroshock.schema.impacts import Impact
from pyroshock.schema.recordings import Recording
from pyroshock.schema.removal.part import recording_part
from sqlalchemy import func, select
from support.records.campaigns import (
    blows,
    force_record,
    gun_campaign,
    hammer_campaign,
    hammer_rows,
    recording_name,
    replace_in,
    with_cell,
    write_recording,
    write_runs,
)
from support.stores.care_stores import HAMMER
from support.stores.hammer_stores import HITS, full_campaign, rows_of
from support.stores.stores import content, counts, ingest, ingested, opened, pyroshock

REASON = "the plate had come loose"
FIRST, SECOND = recording_name(1), recording_name(2)


def runs(url, *arguments, code=0):
    result = pyroshock("runs", *arguments, "--db", url)
    assert result.exit_code == code, result.output
    return result


def discarded(url, campaign, *more):
    return json.loads(runs(url, "discard", campaign, *more, "--reason", REASON, "--json").stdout)


def replaced(url, campaign, recording, *more):
    return json.loads(runs(url, "replace", campaign, recording, *more, "--reason", REASON, "--json").stdout)


def paths(url):
    with opened(url) as store, store.reading() as session:
        return sorted(session.scalars(select(Recording.path)))


def sound(url):
    result = pyroshock("db", "check", "--db", url)
    assert result.exit_code == 0, result.stdout
    return result.stderr


@pytest.fixture(scope="module")
def ingested_hammer(tmp_path_factory):
    """The folder of a store `lab.db` and of the campaign in it, to be copied."""
    folder = tmp_path_factory.mktemp("hammer")
    ingested(f"sqlite:///{folder / 'lab.db'}", hammer_campaign(folder / "campaign"))
    return folder


@pytest.fixture(params=["sqlite", "postgresql"])
def hammer(request, ingested_hammer, tmp_path):
    """A store of two recordings of two hits each, and the folder that they came from."""
    folder = shutil.copytree(ingested_hammer / "campaign", tmp_path / "campaign")
    if request.param == "sqlite":
        file = shutil.copyfile(ingested_hammer / "lab.db", tmp_path / "lab.db")
        yield f"sqlite:///{file}", folder
        return
    with request.getfixturevalue("postgres_copy")(ingested_hammer / "lab.db") as url:
        yield url, folder


def test_discarded_recording_goes_with_its_hits_and_all_else_stays(care_store):
    before = counts(care_store)
    stone = discarded(care_store, HAMMER, FIRST)
    after = counts(care_store)
    gone = {table: before[table] - after[table] for table in before if before[table] > after[table]}
    assert gone == stone["counts"]
    assert (gone["recordings"], gone["impacts"], gone["pulses"], gone["snapshot_pulses"]) == (1, HITS, 2 * HITS, HITS)
    assert (stone["kind"], stone["recording"], len(stone["file_sha256"])) == ("recording", FIRST, 64)
    assert stone["stood_on"]["reopened"] == [{"plan": HAMMER, "run": 1}]
    assert [each["pulses"] for each in stone["stood_on"]["datasets"]] == [HITS]
    assert "dataset 'small'" in sound(care_store)


def test_dry_run_names_what_would_go_and_changes_nothing(care_store):
    before = content(care_store)
    told = runs(care_store, "discard", HAMMER, FIRST, "--reason", REASON, "--dry-run").stderr
    assert "dry run, nothing is deleted; would delete" in told
    assert f"stood on it: dataset small ({HITS} pulses" in told
    assert content(care_store) == before


def test_ingest_of_the_same_folder_does_not_bring_it_back(hammer):
    url, folder = hammer
    whole = content(url)
    discarded(url, "hammer", FIRST)
    again = ingest(url, folder)
    assert again.exit_code == 0
    assert "nothing new" in again.stderr
    assert f"recording {FIRST} was discarded on 20" in again.stderr and f"because {REASON}" in again.stderr
    assert f"--again {FIRST}" in again.stderr
    assert paths(url) == [SECOND]
    result = pyroshock("ingest", folder, "--again", FIRST, "--db", url)
    assert result.exit_code == 0, result.stderr
    assert {name: rows for name, rows in content(url).items() if name != "tombstones"} == {
        name: rows for name, rows in whole.items() if name != "tombstones"
    }
    (stone,) = json.loads(pyroshock("campaigns", "deleted", "--json", "--db", url).stdout)
    assert stone["restored_at"] is not None
    assert "discarded" not in ingest(url, folder).stderr
    sound(url)


def test_another_file_in_the_place_of_a_discarded_one_must_be_asked_for(hammer):
    url, folder = hammer
    discarded(url, "hammer", FIRST)
    write_recording(folder / FIRST, {"force": force_record(blows(1, 2), np.random.default_rng(9))})
    refused = ingest(url, folder)
    assert refused.exit_code == 2
    assert "another file is in its place" in refused.stderr and f"--again {FIRST}" in refused.stderr
    assert paths(url) == [SECOND]
    assert pyroshock("ingest", folder, "--again", FIRST, "--db", url).exit_code == 0
    assert paths(url) == [FIRST, SECOND]
    (stone,) = json.loads(pyroshock("campaigns", "deleted", "--json", "--db", url).stdout)
    assert (stone["restored_at"], stone["replaced_by"] == stone["file_sha256"]) == (None, False)
    assert len(stone["replaced_by"]) == 64
    sound(url)


def test_again_names_a_recording_of_the_folder(hammer):
    url, folder = hammer
    result = pyroshock("ingest", folder, "--again", "recordings/test-99.npz", "--db", url)
    assert result.exit_code == 2 and "no row names this recording" in result.stderr


def test_dry_run_of_an_ingest_keeps_the_tombstone_open(hammer):
    url, folder = hammer
    discarded(url, "hammer", FIRST)
    before = content(url)
    told = pyroshock("ingest", folder, "--again", FIRST, "--dry-run", "--db", url)
    assert "would add 1 recordings" in told.stderr
    assert content(url) == before


def test_discarded_of_a_campaign_that_was_deleted_says_nothing_of_other_files_of_the_next(hammer):
    url, folder = hammer
    discarded(url, "hammer", FIRST)
    assert pyroshock("campaigns", "delete", "hammer", "--reason", REASON, "--db", url).exit_code == 0
    assert FIRST in ingested(url, folder).stderr, "the very same file stays out"
    assert paths(url) == [SECOND]
    assert pyroshock("campaigns", "delete", "hammer", "--reason", REASON, "--db", url).exit_code == 0
    write_recording(folder / FIRST, {"force": force_record(blows(1, 2), np.random.default_rng(9))})
    ingested(url, folder)
    assert paths(url) == [FIRST, SECOND]
    sound(url)


def test_discarded_by_its_run(hammer):
    url, _ = hammer
    assert discarded(url, "hammer", "--run", "2")["recording"] == SECOND
    assert paths(url) == [FIRST]


def test_run_that_shares_its_recording_is_refused_unless_all_are_meant(tables_url, tmp_path):
    rows = [{**row, "run": run, "repetition": 1} for row, run in zip(hammer_rows(), (11, 12, 21, 22), strict=True)]
    folder = hammer_campaign(tmp_path / "campaign")
    write_runs(folder, rows)
    ingested(tables_url, folder)
    before = counts(tables_url)
    told = runs(tables_url, "discard", "hammer", "--run", "11", "--reason", REASON, code=2).stderr
    assert "holds other hits too: run 12, repetition 1" in told
    told = runs(tables_url, "discard", "hammer", "--run", "11", "--run", "21", "--reason", REASON, code=2).stderr
    assert FIRST in told and SECOND in told
    assert "no run 7" in runs(tables_url, "discard", "hammer", "--run", "7", "--reason", REASON, code=2).stderr
    assert counts(tables_url) == before
    assert discarded(tables_url, "hammer", "--run", "12", "--run", "11")["recording"] == FIRST


def test_repetition_that_shares_its_recording_is_refused(hammer):
    url, _ = hammer
    told = runs(url, "discard", "hammer", "--run", "1", "--repetition", "2", "--reason", REASON, code=2).stderr
    assert "run 1, repetition 1" in told and "name every run" in told


def test_row_without_a_recording_is_no_recording(tables_url, tmp_path):
    ingested(tables_url, gun_campaign(tmp_path / "gun"))
    told = runs(tables_url, "discard", "gun", "--run", "1", "--reason", REASON, code=2).stderr
    assert "a row without a recording" in told


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["hammer"], "name one recording"),
        (["hammer", FIRST, "--run", "1"], "name one recording"),
        (["hammer", "--run", "1", "--run", "2", "--repetition", "1"], "exactly one --run"),
        (["hammer", "recordings/none.npz"], f"there: {FIRST}, {SECOND}"),
        (["winter", FIRST], "known: hammer"),
    ],
)
def test_what_cannot_be_discarded_is_named(hammer, words, said):
    url, _ = hammer
    before = counts(url)
    assert said in runs(url, "discard", *words, "--reason", REASON, code=2).stderr
    assert "the reason is empty" in runs(url, "discard", "hammer", FIRST, "--reason", " ", code=2).stderr
    assert counts(url) == before


def test_list_shows_recordings_with_their_runs(hammer):
    url, _ = hammer
    rows = json.loads(runs(url, "list", "hammer", "--json").stdout)
    assert [(row["recording"], row["status"], row["runs"]) for row in rows] == [
        (FIRST, "stored", ["1 (1-2)"]), (SECOND, "stored", ["2 (1-2)"])
    ]  # fmt: skip


def test_corrected_row_is_refused_by_ingest_with_the_way_out_and_replaced(hammer, tmp_path):
    url, folder = hammer
    row = hammer_rows()[0]
    write_runs(folder, [{**each, "tip_radius_mm": 45} if each["run"] == row["run"] else each for each in hammer_rows()])
    refused = ingest(url, folder)
    assert refused.exit_code == 2
    assert f"pyroshock runs replace hammer {FIRST} --from FOLDER --reason TEXT" in refused.stderr
    stone = replaced(url, "hammer", FIRST, "--from", folder)
    assert stone["replaced_by"] == stone["file_sha256"]
    fresh = f"sqlite:///{tmp_path / 'fresh.db'}"
    ingested(fresh, folder)
    assert "nothing new" in ingest(url, folder).stderr
    corrected, expected = content(url), content(fresh)
    for table in ("recordings", "channels", "impacts", "pulses", "quality_findings"):
        assert corrected[table] == expected[table]
    sound(url)


def test_new_file_of_the_same_path_is_refused_by_ingest_with_the_way_out_and_replaced(hammer):
    url, folder = hammer
    write_recording(folder / FIRST, {"force": force_record(blows(1, 2), np.random.default_rng(9))})
    refused = ingest(url, folder)
    assert refused.exit_code == 2
    assert f"pyroshock runs replace hammer {FIRST} --from FOLDER" in refused.stderr
    before = content(url)
    dry = runs(url, "replace", "hammer", FIRST, "--from", folder, "--reason", REASON, "--dry-run")
    assert "would be stored in its place" in dry.stderr
    assert content(url) == before
    stone = replaced(url, "hammer", FIRST, "--from", folder)
    assert len(stone["replaced_by"]) == 64 and stone["replaced_by"] != stone["file_sha256"]
    assert "nothing new" in ingest(url, folder).stderr
    sound(url)


def test_file_under_another_path_takes_the_place(hammer):
    url, folder = hammer
    other = "recordings/test-01b.npz"
    write_recording(folder / other, {"force": force_record(blows(1, 2), np.random.default_rng(9))})
    write_runs(folder, [{**r, "recording": other} if r["recording"] == FIRST else r for r in hammer_rows()])
    refused = ingest(url, folder)
    assert refused.exit_code == 2
    assert f"pyroshock runs replace hammer {FIRST} FOLDER/{other} --reason TEXT" in refused.stderr
    stone = replaced(url, "hammer", FIRST, folder / other)
    assert stone["recording"] == FIRST
    assert set(paths(url)) == {other, SECOND}
    assert "nothing new" in ingest(url, folder).stderr
    sound(url)


def test_two_corrected_recordings_are_replaced_one_after_the_other(hammer):
    url, folder = hammer
    write_runs(folder, [{**row, "tip_radius_mm": 45} for row in hammer_rows()])
    replaced(url, "hammer", FIRST, "--from", folder)
    replaced(url, "hammer", SECOND, "--from", folder)
    assert "nothing new" in ingest(url, folder).stderr
    with opened(url) as store, store.reading() as session:
        assert session.scalar(select(func.count(func.distinct(Impact.configuration_id)))) == 2


def test_nothing_to_replace_is_refused(hammer):
    url, folder = hammer
    before = counts(url)
    told = runs(url, "replace", "hammer", FIRST, "--from", folder, "--reason", REASON, code=2).stderr
    assert "nothing to replace" in told
    assert counts(url) == before


def test_unreadable_file_replaces_nothing(hammer):
    url, folder = hammer
    (folder / FIRST).write_bytes(b"no archive at all")
    before = counts(url)
    told = runs(url, "replace", "hammer", FIRST, "--from", folder, "--reason", REASON, code=2).stderr
    assert f"recording '{FIRST}' stays in the store" in told
    assert counts(url) == before


def test_folder_of_another_campaign_or_without_the_rows_replaces_nothing(hammer, tmp_path):
    url, folder = hammer
    other = hammer_campaign(tmp_path / "other", name="other")
    told = runs(url, "replace", "hammer", FIRST, "--from", other, "--reason", REASON, code=2).stderr
    assert "campaign.name is 'other'" in told
    write_runs(folder, [row for row in hammer_rows() if row["recording"] != FIRST])
    told = runs(url, "replace", "hammer", FIRST, "--from", folder, "--reason", REASON, code=2).stderr
    assert "no row of runs.csv names recording" in told
    stray = tmp_path / "stray.npz"
    shutil.copyfile(folder / FIRST, stray)
    told = runs(url, "replace", "hammer", FIRST, stray, "--reason", REASON, code=2).stderr
    assert "lies in no campaign folder" in told


def test_row_that_takes_a_run_of_another_recording_replaces_nothing(hammer):
    url, folder = hammer
    rows = with_cell(hammer_rows(), "run", 2)
    write_runs(folder, with_cell([row for row in rows if row["recording"] == FIRST], "run", 2, row=1))
    before = counts(url)
    told = runs(url, "replace", "hammer", FIRST, "--from", folder, "--reason", REASON, code=2).stderr
    assert "give this one a number of its own" in told
    assert counts(url) == before


def test_planned_run_is_done_again_by_what_replaces_it(care_store, care_source, tmp_path):
    folder = shutil.copytree(care_source / HAMMER, tmp_path / HAMMER)
    rng = np.random.default_rng(77)
    force = force_record(blows(1, HITS), rng)
    write_recording(
        folder / FIRST, {"force": force, "acceleration_1": rng.standard_normal(force.size).astype(np.float32)}
    )
    stone = replaced(care_store, HAMMER, FIRST, "--from", folder)
    assert stone["stood_on"]["reopened"] == []
    with opened(care_store) as store, store.reading() as session:
        states = session.scalars(select(PlannedRun.status).order_by(PlannedRun.run)).all()
        assert states[:2] == ["done", "done"]
    sound(care_store)


def test_dataset_reads_again_only_when_the_very_same_content_is_back(tables_url, tmp_path):
    folder = full_campaign(tmp_path / "spring", "spring", 2)
    ingested(tables_url, folder)
    assert pyroshock("dataset", "build", "small", "--from", "spring", "--db", tables_url).exit_code == 0
    with opened(tables_url) as store:
        digest = read_snapshot(store, "small").hash
    write_runs(folder, [{**r, "tip_radius_mm": 45} if r["run"] == 1 else r for r in rows_of(2)])
    assert replaced(tables_url, "spring", FIRST, "--from", folder)["returned"] == {}
    with opened(tables_url) as store, pytest.raises(SnapshotError, match=REASON):
        read_snapshot(store, "small")
    write_runs(folder, rows_of(2))
    assert replaced(tables_url, "spring", FIRST, "--from", folder)["returned"] == {"small": HITS}
    with opened(tables_url) as store:
        assert read_snapshot(store, "small").hash == digest
    discarded(tables_url, "spring", SECOND)
    sound(tables_url)
    replace_in(folder / "runs.csv", "polymeric", "none")
    result = pyroshock("ingest", folder, "--again", SECOND, "--db", tables_url)
    assert result.exit_code == 0, result.stderr
    with opened(tables_url) as store, pytest.raises(SnapshotError, match=REASON):
        read_snapshot(store, "small")
    sound(tables_url)


def test_two_who_discard_the_same_recording_at_once_leave_one_tombstone(tables_url, tmp_path):
    ingested(tables_url, hammer_campaign(tmp_path / "campaign"))
    barrier, ends = threading.Barrier(2), []

    def discard_at_once():
        with opened(tables_url) as store:
            with store.reading() as session:
                part = recording_part(session, "hammer", FIRST)
            barrier.wait()
            try:
                ends.append(discard_recording(store, tables_url, part, REASON)["recording"])
            except LookupError as error:
                ends.append(str(error))

    threads = [threading.Thread(target=discard_at_once) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(ends) == 2 and ends.count(FIRST) == 1, ends
    assert len(json.loads(pyroshock("campaigns", "deleted", "--json", "--db", tables_url).stdout)) == 1
    sound(tables_url)
