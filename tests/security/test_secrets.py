"""Passwords and tokens are looked for in all that comes out: addresses, commands, stores,
registries, answers."""

from __future__ import annotations

import logging
import re
import sys
import uuid
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click
import pytest
from click.testing import CliRunner, Result
from pyroshock.app.doors.command_line.common import SECRET_OPTIONS, command_line
from pyroshock.app.doors.command_line.main import main
from pyroshock.app.operations.command_words import COMMANDS
from pyroshock.app.server import command as cli
from pyroshock.app.web.settings import Settings, SettingsError
from pyroshock.schema import migrate
from pyroshock.schema.addresses import (
    AddressError,
    address_for_display,
    parse_address,
    without_secrets,
)
from pyroshock.schema.engine import make_engine
from pyroshock.schema.tables import metadata
from pyroshock.training.registry.model_storage import ModelStorage, storage_for
from sqlalchemy import MetaData, create_engine, make_url, select
from support.processes.web_client import post_json, window
from support.records.campaigns import hammer_campaign
from support.stores.databases import _execute
from support.stores.hammer_stores import full_campaign
from support.stores.stores import opened
from support.stores.web_stores import FACTORS


@pytest.mark.parametrize(("typed", "seen"), [
    ("postgresql://me:PW@host/db", "postgresql://me:***@host/db"),
    ("postgresql+psycopg://me:P%40W@host:5432/db", "postgresql+psycopg://me:***@host:5432/db"),
    ("postgresql://me:P@W@host/db", "postgresql://me:***@host/db"),
    ("postgresql://me:P@W:x@host:5432/db", "postgresql://me:***@host:5432/db"),
    ("postgresql://me:P/W@host/db", "postgresql://me:***@host/db"),
    ("postgresql://me:P W@host/db", "postgresql://me:***@host/db"),
    ("postgresql://me@host/db?password=PW&sslmode=require",
     "postgresql://me@host/db?password=***&sslmode=require"),
    ("postgresql://me@host/db?sslpassword=PW", "postgresql://me@host/db?sslpassword=***"),
    ("host=x user=me password=PW dbname=lab", "host=x user=me password=*** dbname=lab"),
    ("host=x password = 'P W' dbname=lab", "host=x password = *** dbname=lab"),
    ("me:PW@host/db", "***@host/db"),
    ("http://me:PW@tracking:5000/mlflow", "http://me:***@tracking:5000/mlflow"),
    ("https://TOKEN@tracking/mlflow", "https://***@tracking/mlflow"),
])  # fmt: skip
def test_secrets_of_addresses_are_hidden(typed: str, seen: str) -> None:
    assert address_for_display(typed) == seen


def test_texts_commands_and_records_keep_all_but_their_secrets() -> None:
    for address in ("sqlite:///a@b.db", "sqlite:////home/m e/lab é.db",
                    "postgresql+psycopg://me@host/db",
                    "http://127.0.0.1:5000/models/hybrid@3"):  # fmt: skip
        assert address_for_display(address) == without_secrets(address) == address
    message = (
        "no store at postgresql://me:PW@host/db, try http://h:1/x or token=PW; "
        "hybrid@3 promoted by me@lab"
    )
    assert without_secrets(message) == (
        "no store at postgresql://me:***@host/db, try http://h:1/x or "
        "token=***; hybrid@3 promoted by me@lab"
    )
    words = [
        "/bin/pyroshock",
        "serve",
        "--token",
        "WORD",
        "--db=postgresql://me:P W@h/d",
        "--host",
        "0.0.0.0",
    ]
    assert (
        command_line(words)
        == "pyroshock serve --token *** --db=postgresql://me:***@h/d --host 0.0.0.0"
    )
    assert command_line(["x", "serve", "--token=WORD"]) == "x serve --token=***"
    assert command_line(["x", "impacts", "--db", "me:PW@host/d"]) == "x impacts --db ***@host/d"
    assert (
        command_line(["/lib/clone/__main__.py", "ingest", "c"]) == "pyroshock ingest c"
    )  # python -m pyroshock
    assert (
        command_line(["x", "promote", "hybrid@3", "--reason", "a=b"])
        == "x promote hybrid@3 --reason a=b"
    )
    # An option of a new command that is called like a secret must be in the list, unless it is a
    # switch or the name of a file that holds the secret.
    options = {word for command in _commands() for option in command.params for word in option.opts}
    called_so = {
        word
        for word in options
        if word.startswith("--") and re.search("token|password|secret|key", word)
    }
    assert called_so == {*SECRET_OPTIONS, "--no-passwords", "--sso-client-secret-file"}
    settings = Settings("postgresql://me:PW@host/db", token="a token of PW, long enough")
    place = storage_for("sqlite:///lab.db", {"MLFLOW_TRACKING_URI": "http://me:PW@tracking"})
    assert isinstance(place, ModelStorage) and place.shown == "http://me:***@tracking"
    assert "PW" not in f"{settings!r} {place!r}"
    with pytest.raises(SettingsError, match="every page would show its password") as caught:
        Settings("sqlite://", mlflow="http://me:PW@tracking")
    assert "PW" not in str(caught.value)


