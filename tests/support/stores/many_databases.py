"""Databases made and copied by the dozen, on either engine."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol
from uuid import uuid4

from sqlalchemy import URL, make_url

from support.stores.databases import _execute, _text


class Databases(Protocol):
    """A source of databases, gone at its end."""

    engine: str

    def empty(self) -> str:
        """The address of a new one."""

    def copy(self, url: str) -> str:
        """The address of a new one with the content of another, which nobody has open."""


@dataclass
class Files:
    """SQLite, in a folder. A copy of `models.db` is a `models.db` too, in a folder of its own."""

    folder: Path
    engine: str = "SQLite"

    def empty(self) -> str:
        return f"sqlite:///{self._room() / 'lab.db'}"

    def copy(self, url: str) -> str:
        source = Path(url.removeprefix("sqlite:///"))
        room = self._room()
        for file in source.parent.glob(
            f"{source.name}*"
        ):  # with its write-ahead log, if it has one
            shutil.copy(file, room / file.name)
        return f"sqlite:///{room / source.name}"

    def _room(self) -> Path:
        room = self.folder / uuid4().hex
        room.mkdir()
        return room


@dataclass
class OnServer:
    """PostgreSQL."""

    server: URL
    engine: str = "PostgreSQL"
    made: list[str] = field(default_factory=list)

    def empty(self, options: str = "") -> str:
        return self._made(f" {options}")

    def drop(self) -> None:
        """All of them."""
        while self.made:
            _execute(self.server, f'DROP DATABASE "{self.made.pop()}" WITH (FORCE)')

    def copy(self, url: str) -> str:
        template = make_url(url).database
        # MLflow keeps connections of this process open, and a server copies no database that
        # anybody is in.
        _execute(
            self.server,
            f"SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = '{template}'",
        )
        return self._made(f' TEMPLATE "{template}"')

    def _made(self, template: str) -> str:
        name = f"pyroshock_{uuid4().hex}"
        _execute(self.server, f'CREATE DATABASE "{name}"{template}')
        self.made.append(name)
        return _text(self.server.set(database=name))


@contextmanager
def on_server(url: str) -> Iterator[OnServer]:
    """Databases of the server at this address."""
    databases = OnServer(make_url(url))
    try:
        yield databases
    finally:
        databases.drop()
