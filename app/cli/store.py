"""`init` and `db`: making a store and keeping it."""

from __future__ import annotations

import click

from .common import db_option, errors_as_one_line, note, opened
from .database.carry import export, import_
from .database.check import check
from .database.copy import copy
from .roles import note_missing_roles, roles


@click.command()
@db_option
def init(db: str) -> None:
    """Make an empty store, with the known materials in it. An existing store is left as it is.

    \b
    Example:
        pyroshock init --db sqlite:///lab.db
    """
    with opened(db, create=True) as store:
        from ...schema.engine import describe

        note(f"store ready: {describe(store.engine)}")
        note_missing_roles(store.engine)


@click.group()
def db() -> None:
    """Keep the store."""


for each in (check, copy, export, import_, roles):
    db.add_command(each)


@db.command()
@db_option
def upgrade(db: str) -> None:
    """Bring a store made by an older version up to this one.

    \b
    Example:
        pyroshock db upgrade --db sqlite:///lab.db
    """
    with errors_as_one_line():
        from sqlalchemy.exc import DBAPIError

        from ...schema import migrate
        from ...schema.access.permissions import refusal
        from ...schema.addresses import shown
        from ...schema.engine import StoreError, describe, make_engine_of_existing

        engine = make_engine_of_existing(db)
        try:
            before = migrate.current_revision(engine)
            if before is None:
                raise StoreError(f"no store at {describe(engine)}; make one with: pyroshock init --db {shown(db)}")
            if before not in migrate.known_revisions():
                raise StoreError(
                    f"{describe(engine)} is at revision {before}, which this software does not know: update pyroshock"
                )
            try:
                migrate.upgrade(engine)
            except DBAPIError as error:
                raise refusal(engine, error) from error
            note(f"{describe(engine)}: revision {before} -> {migrate.current_revision(engine)}")
            note_missing_roles(engine)
        finally:
            engine.dispose()
