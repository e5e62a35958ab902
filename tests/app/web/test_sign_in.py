"""Signing in: wrong tokens wait and lock their address, sessions end, cookies are closed to scripts
and strangers."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.app.pages.sign_in import own_address
from pyroshock.app.server.application import application
from pyroshock.app.web import sessions as session_limits
from pyroshock.app.web.client_address import client_network
from pyroshock.app.web.sessions import IDLE_S, LIFETIME_S, Sessions
from pyroshock.app.web.settings import Settings
from pyroshock.app.web.sign_in import SESSION
from pyroshock.app.web.sign_in_attempts import ADDRESSES, LOCK_S, LOCKED_FROM, SignInAttempts
from pyroshock.schema.session import Writer, open_store
from starlette.testclient import TestClient
from support.processes.web_client import sqlite, token_in

WORD = "a-token-of-enough-characters"
HTML = {"accept": "text/html"}


class Clock:
    """Seconds that a test sets."""

    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


class Server:
    """A server with a token, whose clock a test sets; each client comes from an address of its own
    choice."""

    def __init__(self, app: Any, clock: Clock) -> None:
        self.app, self.clock = app, clock
        self.sign_in = app.sign_in
        self.sign_in.sessions._clock = self.sign_in.attempts._clock = clock

    def client(self, host: str = "192.0.2.1", scheme: str = "http") -> TestClient:
        return TestClient(
            self.app,
            base_url=f"{scheme}://127.0.0.1:8000",
            follow_redirects=False,
            client=(host, 50_000),
        )


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    db = sqlite(tmp_path)
    with open_store(db, Writer("test", "0"), create=True) as store:
        yield Server(application(Settings(db, host="0.0.0.0", token=WORD), store), Clock())


def signed_in(client: TestClient, word: str = WORD, address: str = "/jobs") -> Any:
    form = client.get("/sign-in", headers=HTML)
    return client.post(
        "/sign-in", data={"csrf": token_in(form.text), "token": word, "address": address}
    )


def bearer(client: TestClient, word: str) -> int:
    return client.get("/api/jobs", headers={"authorization": f"Bearer {word}"}).status_code


# --- wrong tokens ---
def test_wrong_tokens_wait_twice_as_long_each_time_and_the_tenth_locks_the_address() -> None:
    clock, waits = Clock(), []
    attempts = SignInAttempts(clock)
    for _ in range(LOCKED_FROM + 1):
        attempts.failed("192.0.2.1")
        waits.append(attempts.wait_s("192.0.2.1"))
        clock.now += waits[-1]
    assert waits == [0, 0, 1, 2, 4, 8, 16, 32, 64, LOCK_S, LOCK_S]
    assert attempts.wait_s("192.0.2.1") == 0 and attempts.wait_s("192.0.2.2") == 0
    attempts.failed("192.0.2.1")
    clock.now += 24 * 3600 + 1
    attempts.failed("192.0.2.1")
    assert attempts.wait_s("192.0.2.1") == 0


def test_guessing_is_locked_by_address_whichever_door_is_tried_and_open_sessions_go_on(
    server: Server,
) -> None:
    inside, guesser, other = server.client(), server.client(), server.client("192.0.2.9")
    signed_in(inside)
    doors = (
        lambda word: bearer(guesser, word),
        lambda word: guesser.get(f"/jobs?token={word}").status_code,
        lambda word: signed_in(guesser, word).status_code,
    )
    statuses = []
    for number in range(400):
        server.clock.now += 5.0
        statuses.append(doors[number % 3](f"{WORD}{number}"))
    # 400 guesses in 2,000 s: ten are looked at until the lock, and two more when it has passed
    # twice
    assert statuses.count(401) <= LOCKED_FROM + 2 and set(statuses) == {401, 429}
    answer = guesser.get("/api/jobs", headers={"authorization": f"Bearer {WORD}"})
    assert answer.status_code == 429 and int(answer.headers["retry-after"]) > 0
    assert "too many wrong tokens from 192.0.2.1" in answer.json()["detail"]
    assert (
        signed_in(guesser).status_code == 429
        and guesser.get(f"/jobs?token={WORD}").status_code == 429
    )
    assert inside.get("/jobs").status_code == 200 and bearer(other, WORD) == 200
    server.clock.now += LOCK_S
    assert bearer(guesser, WORD) == 200


def test_what_presents_no_token_is_no_guess(server: Server) -> None:
    client = server.client()
    for _ in range(30):
        assert client.get("/jobs").status_code == 401
        assert server_client_with(server, "an-old-one").get("/jobs").status_code == 401
    assert bearer(client, WORD) == 200


@pytest.mark.parametrize(("one", "other", "same"), [
    ("2001:db8:1:2::1", "2001:db8:1:2:ffff:ffff:ffff:ffff", True),
    ("2001:db8:1:2::1", "2001:db8:1:3::1", False),
    ("::ffff:192.0.2.1", "192.0.2.1", True),
    ("192.0.2.1", "192.0.2.2", False),
    ("fe80::1%eth0", "fe80::2%eth1", True),
    (None, "", True),
])  # fmt: skip
def test_a_network_of_ipv6_is_one_guesser(one: str | None, other: str | None, same: bool) -> None:
    assert (client_network(one) == client_network(other)) is same


@given(st.text(max_size=200))
def test_any_text_is_some_address(host: str) -> None:
    assert 1 <= len(client_network(host)) <= 64


def test_memory_of_guessers_is_bounded_and_a_locked_one_is_not_pushed_out() -> None:
    attempts = SignInAttempts(Clock())
    for _ in range(LOCKED_FROM):
        attempts.failed("192.0.2.1")
    for number in range(ADDRESSES + 500):
        attempts.failed(f"10.{number >> 16}.{number >> 8 & 255}.{number & 255}")
    assert len(attempts) == ADDRESSES and attempts.wait_s("192.0.2.1") == LOCK_S


def test_a_forwarded_address_is_not_believed(server: Server) -> None:
    client = server.client()
    for number in range(LOCKED_FROM + 20):
        client.get(
            "/api/jobs",
            headers={
                "authorization": "Bearer wrong",
                "x-forwarded-for": f"198.51.100.{number}",
                "forwarded": "for=x",
            },
        )
    assert bearer(client, WORD) == 429 and bearer(server.client("198.51.100.3"), WORD) == 200


# --- the header ---
@pytest.mark.parametrize(
    "header", [WORD, f"Basic {WORD}", f"Token {WORD}", f"Bearer{WORD}", f"BearerX {WORD}", "", " "]
)
def test_authorization_needs_its_scheme(server: Server, header: str) -> None:
    answer = server.client().get("/api/jobs", headers={"authorization": header})
    assert (answer.status_code, answer.headers["www-authenticate"]) == (401, "Bearer")
    assert "scheme Bearer" in answer.json()["detail"]


def test_the_scheme_is_written_in_any_case(server: Server) -> None:
    for scheme in ("Bearer", "bearer", "BEARER"):
        answer = server.client().get("/api/jobs", headers={"authorization": f"{scheme} {WORD}"})
        assert answer.status_code == 200


# --- sessions ---
def test_a_browser_gets_a_form_that_leads_on_to_the_page_it_came_for(server: Server) -> None:
    client = server.client()
    answer = client.get("/jobs?state=done", headers=HTML)
    assert (
        answer.status_code == 401
        and 'value="/jobs?state=done"' in answer.text
        and "Campaigns" not in answer.text
    )
    wrong = client.post(
        "/sign-in", data={"csrf": token_in(answer.text), "token": "wrong", "address": "/jobs"}
    )
    assert (
        wrong.status_code == 401
        and "this is not the server" in wrong.text
        and "wrong" not in wrong.headers
    )
    right = signed_in(client, address="/jobs?state=done")
    assert (right.status_code, right.headers["location"]) == (303, "/jobs?state=done")
    assert client.get("/jobs", headers=HTML).status_code == 200
    # a form of elsewhere signs nobody in
    assert server.client().post("/sign-in", data={"token": WORD}).status_code == 403


@pytest.mark.parametrize("address", [
    "//evil.example", "/\\evil.example", "https://evil.example", "", "javascript:alert(1)",
    "/\t/evil.example", "/a\nb", "evil.example", "\\\\evil.example", "/ /x",
])  # fmt: skip
def test_a_sign_in_leads_to_no_other_host(server: Server, address: str) -> None:
    assert own_address(address) == "/"
    assert signed_in(server.client(), address=address).headers["location"] == "/"


def test_a_session_has_a_new_identifier_that_nobody_could_plant(server: Server) -> None:
    planted = "planted-by-somebody-else"
    client, thief = server.client(), server.client()
    client.cookies.set(SESSION, planted)
    thief.cookies.set(SESSION, planted)
    answer = signed_in(client)
    identifier = re.match(rf"{SESSION}=([^;]+);", answer.headers["set-cookie"])[1]
    assert identifier != planted and len(identifier) >= 43
    assert thief.get("/jobs").status_code == 401
    again = signed_in(server_client_with(server, identifier))
    assert identifier not in again.headers["set-cookie"]
    assert server_client_with(server, identifier).get("/jobs").status_code == 401


def server_client_with(server: Server, identifier: str) -> TestClient:
    client = server.client()
    client.cookies.set(SESSION, identifier)
    return client


def test_a_session_ends_when_it_is_not_used_and_after_a_day_all_the_same(server: Server) -> None:
    client = server.client()
    signed_in(client)
    server.clock.now += IDLE_S - 1
    assert client.get("/jobs").status_code == 200
    server.clock.now += IDLE_S + 1
    assert client.get("/jobs").status_code == 401
    signed_in(client)
    for _ in range(int(LIFETIME_S / IDLE_S) * 2 - 1):
        server.clock.now += IDLE_S / 2
        assert client.get("/jobs").status_code == 200
    server.clock.now += IDLE_S
    assert client.get("/jobs").status_code == 401


def test_signing_out_ends_one_session_or_all(server: Server) -> None:
    first, second, third = (server.client() for _ in range(3))
    for client in (first, second, third):
        signed_in(client)
    kept = first.cookies[SESSION]
    page = first.get("/jobs", headers=HTML).text
    assert "Sign out all devices" in page
    assert first.post("/sign-out").status_code == 403  # no page of elsewhere signs anybody out
    answer = first.post("/sign-out", data={"csrf": token_in(page)})
    assert (answer.status_code, answer.headers["location"]) == (303, "/sign-in")
    assert first.get("/jobs").status_code == 401 and second.get("/jobs").status_code == 200
    assert server_client_with(server, kept).get("/jobs").status_code == 401
    token = token_in(second.get("/jobs", headers=HTML).text)
    assert second.post("/sign-out/all", data={"csrf": token}).status_code == 303
    assert second.get("/jobs").status_code == third.get("/jobs").status_code == 401


def test_cookies_are_closed_to_scripts_and_strangers_and_to_plain_http_behind_tls(
    server: Server,
) -> None:
    for scheme in ("http", "https"):
        client = server.client(scheme=scheme)
        for answer in (
            client.get("/sign-in"),
            signed_in(client),
            server.client(scheme=scheme).get(f"/?token={WORD}"),
        ):
            cookie = answer.headers["set-cookie"]
            assert {"HttpOnly", "SameSite=strict", "Path=/"} <= set(cookie.split("; "))
            assert ("Secure" in cookie.split("; ")) is (scheme == "https")


def test_sessions_at_once_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(session_limits, "SESSIONS", 3)
    sessions = Sessions(Clock())
    first, *others = (sessions.begin() for _ in range(4))
    assert not sessions.is_open(first) and all(map(sessions.is_open, others))


def test_a_server_without_a_token_has_nothing_to_sign_out_of(tmp_path: Path) -> None:
    db = sqlite(tmp_path)
    with open_store(db, Writer("test", "0"), create=True) as store:
        client = TestClient(application(Settings(db), store), base_url="http://127.0.0.1:8000")
        assert (
            "Sign out" not in client.get("/jobs").text
            and "needs no token" in client.get("/sign-in").text
        )
