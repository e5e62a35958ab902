"""People with roles: who may what through each door that serves others, and that none of the usual
ways around it leads further."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from fastapi.routing import APIRoute
from pyroshock.app.jobs.queue import get_job
from pyroshock.app.jobs.worker import Worker
from pyroshock.app.operations.catalogue import operation, operations
from pyroshock.app.operations.people import passwords, stored_users
from pyroshock.app.operations.people.stored_users import add_user, remove_user, set_password
from pyroshock.app.server.application import application
from pyroshock.app.web.role_needs import declared_need
from pyroshock.app.web.settings import Settings
from pyroshock.app.web.sign_in import SESSION
from pyroshock.schema.audit import AuditRow
from pyroshock.schema.person_roles import PERSON_ROLES
from pyroshock.schema.saved_views import SavedView
from pyroshock.schema.session import Store, Writer, count_rows, open_store
from pyroshock.schema.users import PasswordHash, PersonalToken, User
from sqlalchemy import select
from starlette.testclient import TestClient
from support.processes.web_client import sqlite, token_in
from support.stores.stores import refusal, run_pyroshock

WORD = "a-token-of-enough-characters"
PASSWORD = "four quiet grey herons"
HTML = {"accept": "text/html"}
#: A person of each role.
PEOPLE = dict(zip(("rita", "olaf", "emma", "ada"), PERSON_ROLES, strict=True))
RITA, OLAF, EMMA, ADA = PEOPLE
MATERIAL = {
    "name": "lead",
    "youngs_modulus": "16GPa",
    "poisson_ratio": 0.44,
    "density": "11340kg/m3",
    "yield_strength": "12MPa",
    "source": "a table",
}
PLAN = {"name": "spring", "method": "sobol", "runs": 4, "seed": 3}


class Laboratory:
    """A server over a store with a person of each role, and browsers of these people."""

    def __init__(self, store: Store, db: str, **settings: Any) -> None:
        self.store, self.db = store, db
        self.app = application(
            Settings(db, host="0.0.0.0", token=WORD, works=False, **settings), store
        )

    def client(self, host: str = "192.0.2.1") -> TestClient:
        return TestClient(
            self.app,
            base_url="http://127.0.0.1:8000",
            follow_redirects=False,
            client=(host, 50_000),
        )

    def browser(self, name: str, password: str = PASSWORD) -> TestClient:
        """A browser in which a person has signed in."""
        client = self.client()
        answer = sign_in(client, name, password)
        assert answer.status_code == 303, answer.text
        return client

    def rows(self) -> list[tuple[Any, ...]]:
        """Person, kind, operation and outcome of each row of the audit trail but those of
        sign-ins."""
        query = select(AuditRow.person, AuditRow.person_kind, AuditRow.operation, AuditRow.outcome)
        query = query.where(AuditRow.operation.not_in(("sign-in", "sign-out")))
        with self.store.reading() as session:
            return [tuple(row) for row in session.execute(query.order_by(AuditRow.id))]


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A store with a person of each role."""
    folder = tmp_path_factory.mktemp("people")
    with open_store(sqlite(folder), Writer("test", "0"), create=True) as store:
        with store.writing() as session:
            for name, role in PEOPLE.items():
                add_user(session, name, role, PASSWORD)
        with store.engine.connect() as connection:
            connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)")
    return (folder / "lab.db").read_bytes()


@pytest.fixture
def lab(filled: bytes, tmp_path: Path) -> Iterator[Laboratory]:
    (tmp_path / "lab.db").write_bytes(filled)
    with open_store(sqlite(tmp_path), Writer("test", "0")) as store:
        yield Laboratory(store, sqlite(tmp_path))


def sign_in(client: TestClient, name: str, password: str = PASSWORD) -> Any:
    form = client.get("/sign-in", headers=HTML)
    sent = {"csrf": token_in(form.text), "name": name, "password": password, "address": "/jobs"}
    return client.post("/sign-in", data=sent)


