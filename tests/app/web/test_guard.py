"""What may pass to the application, and that what may not changes nothing."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from pyroshock.app.web.settings import Settings, SettingsError
from pyroshock.schema.session import Store, count_rows
from starlette.testclient import TestClient
from support.processes.web_client import post_json, sqlite, token, token_in, window

WORD = "a-token-of-enough-characters"


@pytest.fixture
def client(tmp_path: Path) -> Iterator[TestClient]:
    with window(sqlite(tmp_path)) as (client, _):
        yield client


@pytest.fixture
def guarded(tmp_path: Path) -> Iterator[TestClient]:
    """Reached from elsewhere, hence with a token."""
    with window(sqlite(tmp_path), host="0.0.0.0", token=WORD) as (client, _):
        yield client


@pytest.mark.parametrize("host", ["0.0.0.0", "192.168.1.5", "lab-server", "::"])
def test_an_address_that_others_reach_needs_a_token(host: str) -> None:
    with pytest.raises(SettingsError, match="token"):
        Settings("sqlite://", host)
    assert Settings("sqlite://", host, token=WORD).host == host


@pytest.mark.parametrize("host", ["127.0.0.1", "localhost", "::1", "127.0.0.9"])
def test_loopback_needs_none(host: str) -> None:
    assert Settings("sqlite://", host).token is None


def test_a_short_token_is_refused() -> None:
    with pytest.raises(SettingsError, match="5 characters"):
        Settings("sqlite://", token="12345")


@pytest.mark.parametrize("host", ["evil.example", "evil.example:8000", "127.0.0.1.evil.example", "", "[", "10.0.0.1"])
def test_a_foreign_name_of_this_machine_is_refused(client: TestClient, host: str) -> None:
    answer = client.get("/jobs", headers={"host": host})
    assert answer.status_code == 421
    assert "pyroshock serve" in answer.text


@pytest.mark.parametrize("host", ["127.0.0.1:8000", "localhost", "[::1]:99", "LOCALHOST:1"])
def test_own_names_are_taken(client: TestClient, host: str) -> None:
    assert client.get("/jobs", headers={"host": host}).status_code == 200


def _tries(client: TestClient) -> list[int]:
    """A write without a token, with a made-up one, with one of another session, and from another page."""
    right = token(client)
    other = TestClient(client.app, base_url="http://127.0.0.1:8000")
    body = {"path": "x"}
    return [
        client.post("/api/ingest", json=body).status_code,
        client.post("/api/ingest", json=body, headers={"X-CSRF-Token": "0" * 64}).status_code,
        client.post("/api/ingest", json=body, headers={"X-CSRF-Token": token(other)}).status_code,
        client.post("/ingest/path", data={"path": "x"}).status_code,
        client.post("/ingest/path", data={"path": "x", "csrf": "é"}).status_code,
        client.post(
            "/api/ingest", json=body, headers={"X-CSRF-Token": right, "origin": "http://evil.example"}
        ).status_code,
    ]


def test_a_write_needs_the_token_of_its_session(tmp_path: Path) -> None:
    with window(sqlite(tmp_path), folders=(tmp_path,)) as (client, store):
        before = count_rows(store)
        assert _tries(client) == [403] * 6
        assert client.get("/api/jobs").json() == []
        assert count_rows(store) == before
        # with it, the same write reaches the folder's check
        assert post_json(client, "/api/ingest", {"path": "x"}).status_code == 422


def test_the_page_carries_the_token(client: TestClient) -> None:
    page = client.get("/ingest").text
    assert token_in(page) == token(client)


def test_every_route_that_writes_asks_for_the_token(client: TestClient) -> None:
    """Whatever is added later, too."""
    routes = client.get("/api/openapi.json").json()["paths"]
    written = [path for path, methods in routes.items() if set(methods) - {"get"}]
    assert len(written) >= 3
    for path in written:
        address = path
        for part in ("job", "diagnosis", "impact", "version", "run"):
            address = address.replace("{" + part + "}", "1")
        address = address.replace("{", "").replace("}", "")
        for method in set(routes[path]) - {"get"}:
            answer = client.request(method, address, json={})
            assert answer.status_code == 403, (method, address, answer.text)


def test_without_the_token_of_the_server_nothing_is_told(guarded: TestClient) -> None:
    for address in ("/jobs", "/api/jobs", "/static/style.css", "/api/openapi.json", "/api/csrf", "/nowhere"):
        answer = guarded.get(address, headers={"host": "lab-server:8000"})
        assert answer.status_code == 401, address
        assert "campaign" not in answer.text.lower()


@pytest.mark.parametrize("wrong", ["", "x", WORD + "x", WORD[:-1], WORD.upper()])
def test_a_wrong_token_is_refused(guarded: TestClient, wrong: str) -> None:
    assert guarded.get(f"/jobs?token={wrong}").status_code == 401
    assert guarded.get("/jobs", headers={"authorization": f"Bearer {wrong}"}).status_code == 401


def test_scripts_bring_the_token_in_a_header(guarded: TestClient) -> None:
    assert guarded.get("/api/jobs", headers={"authorization": f"Bearer {WORD}"}).json() == []


def test_a_browser_brings_it_once_and_keeps_a_cookie(guarded: TestClient) -> None:
    answer = guarded.get(f"/ingest?a=1&token={WORD}")
    assert answer.status_code == 303
    assert answer.headers["location"] == "/ingest?a=1"  # the token leaves the address
    assert WORD not in answer.headers["set-cookie"]
    assert "HttpOnly" in answer.headers["set-cookie"]
    assert guarded.get("/ingest").status_code == 200


def test_the_way_in_leads_nowhere_else(guarded: TestClient) -> None:
    answer = guarded.get(f"http://127.0.0.1:8000//evil.example/?token={WORD}")
    assert answer.headers["location"] == "/evil.example/"


def test_too_much_is_refused_by_its_declared_length(client: TestClient) -> None:
    answer = client.post("/api/jobs/1/stop", content=b"x" * 1_000_001, headers={"X-CSRF-Token": token(client)})
    assert answer.status_code == 413


def test_too_much_is_refused_where_no_length_is_declared(client: TestClient) -> None:
    def body() -> Iterator[bytes]:
        for _ in range(30):
            yield b"a" * 100_000

    headers = {"X-CSRF-Token": token(client), "content-type": "application/json"}
    assert client.post("/api/diagnoses", content=body(), headers=headers).status_code == 413


def test_pages_may_load_nothing_from_elsewhere(client: TestClient) -> None:
    headers = client.get("/ingest").headers
    policy = headers["content-security-policy"]
    assert "default-src 'self'" in policy
    assert "frame-ancestors 'none'" in policy
    assert "script-src" not in policy or "unsafe" not in policy.split("script-src")[1].split(";")[0]
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["cache-control"] == "no-store"


def test_an_error_of_the_user_is_told_in_words(client: TestClient) -> None:
    assert client.get("/api/jobs/7").status_code == 404
    assert "no job 7" in client.get("/api/jobs/7").json()["detail"]
    page = client.get("/jobs/7")
    assert page.status_code == 404
    assert "no job 7" in page.text
    assert client.get("/jobs/x").status_code == 422


def test_a_refused_upload_leaves_the_store_as_it_was(client: TestClient, tmp_path: Path) -> None:
    store: Store = client.app.app.state.store  # type: ignore[attr-defined]
    before = count_rows(store)
    files = [("files", ("../../campaign.toml", b"x"))]
    answer = client.post("/ingest/upload", data={"csrf": token(client)}, files=files)
    assert answer.status_code == 422
    assert count_rows(store) == before
    assert client.get("/api/jobs").json() == []