@pytest.mark.parametrize(
    "address", ["postgresql://me:P@PW@host/db", "postgresql://me:P@PW:x@h:5/db", "me:PW@host"]
)
def test_an_unreadable_address_is_refused_without_its_password(address: str) -> None:
    with pytest.raises(AddressError) as caught:
        parse_address(address)
    assert "PW" not in str(caught.value) and caught.value.__suppress_context__ | (
        caught.value.__context__ is None
    )
    with pytest.raises(AddressError, match="%40"):  # how an @ within a password is written
        parse_address("postgresql://me:P@PW@host/db")


def _commands() -> list[click.Command]:
    context = click.Context(main)
    made = [main.get_command(context, name) for name in COMMANDS]
    below = [
        command.get_command(context, name)
        for command in made
        if isinstance(command, click.Group)
        for name in command.list_commands(context)
    ]
    return [command for command in (*made, *below) if command is not None]


# --- a password and a token are planted in every place that takes one ---
SECRET = "Zq7sEcReT"


@pytest.fixture(autouse=True)
def apart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """No store and no settings but those of the test; every log is looked at, too."""
    monkeypatch.chdir(tmp_path)
    Path("factors.toml").write_text(FACTORS)
    for name in ("PYROSHOCK_DB", "MLFLOW_TRACKING_URI", "PYROSHOCK_TOKEN"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("MLFLOW_HTTP_REQUEST_MAX_RETRIES", "0")
    caplog.set_level(logging.DEBUG)


@pytest.fixture
def run(
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    capfd: pytest.CaptureFixture[str],
) -> Any:
    """The command line as a process has it; nothing that it says, anywhere, may hold the secret."""

    def run(*words: str | Path) -> Result:
        arguments = [str(word) for word in words]
        monkeypatch.setattr(sys, "argv", ["/usr/bin/pyroshock", *arguments])
        result = CliRunner().invoke(main, arguments)
        assert result.exception is None or isinstance(result.exception, SystemExit), (
            result.exception
        )
        beside = capfd.readouterr()
        for said in (result.output, result.stderr, beside.out, beside.err, caplog.text):
            assert SECRET not in said
        return result

    return run


@pytest.fixture
def secret_db(postgres_url: str) -> Iterator[str]:
    """An empty database that is opened with a password; the server takes any."""
    server = make_url(postgres_url)
    if server.password is not None:
        pytest.skip("the given server asks for its own password")
    name = f"pyroshock_{uuid.uuid4().hex}"
    _execute(server, f'CREATE DATABASE "{name}"')
    yield server.set(database=name, password=f"{SECRET}@/:").render_as_string(hide_password=False)
    _execute(server, f'DROP DATABASE "{name}" WITH (FORCE)')


def texts_of(db: str) -> str:
    with opened(db) as store, store.reading() as session:
        return "\n".join(
            str(row) for table in metadata.sorted_tables for row in session.execute(select(table))
        )


def test_no_command_tells_or_keeps_the_password_of_its_store(
    run: Any, secret_db: str, tmp_path: Path
) -> None:
    by_query = make_url(secret_db)._replace(password=None).update_query_dict({"password": SECRET})
    other = by_query.render_as_string(hide_password=False)
    folder = hammer_campaign(tmp_path / "spring", recordings=1, hits=1, name="spring")
    said = run("campaigns", "--db", secret_db)
    assert (
        said.exit_code == 2
        and "pyroshock init --db postgresql+psycopg://postgres:***@" in said.stderr
    )
    assert run("init", "--db", secret_db).exit_code == 0
    assert run("ingest", folder, f"--db={other}", "--jobs", "1").exit_code == 0
    plan = ("plan", "factorial", "mine", "--factors", "factors.toml", "--repetitions", "1")
    assert run(*plan, "--db", secret_db).exit_code == 0
    for words in (
        ("impacts", "--json"),
        ("db", "roles", "--json"),
        ("db", "upgrade"),
        ("dataset", "build", "d", "--from", "nothing"),
        ("models",),
        ("diagnose", "nothing"),
        ("export", "impacts", "--out", tmp_path / "no" / "where.csv"),
    ):
        run(*words, "--db", secret_db)
    kept = texts_of(secret_db)
    assert "--db=postgresql+psycopg://postgres@/" in kept and "password=***" in kept
    assert "--db postgresql+psycopg://postgres:***@/" in kept and SECRET not in kept


@pytest.mark.slow
def test_no_training_keeps_it(
    run: Any, secret_db: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither MLflow's database, which has a password too, nor the files of the models."""
    name, server = f"mlflow_{uuid.uuid4().hex}", make_url(secret_db)
    _execute(server.set(database="postgres"), f'CREATE DATABASE "{name}"')
    tracking = server.set(database=name).render_as_string(hide_password=False)
    monkeypatch.setenv("MLFLOW_TRACKING_URI", tracking)
    assert (
        run(
            "ingest", full_campaign(tmp_path / "spring"), "--db", secret_db, "--jobs", "1"
        ).exit_code
        == 0
    )
    assert run("dataset", "build", "pulses", "--from", "spring", "--db", secret_db).exit_code == 0
    trained = run(
        "train", "pulses", "--models", "linear", "--split", "repetitions", "--db", secret_db
    )
    assert trained.exit_code == 0, trained.stderr
    files = [file for file in tmp_path.rglob("*") if file.is_file()]
    assert any(file.name == "model.json" for file in files)
    assert [file for file in files if SECRET.encode() in file.read_bytes()] == []
    engine, tables = create_engine(tracking), MetaData()
    tables.reflect(engine)
    with engine.connect() as connection:
        kept = [
            str(row) for table in tables.sorted_tables for row in connection.execute(select(table))
        ]
    engine.dispose()
    _execute(server.set(database="postgres"), f'DROP DATABASE "{name}" WITH (FORCE)')
    assert any("linear" in row for row in kept) and [row for row in kept if SECRET in row] == []
    assert SECRET not in texts_of(secret_db)


def test_an_older_and_a_newer_store_are_told_without_it(
    run: Any, secret_db: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    run("init", "--db", secret_db)
    with monkeypatch.context() as patch:
        patch.setattr(migrate, "HEAD", "9998")
        said = run("campaigns", "--db", secret_db)
    assert said.exit_code == 2 and "pyroshock db upgrade --db postgresql" in said.stderr
    engine = make_engine(secret_db)
    for revision, step in (
        ("0003", "older than 0013"),
        ("9999", "update pyroshock"),
    ):
        with engine.begin() as connection:
            connection.exec_driver_sql(f"UPDATE alembic_version SET version_num = '{revision}'")
        said = run("campaigns", "--db", secret_db)
        assert said.exit_code == 2 and step in said.stderr
    engine.dispose()


@pytest.mark.parametrize("address", [
    f"postgresql+psycopg://me:{SECRET}@127.0.0.1:1/none",
    f"postgresql+psycopg://me:p@{SECRET}@127.0.0.1:1/none",
    f"postgresql+psycopg://me:p@{SECRET}:x@127.0.0.1:1/none",
    f"postgresql+psycopg://me@127.0.0.1:1/none?password={SECRET}",
    f"postgresql+psycopg://me@127.0.0.1:1/none?sslpassword={SECRET}&passwd={SECRET}",
    f"host=127.0.0.1 port=1 password={SECRET}",
    f"host=127.0.0.1 password='a {SECRET}'",
    f"me:{SECRET}@host/db",
    f"mysql://me:{SECRET}@host/db",
    f"nothing://me:{SECRET}@host/db",
])  # fmt: skip
def test_an_address_that_fails_is_told_without_it(
    run: Any, monkeypatch: pytest.MonkeyPatch, address: str
) -> None:
    assert run("campaigns", "--db", address).exit_code == 2
    assert run("predict", "--tank-pressure", "nonsense", "--db", address).exit_code == 2
    assert run("campaigns", address).exit_code == 2  # an argument too many is quoted
    assert run(f"--db={address}", "campaigns").exit_code == 2
    monkeypatch.setenv("PYROSHOCK_DB", address)
    assert run("init", "--help").exit_code == 0 and run("db", "upgrade").exit_code == 2


@pytest.mark.parametrize("uri", [
    f"http://me:{SECRET}@127.0.0.1:1",
    f"https://{SECRET}@127.0.0.1:1/mlflow",
    f"postgresql+psycopg://me:p@{SECRET}@127.0.0.1:1/none",
    f"file://me:{SECRET}@host/folder",
    f"me:{SECRET}@host/folder",
])  # fmt: skip
def test_a_registry_that_fails_is_told_without_it(
    run: Any, monkeypatch: pytest.MonkeyPatch, uri: str
) -> None:
    run("init", "--db", "sqlite:///lab.db")
    monkeypatch.setenv("MLFLOW_TRACKING_URI", uri)
    assert run("models", "--db", "sqlite:///lab.db").exit_code == 2


def test_the_token_of_a_server_is_not_kept_or_told_over_http(
    run: Any, tmp_path, monkeypatch, caplog
) -> None:
    """The command that made the store is stored with its first rows."""
    monkeypatch.setattr(cli, "_listen", lambda *_: None)
    token = f"{SECRET}-and-more-of-it"
    assert run("serve", "--db", f"sqlite:///{tmp_path}/lab.db", "--token", token).exit_code == 0
    assert f"serve --db sqlite:///{tmp_path}/lab.db --token ***" in texts_of(
        f"sqlite:///{tmp_path}/lab.db"
    )
    caplog.set_level(logging.WARNING, "httpx2")  # the client's own log
    by_token = {"Authorization": f"Bearer {token}"}
    with window(f"sqlite:///{tmp_path}/lab.db", token=token, folders=(tmp_path,)) as (client, _):
        answers = [
            client.get(f"/campaigns?token={token}"),
            client.get("/campaigns", headers=by_token),
        ]
        client.headers |= by_token
        answers += [
            client.get(path)
            for path in ("/campaigns", "/jobs", "/api/openapi.json", "/models", "/nothing")
        ]
        answers += [post_json(client, "/api/ingest", {"path": f"postgresql://me:{SECRET}@host/db"})]
    for answer in answers:
        assert SECRET not in answer.text and SECRET not in str(answer.headers.get("location"))
    assert SECRET not in caplog.text and SECRET not in texts_of(f"sqlite:///{tmp_path}/lab.db")