def csrf(client: TestClient) -> str:
    return str(client.get("/api/csrf").json()["token"])


def post(client: TestClient, address: str, body: Any, **more: str) -> Any:
    headers = {"X-CSRF-Token": csrf(client), **more}
    return client.post(address, json=body, headers=headers)


def send(client: TestClient, address: str, form: dict[str, Any]) -> Any:
    """A form as a page without scripts sends it."""
    return client.post(address, data={"csrf": csrf(client), **form})


# --- every operation and every route


def test_every_operation_says_which_role_it_needs() -> None:
    for declared in operations():
        assert declared.needed_role in PERSON_ROLES, declared.name
        if declared.deletes is not None and not declared.role:
            assert declared.needed_role == "administrator", declared.name
        if not declared.changes and not declared.role:
            assert declared.needed_role == "reader", declared.name


def test_every_route_that_writes_says_which_role_it_needs(lab: Laboratory) -> None:
    app: Any = lab.app
    included = [
        route.original_router
        for route in app.app.app.app.routes
        if hasattr(route, "original_router")
    ]
    routes = [
        route for router in included for route in router.routes if isinstance(route, APIRoute)
    ]
    assert len(routes) > 100
    unsaid = [
        f"{method} {route.path}"
        for route in routes
        for method in route.methods - {"GET", "HEAD", "OPTIONS"}
        if declared_need(route) is None
    ]
    assert unsaid == []


ENTITLED = [
    ("reader", RITA, "GET", "/api/campaigns", None),
    ("operator", OLAF, "POST", "/api/ingest", {"path": "nowhere"}),
    ("engineer", EMMA, "POST", "/api/plans", PLAN),
    ("administrator", ADA, "POST", "/api/materials", MATERIAL),
    ("administrator", ADA, "GET", "/api/users", None),
    ("engineer", EMMA, "GET", "/api/audit", None),
]


@pytest.mark.parametrize(("role", "name", "verb", "address", "body"), ENTITLED)
def test_a_role_opens_what_it_says_and_the_next_lower_one_does_not(
    lab: Laboratory, role: str, name: str, verb: str, address: str, body: Any
) -> None:
    def ask(person: str) -> Any:
        client = lab.browser(person)
        return client.get(address) if verb == "GET" else post(client, address, body)

    assert ask(name).status_code != 403
    lower = PERSON_ROLES.index(role) - 1
    if lower < 0:
        return
    person = list(PEOPLE)[lower]
    answer = ask(person)
    assert answer.status_code == 403
    words = answer.json()["detail"]
    assert f"needs the role {role}" in words and "an administrator can give it" in words
    assert f"pyroshock users change {person} --role {role}" in words


# --- signing in


def test_an_unknown_name_and_a_wrong_password_get_the_same_answer(lab: Laboratory) -> None:
    answers = [
        sign_in(lab.client(f"192.0.2.{number}"), name, "another long password")
        for number, name in enumerate((ADA, "zoe", "ADA", "' or 1=1 --"))
    ]
    texts = {re.sub('value="[^"]*"', "", answer.text) for answer in answers}
    assert {answer.status_code for answer in answers} == {401} and len(texts) == 1
    assert "the name or the password is wrong" in texts.pop()


def test_an_unknown_name_takes_a_password_hash_as_a_known_one_does(
    lab: Laboratory, monkeypatch: pytest.MonkeyPatch
) -> None:
    looked_at = []
    real = passwords.is_password
    monkeypatch.setattr(
        stored_users,
        "is_password",
        lambda argon2, password: looked_at.append(cost_of(argon2)) or real(argon2, password),
    )
    sign_in(lab.client(), ADA, "another long password")
    sign_in(lab.client(), "zoe", "another long password")
    assert len(looked_at) == 2 and len(set(looked_at)) == 1  # one hash each, of one cost


def cost_of(argon2: str) -> str:
    """The part of a stored hash that says how dear it was, before its salt."""
    return argon2.rsplit("$", 2)[0]


