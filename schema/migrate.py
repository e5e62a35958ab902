"""Where a store stands, and how Alembic moves it. Alembic is imported to move a store, not to look
at one."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING

from sqlalchemy import Connection, Engine, inspect, text
from sqlalchemy.exc import DBAPIError

from .access.permissions import refusal
from .engine import StoreVersionError
from .tables import metadata

if TYPE_CHECKING:
    from alembic.config import Config
    from alembic.script import ScriptDirectory

#: The revision that this software reads and writes: the newest in `migrations/versions` (a test
#: holds it to that).
HEAD = "0021"
#: Who makes or moves a store on PostgreSQL holds it. Any number will do that no other program on
#: the server takes.
MIGRATION_LOCK = 0x5EED
#: The scripts of Alembic act on one connection for the whole process: two threads that make stores
#: at once, as two exports do, would make the tables of both in one of them.
_ONE_AT_A_TIME = Lock()


def config(engine: Engine | None = None) -> Config:
    """Alembic's configuration, without a file: the scripts lie in `migrations/` beside this module.

    Parameters:
        engine: The engine of the store that is moved; by default none, for what only reads the
            scripts.
    """
    from alembic.config import Config

    settings = Config()
    settings.set_main_option(
        "script_location", str(Path(__file__).parent / "migrations").replace("%", "%%")
    )
    settings.set_main_option("path_separator", "os")
    if engine is not None:
        settings.attributes["engine"] = engine
    return settings


@cache
def _scripts() -> ScriptDirectory:
    from alembic.script import ScriptDirectory

    return ScriptDirectory.from_config(config())


@cache
def known_revisions() -> tuple[str, ...]:
    """All revisions, oldest first."""
    return tuple(script.revision for script in reversed(list(_scripts().walk_revisions())))


def current_revision(engine: Engine) -> str | None:
    """Where the store stands.

    Parameters:
        engine: The engine of the store.

    Returns:
        The revision of the tables; None for an empty place.
    """
    with engine.connect() as connection:
        if not inspect(connection).has_table("alembic_version"):
            return None
        return connection.execute(text("SELECT version_num FROM alembic_version")).scalar()


def upgrade(engine: Engine, revision: str = "head") -> None:
    """Move the store up, in one transaction.

    Parameters:
        engine: The engine of the store.
        revision: The revision at which the move ends; by default the newest.

    Raises:
        StoreError: Where the database refuses, above all because the login is not the owner's.
    """
    from alembic import command

    with _database_errors(engine), _ONE_AT_A_TIME:
        command.upgrade(config(engine), revision)


def make_within(connection: Connection) -> None:
    """Make the tables in an empty place, as a part of a transaction.

    Parameters:
        connection: A connection on which the transaction is open.
    """
    from alembic import command

    settings = config()
    settings.attributes["connection"] = connection
    with _ONE_AT_A_TIME:
        command.upgrade(settings, "head")


def version_error(place: str, address: str, revision: str) -> StoreVersionError:
    """The error of a store of another version of this software: what is to be done.

    Parameters:
        place: The store as the message names it.
        address: The store's address as the command that mends it takes it.
        revision: The revision that the store has.
    """
    printable = revision if revision.isalnum() else repr(revision)
    subject, first = f"{place} is at revision {printable:.40}", known_revisions()[0]
    if revision in known_revisions():
        return StoreVersionError(
            f"{subject}, older than this software: pyroshock db upgrade --db {address}"
        )
    if revision < first:
        return StoreVersionError(
            f"{subject}, older than {first}, the first that this software can upgrade: ingest its "
            f"campaign folders into a new store, or upgrade it by an earlier version first "
            f"(docs/reference/store.md, Backup and upgrade)"
        )
    return StoreVersionError(f"{subject}, which this software does not know: update pyroshock")


@contextmanager
def _database_errors(engine: Engine) -> Iterator[None]:
    """What the database refuses, as an error of ours: above all that this is not the owner's
    login."""
    try:
        yield
    except DBAPIError as error:
        raise refusal(engine, error) from error


def differences(engine: Engine) -> list[object]:
    """What Alembic would still have to change for the tables to be the models': empty when they
    agree.

    Parameters:
        engine: The engine of the store.
    """
    from alembic.autogenerate import compare_metadata
    from alembic.migration import MigrationContext

    with engine.connect() as connection:
        context = MigrationContext.configure(connection, opts={"compare_type": True})
        return list(compare_metadata(context, metadata))
