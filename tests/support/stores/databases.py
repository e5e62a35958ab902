"""Fresh empty databases for the tests, SQLite always, PostgreSQL where a server can be had; and
stores to copy."""

from __future__ import annotations

import os
import shutil
import sqlite3
import uuid
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from itertools import count
from pathlib import Path
from typing import Any
from uuid import uuid4

import pytest
from sqlalchemy import URL, make_url

from support.missing import skip_for_want_of
from support.stores.postgres_server import NoServerError, running_server


@pytest.fixture(scope="session")
def postgres_url() -> Iterator[str]:
    """A PostgreSQL server in which databases may be made: $TEST_DATABASE_URL, or one started for
    the session."""
    given = os.environ.get("TEST_DATABASE_URL")
    if given:
        yield _text(make_url(given).set(drivername="postgresql+psycopg"))
        return
    try:
        with running_server() as url:
            yield url
    except NoServerError as error:
        skip_for_want_of("PostgreSQL", str(error))


@pytest.fixture
def sqlite_url(tmp_path: Path) -> str:
    """An SQLite database that does not exist yet."""
    return f"sqlite:///{tmp_path / 'pyroshock.db'}"


@pytest.fixture(params=["sqlite", "postgresql"])
def database_url(request: pytest.FixtureRequest) -> Iterator[str]:
    """An empty database of each kind in turn, gone after the test."""
    if request.param == "sqlite":
        yield request.getfixturevalue("sqlite_url")
        return
    with fresh_database(request.getfixturevalue("postgres_url")) as url:
        yield url


@pytest.fixture(scope="session")
def sqlite_tables(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file with a store's tables and no row, to be copied."""
    file = tmp_path_factory.mktemp("tables") / "tables.db"
    make_tables(f"sqlite:///{file}")
    return file


@pytest.fixture(scope="session")
def postgres_tables(postgres_url: str) -> Iterator[str]:
    """The name of a database with a store's tables and no row, to be copied."""
    with fresh_database(postgres_url) as url:
        make_tables(url)
        yield str(make_url(url).database)


@pytest.fixture(params=["sqlite", "postgresql"])
def tables_url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """As `database_url`, with the tables of a store: for tests of what is in them, not of how they
    are made.

    A copy of tables is there in a third of the time that making them takes.
    """
    if request.param == "sqlite":
        file = shutil.copy(request.getfixturevalue("sqlite_tables"), tmp_path / "pyroshock.db")
        yield f"sqlite:///{file}"
        return
    server = request.getfixturevalue("postgres_url")
    with fresh_database(server, request.getfixturevalue("postgres_tables")) as url:
        yield url


@pytest.fixture(scope="session")
def postgres_copy(postgres_url: str) -> Iterator[Callable[[Path], AbstractContextManager[str]]]:
    """Of an SQLite store, a PostgreSQL database with its content, gone after the block: read in
    once, then copied."""
    from support.stores.care_stores import copied

    templates: dict[Path, str] = {}
    with ExitStack() as made:

        def copy(store: Path) -> AbstractContextManager[str]:
            if store not in templates:
                url = made.enter_context(fresh_database(postgres_url))
                copied(f"sqlite:///{store}", url)
                templates[store] = str(make_url(url).database)
            return fresh_database(postgres_url, templates[store])

        yield copy


def make_tables(url: str) -> None:
    """Of a store, in an empty database, revision by revision."""
    from pyroshock.schema import migrate
    from pyroshock.schema.engine import make_engine

    engine = make_engine(url)
    try:
        migrate.upgrade(engine)
    finally:
        engine.dispose()


@pytest.fixture(scope="module", params=["sqlite", "postgresql"])
def new_database(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Callable[[], str]]:
    """Each call makes an empty database of each kind in turn, gone after the module: for stores
    that tests only read.

    Making one takes longer than most questions to it.
    """
    if request.param == "sqlite":
        folder, numbers = tmp_path_factory.mktemp("databases"), count(1)
        yield lambda: f"sqlite:///{folder / f'{next(numbers)}.db'}"
        return
    server = request.getfixturevalue("postgres_url")
    with ExitStack() as made:
        yield lambda: made.enter_context(fresh_database(server))


@contextmanager
def fresh_database(server_url: str, like: str = "template1") -> Iterator[str]:
    """A database on a PostgreSQL server, empty or a copy of the one called `like`, gone after the
    block."""
    server = make_url(server_url)
    name = f"pyroshock_{uuid.uuid4().hex}"
    _execute(server, f'CREATE DATABASE "{name}" TEMPLATE "{like}"')
    try:
        yield _text(server.set(database=name))
    finally:
        # A connection the test left open must not keep the database alive: it fails the test by its
        # own warning.
        _execute(server, f'DROP DATABASE "{name}" WITH (FORCE)')


def _execute(server: URL, statement: str) -> None:
    import psycopg

    with psycopg.connect(_text(server.set(drivername="postgresql")), autocommit=True) as connection:
        connection.execute(statement.encode())


def _text(url: URL) -> str:
    return url.render_as_string(hide_password=False)


@pytest.fixture(scope="session", autouse=True)
def quick_stores(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., bool]]:
    """A new SQLite file becomes a store by a copy of its tables: making them takes twenty times as
    long.

    `tests/schema` makes its stores revision by revision, as do processes that tests start. Gives
    what it stands in for.
    """
    from pyroshock.schema import session
    from sqlalchemy import Pool, event

    real_check = session._check_revision
    made: list[Path] = []

    def check(engine: Any, url: str, create: bool) -> bool:
        is_new, place = False, engine.url.database
        if (
            create
            and engine.dialect.name == "sqlite"
            and place
            and place != ":memory:"
            and not Path(place).exists()
        ):
            if not made:
                file = tmp_path_factory.mktemp("tables") / "tables.db"
                make_tables(f"sqlite:///{file}")
                made.append(file)
            is_new = _copy_unless_there(made[0], Path(place))
        return bool(real_check(engine, url, create)) or is_new

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(session, "_check_revision", check)
        event.listen(Pool, "checkout", _forget_the_disk)
        yield real_check
        event.remove(Pool, "checkout", _forget_the_disk)


