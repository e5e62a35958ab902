"""`query`: reads whatever SQL can say, and changes nothing, whatever is tried; on either engine."""

from __future__ import annotations

import json
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from click.testing import CliRunner
from pyroshock.app.doors.command_line.main import main
from pyroshock.app.operations.store.query import QueryError, Statement, list_columns, unit_of
from pyroshock.app.operations.store.question import USUAL_ROWS
from pyroshock.schema.session import Writer, count_rows, open_store
from support.processes.web_client import post_json, window
from support.records.campaigns import hammer_campaign

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


@pytest.fixture(scope="module")
def store(new_database, tmp_path_factory) -> str:
    """The shipped shots and a hammer campaign; tests only read it, or try to change it."""
    url = new_database()
    hammer = hammer_campaign(tmp_path_factory.mktemp("query") / "hammer")
    words = ["ingest", str(hammer), str(EXAMPLES / "first-shots"), "--db", url, "--jobs", "1"]
    assert CliRunner().invoke(main, ["init", "--db", url]).exit_code == 0
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 0, result.stderr
    return url


def query(url: str, *words: object, code: int = 0):
    result = CliRunner().invoke(main, ["query", *map(str, words), "--db", url])
    assert result.exit_code == code, (result.output, result.stderr, result.exception)
    return result


def refused(url: str, *words: object) -> str:
    error = query(url, *words, code=2).stderr
    assert error.count("\n") == 1
    return error


def test_an_answer_is_a_table_or_the_same_rows_in_csv_and_json(store, tmp_path):
    lines = query(store, "select name, kind from campaigns order by name").stdout.splitlines()
    assert lines == ["name         kind", "first-shots  gun", "hammer       hammer"]
    sql = "select id, peak_force_n from pulses order by id"
    rows = json.loads(query(store, sql, "--json").stdout)
    (tmp_path / "x.csv").write_text(query(store, sql, "--csv").stdout, encoding="utf-8")
    assert len(rows) > 1 and pd.read_csv(tmp_path / "x.csv").to_dict("records") == rows

    def row(*words):
        (row,) = json.loads(query(store, *words, "--json").stdout)
        return row

    frame = row("select frame from series_chunks limit 1")["frame"]
    assert (
        frame.startswith("<")
        and frame.endswith(" bytes>")
        and row("select 1 as a, 2 as a") == {"a": 1, "a_2": 2}
    )
    sql = "select count(*) as n from shots where tank_pressure_pa > :low and run <= :last"
    assert row(sql, "-p", "low", "1.5e4", "-p", "last", "3")["n"] == 3
    assert query(store, "select id from shots", "--limit", "2", "--csv").stdout.count("\n") == 3


READERS: dict[str, Any] = {"csv": pd.read_csv, "json": pd.read_json, "parquet": pd.read_parquet}


@pytest.mark.parametrize("ending", ["csv", "json", "parquet"])
def test_a_file_holds_the_answer_also_one_without_rows(store, tmp_path, ending):
    out, sql = tmp_path / f"x.{ending}", "select run, tank_pressure_pa from shots order by run"
    query(store, sql, "--out", out)
    expected = [row["tank_pressure_pa"] for row in json.loads(query(store, sql, "--json").stdout)]
    assert list(READERS[ending](out)["tank_pressure_pa"]) == pytest.approx(expected)
    query(
        store,
        "select id, name from campaigns where name = 'none'",
        "--out",
        tmp_path / f"none.{ending}",
    )
    assert len(READERS[ending](tmp_path / f"none.{ending}")) == 0


@pytest.mark.parametrize("name", ["first-shots", "x' or '1'='1", "x'; drop table shots; --"])
def test_parameters_are_bound(store, name):
    sql = "select count(*) as n from campaigns where name = :campaign and ':other' <> ''"
    (row,) = json.loads(query(store, sql, "-p", "campaign", name, "--json").stdout)
    assert row["n"] == (name == "first-shots")


