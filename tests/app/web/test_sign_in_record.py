"""Sign-ins, those that failed and sign-outs have rows in the audit trail, without what people sign
in with, and so few that nobody fills the store by guessing."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pyroshock.app.operations.people.stored_users import add_user
from pyroshock.app.server.application import application
from pyroshock.app.web import sign_in_attempts
from pyroshock.app.web.settings import Settings
from pyroshock.app.web.sign_in_record import ROWS_AN_HOUR, SignInRecord
from pyroshock.schema.audit import AuditRow
from pyroshock.schema.session import Store, Writer, open_store
from sqlalchemy import select
from starlette.testclient import TestClient
from support.processes.web_client import ADDRESS, sqlite, token_in

WORD, PASSWORD, WRONG = "a-token-of-enough-characters", "four quiet grey herons", "hunter2hunter2"
HTML = {"accept": "text/html"}


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    with open_store(sqlite(tmp_path), Writer("test", "0"), create=True) as opened:
        with opened.writing() as session:
            add_user(session, "emma", "engineer", PASSWORD)
        yield opened


@pytest.fixture
def browser(store: Store) -> TestClient:
    url = store.engine.url.render_as_string()
    app = application(Settings(url, host="0.0.0.0", token=WORD, works=False), store)
    return TestClient(app, base_url=ADDRESS, follow_redirects=False, client=("192.0.2.7", 50_000))


def sign_in(browser: TestClient, **values: str) -> int:
    form = browser.get("/sign-in", headers=HTML).text
    sent = {"csrf": token_in(form), **values}
    return int(browser.post("/sign-in", data=sent).status_code)


def rows(store: Store) -> list[tuple[Any, ...]]:
    columns = (AuditRow.person, AuditRow.person_kind, AuditRow.operation, AuditRow.subject)
    query = select(*columns, AuditRow.outcome, AuditRow.request).order_by(AuditRow.id)
    with store.reading() as session:
        return [tuple(row) for row in session.execute(query)]


def test_a_sign_in_and_a_sign_out_have_their_rows(browser: TestClient, store: Store) -> None:
    assert sign_in(browser, name="emma", password=PASSWORD) == 303
    form = browser.get("/jobs", headers=HTML).text
    assert browser.post("/sign-out/all", data={"csrf": token_in(form)}).status_code == 303
    here = {"from": "192.0.2.7"}
    assert rows(store) == [
        ("emma", "user", "sign-in", "", "done", {"method": "password", **here}),
        ("emma", "user", "sign-out", "", "done", {"all_devices": True, **here}),
    ]


def test_the_servers_token_has_its_rows(browser: TestClient, store: Store) -> None:
    assert sign_in(browser, token=WORD) == 303
    browser.get(f"/jobs?token={WORD}")
    form = browser.get("/jobs", headers=HTML).text
    browser.post("/sign-out", data={"csrf": token_in(form)})
    assert [row[:3] for row in rows(store)] == [
        ("token", "token", "sign-in"), ("token", "token", "sign-in"),
        ("token", "token", "sign-out"),
    ]  # fmt: skip


def test_a_failed_sign_in_names_the_user_who_was_tried_and_nobody_else(
    browser: TestClient, store: Store
) -> None:
    """Who typed a password into the field of the name finds it nowhere."""
    assert sign_in(browser, name="emma", password=WRONG) == 401
    assert sign_in(browser, name=PASSWORD, password=WRONG) == 401
    browser.get("/api/campaigns", headers={"authorization": f"Bearer {WRONG}"})
    failed = rows(store)
    assert [row[:5] for row in failed] == [
        ("nobody", "local", "sign-in", "emma", "failed"),
        ("nobody", "local", "sign-in", "", "failed"),
        ("nobody", "local", "sign-in", "", "failed"),
    ]
    assert [row[5]["method"] for row in failed] == ["password", "password", "token"]
    with store.engine.connect() as connection:
        dump = "\n".join(connection.connection.driver_connection.iterdump())
    assert WRONG not in dump and PASSWORD not in dump


def test_requests_of_a_session_or_a_right_token_have_none(
    browser: TestClient, store: Store
) -> None:
    for _ in range(3):
        browser.get("/api/campaigns", headers={"authorization": f"Bearer {WORD}"})
        browser.get("/api/campaigns")
    assert rows(store) == []


def test_who_guesses_fills_no_store(
    store: Store, browser: TestClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From ever new addresses, so that no address waits."""
    monkeypatch.setattr(sign_in_attempts, "FREE", 10**9)
    for number in range(ROWS_AN_HOUR + 40):
        bearer = {"authorization": f"Bearer wrong-{number}"}
        assert browser.get("/api/campaigns", headers=bearer).status_code in (401, 429)
    assert len(rows(store)) <= ROWS_AN_HOUR


def test_those_without_a_row_are_counted_in_the_next(store: Store) -> None:
    now = [0.0]
    record = SignInRecord(store, lambda: now[0])
    for _ in range(ROWS_AN_HOUR + 40):
        record.failed("192.0.2.7", "password")
    assert len(rows(store)) == ROWS_AN_HOUR
    now[0] = 3600.0
    record.failed("192.0.2.7", "password")
    record.failed("192.0.2.7", "password")
    counted = [row[5].get("failed_before_without_a_row") for row in rows(store)[-2:]]
    assert counted == [40, None]


def test_a_store_that_takes_no_rows_lets_people_in(
    browser: TestClient, store: Store, caplog: pytest.LogCaptureFixture
) -> None:
    with store.engine.begin() as connection:
        connection.exec_driver_sql(
            "CREATE TRIGGER full BEFORE INSERT ON audit_rows BEGIN "
            "SELECT RAISE(ABORT, 'the disk is full'); END"
        )
    assert sign_in(browser, name="emma", password=PASSWORD) == 303
    assert "has no row in the audit trail" in caplog.text


def test_engineers_read_them(browser: TestClient) -> None:
    sign_in(browser, name="emma", password=PASSWORD)
    answer = browser.get("/api/audit?operation=sign-in").json()
    assert [(row["person"], json.dumps(row["request"])) for row in answer] == [
        ("emma", '{"method": "password", "from": "192.0.2.7"}')
    ]
    assert "sign-in" in browser.get("/audit", headers=HTML).text
