"""Misspelt columns of runs.csv are refused; what is meant as a free factor is declared or
confirmed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from pyroshock.diagnosis.reading.campaign import TRAVEL as TRAVEL_OF_DIAGNOSIS
from pyroshock.ingest.folder.column_names import KNOWN, TRAVEL, resembled
from pyroshock.schema.campaigns import Factor, FactorLevel
from sqlalchemy import select
from support.records.campaigns import gun_rows, hammer_rows, replace_in, with_cell, write_runs
from support.stores.stores import ingest, ingested, opened, pyroshock

Refused = Callable[..., str]


def renamed(folder: Path, old: str, new: str) -> Path:
    write_runs(
        folder,
        [
            {new if key == old else key: value for key, value in row.items()}
            for row in hammer_rows()
        ],
    )
    return folder


MISSPELT = {
    "recording": ("Recording", "recordings"),
    "tip_material": ("tip_materal", "Tip material", "tip-material", "tipmaterial"),
    "tip_radius_mm": ("tip_radius_m", "Tip radius"),
    "hammer_speed": ("hamer_sped",),
}


@pytest.mark.parametrize(
    ("known", "written"),
    [(column, misspelt) for column, many in MISSPELT.items() for misspelt in many],
)
def test_misspelt_column_is_refused_with_the_known_one(
    hammer_folder, refused: Refused, known, written
):
    folder = renamed(hammer_folder, known, written)
    refused(folder, "runs.csv", repr(written), repr(known), "[factors]", "--free-factor")


def test_other_units_and_swapped_letters_resemble():
    columns = {
        "tank_pressure_psi": "tank_pressure_bar", "tank_pressure_Pa": "tank_pressure_bar",
        "bullet_mass_g": "bullet_mass_kg", "bullet_length_m": "bullet_length_mm",
        "impact_velocity": "impact_velocity_m_s", "impact_velocity_km_h": "impact_velocity_m_s",
        "Measured velocity": "measured_velocity_m_s", "anvil_materail": "anvil_material",
    }  # fmt: skip
    assert {written: resembled(written) for written in columns} == columns
    assert set(TRAVEL) == set(TRAVEL_OF_DIAGNOSIS)


@pytest.mark.parametrize(
    "name",
    [
        *(
            "pulse_setting",
            "order",
            "repetitions",
            "velocity_level",
            "operator",
            "temperature_c",
            "chain_height_mm",
        ),
        *(
            "tip_mass_g",
            "travel_time",
            "tip",
            "plate_thickness_mm",
            "treatment",
            "remarks",
            "Feuchte_%",
        ),
        *KNOWN,
    ],
)
def test_names_of_their_own_do_not_resemble(name):
    assert resembled(name) is None


def test_factor_is_declared_in_the_campaign_file(hammer_folder, sqlite_url):
    renamed(hammer_folder, "tip_material", "tip_material_2")
    with (hammer_folder / "campaign.toml").open("a", encoding="utf-8") as file:
        file.write('[factors]\ntip_material_2 = "material of the second tip"\n')
    assert "free factors" not in ingested(sqlite_url, hammer_folder).stderr
    assert "tip material 2" in pyroshock("impacts", "--db", sqlite_url).stdout


def test_factor_is_confirmed_on_the_command_line(hammer_folder, sqlite_url):
    renamed(hammer_folder, "tip_material", "tip_material_2")
    assert ingest(sqlite_url, hammer_folder).exit_code == 2
    told = pyroshock(
        "ingest",
        hammer_folder,
        "--db",
        sqlite_url,
        "--jobs",
        "1",
        "--free-factor",
        "tip_material_2",
    )
    assert told.exit_code == 0, told.stderr
    assert "free factors: tip_material_2" in told.stderr


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ('tip_material = "what it is"', ("[factors]", "'tip_material'", "known column")),
        ('humidity = "what it is"', ("[factors]", "'humidity'", "no column")),
        ("humidity = 3", ("factors.humidity", "3", "text")),
    ],
)
def test_declaration_that_the_table_does_not_bear_out_is_refused(
    hammer_folder, refused: Refused, line, words
):
    with (hammer_folder / "campaign.toml").open("a", encoding="utf-8") as file:
        file.write(f"[factors]\n{line}\n")
    refused(hammer_folder, "campaign.toml", *words)


def test_undeclared_factor_is_kept_and_told(hammer_folder, sqlite_url):
    """The contract of the folder: further columns are kept as free factors."""
    write_runs(hammer_folder, [{**row, "pulse_setting": "soft"} for row in hammer_rows()])
    assert "free factors: pulse_setting" in ingested(sqlite_url, hammer_folder).stderr
    assert "soft" in pyroshock("impacts", "--db", sqlite_url).stdout


def test_missing_key_names_the_column_that_was_meant(hammer_folder, refused: Refused):
    replace_in(hammer_folder / "runs.csv", "run,repetition", "run,Repetitions")
    refused(hammer_folder, "no column 'repetition'", "'Repetitions' resembles it")


def test_columns_of_campaigns_do_not_resemble(examples: Path, thesis_tables: Path):
    tables = [*examples.glob("*/runs.csv"), *thesis_tables.glob("table_a1*.csv")]
    assert len(tables) == 4
    for table in tables:
        header = table.read_text(encoding="utf-8").split("\n", 1)[0].strip().split(",")
        assert [column for column in header if resembled(column)] == [], table


def labels(url: str, factor: str) -> list[str]:
    with opened(url) as store, store.reading() as session:
        query = (
            select(FactorLevel.label)
            .join(Factor)
            .where(Factor.name == factor)
            .order_by(FactorLevel.id)
        )
        return list(session.scalars(query))


def test_a_profile_in_two_spellings_is_one_level(sqlite_url, gun_folder):
    rows = with_cell(gun_rows(), "valve_profile", "0:0, 0.1:1,0.40:1, 0.5:0.0", 0)
    write_runs(gun_folder, with_cell(rows, "valve_profile", "0:0 0.1:1 0.4:1 0.5:0", 1), ";")
    ingested(sqlite_url, gun_folder)
    assert labels(sqlite_url, "valve_profile") == ["0:0 0.1:1 0.4:1 0.5:0"]


@pytest.mark.parametrize("text", ["0:0 0.1", "0.1:0 0:1", "0:3"])
def test_a_text_that_is_no_profile_is_refused(gun_folder, refused, text):
    write_runs(gun_folder, with_cell(gun_rows(), "valve_profile", text))
    refused(
        gun_folder,
        "runs.csv: row 2, column 'valve_profile'",
        repr(text),
        "expected points TIME:POSITION",
    )
