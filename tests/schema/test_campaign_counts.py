"""The kept numbers of impacts and shots are those that a count gives, whoever has written."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from functools import partial

import pytest
from pyroshock.schema.campaign_counts import CampaignCounts, count_added, hit_counts
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.impacts import Shot
from pyroshock.schema.listings import list_campaigns
from sqlalchemy import delete, func, select, update
from support.records.campaigns import (
    gun_campaign,
    hammer_campaign,
    hammer_rows,
    recording_name,
    write_runs,
)
from support.stores.campaign_counts import assert_counts_kept
from support.stores.stores import ingested, opened, pyroshock, run_pyroshock


def _listed(url):
    with opened(url) as store, store.reading() as session:
        return {row["name"]: (row["impacts"], row["shots"]) for row in list_campaigns(session)}


def test_every_command_that_adds_or_removes_hits_keeps_the_numbers(
    tables_url, tmp_path, monkeypatch
):
    # what is discarded from a store on a server is archived in the working directory
    monkeypatch.chdir(tmp_path)
    url, folder = tables_url, hammer_campaign(tmp_path / "shelf", 3, 2, "shelf")
    write_runs(folder, hammer_rows(2, 2))
    second, file = recording_name(2), tmp_path / "shelf.pyroshock"
    because = ("--reason", "loose plate")

    def after(words, impacts, shots=3):
        run_pyroshock(*words, "--db", url)
        with opened(url) as store, store.reading() as session:
            assert_counts_kept(session)
        assert _listed(url) == {
            name: hits for name, hits in (("gun", (0, shots)), ("shelf", (impacts, 0))) if any(hits)
        }

    after(("ingest", folder, gun_campaign(tmp_path / "gun"), "--jobs", "1"), 4)
    after(("ingest", folder, "--jobs", "1"), 4)
    write_runs(folder, hammer_rows(3, 2))
    after(("ingest", folder, "--jobs", "1"), 6)
    after(("ingest", folder, "--jobs", "1", "--dry-run"), 6)
    after(("extract", "shelf", "--segmentation", "mask"), 6)
    after(("runs", "discard", "shelf", second, *because, "--dry-run"), 6)
    after(("runs", "discard", "shelf", second, *because), 4)
    after(("ingest", folder, "--again", second, "--jobs", "1"), 6)
    write_runs(folder, [{**row, "tip_material": "delrin"} for row in hammer_rows(3, 2)])
    after(("runs", "replace", "shelf", recording_name(1), "--from", folder, *because), 6)
    after(("campaigns", "archive", "shelf", "--out", file, *because), 0)
    after(("campaigns", "restore", file), 6)
    after(("campaigns", "delete", "gun", *because), 6, shots=0)
    after(("campaigns", "delete", "shelf", *because), 0, shots=0)
    after(("db", "import", file), 6, shots=0)
    after(("db", "import", file), 6, shots=0)


def test_a_copy_and_a_backup_keep_the_numbers_and_an_export_has_none(sqlite_url, tmp_path):
    ingested(sqlite_url, hammer_campaign(tmp_path / "shelf", 2, 2, "shelf"))
    copy, file = tmp_path / "copy.db", tmp_path / "shelf.pyroshock"
    run_pyroshock("db", "copy", sqlite_url, f"sqlite:///{copy}")
    run_pyroshock("db", "export", "shelf", "--out", file, "--db", sqlite_url)
    for place, rows in ((copy, 1), (file, 0)):
        assert _listed(f"sqlite:///{place}") == {"shelf": (4, 0)}
        with opened(f"sqlite:///{place}") as store, store.reading() as session:
            assert session.scalar(select(func.count()).select_from(CampaignCounts)) == rows


def test_processes_that_add_to_one_campaign_at_once_count_all_of_it(tables_url, tmp_path):
    """Each adds to a campaign without kept numbers, and to what others have counted meanwhile."""
    ingested(tables_url, gun_campaign(tmp_path / "gun"))
    with opened(tables_url) as store:
        store.write(lambda session: session.execute(delete(CampaignCounts)))

    def add_shots(first):
        with opened(tables_url) as store:
            for run in range(first, first + 10):
                store.write(partial(_add_shot, run=run))

    with ThreadPoolExecutor(4) as threads:
        list(threads.map(add_shots, range(100, 500, 100)))
    with opened(tables_url) as store, store.reading() as session:
        assert_counts_kept(session)
    assert _listed(tables_url) == {"gun": (0, 3 + 4 * 10)}


def _add_shot(session, run):
    like = session.scalars(select(Shot).order_by(Shot.id).limit(1)).one()
    row = {"repetition": 1, "tank_pressure_pa": 2e5, "bullet_mass_kg": 0.1}
    common = {name: getattr(like, name) for name in ("campaign_id", "configuration_id")}
    session.add(Shot(run=run, **common, **row))
    session.flush()
    count_added(session.connection(), like.campaign_id, 0, 1)


@pytest.mark.parametrize("column", ["impacts", "shots"])
def test_the_check_names_both_numbers_and_an_upgrade_counts_anew(tables_url, tmp_path, column):
    ingested(tables_url, hammer_campaign(tmp_path / "a", 2, 2, "a"), gun_campaign(tmp_path / "gun"))
    counted = {"impacts": ("a", 4), "shots": ("gun", 3)}[column]
    campaign_key = select(Campaign.id).where(Campaign.name == counted[0]).scalar_subquery()
    with opened(tables_url) as store:
        wrong_count = update(CampaignCounts).where(CampaignCounts.campaign_id == campaign_key)
        store.write(lambda session: session.execute(wrong_count.values({column: 17})))
    lines = pyroshock("db", "check", "--db", tables_url).stdout.splitlines()
    (line,) = [line for line in lines if line.startswith("counts")]
    assert f"campaign {counted[0]}, kept 17, counted {counted[1]}" in line
    assert f"another number of {column} is kept" in line and "pyroshock db upgrade" in line
    run_pyroshock("db", "upgrade", "--db", tables_url)
    run_pyroshock("db", "check", "--db", tables_url)
    with opened(tables_url) as store, store.reading() as session:
        assert_counts_kept(session)


def test_a_row_that_was_altered_by_hand_is_written_anew_by_an_upgrade(sqlite_url, tmp_path):
    ingested(sqlite_url, hammer_campaign(tmp_path / "a", 1, 1, "a"))
    with opened(sqlite_url) as store, store.engine.begin() as connection:
        connection.exec_driver_sql("UPDATE campaign_counts SET impacts = 2")
    assert "the row was altered" in pyroshock("db", "check", "--db", sqlite_url).stdout
    run_pyroshock("db", "upgrade", "--db", sqlite_url)
    run_pyroshock("db", "check", "--db", sqlite_url)


def test_campaigns_without_kept_numbers_are_counted(sqlite_url, tmp_path):
    ingested(sqlite_url, hammer_campaign(tmp_path / "a", 2, 2, "a"), gun_campaign(tmp_path / "gun"))
    with opened(sqlite_url) as store:
        store.write(lambda session: session.execute(delete(CampaignCounts)))
        with store.reading() as session:
            keys = dict(iter(session.execute(select(Campaign.name, Campaign.id))))
            assert hit_counts(session) == {keys["a"]: (4, 0), keys["gun"]: (0, 3)}
            assert hit_counts(session, [keys["gun"]]) == {keys["gun"]: (0, 3)}
