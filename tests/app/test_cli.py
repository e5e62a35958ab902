"""The command line as scripts rely on it: JSON and nothing else, exit codes, one line per error;
and `calibrate`."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from pyroshock import __version__
from pyroshock.app.common.filters import parse_where
from pyroshock.app.doors.command_line.main import main
from pyroshock.app.operations.command_words import COMMANDS
from pyroshock.schema.listings import Condition
from support.records.campaigns import (
    blows,
    force_record,
    hammer_campaign,
    recording_name,
    write_recording,
)

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.fixture(scope="module")
def filled(tmp_path_factory):
    """A store with the shipped shots and a hammer campaign of two recordings; tests only read
    it."""
    folder = tmp_path_factory.mktemp("cli")
    url, campaign = f"sqlite:///{folder / 'x.db'}", hammer_campaign(folder / "hammer")
    result = CliRunner().invoke(
        main, ["ingest", str(campaign), str(EXAMPLES / "first-shots"), "--db", url, "--jobs", "1"]
    )
    assert result.exit_code == 0, result.stderr
    return url


def run(*words: object, code: int = 0):
    result = CliRunner().invoke(main, [str(word) for word in words])
    assert result.exit_code == code, (result.output, result.stderr, result.exception)
    return result


def json_of(*words: object):
    return json.loads(run(*words, "--json").stdout)


def test_every_command_has_help_and_ingest_prints_the_contract(tmp_path):
    for name in COMMANDS:
        text = run(name, "--help").output
        assert "Example:" in text or name == "db", name
    assert "Example:" in run("db", "upgrade", "--help").output
    words = (EXAMPLES / "first-shots", "--db", f"sqlite:///{tmp_path}/x.db")
    none = {"recordings": 0, "impacts": 0, "set_aside": [], "findings": []}
    assert json_of("ingest", *words) == {"campaign": "first-shots", "shots": 5, **none}
    assert json.loads(run("ingest", "--json", *words).stdout)["campaign"] == "first-shots"


def test_json_goes_to_a_file_and_listings_have_the_contracts_keys(filled, tmp_path):
    assert run("campaigns", "--db", filled, "--json", tmp_path / "c.json").stdout == ""
    assert {c["name"] for c in json.loads((tmp_path / "c.json").read_text())} == {
        "hammer",
        "first-shots",
    }
    campaign = json_of("campaigns", "--db", filled)[0]
    assert list(campaign) == ["name", "kind", "date", "impacts", "shots", "planned", "done"]
    row = json_of("impacts", "--db", filled)[0]
    expected = {
        "id",
        "campaign",
        "run",
        "repetition",
        "impact_velocity_m_s",
        "contact_time_s",
        "peak_force_n",
    }
    assert expected | {"impulse_n_s", "compression_time_s", "quality", "tip_material"} <= set(row)
    rows = json_of("shots", "--db", filled, "--campaign", "first-shots")
    expected = {"id", "campaign", "run", "repetition", "tank_pressure_pa", "bullet_mass_kg"}
    assert set(rows[0]) == expected | {
        "measured_velocity_m_s",
        "measured_velocity_u_m_s",
        "predicted_velocity_m_s",
    }
    assert [row["tank_pressure_pa"] for row in rows] == pytest.approx(
        [23190, 26510, 61580, 40420, 57840]
    )


@pytest.mark.parametrize(("words", "said"), [
    (("plann",), "No such command 'plann'; did you mean plan, plans?"),
    (("qqq",), "No such command 'qqq'; pyroshock --help lists them"),
    (("plan", "show"),
     "No such command 'show'; augment, box-behnken, central-composite, decide, discard,"),
])  # fmt: skip
def test_unknown_command_is_told_which_there_are(words, said):
    assert run(*words, code=2).stderr.startswith(f"pyroshock: {said}")


@pytest.mark.parametrize(
    ("where", "runs"),
    [
        ("tank_pressure_bar=0.6158", [3]),
        ("tank_pressure_pa>50000", [3, 5]),
        ("measured_velocity_m_s<=11", [1]),
    ],
)
def test_where_filters_in_the_labs_units_and_in_si(filled, where, runs):
    rows = json_of("shots", "--db", filled, "--campaign", "first-shots", "--where", where)
    assert [row["run"] for row in rows] == runs


@pytest.mark.parametrize(("text", "condition"), [
    ("tip_material=steel", Condition("tip_material", "=", "steel")),
    ("tip_radius_mm = 45", Condition("tip_radius", "=", 0.045)),
    ("peak_force_n>=1e3", Condition("peak_force_n", ">=", 1000.0)),
    ("peak_force>1kN", Condition("peak_force_n", ">", 1000.0)),
    ("peak force (kN) > 1 kN", Condition("peak_force_n", ">", 1000.0)),
    ("peak_force_n>1kN", Condition("peak_force_n", ">", 1000.0)),
    ("contact time<=0.5ms", Condition("contact_time_s", "<=", 0.0005)),
    ("tank_pressure<=1.5bar", Condition("tank_pressure", "<=", 150000.0)),
    ("tip radius=45mm", Condition("tip_radius", "=", 0.045)),
    ("note!=a=b", Condition("note", "!=", "a=b")),
    ("campaign=2024", Condition("campaign", "=", "2024")),
])  # fmt: skip
def test_condition_is_parsed(text, condition):
    assert parse_where((text,)) == (condition,)


@pytest.mark.parametrize(("text", "meant"), [
    ("peak_force>1", "1kN"), ("tank_pressure<=1.5", "1.5bar"), ("tip radius=45", "45mm"),
])  # fmt: skip
def test_condition_without_a_unit_in_field_or_value_is_refused_with_the_one_that_was_meant(
    text, meant
):
    with pytest.raises(ValueError, match=f"expected a number with a unit: did you mean {meant}"):
        parse_where((text,))


@pytest.mark.parametrize("columns", ["peak_force_n", "peak_force", "peak force", "peak force (kN)"])
def test_columns_are_named_by_their_key_or_the_words_of_their_heading(filled, columns):
    listed = run("impacts", "--db", filled, "--columns", columns, "--sort", f"-{columns}").stdout
    assert listed.startswith("peak force (kN)")


@pytest.mark.parametrize("text", ["", "steel", "=steel", "tip_material=", "peak_force_n>many"])
def test_condition_that_is_none_is_refused(filled, text):
    result = run("impacts", "--db", filled, "--where", text, code=2)
    assert len(result.stderr.strip().splitlines()) == 1 and repr(text) in result.stderr


def test_condition_that_nothing_matches_is_answered_with_what_the_store_has(filled):
    printed = run(
        "impacts", "--db", filled, "--where", "tip_material=cheese", "--where", "run=1"
    ).stdout
    levels = {row["tip_material"] for row in json_of("impacts", "--db", filled)}
    assert printed.startswith("no impacts match; the store has tip material ")
    assert set(printed.strip().split("tip material ")[1].split(", ")) >= levels


@pytest.mark.parametrize("words", [
    ["impacts", "--db", "sqlite:///nowhere.db"],
    ["impacts", "--db", "nonsense"],
    ["impacts", "--limit", "0"],
    ["ingest"],
    ["ingest", "/no/such/folder"],
    ["nothing"],
    ["--nothing"],
    ["show"],
    ["export", "impacts"],
], ids=" ".join)  # fmt: skip
def test_error_is_one_line_and_exit_code_2(tmp_path, monkeypatch, words):
    monkeypatch.chdir(tmp_path)
    result = run(*words, code=2)
    assert result.stdout == "" and len(result.stderr.strip().splitlines()) == 1
    assert result.stderr.startswith("pyroshock: ")


@pytest.mark.parametrize("suffix", ["csv", "parquet"])
@pytest.mark.parametrize("what", ["impacts", "shots", "pulses", "series"])
def test_export_holds_what_the_store_holds(filled, tmp_path, what, suffix):
    import pandas as pd

    out = tmp_path / f"x.{suffix}"
    run(
        "export",
        what,
        "--db",
        filled,
        "--out",
        out,
        *(["--campaign", "hammer"] if what != "shots" else []),
    )
    table = pd.read_csv(out) if suffix == "csv" else pd.read_parquet(out)
    if what == "series":
        assert set(table.columns) == {"campaign", "recording", "channel", "time_s", "value", "unit"}
        assert table.groupby("recording").size().nunique() == 1
        return
    rows = json_of("shots" if what == "shots" else "impacts", "--db", filled)
    rows = [row for row in rows if what == "shots" or row["campaign"] == "hammer"]
    assert table["id"].tolist() == [row["id"] for row in rows]
    key = "measured_velocity_m_s" if what == "shots" else "peak_force_n"
    assert table[key].tolist() == [row[key] for row in rows]
    assert (
        what != "pulses" or [c for c in table.columns if c.startswith("force_")][-1] == "force_20_n"
    )
    assert not list(tmp_path.glob("*.part"))


def test_exported_series_is_the_recording(filled, tmp_path):
    import pandas as pd
    from pyroshock.ingest.readers import open_recording

    recording, out = recording_name(1), tmp_path / "s.parquet"
    run(
        "export",
        "series",
        "--db",
        filled,
        "--campaign",
        "hammer",
        "--recording",
        recording,
        "--out",
        out,
    )
    table = pd.read_parquet(out)
    with open_recording(hammer_campaign(tmp_path / "again") / recording) as source:
        expected = source.read("force").astype(float)
    np.testing.assert_array_equal(table[table["channel"] == "force"]["value"], expected)


def test_show_tells_versions_and_draws_what_it_can(filled, tmp_path):
    page = json_of("show", 1, "--db", filled)
    assert page["pulses"][0]["in_use"] == "yes" and page["pulses"][0]["written_by"].startswith(
        f"{__version__}: "
    )
    assert page["channels"][0]["channel"] == "force"
    run("show", 1, "--db", filled, "--plot", tmp_path / "x.png")
    assert (tmp_path / "x.png").read_bytes().startswith(b"\x89PNG")
    assert "'x.doc'" in run("show", 1, "--db", filled, "--plot", tmp_path / "x.doc", code=2).stderr


def test_a_finding_says_of_which_channel_it_is(sqlite_url, tmp_path):
    """Of two accelerometers one never moves: its name stands with the finding, wherever findings
    are told."""
    folder = hammer_campaign(tmp_path / "h", 1)
    toml = folder / "campaign.toml"
    more = "".join(
        f'[channels.{name}]\nquantity = "acceleration"\nunit = "m/s2"\n' for name in ("a1", "a2")
    )
    toml.write_text(toml.read_text() + more)
    force = force_record(blows(1, 2), np.random.default_rng(1))
    write_recording(
        folder / recording_name(1),
        {"force": force, "a1": force / 10, "a2": np.full(force.size, 2.5)},
    )
    told = run("ingest", folder, "--db", sqlite_url, "--jobs", "1", "--json")
    assert "reject: dropouts (1) of a2" in told.stderr
    assert [
        f["channel"] for f in json.loads(told.stdout)["findings"] if f["check"] == "dropouts"
    ] == ["a2"]
    page = json_of("show", 1, "--db", sqlite_url)
    assert [f["channel"] for f in page["findings"] if f["check"] == "dropouts"] == ["a2"]
    line = next(
        x for x in run("show", 1, "--db", sqlite_url).stdout.splitlines() if "never moves" in x
    )
    assert line.split()[:3] == ["reject", "dropouts", "a2"]


def test_material_is_added_once_and_extract_keeps_the_old_version(tmp_path):
    url = f"sqlite:///{tmp_path}/x.db"
    run("init", "--db", url)
    words = [
        "materials",
        "add",
        "titanium",
        "--youngs-modulus",
        "114GPa",
        "--poisson-ratio",
        "0.34",
    ]
    words += [
        "--density",
        "4430kg/m3",
        "--yield-strength",
        "880MPa",
        "--source",
        "data sheet",
        "--db",
        url,
    ]
    bare = [word.removesuffix("GPa") for word in words]
    assert "'114'; expected a number with a unit: did you mean 114GPa?" in run(*bare, code=2).stderr
    run(*words)
    found = next(m for m in json_of("materials", "--db", url) if m["name"] == "titanium")
    assert (found["youngs_modulus_pa"], found["density_kg_m3"]) == (114e9, 4430.0)
    assert "known already" in run(*words, code=2).stderr
    url, campaign = f"sqlite:///{tmp_path}/x.db", hammer_campaign(tmp_path / "hammer")
    count = json_of("ingest", campaign, "--db", url)["impacts"]
    before = json_of("impacts", "--db", url)
    changed = json_of("extract", "hammer", "--segmentation", "mask", "--db", url)
    assert changed == {
        "campaign": "hammer",
        "added": count,
        "reused": 0,
        "measured": 0,
        "skipped": [],
    }
    after = json_of("impacts", "--db", url)
    assert all(
        a["contact_time_s"] < b["contact_time_s"] for a, b in zip(after, before, strict=True)
    )
    page = json_of("show", before[0]["id"], "--db", url)
    assert [(p["segmentation"], p["in_use"]) for p in page["pulses"]] == [
        ("walk", "no"),
        ("mask", "yes"),
    ]
    assert (
        json_of("extract", "hammer", "--db", url)["reused"] == count
        and json_of("impacts", "--db", url) == before
    )


def test_closed_pipe_is_no_error(filled):
    code = "from pyroshock.app.doors.command_line.main import main; main()"
    with subprocess.Popen(
        [sys.executable, "-c", code, "impacts", "--db", filled, "--json"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    ) as process:
        assert process.stdout is not None and process.stderr is not None
        process.stdout.close()
        assert b"Traceback" not in process.stderr.read()


# --- `calibrate`: a table of points to what campaign.toml takes ---
BAR = [0.0, 1.0, 2.0, 3.0, 4.0]
VOLT = [0.3626, 0.9248, 1.4862, 2.0491, 2.6105]


@pytest.fixture
def points(tmp_path):
    path = tmp_path / "transducer.csv"
    rows = [f"{bar},{volt}" for bar, volt in zip(BAR, VOLT, strict=True)]
    path.write_text("\n".join(["reference,reading_v", *rows, ""]), encoding="utf-8")
    return path


def test_json_has_the_line_and_its_uncertainty_and_text_a_table_for_campaign_toml(points):
    words = ["calibrate", str(points), "--date", "2026-03-02", "--common-u", "5mbar", "--json"]
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 0, result.stderr
    data = json.loads(result.stdout)
    (slope, offset), covariance = np.polyfit(BAR, VOLT, 1, cov=True)
    assert (data["sensitivity_v_per_unit"], data["offset_v"]) == pytest.approx((slope, offset))
    assert data["sensitivity_u_v_per_unit"] ** 2 == pytest.approx(covariance[0, 0])
    assert data["common_u"] == pytest.approx(0.005)
    assert data["points"][2]["residual"] == pytest.approx((1.4862 - offset) / slope - 2.0)
    words = [
        "calibrate",
        str(points),
        "--date",
        "2026-03-02",
        "--common-u",
        "5mbar",
        "--reading-u",
        "1mV",
    ]
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 0, result.stderr
    table = tomllib.loads(result.stdout[result.stdout.index("[channels") :])
    calibration = table["channels"]["tank_pressure"]["calibration"]
    assert calibration["file"] == "transducer.csv"
    assert (calibration["common_u"], calibration["reading_u_v"]) == (0.005, 0.001)
    assert str(calibration["date"]) == "2026-03-02"


@pytest.mark.parametrize(("words", "message"), [
    (["--unit", "kg"], "kg"),
    (["--common-u", "5"], "--common-u is '5'; expected a number with a unit"),
    (["--date", "March"], "--date is 'March'; expected a day such as 2026-03-02"),
])  # fmt: skip
def test_what_cannot_be_is_one_line(points, words, message):
    result = CliRunner().invoke(main, ["calibrate", str(points), *words])
    assert result.exit_code == 2 and message in result.stderr
