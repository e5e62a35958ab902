"""All faults of a folder's tables are told in one run, a line each; the only fault is told on its
one line."""

from __future__ import annotations

import pytest
from pyroshock.ingest.errors import MOST_LISTED, IngestError
from pyroshock.ingest.folder.campaign_file import read_campaign_file
from pyroshock.ingest.folder.runs_table import read_runs
from support.records.campaigns import gun_rows, hammer_rows, replace_in, with_cell, write_runs
from support.stores.stores import counts, ingest


def lines_of(url, folder):
    """What a refused ingest prints; nothing is stored."""
    before = counts(url)
    result = ingest(url, folder)
    assert (result.exit_code, result.stdout) == (2, ""), result.output
    assert counts(url) == before
    return result.stderr.splitlines()


def faults_of(folder):
    with pytest.raises(IngestError) as error:
        read_campaign_file(folder)
    return error.value.faults


def test_faults_of_both_files_are_told_together(sqlite_url, hammer_folder):
    replace_in(hammer_folder / "campaign.toml", 'unit = "N"', 'unit = "gg"')
    replace_in(hammer_folder / "campaign.toml", "2026-03-02", "2 March")
    replace_in(hammer_folder / "campaign.toml", "mass_kg = 0.32", "mass_kg = -1")
    rows = with_cell(hammer_rows(), "tip_material", "cheese")
    rows = with_cell(rows, "tip_radius_mm", "big", row=2)
    write_runs(hammer_folder, with_cell(rows, "repetition", 0, row=2))
    first, *below = lines_of(sqlite_url, hammer_folder)
    assert first == "pyroshock: campaign.toml and runs.csv: 6 faults"
    assert all(line.startswith("  ") for line in below)
    for line, words in zip(
        below,
        [
            ("campaign.toml: campaign.date is '2 March'", "ISO date"),
            ("campaign.toml: bench.hammer.mass_kg is -1", "above zero"),
            ("campaign.toml: channels.force", "'gg'"),
            ("runs.csv: row 2, column 'tip_material': 'cheese'", "expected"),
            ("runs.csv: row 4, column 'tip_radius_mm': 'big'", "expected"),
            ("runs.csv: row 4, column 'repetition': '0'", "expected"),
        ],
        strict=True,
    ):
        for word in words:
            assert word in line


def test_only_fault_is_one_line(sqlite_url, hammer_folder):
    write_runs(hammer_folder, with_cell(hammer_rows(), "tip_material", "cheese"))
    (line,) = lines_of(sqlite_url, hammer_folder)
    assert line.startswith("pyroshock: runs.csv: row 2, column 'tip_material': 'cheese'; expected")
    (hammer_folder / "campaign.toml").write_text("[campaign\n", encoding="utf-8")
    _, *below = lines_of(sqlite_url, hammer_folder)
    assert "not TOML" in below[0] and "row 2, column 'tip_material': 'cheese'" in below[1]


def test_faults_of_one_file_are_headed_by_its_name(sqlite_url, gun_folder):
    replace_in(gun_folder / "campaign.toml", "travel_m = 0.9", "travel = 0.9")
    first, *below = lines_of(sqlite_url, gun_folder)
    assert first == "pyroshock: campaign.toml: 2 faults"
    assert "unknown key 'bench.gun.travel'" in below[0]
    assert "bench.gun.travel_m is missing" in below[1]


def test_table_is_read_in_spite_of_a_kind_that_is_none(sqlite_url, gun_folder):
    replace_in(gun_folder / "campaign.toml", 'kind = "gun"', 'kind = "guns"')
    write_runs(gun_folder, with_cell(gun_rows(), "bullet_mass_kg", "heavy"))
    _, *below = lines_of(sqlite_url, gun_folder)
    assert len(below) == 2
    assert "'guns'" in below[0]
    assert "column 'bullet_mass_kg': 'heavy'" in below[1]


def test_faults_of_rows_are_counted_joined_and_told_whatever_their_length(
    sqlite_url, hammer_folder
):
    write_runs(hammer_folder, [{**row, "tip_radius_mm": -1} for row in hammer_rows(2, MOST_LISTED)])
    first, *below = lines_of(sqlite_url, hammer_folder)
    assert first == f"pyroshock: runs.csv: {2 * MOST_LISTED} faults"
    assert len(below) == MOST_LISTED + 1
    assert below[-1] == f"  and {MOST_LISTED} more"
    write_runs(
        hammer_folder, [{**row, "recording": f"{row['run']}.npz"} for row in hammer_rows(2, 5)]
    )
    _, *below = lines_of(sqlite_url, hammer_folder)
    assert [line.split(";")[0] for line in below] == [
        "  runs.csv: row 2, column 'recording': '1.npz'",
        "  runs.csv: row 7, column 'recording': '2.npz'",
    ]
    write_runs(hammer_folder, with_cell(hammer_rows(), "tip_material", "cheese", row=1))
    table = hammer_folder / "runs.csv"
    header, first, *rest = table.read_text(encoding="utf-8").splitlines()
    table.write_text("\n".join([header, first + ",7", *rest]) + "\n", encoding="utf-8")
    _, *below = lines_of(sqlite_url, hammer_folder)
    assert "row 2: 7 cells; expected 6" in below[0]
    assert "row 3, column 'tip_material'" in below[1]


def test_rows_that_no_bench_has_are_told_beside_other_faults(sqlite_url, gun_folder):
    rows = [{**row, "tank_pressure_bar": 9 + i} for i, row in enumerate(gun_rows())]
    write_runs(gun_folder, with_cell(rows, "tip_material", "cheese", row=2))
    _, *below = lines_of(sqlite_url, gun_folder)
    assert "row 4, column 'tip_material'" in below[0]
    assert [
        "row 2: tank_pressure_bar is 9" in below[1],
        "row 3: tank_pressure_bar is 10" in below[2],
    ] == [True, True]


def test_missing_table_is_one_fault_and_each_key_of_a_plate_has_its_own(hammer_folder):
    toml = hammer_folder / "campaign.toml"
    with toml.open("a", encoding="utf-8") as file:
        file.write('[bench.plate]\nmaterial = "steel"\nthickness_m = "thick"\noutline_m = 3\n')
    places = [fault.split(" is ")[0] for fault in faults_of(hammer_folder)]
    assert places == [f"campaign.toml: bench.plate.{key}" for key in ("thickness_m", "outline_m")]
    toml.write_text("[bench.hammer]\nmass_kg = 1\n", encoding="utf-8")
    assert faults_of(hammer_folder) == (
        "campaign.toml: no table [campaign]; expected name, kind and date there",
    )


def test_columns_that_resemble_known_ones_are_all_named(hammer_folder):
    write_runs(
        hammer_folder,
        [{**row, "Tip material": "steel", "recordings": "a"} for row in hammer_rows()],
    )
    with pytest.raises(IngestError) as error:
        read_runs(hammer_folder, "hammer", lambda name: name)
    assert [fault.split(" resembles")[0] for fault in error.value.faults] == [
        "runs.csv: column 'Tip material'",
        "runs.csv: column 'recordings'",
    ]
