"""Facts that a stored campaign lacks are added by its folder; what it has stays, and so do datasets
built of it."""

from __future__ import annotations

import json

import pytest
from pyroshock.dataset.snapshot import read_snapshot
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.impacts import Impact, Shot
from pyroshock.schema.provenance import Provenance
from sqlalchemy import select
from support.records.campaigns import (
    gun_campaign,
    gun_rows,
    hammer_campaign,
    hammer_rows,
    replace_in,
    with_cell,
    write_runs,
)
from support.stores.stores import content, counts, ingest, ingested, opened, pyroshock

PLATE = (
    '[bench.plate]\nmaterial = "steel"\nthickness_m = 0.01\noutline_m = [[0, 0], '
    "[0.2, 0], [0.2, 0.2]]\n"
)
OTHERS = {
    "anvil_material": "none",
    "insulator": "none",
    "plate_material": "steel",
    "boundary_conditions": "free",
}


def with_columns(rows, **columns):
    return [{**row, **columns} for row in rows]


def append(folder, text):
    with (folder / "campaign.toml").open("a", encoding="utf-8") as file:
        file.write(text)


def impacts_of(url):
    return json.loads(pyroshock("impacts", "--db", url, "--json").stdout)


def same_as_anew(url, folder, tmp_path):
    """Whether the store holds of the folder what a new store would, but for what nobody points at
    any more."""
    other = f"sqlite:///{tmp_path / 'anew.db'}"
    ingested(other, folder)
    here, there = content(url), content(other)
    spare = {
        "configurations",
        "configuration_levels",
        "factors",
        "factor_levels",
        "hammers",
        "plates",
        "guns",
    }
    return {name: here[name] for name in here.keys() - spare} == {
        name: there[name] for name in there.keys() - spare
    }


def test_missing_mass_and_plate_are_added(sqlite_url, tmp_path):
    folder = hammer_campaign(tmp_path / "c")
    whole = (folder / "campaign.toml").read_text(encoding="utf-8")
    replace_in(folder / "campaign.toml", "[bench.hammer]\nmass_kg = 0.32\n", "")
    ingested(sqlite_url, folder)
    (folder / "campaign.toml").write_text(whole, encoding="utf-8")
    append(folder, PLATE)
    notes = ingested(sqlite_url, folder).stderr
    assert (
        "bench.hammer.mass_kg = 0.32; bench.plate.material = 'steel'; "
        "bench.plate.thickness_m = 0.01" in notes
    )
    with opened(sqlite_url) as store, store.reading() as session:
        campaign = session.scalars(select(Campaign)).one()
        assert (campaign.hammer.mass_kg, campaign.plate.thickness_m) == (0.32, 0.01)
        entry = session.get_one(Provenance, campaign.written_by_id)
        assert "added to campaign 'hammer': bench.hammer.mass_kg = 0.32" in entry.command
        assert entry.user
    assert "nothing new" in ingested(sqlite_url, folder).stderr
    assert pyroshock("db", "check", "--db", sqlite_url).exit_code == 0
    assert same_as_anew(sqlite_url, folder, tmp_path)


def test_missing_fact_of_a_plate_is_added_to_it(sqlite_url, hammer_folder):
    append(hammer_folder, PLATE.split("outline_m")[0])
    ingested(sqlite_url, hammer_folder)
    append(hammer_folder, "outline_m" + PLATE.split("outline_m")[1])
    assert "bench.plate.outline_m = " in ingested(sqlite_url, hammer_folder).stderr


def test_factor_is_added_to_the_impacts_of_its_rows(stored_hammer, tmp_path):
    sqlite_url, folder = stored_hammer
    before = counts(sqlite_url)
    write_runs(folder, with_cell(hammer_rows(), "boundary_conditions", "free", row=3))
    notes = ingested(sqlite_url, folder).stderr
    assert "boundary_conditions of 1 impacts" in notes
    assert [row.get("boundary_conditions") for row in impacts_of(sqlite_url)] == [
        None,
        None,
        None,
        "free",
    ]
    assert counts(sqlite_url)["impacts"] == before["impacts"]
    assert counts(sqlite_url)["pulses"] == before["pulses"]
    assert same_as_anew(sqlite_url, folder, tmp_path)
    with opened(sqlite_url) as store, store.reading() as session:
        rows = session.execute(
            select(Impact.run, Impact.repetition, Impact.written_by_id).order_by(Impact.id)
        ).all()
        assert len({key for _, _, key in rows[:3]}) == 1
        assert rows[3][2] != rows[0][2]
        assert "boundary_conditions of 1 impacts" in session.get_one(Provenance, rows[3][2]).command


def test_factor_of_a_row_that_stands_for_all_hits(sqlite_url, tmp_path):
    folder = hammer_campaign(tmp_path / "c", recordings=1, hits=10)
    write_runs(folder, hammer_rows(1, 10)[:1])
    ingested(sqlite_url, folder)
    write_runs(folder, with_columns(hammer_rows(1, 10)[:1], boundary_conditions="fixed"))
    assert "boundary_conditions of 10 impacts" in ingested(sqlite_url, folder).stderr
    assert [row["boundary_conditions"] for row in impacts_of(sqlite_url)] == ["fixed"] * 10
    assert same_as_anew(sqlite_url, folder, tmp_path)


