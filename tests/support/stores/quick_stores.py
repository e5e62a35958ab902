"""What tests spare SQLite: ten revisions for each new store, and waiting for a disk that no test switches off."""

from __future__ import annotations

import os
import shutil
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any
from uuid import uuid4

import pytest

from support.stores.databases import make_tables


@pytest.fixture(scope="session", autouse=True)
def quick_stores(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., None]]:
    """A new SQLite file becomes a store by a copy of its tables: making them takes twenty times as long.

    `tests/schema` makes its stores revision by revision, as do processes that tests start. Gives what it stands in for.
    """
    from pyroshock.schema import session
    from sqlalchemy import Pool, event

    really = session._check_revision
    made: list[Path] = []

    def check(engine: Any, url: str, create: bool) -> None:
        place = engine.url.database
        if create and engine.dialect.name == "sqlite" and place and place != ":memory:" and not Path(place).exists():
            if not made:
                file = tmp_path_factory.mktemp("tables") / "tables.db"
                make_tables(f"sqlite:///{file}")
                made.append(file)
            _copy_unless_there(made[0], Path(place))
        really(engine, url, create)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(session, "_check_revision", check)
        event.listen(Pool, "checkout", _forget_the_disk)
        yield really
        event.remove(Pool, "checkout", _forget_the_disk)


def _copy_unless_there(tables: Path, place: Path) -> None:
    """In one step, for others may make a store there at the same moment. What a folder refuses is found out later."""
    beside = place.with_name(f"{place.name}.{uuid4().hex}")
    with suppress(OSError):
        shutil.copyfile(tables, beside)
        with suppress(FileExistsError):
            os.link(beside, place)
    with suppress(OSError):
        beside.unlink()


def _forget_the_disk(connection: Any, _record: Any, _proxy: Any) -> None:
    """What a process has written outlives it; waiting for the disk guards against the machine's end alone."""
    if isinstance(connection, sqlite3.Connection) and not connection.in_transaction:
        connection.execute("PRAGMA synchronous = OFF")