@pytest.fixture(scope="session", autouse=True)
def compiled_once() -> Iterator[None]:
    """A statement that one store has compiled is not compiled again for the next on such an engine:
    that took a third of the time of all tests with a store.

    A program that opens one store compiles each statement once anyway.
    """
    from sqlalchemy import Engine
    from sqlalchemy.engine.default import DefaultDialect
    from sqlalchemy.util import LRUCache

    compiled: LRUCache[Any, Any] = LRUCache(5_000)
    initialise = Engine.__init__

    def make(engine: Engine, *arguments: Any, **options: Any) -> None:
        initialise(engine, *arguments, **options)
        engine._compiled_cache = compiled

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Engine, "__init__", make)
        patch.setattr(
            DefaultDialect,
            "__eq__",
            lambda dialect, other: _dialect_key(dialect) == _dialect_key(other),
        )
        patch.setattr(DefaultDialect, "__hash__", lambda dialect: hash(_dialect_key(dialect)))
        yield


def _dialect_key(dialect: Any) -> tuple[Any, ...]:
    """What the text of a compiled statement depends on."""
    return (type(dialect), dialect.paramstyle, getattr(dialect, "server_version_info", None))


def _copy_unless_there(tables: Path, place: Path) -> bool:
    """In one step, for others may make a store there at the same moment. What a folder refuses is
    found out later. Whether the copy is there."""
    is_there = False
    beside = place.with_name(f"{place.name}.{uuid4().hex}")
    with suppress(OSError):
        shutil.copyfile(tables, beside)
        with suppress(FileExistsError):
            os.link(beside, place)
            is_there = True
    with suppress(OSError):
        beside.unlink()
    return is_there


def _forget_the_disk(connection: Any, _record: Any, _proxy: Any) -> None:
    """What a process has written outlives it; waiting for the disk guards against the machine's end
    alone."""
    if isinstance(connection, sqlite3.Connection) and not connection.in_transaction:
        connection.execute("PRAGMA synchronous = OFF")


@pytest.fixture(scope="session")
def care_source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the store `lab.db`, and of the campaign folders that it was filled from; tests
    only read it."""
    from support.stores.care_stores import fill

    folder = tmp_path_factory.mktemp("care")
    fill(folder)
    return folder


@pytest.fixture
def care_copy(care_source: Path, tmp_path: Path) -> str:
    """The address of an SQLite copy that a test may change."""
    shutil.copyfile(care_source / "lab.db", tmp_path / "lab.db")
    return f"sqlite:///{tmp_path / 'lab.db'}"


@pytest.fixture(params=["sqlite", "postgresql"])
def care_store(request: pytest.FixtureRequest, care_source: Path) -> Iterator[str]:
    """The same on either engine in turn."""
    if request.param == "sqlite":
        yield request.getfixturevalue("care_copy")
        return
    with request.getfixturevalue("postgres_copy")(care_source / "lab.db") as url:
        yield url


@pytest.fixture
def postgres_database(postgres_url: str) -> Iterator[str]:
    """An empty PostgreSQL database."""
    with fresh_database(postgres_url) as url:
        yield url