@pytest.mark.parametrize("sql", [
    "delete from shots",
    "insert into factors (name) values ('x')",
    "update shots set run = 9",
    "drop table shots",
    "create table x (a int)",
    "attach 'other.db' as other",
    "pragma query_only = off",
    "vacuum into 'copy.db'",
    "begin; delete from shots",
    "with gone as (select 1) delete from shots",
    "with gone as (delete from shots returning id) select * from gone",
    "select 1; delete from shots",
    "select 1; commit; delete from shots",
    "select set_config('transaction_read_only', 'off', true); delete from shots",
    "/* select */ delete from shots",
    "select load_extension('x')",
])  # fmt: skip
def test_nothing_is_changed(store, sql, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def rows() -> dict[str, int]:
        with open_store(store, Writer("test", "0")) as opened:
            return count_rows(opened)

    before = rows()
    refused(store, sql)
    assert rows() == before and not list(tmp_path.iterdir())


@pytest.mark.parametrize(("words", "expected"), [
    (("delete from impacts",), "pyroshock runs discard"),
    (("with a as (select 1) insert into factors (name) select 'x'",), "pyroshock ingest"),
    (("select set_config('transaction_read_only', 'off', true)",), ""),
    (("select * from impact",),
     "no table 'impact' in the store; tables: attached_contents, attached_pieces,"),
    (("select p.peak_force from pulses p",),
     "no column 'peak_force' in pulses; did you mean peak_force_n"),
    (("with recursive n(i) as (select 1 union all select i + 1 from n where i > 0) "
      "select max(i / 1000000) from n",
      "--timeout", "200ms"), "longer than 0.2 s"),
    (("select :a",), "no value for :a"),
    (("select 1", "-p", "a", "1"), "the statement has no :a"),
    (("",), "the statement is empty"),
    (("select 1", "--out", "x.txt"), "expected a name that ends in .csv or .parquet or .json"),
    (("select 1", "--out", "x.csv", "--json"), "--out x.csv does not end in .json"),
    (("select 1", "--timeout", "0s"), "more than 0s"),
    (("select from where",), "the statement cannot be run"),
    (("--schema", "shot"), "did you mean shots"),
    ((), 'give one statement ("select ...")'),
    (("select 1", "--tables"), "give one statement"),
])  # fmt: skip
def test_what_cannot_be_asked_is_one_line(store, words, expected, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert expected in refused(store, *words)


def test_tables_and_columns_are_listed_with_the_units_of_their_names(store):
    tables = {
        row["table"]: row["a row is"]
        for row in json.loads(query(store, "--tables", "--json").stdout)
    }
    assert tables["shots"] == "One firing"
    columns = {
        row["column"]: row["unit"]
        for row in json.loads(query(store, "--schema", "shots", "--json").stdout)
    }
    assert columns["tank_pressure_pa"] == "Pa" and columns["run"] is None
    assert {row["column"]: row for row in list_columns("pulses")}["impact_id"][
        "refers to"
    ] == "impacts.id"
    units = {
        "peak_acceleration_m_s2": "m/s²",
        "impulse_n_s": "N s",
        "velocity_m_s": "m/s",
        "contact_time_s": "s",
    }
    units |= {"density_kg_m3": "kg/m³", "status": None, "samples": None}
    assert {column: unit_of(column) for column in units} == units


def test_colons_in_text_are_no_parameters_and_a_read_only_file_is_asked_too(tmp_path):
    statement = Statement(
        "select ':a', b::text, \":c\" -- :d\n, :e /* :f */ where :e > :g", {"e": "1", "g": "007"}
    )
    assert statement.names() == ["e", "g"]
    bound = "select ':a', b::text, \":c\" -- :d\n, $1 /* :f */ where $1 > $2"
    assert statement.for_postgresql() == (bound, ["1", "007"]) and statement.for_sqlite()[1] == {
        "e": 1,
        "g": "007",
    }
    with pytest.raises(QueryError, match="DELETE is refused"):  # a comment begins no statement
        Statement("-- select\ndelete from shots", {}).check()
    # A file of another user, or on a disk that is mounted read-only, has no write-ahead log to be
    # made.
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    assert CliRunner().invoke(main, ["init", "--db", url]).exit_code == 0
    before = (tmp_path / "lab.db").read_bytes()
    query(url, "select count(*) from materials")
    assert (tmp_path / "lab.db").read_bytes() == before


def test_a_large_answer_does_not_fill_memory(tmp_path):
    """Ten times the rows to CSV take no more memory."""
    import tracemalloc

    from pyroshock.app.common.table_files import write_batches
    from pyroshock.app.operations.store.query import run_statement
    from pyroshock.schema.engine import make_engine

    url = f"sqlite:///{tmp_path / 'numbers.db'}"
    with closing(sqlite3.connect(tmp_path / "numbers.db")) as connection:
        connection.execute("create table numbers (a real)")
        connection.commit()
    sql = (
        "with recursive n(i) as (select 1 union all select i + 1 from n where i "
        "< :last) select i, i * 0.1 from n"
    )
    peaks = []
    for last in ("10000", "100000"):
        tracemalloc.start()
        with run_statement(make_engine(url), Statement(sql, {"last": last}), 60) as batches:
            assert write_batches(tmp_path / "x.csv", batches) == int(last)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < peaks[0] + 1e6


def test_over_a_network_rows_and_time_are_limited(tmp_path):
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    numbers = (
        "with recursive n(i) as (select 1 union all select i + 1 from n where i < 20000) "
        "select i from n"
    )
    with window(url) as (client, _):
        answers = [
            post_json(client, "/api/query", {"statement": numbers, **more})
            for more in ({}, {"limit": 12000}, {"limit": 200000}, {"timeout": 61})
        ]
        assert [answer.status_code for answer in answers] == [200, 200, 422, 422]
        assert [len(answer.json()) for answer in answers[:2]] == [USUAL_ROWS, 12000]
        assert "expected at most 60s over a network" in answers[3].json()["detail"]
        gone = post_json(client, "/api/query", {"statement": "delete from materials"})
        assert gone.status_code == 422 and "DELETE is refused" in gone.json()["detail"]
