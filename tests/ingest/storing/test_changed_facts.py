"""The same campaign again adds nothing; what changed under it is refused: both values are told, and
the way out."""

from __future__ import annotations

import json

import pytest
from pyroshock.schema.recordings import RecordedChannel
from sqlalchemy import select
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
from support.records.plate_folders import plate_campaign
from support.stores.stores import content, counts, ingest, ingested, opened, pyroshock


def refused_again(url, folder):
    """The one line with which the folder is refused; the store is as before."""
    before = counts(url)
    result = ingest(url, folder)
    assert (result.exit_code, result.stdout, len(result.stderr.splitlines())) == (2, "", 1), (
        result.output
    )
    assert counts(url) == before
    return result.stderr


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('unit = "N"', 'unit = "kN"', ("channels.force.unit is 'kN'", "'N' in the store")),
        (
            'unit = "N"',
            'unit = "N"\nsensitivity = 0.01',
            ("channels.force.sensitivity is 0.01", "not given in the"),
        ),
        (
            "range = 10000.0",
            "range = 5000.0",
            ("channels.force.range is 5000.0", "10000.0 in the store"),
        ),
        ("range = 10000.0\n", "", ("channels.force.range is not given", "10000.0 in the store")),
        (
            'position = "tip"',
            'position = "plate"',
            ("channels.force.position is 'plate'", "'tip' in the store"),
        ),
        ('"tip"', '"tip"\naxis = "z"', ("channels.force.axis is 'z'", "not given in the store")),
        (
            'quantity = "force"\nunit = "N"',
            'quantity = "acceleration"\nunit = "m/s2"',
            ("channels.force.quantity is 'acceleration'", "'force' in the store"),
        ),
        ("mass_kg = 0.32", "mass_kg = 0.4", ("bench.hammer.mass_kg is 0.4", "0.32 in the store")),
        (
            "[bench.hammer]\nmass_kg = 0.32\n",
            "",
            ("bench.hammer.mass_kg is not given", "0.32 in the store"),
        ),
        ("2026-03-02", "2026-03-09", ("campaign.date is 2026-03-09", "2026-03-02 in the store")),
        # all changes are told at once
        (
            '"N"\nposition = "tip"\nrange = 10000.0',
            '"kN"\nrange = 5.0',
            ("force.unit", "force.range"),
        ),
        # several force channels are summed: the same column would hold one cell's force and an
        # array's
        (
            "range = 10000.0\n",
            'range = 10000.0\n[channels.force_2]\nquantity = "force"\nunit = "N"\n',
            ("force channels are force, force_2 in campaign.toml, force in the store",),
        ),
    ],
)
def test_changed_channel_or_bench_is_refused_with_both_values(stored_hammer, old, new, words):
    url, folder = stored_hammer
    replace_in(folder / "campaign.toml", old, new)
    message = refused_again(url, folder)
    for word in (*words, "another name"):
        assert word in message


def test_recordings_added_later_do_not_take_another_unit(sqlite_url, tmp_path):
    folder = hammer_campaign(tmp_path / "c", recordings=3)
    write_runs(folder, hammer_rows(2))
    ingested(sqlite_url, folder)
    replace_in(folder / "campaign.toml", 'unit = "N"', 'unit = "kN"')
    write_runs(folder, hammer_rows(3))
    refused_again(sqlite_url, folder)
    with opened(sqlite_url) as store, store.reading() as session:
        assert set(session.scalars(select(RecordedChannel.unit))) == {"N"}


def test_the_same_meaning_in_other_words_is_no_change(sqlite_url, hammer_folder):
    """10 kN are 10,000 N; volts of 1 V/N are newtons, but these are other numbers of a file and
    stay refused above."""
    replace_in(
        hammer_folder / "campaign.toml",
        'unit = "N"',
        'unit = "N"\nsensitivity = 0.01\noffset_v = 0.5',
    )
    ingested(sqlite_url, hammer_folder)
    replace_in(
        hammer_folder / "campaign.toml",
        'unit = "N"\nsensitivity = 0.01',
        'unit = "kN"\nsensitivity = 10',
    )
    replace_in(hammer_folder / "campaign.toml", "range = 10000.0", "range = 10")
    replace_in(hammer_folder / "campaign.toml", '"tip"', '" Tip"')
    assert "nothing new" in ingested(sqlite_url, hammer_folder).stderr


def test_changed_gun_and_plate_are_told_with_both_values(sqlite_url, hammer_folder, tmp_path):
    gun = gun_campaign(tmp_path / "gun")
    with (hammer_folder / "campaign.toml").open("a", encoding="utf-8") as file:
        file.write('[bench.plate]\nmaterial = "steel"\nthickness_m = 0.01\n')
    ingested(sqlite_url, hammer_folder, gun)
    for folder, key, old, new in (
        (gun, "bench.gun.travel_m", "0.9", "0.85"),
        (hammer_folder, "bench.plate.thickness_m", "0.01", "0.012"),
    ):
        name = key.rpartition(".")[2]
        replace_in(folder / "campaign.toml", f"{name} = {old}", f"{name} = {new}")
        message = refused_again(sqlite_url, folder)
        assert f"{key} is {new}" in message and f"{old} in the store" in message


