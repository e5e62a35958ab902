"""`db roles`: who may do what in a store on PostgreSQL."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from .common import db_option, note, opened
from .listed import Listing, listing_options

if TYPE_CHECKING:
    from sqlalchemy import Engine


@click.command()
@db_option
@listing_options
def roles(db: str, listing: Listing) -> None:
    """Make reader, operator and admin of a store on PostgreSQL, grant what they lack, and list who has them.

    The migrations do so, too, where their login may make roles. A login is given one in SQL:
    GRANT pyroshock_operator TO "alice".

    \b
    Example:
        pyroshock db roles --db postgresql+psycopg://keeper@server/lab
    """
    with opened(db) as store:
        from dataclasses import asdict

        from ...schema.access.roles import ensure_roles

        rows = [asdict(role) for role in ensure_roles(store.engine)]
    listing.show(rows, "none", lambda row: {**row, "members": ", ".join(row["members"]) or "-"})


def note_missing_roles(engine: Engine) -> None:
    """Say after `init` and `db upgrade` that a store has no roles yet, and what makes them."""
    from ...schema.access.roles import without_roles

    if (missing := without_roles(engine)) is not None:
        note(missing)
