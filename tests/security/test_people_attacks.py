"""People, the audit trail and notes on PostgreSQL, attacked by SQL as each role: an operator adds
rows of the trail and of notes, and an administrator alone writes users."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import closing

import psycopg
import pytest
from pyroshock.app.operations.people.stored_users import add_user
from pyroshock.schema.engine import make_engine
from starlette.testclient import TestClient
from support.processes.web_client import post_json, token_in, window
from support.stores.people_rows import NAME, PASSWORD, add_people_rows
from support.stores.roled_servers import ADMIN, OPERATOR, READER, Server, roled_server
from support.stores.stores import opened, pyroshock, refusal, run_pyroshock

_ROW = (
    "INSERT INTO {table} SELECT * FROM {table} LIMIT 0; "
    "INSERT INTO {table} (id, {columns}, written_by_id) VALUES (999, {values}, 1)"
)
_USER = _ROW.format(
    table="users",
    columns="name, role, made_at, generation",
    values="'eve', 'administrator', now(), 1",
)
#: Refused to an operator and to a reader.
ATTACKS = {
    "change the trail": "UPDATE audit_rows SET person = 'x'",
    "change a hash of the trail": "UPDATE audit_rows SET row_sha256 = 'unsealed'",
    "empty the trail": "DELETE FROM audit_rows",
    "truncate the trail": "TRUNCATE audit_rows",
    "change the trail by conflict": (
        "INSERT INTO audit_rows SELECT * FROM audit_rows ON CONFLICT (id) DO UPDATE SET person='x'"
    ),
    "change a note": "UPDATE notes SET text = 'x' WHERE text IS NOT NULL",
    "take a note's author": "UPDATE notes SET author = 'x'",
    "delete notes": "DELETE FROM notes",
    "change what is attached": "UPDATE attached_pieces SET data = 'x'",
    "give a content another hash": "UPDATE attached_contents SET sha256 = repeat('0', 64)",
    "call a picture something else": "UPDATE attached_contents SET media_type = 'text/plain'",
    "delete what is attached": "DELETE FROM attached_pieces",
    "delete contents": "DELETE FROM attached_contents",
    "change a caption": "UPDATE attachments SET caption = 'x'",
    "attach it to something else": "UPDATE attachments SET subject = 'x', content_id = 1",
    "attach it as somebody else": "UPDATE attachments SET author = 'x'",
    "delete attachments": "DELETE FROM attachments",
    "raise a role": "UPDATE users SET role = 'administrator'",
    "take back a removed user": "UPDATE users SET removed_at = NULL",
    "add an administrator": _USER,
    "delete users": "DELETE FROM users",
    "change a password": "UPDATE password_hashes SET argon2 = 'x'",
    "add a password": "INSERT INTO password_hashes SELECT * FROM password_hashes",
    "delete a password": "DELETE FROM password_hashes",
    "make a token": "INSERT INTO personal_tokens SELECT * FROM personal_tokens",
    "raise a token": "UPDATE personal_tokens SET role = 'administrator', revoked_at = NULL",
    "bind an account": "UPDATE sign_on_identities SET subject = 'x'",
    "add an account": "INSERT INTO sign_on_identities SELECT * FROM sign_on_identities",
    "take an account away": "DELETE FROM sign_on_identities",
    "own the trail": "ALTER TABLE audit_rows OWNER TO CURRENT_USER",
    "no trail any more": "DROP TABLE audit_rows CASCADE",
}
#: Refused to a reader alone.
READING = {
    "read passwords": "SELECT argon2 FROM password_hashes",
    "read tokens": "SELECT sha256 FROM personal_tokens",
    "write the trail": "INSERT INTO audit_rows SELECT * FROM audit_rows",
    "write a note": "INSERT INTO notes SELECT * FROM notes",
    "take a tag off": "DELETE FROM tags",
    "attach a file": "INSERT INTO attachments SELECT * FROM attachments",
    "remove what is attached": "UPDATE attachments SET removed_at = NULL",
}


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with roled_server(tmp_path_factory.mktemp("lab")) as served:
        with opened(served.address("keeper")) as store, store.writing() as session:
            add_people_rows(session, "spring")
            add_user(session, "ada", "administrator", PASSWORD)
        yield served


def attack(server: Server, login: str, statement: str) -> None:
    """Raises what the database refuses; nothing is committed."""
    engine = make_engine(server.address(login))
    try:
        with closing(engine.raw_connection()) as connection:
            connection.driver_connection.execute(statement)
            connection.rollback()
    finally:
        engine.dispose()


@pytest.mark.parametrize("login", [OPERATOR, READER])
@pytest.mark.parametrize("name", ATTACKS)
def test_neither_operator_nor_reader_changes_what_stays(
    server: Server, login: str, name: str
) -> None:
    with pytest.raises(psycopg.errors.InsufficientPrivilege):
        attack(server, login, ATTACKS[name])


@pytest.mark.parametrize("name", READING)
def test_a_reader_reads_no_hash_and_writes_nothing(server: Server, name: str) -> None:
    with pytest.raises(psycopg.errors.InsufficientPrivilege):
        attack(server, READER, READING[name])


@pytest.mark.parametrize("login", [READER, OPERATOR, ADMIN])
def test_no_question_reads_a_hash_whatever_the_login(server: Server, login: str) -> None:
    for table in ("password_hashes", "personal_tokens"):
        statement = f"select * from {table}"
        assert "does not read" in refusal("query", statement, "--db", server.address(login))
    listed = run_pyroshock("query", "select name from users", "--db", server.address(login))
    assert NAME in listed.stdout


def test_an_operators_login_writes_notes_and_lets_people_sign_in_and_manages_no_users(
    server: Server,
) -> None:
    db = server.address(OPERATOR)
    run_pyroshock("notes", "add", "campaign", "spring", "--text", "from olaf", "--db", db)
    run_pyroshock("tags", "add", "impact", "1", "odd", "--db", db)
    run_pyroshock("tags", "remove", "impact", "1", "odd", "--db", db)
    assert "tag-remove" in run_pyroshock("audit", "--db", db).stdout
    refused = pyroshock("users", "add", "ben", "--db", db, typed=f"{PASSWORD}\n")
    assert refused.exit_code == 2 and "needs the role pyroshock_admin" in refused.stderr
    with window(db, works=False, asks_people=True) as (client, _):
        sign_in(client, "ada")
        assert client.get("/users").status_code == 200
        body = {"name": "ben", "password": PASSWORD, "role": "reader"}
        answer = post_json(client, "/api/users", body)
        assert answer.status_code == 403 and "pyroshock_admin" in answer.json()["detail"]


def test_an_admins_login_manages_users_on_the_pages(server: Server) -> None:
    with window(server.address(ADMIN), works=False, asks_people=True) as (client, _):
        sign_in(client, "ada")
        body = {"name": "ben", "password": PASSWORD, "role": "reader"}
        assert post_json(client, "/api/users", body).status_code == 200
        assert client.get("/api/audit?person=ada").json()[0]["operation"] == "user-add"
        assert client.get("/search?words=loose").status_code == 200


def sign_in(client: TestClient, name: str) -> None:
    form = client.get("/sign-in", headers={"accept": "text/html"})
    sent = {"csrf": token_in(form.text), "name": name, "password": PASSWORD}
    assert client.post("/sign-in", data=sent).status_code == 303
