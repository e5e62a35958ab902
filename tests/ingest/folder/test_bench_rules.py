"""What the bench cannot have is refused, or confirmed by name; what has no record is not judged."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from pyroshock.doe.limits.bench import BenchLimits
from pyroshock.ingest.folder.campaign_file import read_campaign_file
from support.records.campaigns import gun_rows, hammer_rows, replace_in, with_cell, write_runs
from support.stores.stores import ingest, ingested, pyroshock

Refused = Callable[..., str]

#: The rule, what a row of a gun campaign says, and what the refusal tells of it.
IMPOSSIBLE = [
    (
        "insulator-without-anvil",
        {"insulator": "polymeric", "anvil_material": "none"},
        ("'polymeric'", "'none'"),
    ),
    (
        "insulator-without-anvil",
        {"insulator": "polymeric"},
        ("'polymeric'", "anvil_material is not given"),
    ),
    ("negative-size", {"block_height_mm": -56}, ("'block_height_mm'", "-56")),
    ("pressure-above-regulator", {"tank_pressure_bar": 8.5}, ("8.5", "at most 8 bar")),
]


def with_row(folder: Path, cells: dict[str, object]) -> Path:
    """The second row of the gun campaign says `cells`."""
    rows = gun_rows()
    for column, value in cells.items():
        rows = with_cell(rows, column, value, row=1)
    write_runs(folder, rows)
    return folder


@pytest.mark.parametrize(("rule", "cells", "words"), IMPOSSIBLE)
def test_what_the_bench_cannot_have_is_refused(gun_folder, refused: Refused, rule, cells, words):
    refused(with_row(gun_folder, cells), "row 3", *words, f"--confirm {rule}")


@pytest.mark.parametrize(("rule", "cells", "words"), IMPOSSIBLE)
def test_what_is_confirmed_is_stored_and_told(gun_folder, sqlite_url, rule, cells, words):
    with_row(gun_folder, cells)
    given = ("--db", sqlite_url, "--jobs", "1", "--json", "--confirm", rule)
    report = json.loads(pyroshock("ingest", gun_folder, *given).stdout)
    assert report["shots"] == 3
    assert [finding["check"] for finding in report["findings"]] == [rule]
    assert "row 3" in report["findings"][0]["message"]


def test_rule_is_confirmed_in_the_campaign_file(gun_folder, sqlite_url):
    with_row(gun_folder, {"block_height_mm": -56})
    replace_in(
        gun_folder / "campaign.toml",
        "[bench.gun]",
        '[bench]\nconfirmed = ["negative-size"]\n\n[bench.gun]',
    )
    assert "note: negative-size (1)" in ingested(sqlite_url, gun_folder).stderr


@pytest.mark.parametrize("value", ['["negative-sizes"]', '"negative-size"', "[1]"])
def test_unknown_confirmation_is_refused(gun_folder, refused: Refused, value):
    replace_in(
        gun_folder / "campaign.toml", "[bench.gun]", f"[bench]\nconfirmed = {value}\n\n[bench.gun]"
    )
    refused(gun_folder, "negative-size")


#: The last of them one by one: 8 bar is the regulator's most (thesis, section 2.1.2).
POSSIBLE = (
    {"insulator": "polymeric", "anvil_material": "steel"}, {"insulator": "none",
    "anvil_material": "none"},
    {"tank_pressure_bar": 8}, {"block_height_mm": 0}, {"temperature_c": -5}, {"offset_x_mm": -20},
)  # fmt: skip


@pytest.mark.parametrize("cells", POSSIBLE)
def test_what_the_bench_has_is_stored(gun_folder, sqlite_url, cells):
    assert "note" not in ingested(sqlite_url, with_row(gun_folder, cells)).stderr


def test_gun_states_the_limit_of_its_own_regulator(gun_folder, sqlite_url):
    assert (
        read_campaign_file(gun_folder).max_regulated_pressure_pa
        == BenchLimits().max_regulated_pressure_pa
    )
    with_row(gun_folder, {"tank_pressure_bar": 8.5})
    replace_in(
        gun_folder / "campaign.toml",
        "efficiency = 0.5",
        "efficiency = 0.5\nmax_regulated_pressure_pa = 1e6",
    )
    ingested(sqlite_url, gun_folder)
    with_row(gun_folder, {"tank_pressure_bar": 10.5})
    assert "at most 10 bar" in ingest(sqlite_url, gun_folder).stderr


def test_pad_under_a_hammer_is_told(hammer_folder, sqlite_url):
    """The disclosed hammer campaigns have an insulator on the bare plate."""
    rows = [{**row, "insulator": "polymeric", "anvil_material": "none"} for row in hammer_rows()]
    write_runs(hammer_folder, rows)
    assert "note: insulator-without-anvil (1)" in ingested(sqlite_url, hammer_folder).stderr


def test_row_without_recording_is_not_judged(hammer_folder, sqlite_url):
    """No check has seen the impact: `ok` would be a verdict without evidence."""
    rows = [{**row, "impact_velocity_m_s": 1.0} for row in hammer_rows()]
    rows[2:] = [{**row, "recording": ""} for row in rows[2:]]
    write_runs(hammer_folder, rows)
    told = ingested(sqlite_url, hammer_folder)
    assert "note: not-judged (1)" in told.stderr
    listed = json.loads(pyroshock("impacts", "--db", sqlite_url, "--json").stdout)
    assert {row["run"]: row["quality"] == "not judged" for row in listed} == {1: False, 2: True}
    found = json.loads(
        pyroshock("impacts", "--db", sqlite_url, "--where", "quality=not judged", "--json").stdout
    )
    assert {row["run"] for row in found} == {2}
