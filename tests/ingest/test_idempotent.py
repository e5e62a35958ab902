"""The same campaign again adds nothing; what changed under the same numbers is refused."""

from __future__ import annotations

import json

import pytest
from support.records.campaigns import (
    gun_campaign,
    gun_rows,
    hammer_campaign,
    hammer_rows,
    recording_name,
    replace_in,
    with_cell,
    write_runs,
)
from support.stores.stores import content, counts, ingest, ingested, pyroshock


def test_same_folder_twice_adds_no_row_and_gives_the_same_totals(database_url, hammer_folder, tmp_path):
    gun, other_url = gun_campaign(tmp_path / "gun"), f"sqlite:///{tmp_path / 'other.db'}"
    first = ingested(database_url, hammer_folder, gun)
    before = counts(database_url)
    second = ingested(database_url, hammer_folder, gun)
    assert counts(database_url) == before
    assert "nothing new" in second.stderr
    assert "nothing new" not in first.stderr
    reports = [json.loads(pyroshock("ingest", gun, "--db", url, "--json").stdout) for url in (database_url, other_url)]
    assert reports[0] == reports[1]


def test_campaign_grows_by_its_new_rows(sqlite_url, tmp_path):
    folder = hammer_campaign(tmp_path / "c", recordings=3)
    write_runs(folder, hammer_rows(2))
    ingested(sqlite_url, folder)
    write_runs(folder, hammer_rows(3))
    ingested(sqlite_url, folder)
    whole = f"sqlite:///{tmp_path / 'whole.db'}"
    ingested(whole, folder)
    assert content(sqlite_url) == content(whole)


def test_order_of_rows_and_campaigns_does_not_matter(sqlite_url, tmp_path):
    one, two = hammer_campaign(tmp_path / "a", 2, name="a"), gun_campaign(tmp_path / "b", name="b")
    ingested(sqlite_url, one, two)
    other = f"sqlite:///{tmp_path / 'other.db'}"
    write_runs(one, hammer_rows(2)[::-1])
    # hits of a recording are matched to rows in time order: the rows of one recording keep theirs
    write_runs(one, [*hammer_rows(2)[2:], *hammer_rows(2)[:2]])
    ingested(other, two, one)
    assert content(sqlite_url) == content(other)


@pytest.mark.parametrize(("column", "value"), [("measured_velocity_m_s", 99.0), ("tank_pressure_bar", 0.9)])
def test_changed_row_is_refused(sqlite_url, gun_folder, column, value):
    ingested(sqlite_url, gun_folder)
    before = counts(sqlite_url)
    write_runs(gun_folder, with_cell(gun_rows(), column, value, row=1))
    result = ingest(sqlite_url, gun_folder)
    assert (result.exit_code, len(result.stderr.splitlines())) == (2, 1)
    assert "row 3: run 2, repetition 1 is in the store with other" in result.stderr
    assert counts(sqlite_url) == before


def test_changed_recording_is_refused(stored_hammer, tmp_path):
    sqlite_url, folder = stored_hammer
    before = counts(sqlite_url)
    other = hammer_campaign(tmp_path / "other", seed=2)
    (folder / recording_name(1)).write_bytes((other / recording_name(1)).read_bytes())
    result = ingest(sqlite_url, folder)
    assert (result.exit_code, len(result.stderr.splitlines())) == (2, 1)
    assert f"{recording_name(1)}: the file has changed" in result.stderr
    assert counts(sqlite_url) == before


def test_another_kind_of_campaign_of_the_same_name_is_refused(stored_hammer):
    url, folder = stored_hammer
    before = counts(url)
    replace_in(folder / "campaign.toml", '"hammer"\ndate', '"gun"\ndate')
    write_runs(folder, gun_rows())
    result = ingest(url, folder)
    assert (result.exit_code, len(result.stderr.splitlines())) == (2, 1)
    assert "'hammer' is in the store with another kind, date or bench" in result.stderr
    assert counts(url) == before