def test_changed_modal_table_is_told_with_both_values(sqlite_url, tmp_path):
    folder = plate_campaign(tmp_path / "plate", recordings=1).folder
    ingested(sqlite_url, folder)
    table = folder / "plate_modes.csv"
    header, first, *rest = table.read_text(encoding="utf-8").splitlines()
    cells = dict(zip(header.split(","), first.split(","), strict=True))
    stored = float(cells["frequency_hz"])
    cells["frequency_hz"] = "1234.5"
    table.write_text("\n".join([header, ",".join(cells.values()), *rest]) + "\n", encoding="utf-8")
    told = refused_again(sqlite_url, folder)
    assert "another modal table" in told
    assert f"mode {cells['mode']}: frequency_hz is 1234.5" in told
    assert f"{stored!r} in the store" in told


@pytest.mark.parametrize(
    ("column", "value", "words"),
    [
        ("tip_radius_mm", 45, ("tip_radius is 0.045 m", "0.01 m in the store")),
        ("tip_material", "steel", ("tip_material is steel", "aluminum in the store")),
        ("impact_velocity_m_s", 1.5, ("impact_velocity_m_s is 1.5", "not given in the store")),
        ("tip_material", "", ("tip_material is not given", "aluminum in the store")),
    ],
)
def test_changed_row_is_told_with_both_values(stored_hammer, column, value, words):
    url, folder = stored_hammer
    write_runs(folder, with_cell(hammer_rows(), column, value))
    message = refused_again(url, folder)
    for word in words:
        assert word in message


def test_same_folder_twice_adds_no_row_and_gives_the_same_totals(
    database_url, hammer_folder, tmp_path
):
    gun, other_url = gun_campaign(tmp_path / "gun"), f"sqlite:///{tmp_path / 'other.db'}"
    first = ingested(database_url, hammer_folder, gun)
    before = counts(database_url)
    second = ingested(database_url, hammer_folder, gun)
    assert counts(database_url) == before
    assert "nothing new" in second.stderr
    assert "nothing new" not in first.stderr
    reports = [
        json.loads(pyroshock("ingest", gun, "--db", url, "--json").stdout)
        for url in (database_url, other_url)
    ]
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
    hammer_folder, two = (
        hammer_campaign(tmp_path / "a", 2, name="a"),
        gun_campaign(tmp_path / "b", name="b"),
    )
    ingested(sqlite_url, hammer_folder, two)
    other = f"sqlite:///{tmp_path / 'other.db'}"
    write_runs(hammer_folder, hammer_rows(2)[::-1])
    # hits of a recording are matched to rows in time order: the rows of one recording keep theirs
    write_runs(hammer_folder, [*hammer_rows(2)[2:], *hammer_rows(2)[:2]])
    ingested(other, two, hammer_folder)
    assert content(sqlite_url) == content(other)


@pytest.mark.parametrize(
    ("column", "value", "words"),
    [
        ("measured_velocity_m_s", 99.0, ("run 2, repetition 1 is in the store with other",)),
        ("tank_pressure_bar", 0.9, ("run 2, repetition 1 is in the store with other",)),
        ("impact_velocity_m_s", 8.0, ("impact_velocity_m_s is 8.0", "9.0 in the store")),
    ],
)
def test_changed_row_of_a_gun_is_refused(sqlite_url, gun_folder, column, value, words):
    rows = [{**row, "impact_velocity_m_s": 9.0} for row in gun_rows()]
    write_runs(gun_folder, rows)
    ingested(sqlite_url, gun_folder)
    write_runs(gun_folder, with_cell(rows, column, value, row=1))
    message = refused_again(sqlite_url, gun_folder)
    for word in ("row 3", *words):
        assert word in message


def test_changed_recording_and_kind_of_campaign_are_refused(stored_hammer, tmp_path):
    url, folder = stored_hammer
    path = folder / recording_name(1)
    good = path.read_bytes()
    path.write_bytes((hammer_campaign(tmp_path / "other", seed=2) / recording_name(1)).read_bytes())
    assert f"{recording_name(1)}: the file has changed" in refused_again(url, folder)
    path.write_bytes(good)
    replace_in(folder / "campaign.toml", '"hammer"\ndate', '"gun"\ndate')
    write_runs(folder, gun_rows())
    assert "'hammer' is in the store with another kind, date, bench or known fact" in refused_again(
        url, folder
    )