def test_factor_is_added_to_shots_and_their_impacts(database_url, tmp_path):
    folder = gun_campaign(tmp_path / "gun")
    rows = with_columns(gun_rows(), impact_velocity_m_s=9.0)
    write_runs(folder, rows)
    ingested(database_url, folder)
    write_runs(folder, with_columns(rows, anvil_material="steel"))
    assert "anvil_material of 3 shots" in ingested(database_url, folder).stderr
    assert [row["anvil_material"] for row in impacts_of(database_url)] == ["steel"] * 3
    with opened(database_url) as store, store.reading() as session:
        of_impacts, of_shots = (
            session.scalars(select(table.configuration_id)).all() for table in (Impact, Shot)
        )
        assert sorted(of_impacts) == sorted(of_shots)
    assert "nothing new" in ingested(database_url, folder).stderr
    assert pyroshock("db", "check", "--db", database_url).exit_code == 0


@pytest.mark.parametrize("value", ["steel", ""])
def test_other_or_absent_value_beside_an_addition_is_refused(stored_hammer, value):
    url, folder = stored_hammer
    before = counts(url)
    write_runs(
        folder,
        with_cell(
            with_columns(hammer_rows(), boundary_conditions="free"), "tip_material", value, row=2
        ),
    )
    result = ingest(url, folder)
    assert (result.exit_code, "tip_material is" in result.stderr) == (2, True)
    assert "boundary_conditions" not in result.stderr
    write_runs(folder, hammer_rows())
    replace_in(folder / "campaign.toml", "mass_kg = 0.32", "mass_kg = 0.4")
    append(folder, PLATE)
    result = ingest(url, folder)
    assert (
        result.exit_code,
        "bench.hammer.mass_kg is 0.4, 0.32 in the store" in result.stderr,
    ) == (2, True)
    assert "bench.plate" not in result.stderr
    assert counts(url) == before


def test_rehearsal_says_what_would_be_added(stored_hammer):
    sqlite_url, folder = stored_hammer
    before = content(sqlite_url)
    append(folder, PLATE)
    write_runs(folder, with_columns(hammer_rows(), boundary_conditions="free"))
    result = pyroshock("ingest", folder, "--db", sqlite_url, "--jobs", "1", "--dry-run", "--json")
    assert "note: added-facts: bench.plate.material" in result.stderr
    (finding,) = [
        each for each in json.loads(result.stdout)["findings"] if each["check"] == "added-facts"
    ]
    assert "boundary_conditions of 4 impacts" in finding["message"]
    assert content(sqlite_url) == before


def test_recordings_are_added_along_with_facts(sqlite_url, tmp_path):
    folder = hammer_campaign(tmp_path / "c", recordings=3)
    write_runs(folder, hammer_rows(2))
    ingested(sqlite_url, folder)
    append(folder, PLATE)
    write_runs(folder, with_columns(hammer_rows(3), boundary_conditions="free"))
    notes = ingested(sqlite_url, folder).stderr
    assert "added 1 recordings, 2 impacts" in notes
    assert "boundary_conditions of 4 impacts" in notes
    assert same_as_anew(sqlite_url, folder, tmp_path)


LACKING = (
    'name = "tips"\nkind = "hammer"\n[[predictors]]\nname = "tip_radius"\nunit = '
    '"m"\nfrom = "factor.tip_radius"\n'
)


def test_frozen_dataset_stays_as_it_was(database_url, tmp_path):
    """It is read from the rows of the store, which have the new facts; a dataset built now has them
    too."""
    folder = hammer_campaign(tmp_path / "c")
    replace_in(folder / "campaign.toml", "[bench.hammer]\nmass_kg = 0.32\n", "")
    (tmp_path / "tips.toml").write_text(LACKING, encoding="utf-8")
    build = (
        "dataset",
        "build",
        "--predictors",
        tmp_path / "tips.toml",
        "--db",
        database_url,
        "--from",
        "hammer",
    )
    ingested(database_url, folder)
    assert pyroshock(*build, "--", "old").exit_code == 0
    with opened(database_url) as store:
        old = read_snapshot(store, "old")
    for text, columns in (
        (PLATE, {"boundary_conditions": "free"}),
        ("[bench.hammer]\nmass_kg = 0.32\n", OTHERS),
    ):
        append(folder, text)
        write_runs(folder, with_columns(hammer_rows(), **columns))
        ingested(database_url, folder)
        with opened(database_url) as store:
            again = read_snapshot(store, "old")
        assert again.hash == old.hash
        assert again.table.configuration.tolist() == old.table.configuration.tolist()
    assert pyroshock(*build, "--", "new").exit_code == 0
    assert pyroshock("db", "check", "--db", database_url).exit_code == 0
    with opened(database_url) as store:
        new = read_snapshot(store, "new")
    assert new.hash != old.hash
    assert new.table.impactor_mass_kg.tolist() == [0.32] * 4
    assert all("boundary_conditions=free" in text for text in new.table.configuration)
