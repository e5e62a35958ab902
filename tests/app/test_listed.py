"""`--sort`, `--columns` and `--csv` of listings, and the columns of `export`."""

from __future__ import annotations

import csv
import json

import click
import pandas as pd
import pytest
from click.testing import CliRunner
from pyroshock.app.doors.command_line.listed import Listing, listing_options
from pyroshock.app.doors.command_line.main import main
from support.records.campaigns import hammer_campaign

ROWS = [
    {"name": "b", "force_n": 10.0, "of": ["x", "y"]},
    {"name": "a", "force_n": None, "of": []},
    {"name": "c", "force_n": 9.0, "extra": 1},
    {"name": "d", "force_n": float("nan")},
    {"name": "e", "force_n": -100},
]


@click.command()
@listing_options
def listing(listing: Listing) -> None:
    """One to try."""
    listing.show(ROWS, "nothing", lambda row: row | {"name": row["name"].upper()})


def shown(*words: str, code: int = 0) -> str:
    result = CliRunner().invoke(listing, list(words))
    assert result.exit_code == code, result.stderr
    return result.stdout


def order(*words: str) -> str:
    return "".join(row["name"] for row in csv.DictReader(shown(*words, "--csv").splitlines()))


@pytest.mark.parametrize(("words", "expected"), [
    (("--sort", "force_n"), "ecbad"),
    (("--sort", "-force_n"), "bcead"),
    (("--sort", "force_n", "--descending"), "bcead"),
    (("--sort", "-force_n", "--descending"), "ecbad"),
    (("--sort", "name", "--descending"), "edcba"),
    (("--sort", "extra"), "cbade"),
])  # fmt: skip
def test_numbers_sort_by_size_and_what_is_empty_is_last(words, expected):
    assert order(*words) == expected


@pytest.mark.parametrize(
    "words",
    [("--sort", "-forec_n"), ("--columns", "name,forec_n"), ("--sort", "forec_n", "--json")],
)
def test_an_unknown_column_lists_the_columns(words):
    result = CliRunner().invoke(listing, list(words))
    assert isinstance(result.exception, LookupError)
    assert str(result.exception) == "no column 'forec_n'; columns: name, force_n, of, extra"


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("--csv", "--json"), "exclude each other"),
        (("--descending",), "--descending goes with --sort"),
    ],
)
def test_options_that_do_not_go_together_are_refused(words, expected):
    result = CliRunner().invoke(listing, list(words))
    assert result.exit_code == 2 and expected in result.stderr


def test_rows_keep_their_order_or_are_sorted_and_columns_are_chosen():
    rows = [{"a": "9"}, {"a": 10}, {"a": "x"}, {"a": 9}]
    assert Listing(sort="a")._sorted(rows) == [{"a": 9}, {"a": 10}, {"a": "9"}, {"a": "x"}]
    assert [line[0] for line in shown().splitlines()] == ["n", *"BACDE"]
    assert shown("--columns", "force_n, name").splitlines()[:2] == [
        "force (kN)  name",
        "0.01        B",
    ]
    assert shown("--columns", "force_n,", "--columns", "name") == shown(
        "--columns", "force_n, name"
    )
    assert json.loads(shown("--columns", "name", "--sort", "-force_n", "--json"))[0] == {
        "name": "b"
    }
    assert shown("--columns", "name,force_n", "--csv").splitlines()[:3] == [
        "name,force_n",
        "b,10.0",
        "a,",
    ]
    header, first, *_ = csv.reader(shown("--csv").splitlines())
    assert header == ["name", "force_n", "of", "extra"] and first == ["b", "10.0", "x, y", ""]


#: Commands that list.
LISTINGS = (
    "campaigns", "campaigns list", "campaigns deleted", "runs list one", "impacts", "shots",
    "dataset", "dataset list",
    "plan", "plan list", "models", "models --promotions", "jobs", "materials",
)  # fmt: skip


@pytest.fixture(scope="module")
def store(tmp_path_factory) -> str:
    """Two hammer campaigns, of which the second has a free factor."""
    folder = tmp_path_factory.mktemp("listed")
    url = f"sqlite:///{folder / 'lab.db'}"
    first, second = (hammer_campaign(folder / name, name=name) for name in ("one", "two"))
    table = pd.read_csv(second / "runs.csv", dtype=str)
    table["room"] = "cellar"
    table.to_csv(second / "runs.csv", index=False)
    for words in ([str(first)], [str(second), "--free-factor", "room"]):
        result = CliRunner().invoke(main, ["ingest", *words, "--db", url, "--jobs", "1"])
        assert result.exit_code == 0, result.stderr
    return url


def run(*words: object) -> str:
    result = CliRunner().invoke(main, list(map(str, words)))
    assert result.exit_code == 0, (result.stderr, result.exception)
    return result.stdout


@pytest.mark.parametrize("command", LISTINGS)
def test_every_listing_prints_csv(store, command):
    printed = run(*command.split(), "--csv", "--db", store)
    listed = json.loads(run(*command.split(), "--json", "--db", store))
    rows = list(csv.DictReader(printed.splitlines()))
    assert len(rows) == len(listed) and all(
        set(row) == {name for listed_row in listed for name in listed_row} for row in rows
    )


def test_impacts_are_sorted_and_exported_with_chosen_columns(store, tmp_path):
    rows = json.loads(run("impacts", "--sort", "-peak_force_n", "--json", "--db", store))
    forces = [row["peak_force_n"] for row in rows]
    assert len(set(forces)) > 1 and forces == sorted(forces, reverse=True)
    result = CliRunner().invoke(main, ["impacts", "--sort", "speed", "--db", store])
    assert (result.exit_code, result.stderr.count("\n")) == (2, 1)
    assert result.stderr.startswith("pyroshock: no column 'speed'; columns: id, campaign, run")
    words = [
        "export",
        "impacts",
        "--db",
        store,
        "--out",
        str(tmp_path / "x.csv"),
        "--columns",
        "id,speed",
    ]
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 2 and "no column 'speed'; columns: id, campaign" in result.stderr
    assert list(tmp_path.iterdir()) == []
    run(
        "export",
        "impacts",
        "--db",
        store,
        "--out",
        tmp_path / "x.json",
        "--columns",
        "peak_force_n,id",
    )
    rows = json.loads((tmp_path / "x.json").read_text(encoding="utf-8"))
    assert list(rows[0]) == ["peak_force_n", "id"]
    assert rows == json.loads(
        run("impacts", "--columns", "peak_force_n,id", "--json", "--db", store)
    )


@pytest.mark.parametrize("what", ["impacts", "pulses"])
def test_export_has_no_factor_of_other_campaigns(store, tmp_path, what):
    def columns(*words: str) -> list[str]:
        run("export", what, "--db", store, "--out", tmp_path / "x.csv", *words)
        return list(pd.read_csv(tmp_path / "x.csv").columns)

    assert "room" in columns() and "room" in columns("--campaign", "two")
    assert "room" not in columns("--campaign", "one") and "room" not in columns(
        "--where", "campaign=one"
    )
    assert "peak_acceleration_m_s2" not in columns("--campaign", "one")
