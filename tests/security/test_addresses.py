"""What may be shown of an address, of a text that holds one, and of a command as it was typed."""

from __future__ import annotations

import importlib
import re

import click
import pytest
from pyroshock.app.cli.common import SECRET_OPTIONS, command_line
from pyroshock.app.cli.main import COMMANDS
from pyroshock.app.web.settings import Settings, SettingsError
from pyroshock.schema.addresses import AddressError, address_for_display, parse_address, without_secrets
from pyroshock.training.registry.model_storage import ModelStorage, storage_for


@pytest.mark.parametrize(
    ("typed", "seen"),
    [
        ("postgresql://me:PW@host/db", "postgresql://me:***@host/db"),
        ("postgresql+psycopg://me:P%40W@host:5432/db", "postgresql+psycopg://me:***@host:5432/db"),
        ("postgresql://me:P@W@host/db", "postgresql://me:***@host/db"),
        ("postgresql://me:P@W:x@host:5432/db", "postgresql://me:***@host:5432/db"),
        ("postgresql://me:P/W@host/db", "postgresql://me:***@host/db"),
        ("postgresql://me:P W@host/db", "postgresql://me:***@host/db"),
        ("postgresql://me@host/db?password=PW&sslmode=require", "postgresql://me@host/db?password=***&sslmode=require"),
        ("postgresql://me@host/db?sslpassword=PW", "postgresql://me@host/db?sslpassword=***"),
        ("host=x user=me password=PW dbname=lab", "host=x user=me password=*** dbname=lab"),
        ("host=x password = 'P W' dbname=lab", "host=x password = *** dbname=lab"),
        ("me:PW@host/db", "***@host/db"),
        ("http://me:PW@tracking:5000/mlflow", "http://me:***@tracking:5000/mlflow"),
        ("https://TOKEN@tracking/mlflow", "https://***@tracking/mlflow"),
    ],
)
def test_secrets_of_addresses_are_hidden(typed: str, seen: str) -> None:
    assert address_for_display(typed) == seen


def test_a_text_keeps_all_but_its_secrets() -> None:
    """And an address without secrets all."""
    for address in ("sqlite:///a@b.db", "sqlite:////home/m e/lab é.db", "postgresql+psycopg://me@host/db",
                    "http://127.0.0.1:5000/models/hybrid@3"):  # fmt: skip
        assert address_for_display(address) == without_secrets(address) == address
    said = "no store at postgresql://me:PW@host/db, try http://h:1/x or token=PW; hybrid@3 promoted by me@lab"
    assert without_secrets(said) == (
        "no store at postgresql://me:***@host/db, try http://h:1/x or token=***; hybrid@3 promoted by me@lab"
    )


@pytest.mark.parametrize("address", ["postgresql://me:P@PW@host/db", "postgresql://me:P@PW:x@h:5/db", "me:PW@host"])
def test_an_unreadable_address_is_refused_without_its_password(address: str) -> None:
    with pytest.raises(AddressError) as caught:
        parse_address(address)
    assert "PW" not in str(caught.value) and caught.value.__suppress_context__ | (caught.value.__context__ is None)
    with pytest.raises(AddressError, match="%40"):  # how an @ within a password is written
        parse_address("postgresql://me:P@PW@host/db")


def test_a_command_is_kept_without_its_secrets() -> None:
    words = ["/bin/pyroshock", "serve", "--token", "WORD", "--db=postgresql://me:P W@h/d", "--host", "0.0.0.0"]
    assert command_line(words) == "pyroshock serve --token *** --db=postgresql://me:***@h/d --host 0.0.0.0"
    assert command_line(["x", "serve", "--token=WORD"]) == "x serve --token=***"
    assert command_line(["x", "impacts", "--db", "me:PW@host/d"]) == "x impacts --db ***@host/d"
    assert command_line(["/lib/clone/__main__.py", "ingest", "c"]) == "pyroshock ingest c"  # python -m pyroshock
    assert command_line(["x", "promote", "hybrid@3", "--reason", "a=b"]) == "x promote hybrid@3 --reason a=b"
    # An option of a new command that is called like a secret must be in the list.
    words = {word for command in _commands() for option in command.params for word in option.opts}
    called_so = {word for word in words if word.startswith("--") and re.search("token|password|secret|key", word)}
    assert called_so == set(SECRET_OPTIONS)


def _commands() -> list[click.Command]:
    made = [getattr(importlib.import_module(module, "pyroshock"), name) for module, name, _ in COMMANDS.values()]
    return [each for command in made for each in (command, *getattr(command, "commands", {}).values())]


def test_records_do_not_print_their_secrets() -> None:
    settings = Settings("postgresql://me:PW@host/db", token="a token of PW, long enough")
    place = storage_for("sqlite:///lab.db", {"MLFLOW_TRACKING_URI": "http://me:PW@tracking"})
    assert isinstance(place, ModelStorage) and place.shown == "http://me:***@tracking"
    assert "PW" not in f"{settings!r} {place!r}"
    with pytest.raises(SettingsError, match="every page would show its password") as caught:
        Settings("sqlite://", mlflow="http://me:PW@tracking")
    assert "PW" not in str(caught.value)