def test_a_password_is_hashed_with_64_mib_and_three_passes(
    cheap_hashes: Callable[[], Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The other tests hash at less cost."""
    monkeypatch.setattr(passwords, "_hasher", cheap_hashes)
    argon2 = passwords.hash_password(PASSWORD)
    assert cost_of(argon2) == "$argon2id$v=19$m=65536,t=3,p=4"
    assert passwords.is_password(argon2, PASSWORD)
    assert not passwords.is_password(argon2, "another long password")


def test_guessing_one_name_from_many_addresses_is_slowed(lab: Laboratory) -> None:
    statuses = [
        sign_in(lab.client(f"192.0.{number}.7"), ADA, f"guess number {number}").status_code
        for number in range(5)
    ]
    assert statuses[:3] == [401, 401, 401] and 429 in statuses
    assert sign_in(lab.client("198.51.100.1"), OLAF).status_code == 303


def test_passwords_and_tokens_are_stored_as_hashes_alone(lab: Laboratory) -> None:
    client = lab.browser(OLAF)
    made = post(client, "/api/account/tokens", {"label": "plots", "role": "reader"}).json()
    with lab.store.reading() as session:
        hashes = list(session.scalars(select(PasswordHash.argon2)))
        token = session.scalars(select(PersonalToken)).one()
        assert made["token"] not in (token.sha256, token.label)
    assert all(word.startswith("$argon2id$") for word in hashes) and len(set(hashes)) == 4
    content = b"".join(path.read_bytes() for path in Path(lab.db[10:]).parent.iterdir())
    assert PASSWORD.encode() not in content and made["token"].encode() not in content


@pytest.mark.parametrize("password", [
    "short", "password1234", "aaaaaaaaaaaa", "121212121212", "123456789012", "abcdefghijklm",
    "ADMINISTRATOR", "x" * 1001,
])  # fmt: skip
def test_a_password_that_is_guessed_first_is_refused_without_being_repeated(
    lab: Laboratory, password: str
) -> None:
    answer = post(lab.browser(ADA), "/api/users", {"name": "ben", "password": password})
    assert answer.status_code == 422 and password not in answer.text
    assert "password" in answer.json()["detail"]


def test_a_password_of_128_characters_is_taken(lab: Laboratory) -> None:
    long = "a quiet heron " * 9 + "ab"
    assert len(long) == 128
    body = {"name": "ben", "password": long, "role": "reader"}
    assert post(lab.browser(ADA), "/api/users", body).status_code == 200
    assert lab.browser("ben", long).get("/campaigns").status_code == 200


def test_the_command_line_reads_the_password_and_takes_no_argument(lab: Laboratory) -> None:
    from click.testing import CliRunner
    from pyroshock.app.doors.command_line.main import main

    words = ["users", "add", "ben", "--role", "operator", "--db", lab.db]
    result = CliRunner().invoke(main, words, input=f"{PASSWORD}\n")
    assert result.exit_code == 0 and PASSWORD not in result.output
    assert lab.browser("ben").get("/account").status_code == 200
    assert "No such option" in refusal(*words, "--password", PASSWORD)
    assert "ben" in run_pyroshock("users", "--db", lab.db).stdout


# --- attacks


def test_a_forged_session_opens_nothing(lab: Laboratory) -> None:
    client = lab.browser(ADA)
    own = client.cookies[SESSION]
    for forged in ("", "ada", own[:-1], own + "A", own[::-1]):
        other_client = lab.client()
        other_client.cookies.set(SESSION, forged)
        assert other_client.get("/users", headers=HTML).status_code == 401
    assert client.get("/users").status_code == 200


def test_a_session_is_not_taken_over_from_before_the_sign_in(lab: Laboratory) -> None:
    client = lab.client()
    client.get("/sign-in", headers=HTML)
    old_cookie = client.cookies[SESSION]
    sign_in(client, OLAF)
    other_client = lab.client()
    other_client.cookies.set(SESSION, old_cookie)
    assert client.cookies[SESSION] != old_cookie and other_client.get("/jobs").status_code == 401


def test_a_role_in_a_form_or_a_body_changes_nothing(lab: Laboratory) -> None:
    client = lab.browser(OLAF)
    for more in ({"role": "administrator"}, {"person": ADA}, {"user_id": 4}):
        assert post(client, "/api/materials", {**MATERIAL, **more}).status_code == 403
        assert send(client, "/ask/material-add", {**MATERIAL, **more}).status_code == 403
    answer = post(client, "/api/account/tokens", {"label": "x", "role": "administrator"})
    assert answer.status_code == 422 and "at most your own role" in answer.text
    for extra in ({"user_id": 4}, {"sha256": "0" * 64}, {"generation": 9}):
        body = {"label": "x", "role": "reader", **extra}
        assert post(client, "/api/account/tokens", body).status_code == 422
    assert {row[2] for row in lab.rows()} == set()


def test_nobody_raises_the_own_role(lab: Laboratory) -> None:
    for name in (RITA, OLAF, EMMA):
        client = lab.browser(name)
        body = {"role": "administrator"}
        assert post(client, f"/api/users/{name}/role", body).status_code == 403
        assert send(client, f"/users/{name}/role", body).status_code == 403
        own = {"name": "ben", "password": PASSWORD, "role": "administrator"}
        assert post(client, "/api/users", own).status_code == 403
        assert post(client, f"/api/users/{ADA}/password", {"password": PASSWORD}).status_code == 403
        assert post(client, f"/api/users/{ADA}/remove", {}).status_code == 403
    with lab.store.reading() as session:
        assert dict(session.execute(select(User.name, User.role)).all()) == PEOPLE


@pytest.mark.parametrize("address", [
    "/users", "/users/", "/%2fusers", "/./users", "/campaigns/../users", "/campaigns/%2e%2e/users",
    "/campaigns/..%2fusers", "/USERS", "/users%2f", "/users;x=1", "/users?role=administrator",
    "/users%00", "/%75sers", "/api/users", "/api//users", "/api/users/",
])  # fmt: skip
def test_no_spelling_of_an_address_leads_around_its_role(lab: Laboratory, address: str) -> None:
    client = lab.browser(RITA)
    answer = client.get(address)
    assert answer.status_code in (307, 400, 403, 404)
    assert f'"{ADA}"' not in answer.text and f"person={ADA}" not in answer.text


@pytest.mark.parametrize(
    "verb", ["GET", "HEAD", "PUT", "PATCH", "DELETE", "OPTIONS", "TRACE", "post"]
)
def test_no_verb_leads_around_a_role(lab: Laboratory, verb: str) -> None:
    client = lab.browser(RITA)
    headers = {
        "X-CSRF-Token": csrf(client),
        "X-HTTP-Method-Override": "POST",
        "X-Original-URL": "/api/campaigns",
        "X-Rewrite-URL": "/api/campaigns",
    }
    for address in ("/api/materials?_method=POST", "/users", "/api/users"):
        answer = client.request(verb, address, json=MATERIAL, headers=headers)
        listed = verb in ("GET", "HEAD") and address.startswith("/api/materials")
        assert answer.status_code in ((200, 405, 422) if listed else (403, 404, 405))
    with lab.store.reading() as session:
        assert session.scalars(select(User).where(User.name == "lead")).first() is None
    assert lab.rows() == []


def test_a_write_without_the_token_of_its_session_is_refused_for_an_administrator_too(
    lab: Laboratory,
) -> None:
    client, other_client = lab.browser(ADA), lab.browser(OLAF)
    for headers in ({}, {"X-CSRF-Token": csrf(other_client)}, {"X-CSRF-Token": "0" * 64}):
        assert client.post("/api/materials", json=MATERIAL, headers=headers).status_code == 403
    elsewhere = {"X-CSRF-Token": csrf(client), "origin": "http://evil.example"}
    assert client.post("/api/materials", json=MATERIAL, headers=elsewhere).status_code == 403
    assert lab.rows() == []


# --- what pages offer


def forms(page: str) -> dict[str, tuple[bool, str]]:
    """Id of each form that is sent -> whether it can be sent, and its content."""
    contents_by_id = re.findall(
        r'<form method="post"[^>]*?id="([^"]+)"[^>]*>(.*?)</form>', page, re.DOTALL
    )
    return {
        name: ("<fieldset disabled" not in content, content) for name, content in contents_by_id
    }


def test_a_page_that_is_kept_is_made_for_each_role(lab: Laboratory) -> None:
    """The page of one role would show another what it may not do, or hide what it may."""
    pages = {name: lab.browser(name) for name in PEOPLE}
    for _ in range(2):
        for name, client in pages.items():
            answer = client.get("/notes", headers=HTML)
            assert forms(answer.text)["filter-save"][0] is (name != RITA), name


@pytest.mark.parametrize(("address", "form", "role"), [
    ("/notes", "filter-save", "operator"), ("/plans/new", "make", "engineer"),
    ("/ingest", "upload", "operator"), ("/deleted", "restore", "administrator"),
    ("/account", "token-add", "reader"), ("/tune", "tune", "operator"),
])  # fmt: skip
def test_a_form_that_the_role_may_not_send_is_disabled_and_says_which_role_it_needs(
    lab: Laboratory, address: str, form: str, role: str
) -> None:
    for name, own in PEOPLE.items():
        page = lab.browser(name).get(address, headers=HTML)
        assert page.status_code == 200
        may = PERSON_ROLES.index(own) >= PERSON_ROLES.index(role)
        assert forms(page.text)[form][0] is may, name
        sentence = f"This needs the role {role}, and you have the role {own}."
        assert (sentence in page.text) is not may


def test_a_form_that_is_shown_can_be_sent_and_one_that_is_disabled_cannot(lab: Laboratory) -> None:
    """What pages show holds against what routes refuse, for each form of some pages."""
    for name in (RITA, OLAF, EMMA):
        client = lab.browser(name)
        for address in ("/notes", "/datasets", "/plans/new", "/ingest", "/deleted"):
            page = client.get(address, headers=HTML).text
            for match in re.finditer(r'<form method="post"([^>]*)>(.*?)</form>', page, re.DOTALL):
                to = re.search(r'action="([^"]*)"', match[1])
                if to is not None and to[1].startswith("/sign-out"):
                    continue
                refused = send(client, to[1] if to else address, {}).status_code == 403
                assert refused is ("<fieldset disabled" in match[2]), (name, address, match[1])


def test_a_button_in_a_line_is_left_out_where_the_role_lacks_it(lab: Laboratory) -> None:
    filters = {"name": "mine", "address": "/impacts"}
    assert post(lab.browser(OLAF), "/api/filters", filters).status_code == 200
    address = "/filters/mine/delete"
    assert address in lab.browser(OLAF).get("/notes", headers=HTML).text
    assert address not in lab.browser(RITA).get("/notes", headers=HTML).text


def test_no_page_links_to_one_that_the_role_may_not_see(lab: Laboratory) -> None:
    for name in (RITA, OLAF, EMMA):
        client = lab.browser(name)
        for address in ("/", "/campaigns", "/models", "/twin", "/diagnoses", "/account", "/notes",
                        "/compare/spectra", "/api", "/plans", "/deleted"):  # fmt: skip
            page = client.get(address, headers=HTML).text
            for link in set(re.findall(r'<a [^>]*?href="(/[^"#?]*)', page)):
                assert client.get(link, headers=HTML).status_code != 403, (name, address, link)
    assert "/ask/blind-check" in lab.browser(ADA).get("/diagnoses", headers=HTML).text


def test_a_reader_predicts_and_nothing_is_written(lab: Laboratory) -> None:
    client = lab.browser(RITA)
    rows_before = count_rows(lab.store)
    assert client.get("/twin", headers=HTML).status_code == 200
    shot = {"impact_velocity_m_s": "8"}
    assert client.get("/api/predict", params=shot).status_code == 200
    assert post(client, "/api/predict", shot).status_code == 200
    assert client.get("/twin/answer", params=shot).status_code == 200
    assert client.get("/api/twin").status_code == 200
    assert count_rows(lab.store) == rows_before


def test_a_removed_user_is_out_at_once_with_sessions_and_tokens(lab: Laboratory) -> None:
    client = lab.browser(EMMA)
    made = post(client, "/api/account/tokens", {"label": "x", "role": "engineer"}).json()["token"]
    script = lab.client()
    bearer = {"authorization": f"Bearer {made}"}
    assert script.get("/api/audit", headers=bearer).status_code == 200
    assert post(lab.browser(ADA), f"/api/users/{EMMA}/remove", {}).status_code == 200
    assert client.get("/campaigns").status_code == 401
    assert script.get("/api/campaigns", headers=bearer).status_code == 401
    assert sign_in(lab.client("192.0.2.8"), EMMA).status_code == 401


def test_a_token_does_no_more_than_its_role_nor_than_its_owner(lab: Laboratory) -> None:
    client = lab.browser(EMMA)
    words = {
        role: post(client, "/api/account/tokens", {"label": role, "role": role}).json()["token"]
        for role in ("reader", "engineer")
    }

    def ask(role: str) -> int:
        script = lab.client()
        bearer = {"authorization": f"Bearer {words[role]}"}
        token = script.get("/api/csrf", headers=bearer).json()["token"]
        headers = {**bearer, "X-CSRF-Token": token}
        return int(script.post("/api/plans", json=PLAN, headers=headers).status_code)

    assert (ask("reader"), ask("engineer")) == (403, 200)
    run_pyroshock("users", "change", EMMA, "--role", "operator", "--db", lab.db)
    assert ask("engineer") == 403


def test_a_token_is_revoked_by_its_owner_alone(lab: Laboratory) -> None:
    emma, olaf = lab.browser(EMMA), lab.browser(OLAF)
    word = post(emma, "/api/account/tokens", {"label": "x", "role": "reader"}).json()["token"]
    bearer = {"authorization": f"Bearer {word}"}
    assert post(olaf, "/api/account/tokens/1/revoke", {}).status_code == 404
    assert post(lab.browser(ADA), "/api/account/tokens/1/revoke", {}).status_code == 404
    assert lab.client().get("/api/campaigns", headers=bearer).status_code == 200
    assert post(emma, "/api/account/tokens/1/revoke", {}).status_code == 200
    assert lab.client().get("/api/campaigns", headers=bearer).status_code == 401


def test_a_new_password_ends_the_other_sessions_and_not_its_own(lab: Laboratory) -> None:
    here, elsewhere = lab.browser(OLAF), lab.browser(OLAF)
    wrong = {"current": "not this one, surely", "new": "five other grey herons"}
    assert send(here, "/account/password", wrong).status_code == 422
    right = {"current": PASSWORD, "new": "five other grey herons"}
    assert send(here, "/account/password", right).status_code == 303
    assert here.get("/account").status_code == 200
    assert elsewhere.get("/account").status_code == 401
    assert sign_in(lab.client(), OLAF).status_code == 401
    assert sign_in(lab.client(), OLAF, "five other grey herons").status_code == 303


def test_a_password_that_an_administrator_sets_ends_every_session(lab: Laboratory) -> None:
    client = lab.browser(OLAF)
    with lab.store.writing() as session:
        set_password(session, OLAF, "five other grey herons")
    assert client.get("/account").status_code == 401


def test_another_role_holds_from_the_next_request_on(lab: Laboratory) -> None:
    client = lab.browser(EMMA)
    assert client.get("/audit").status_code == 200
    run_pyroshock("users", "change", EMMA, "--role", "reader", "--db", lab.db)
    assert client.get("/audit").status_code == 403


def test_the_last_administrator_stays(lab: Laboratory) -> None:
    client = lab.browser(ADA)
    assert "last administrator" in post(client, f"/api/users/{ADA}/remove", {}).text
    body = {"role": "reader"}
    assert "last administrator" in post(client, f"/api/users/{ADA}/role", body).text


@pytest.mark.parametrize("how", ["lesser role", "removed"])
def test_a_job_is_not_done_once_its_person_may_not_ask_for_it(lab: Laboratory, how: str) -> None:
    job = post(lab.browser(EMMA), "/api/plans", PLAN).json()["id"]
    if how == "removed":
        with lab.store.writing() as session:
            remove_user(session, EMMA)
    else:
        run_pyroshock("users", "change", EMMA, "--role", "operator", "--db", lab.db)
    Worker(lab.store, lab.db).run(once=True)
    ended = get_job(lab.store, job)
    assert ended.state == "failed"
    assert ("no user any more" if how == "removed" else "needs the role engineer") in ended.error
    trail = [row for row in lab.rows() if row[2] == "plan"]
    assert trail == [(EMMA, "user", "plan", "asked"), (EMMA, "user", "plan", "failed")]


def test_a_job_of_another_is_not_asked_for_again_by_who_may_not(lab: Laboratory) -> None:
    job = post(lab.browser(EMMA), "/api/plans", PLAN).json()["id"]
    assert post(lab.browser(EMMA), f"/api/jobs/{job}/stop", {}).status_code == 200
    assert send(lab.browser(RITA), f"/jobs/{job}/again", {}).status_code == 403
    answer = send(lab.browser(OLAF), f"/jobs/{job}/again", {})
    assert answer.status_code == 403 and "needs the role engineer" in answer.text
    assert send(lab.browser(EMMA), f"/jobs/{job}/again", {}).status_code == 303


def test_a_job_is_done_for_its_person_and_signs_with_the_name(lab: Laboratory) -> None:
    job = post(lab.browser(EMMA), "/api/plans", PLAN).json()["id"]
    Worker(lab.store, lab.db).run(once=True)
    assert get_job(lab.store, job).state == "done"
    page = lab.browser(RITA).get("/jobs").text
    assert EMMA in page
    assert [row for row in lab.rows() if row[2] == "plan"] == [
        (EMMA, "user", "plan", "asked"),
        (EMMA, "user", "plan", "done"),
    ]


@pytest.mark.parametrize("statement", [
    "select * from password_hashes", "select argon2 from PASSWORD_HASHES",
    'select "sha256" from "personal_tokens"', "select (select argon2 from password_hashes) a",
    "with x as (select * from password_hashes) select * from x",
    "select name from campaigns union select argon2 from password_hashes",
])  # fmt: skip
def test_no_question_reads_what_people_sign_in_with(lab: Laboratory, statement: str) -> None:
    for name in PEOPLE:
        answer = post(lab.browser(name), "/api/query", {"statement": statement})
        assert answer.status_code == 422 and "does not read" in answer.text
    assert "does not read" in refusal("query", statement, "--db", lab.db)


def test_a_question_reads_users_and_the_trail_for_who_may_see_them(lab: Laboratory) -> None:
    post(lab.browser(ADA), "/api/materials", MATERIAL)
    for statement, allowed in (
        ("select name from users", {ADA}),
        ("select person from audit_rows", {ADA, EMMA}),
    ):
        for name in PEOPLE:
            answer = post(lab.browser(name), "/api/query", {"statement": statement})
            assert (answer.status_code == 200) is (name in allowed), (name, statement)


def test_the_servers_token_acts_as_the_administrator_named_token(lab: Laboratory) -> None:
    script = lab.client()
    bearer = {"authorization": f"Bearer {WORD}"}
    headers = {**bearer, "X-CSRF-Token": script.get("/api/csrf", headers=bearer).json()["token"]}
    assert script.post("/api/materials", json=MATERIAL, headers=headers).status_code == 200
    assert lab.rows() == [("token", "token", "material-add", "done")]
    assert script.get("/api/account/tokens", headers=bearer).status_code == 422


def test_users_alone_are_let_in_where_the_server_is_told_so(filled: bytes, tmp_path: Path) -> None:
    (tmp_path / "lab.db").write_bytes(filled)
    db = sqlite(tmp_path)
    with open_store(db, Writer("test", "0")) as store:
        app = application(Settings(db, asks_people=True, works=False), store)
        client = TestClient(app, base_url="http://127.0.0.1:8000", follow_redirects=False)
        assert client.get("/jobs").status_code == 401
        assert client.get("/jobs?token=x").status_code == 401
        assert client.get("/jobs", headers={"authorization": "Bearer "}).status_code == 401
        assert sign_in(client, RITA).status_code == 303
        assert client.get("/jobs").status_code == 200


def test_signing_out_everywhere_ends_the_own_sessions_alone(lab: Laboratory) -> None:
    here, there, other_client = lab.browser(OLAF), lab.browser(OLAF), lab.browser(EMMA)
    assert send(here, "/sign-out/all", {}).status_code == 303
    assert (there.get("/jobs").status_code, other_client.get("/jobs").status_code) == (401, 200)


# --- pages


def test_pages_of_people_show_who_may_what(lab: Laboratory) -> None:
    client = lab.browser(ADA)
    page = client.get("/users").text
    assert all(name in page and role in page for name, role in PEOPLE.items())
    assert (
        send(client, "/users", {"name": "ben", "role": "reader", "password": PASSWORD}).headers[
            "location"
        ]
        == "/users"
    )
    trail = client.get("/audit?person=ada").text
    assert "user-add" in trail and "ben" in trail and PASSWORD not in trail
    assert "Nothing was changed yet" in client.get("/audit?person=zoe").text
    account = lab.browser(RITA).get("/account").text
    assert "<strong>rita</strong>" in account and "/audit" not in account
    made = send(lab.browser(RITA), "/account/tokens", {"label": "my plots", "role": "reader"})
    assert "pyroshock_" in made.text and "shown this once" in made.text


def test_the_trail_says_what_was_asked_and_through_which_door(lab: Laboratory) -> None:
    post(lab.browser(ADA), "/api/materials", MATERIAL)
    rows = lab.browser(EMMA).get("/api/audit?operation=material-add").json()
    assert rows[0]["command"] == "serve: POST /api/materials" and rows[0]["subject"] == "lead"
    assert rows[0]["request"]["density"] == 11340.0
    trail = run_pyroshock("audit", "--person", ADA, "--db", lab.db).stdout
    assert "material-add" in trail and "lead" in trail


def test_what_is_refused_or_changes_nothing_leaves_no_row(lab: Laboratory) -> None:
    client = lab.browser(ADA)
    assert post(client, "/api/materials", MATERIAL).status_code == 200
    assert post(client, "/api/materials", MATERIAL).status_code == 422
    assert len(lab.rows()) == 1
    assert operation("material-add").needed_role == "administrator"


# --- who it was


def test_a_saved_view_is_by_who_is_signed_in(lab: Laboratory) -> None:
    client = lab.browser(OLAF)
    view = {"name": "force", "kind": "distribution", "x": "peak_force_n"}
    answer = post(client, "/api/views", {**view, "creator": ADA})
    assert answer.status_code == 422 and "you are signed in as olaf" in answer.text
    assert post(client, "/api/views", view).status_code == 200
    with lab.store.reading() as session:
        assert session.scalars(select(SavedView.creator)).one() == OLAF
    assert 'name="creator"' not in client.get("/explore", headers=HTML).text
