"""Many shots foretold: each as it would be alone, whoever works, and every slip in a table named with its row."""

from __future__ import annotations

import csv
import json

import pandas as pd
import pytest
from click.testing import CliRunner
from pyroshock.app.cli.main import main
from pyroshock.app.predict.batch import assumed, rows_of_file
from pyroshock.app.predict.cli import predict

TABLE = """run,repetition,tip_material,tip_radius_mm,bullet_mass_kg,tank_pressure_bar,anvil_material
1,1,steel,45,0.5,2,none
1,2,aluminum,30,0.5,1.5,steel
2,1,PLA,60,1,3,none
"""
#: The same shots, one by one.
ALONE = (
    "--tip steel --tip-radius 45mm --bullet-mass 0.5kg --tank-pressure 2bar",
    "--tip aluminum --tip-radius 30mm --bullet-mass 0.5kg --tank-pressure 1.5bar --anvil steel",
    "--tip PLA --tip-radius 60mm --bullet-mass 1kg --tank-pressure 3bar",
)


@pytest.fixture
def lab(quick_twins):
    """A folder with the table."""
    (quick_twins / "shots.csv").write_text(TABLE, encoding="utf-8")
    return quick_twins


def run(*words, refused=False):
    result = CliRunner().invoke(main, ["predict", *words])
    assert result.exit_code == (2 if refused else 0), result.output
    return result.stderr if refused else result.stdout


def test_every_row_is_what_predict_says_of_it_alone(lab):
    many = json.loads(run("--shots", "shots.csv", "--json"))
    for row, words in zip(many, ALONE, strict=True):
        alone = json.loads(CliRunner().invoke(predict, [*words.split(), "--json"]).stdout)
        for name in ("velocity_m_s", "contact_time_s", "peak_force_n", "impulse_n_s"):
            assert row[f"predicted_{name}"] == alone[name]["mean"]
            assert [row[f"predicted_{name}_low"], row[f"predicted_{name}_high"]] == alone[name]["ci90"]
        sensor = row["srs"][0]["sensor"]
        means = [line["mean_m_s2"] for line in row["srs"] if line["sensor"] == sensor]
        assert means == alone["srs"][sensor]["mean"]


def test_two_processes_write_the_same_files_as_one(lab):
    for jobs in ("1", "2"):
        run("--shots", "shots.csv", "--jobs", jobs, "--out", f"{jobs}.csv", "--spectra", f"{jobs}s.csv", "--draws", "8")
    assert (lab / "1.csv").read_bytes() == (lab / "2.csv").read_bytes()
    assert (lab / "1s.csv").read_bytes() == (lab / "2s.csv").read_bytes()
    rows = list(csv.DictReader((lab / "1.csv").read_text().splitlines()))
    assert [(row["run"], row["repetition"]) for row in rows] == [("1", "1"), ("1", "2"), ("2", "1")]
    run("--shots", "shots.csv", "--out", "shots.parquet", "--draws", "4")
    table = pd.read_parquet("shots.parquet")
    assert table["run"].tolist() == [1, 1, 2]
    assert (table["predicted_peak_force_n_low"] < table["predicted_peak_force_n_high"]).all()


def test_plan_is_predicted_with_the_plates_that_its_runs_name(lab, tmp_path):
    CliRunner().invoke(main, ["init"])
    made = CliRunner().invoke(main, ["plan", "lhs", "spring", "--runs", "4", "--seed", "1"])
    assert made.exit_code == 0, made.output
    rows = json.loads(run("--plan", "spring", "--draws", "2", "--json"))
    assert [row["run"] for row in rows] == [1, 2, 3, 4]
    assert all(row["predicted_velocity_m_s"] > 0 for row in rows)


def test_what_the_table_does_not_say_is_told(lab):
    (lab / "short.csv").write_text("run,tank_pressure_bar\n1,2\n")
    told = assumed(rows_of_file(lab / "short.csv"), 0.5)
    assert "no column bullet_mass_kg: 0.5" in told
    assert not any("tank_pressure" in line for line in told)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("run,tip_material\n1,steel\n", "run 1: expected tank_pressure_bar or impact_velocity_m_s"),
        ("run,tank_pressure_bar,impact_velocity_m_s\n7,2,3\n", "run 7: expected tank_pressure_bar or"),
        ("run,tank_pressure_bar\n3,much\n", "run 3: tank_pressure_bar is 'much'; expected a number"),
        ("run,tank_pressure_bar,tip_material\n1,2,steel\n2,2,butter\n", "run 2: no material 'butter'"),
        ("run,tank_pressure_bar\n", "has no row to predict"),
    ],
)
def test_slip_in_a_table_is_one_line_with_its_run(lab, table, message):
    (lab / "wrong.csv").write_text(table, encoding="utf-8")
    assert message in run("--shots", "wrong.csv", "--draws", "2", refused=True)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--shots", "shots.csv", "--plan", "spring"), "--plan and --shots: expected one of them"),
        (("--plan", "spring"), "no plan 'spring': there is no store"),
        (("--shots", "shots.csv", "--tip", "steel"), "--tip: of one shot"),
        (("--out", "x.csv"), "--out and --spectra go with --plan or --shots"),
        (("--shots", "shots.csv", "--out", "x.txt", "--draws", "2"), "a name that ends in .csv or .parquet or .json"),
    ],
)
def test_options_that_do_not_go_together_are_refused(lab, words, message):
    assert message in run(*words, refused=True)
