"""PostgreSQL crashes and comes back in the midst of the work: it goes on by itself, or a repeat
completes it."""

from __future__ import annotations

import json
from collections.abc import Iterator

import pytest
from pyroshock.ingest.extraction.settings import ExtractionSettings
from pyroshock.ingest.load import ingest_folder
from sqlalchemy import event
from support.missing import skip_for_want_of
from support.processes.web_client import window
from support.records.campaigns import hammer_campaign
from support.stores.postgres_server import NoServerError, _Server, own_server
from support.stores.stores import assert_whole, content, ingested, opened, pyroshock

HITS = 2


@pytest.fixture(scope="module")
def server() -> Iterator[_Server]:
    """A server that no other test works on."""
    try:
        with own_server() as found:
            yield found
    except NoServerError as error:
        skip_for_want_of("PostgreSQL", str(error))


@pytest.fixture
def url(server) -> str:
    """The server's database, without tables."""
    import psycopg

    plain = server.url.replace("postgresql+psycopg", "postgresql")
    with psycopg.connect(plain, autocommit=True) as connection:
        connection.execute("DROP SCHEMA public CASCADE")
        connection.execute("CREATE SCHEMA public")
    return str(server.url)


def crashed(server: _Server) -> None:
    server.stop()
    server.launch()


@pytest.fixture
def campaign(tmp_path):
    return hammer_campaign(tmp_path / "c", recordings=3, hits=HITS)


@pytest.fixture
def expected(tmp_path, campaign):
    usual = f"sqlite:///{tmp_path / 'usual.db'}"
    ingested(usual, campaign)
    return content(usual)


def crash_at_insert(server: _Server, store, table: str, number: int):
    """Crash the server in the transaction of the n-th statement that adds to this table, before the
    statement."""
    seen = [0]

    @event.listens_for(store.engine, "before_cursor_execute")
    def look(_connection, _cursor, statement, *_):
        seen[0] += statement.startswith(f"INSERT INTO {table}")
        if seen[0] == number and statement.startswith(f"INSERT INTO {table}"):
            crashed(server)

    return seen


@pytest.mark.parametrize(("table", "number"), [
    pytest.param("recordings", 1, marks=pytest.mark.slow),
    ("pulses", 2),
    pytest.param("impacts", 3, marks=pytest.mark.slow),
])  # fmt: skip
def test_ingest_goes_on_over_a_crash_in_mid_transaction(
    server, url, campaign, expected, table, number
):
    with opened(url, create=True) as store:
        seen = crash_at_insert(server, store, table, number)
        ingest_folder(store, campaign, ExtractionSettings(), jobs=1)
    assert seen[0] > number  # it was said again
    assert_whole(url, HITS)
    ingested(url, campaign)
    assert_whole(url, HITS)
    assert {name: rows for name, rows in content(url).items() if rows} == {
        name: rows for name, rows in expected.items() if rows
    }


def test_next_request_after_a_crash_is_answered(server, url, campaign):
    ingested(url, campaign)
    with window(url, works=False) as (client, _store):
        before = client.get("/api/campaigns").json()
        crashed(server)
        answer = client.get("/api/campaigns")
        assert (answer.status_code, answer.json()) == (200, before)


@pytest.mark.slow
def test_server_that_is_down_is_one_line(server, url, campaign):
    ingested(url, campaign)
    server.stop()
    try:
        refused = pyroshock("impacts", "--db", url)
    finally:
        server.launch()
    assert (refused.exit_code, refused.stderr.count("\n")) == (2, 1)
    assert len(json.loads(pyroshock("impacts", "--json", "--db", url).stdout)) == 6
