"""One table from store to store, read back and compared."""

from __future__ import annotations

from sqlalchemy import ColumnElement, Connection, Table

from ..engine import StoreError
from .digest import TableDigest
from .loading import load
from .progress import ProgressBar
from .rows import iter_batches


def transfer(
    origin: Connection, copy: Connection, table: Table, bar: ProgressBar, where: ColumnElement[bool] | None = None
) -> TableDigest:
    """Copy the rows of a table (those `where` holds) as they are; what was read, as a digest."""
    digest = TableDigest()
    try:
        load(copy, table, bar.watch(digest.watch(iter_batches(origin, table, where)), f"copying {table.name}"))
    except StoreError as error:
        raise StoreError(f"{error}; look at the source with: pyroshock db check") from error
    return digest


def verify(copy: Connection, table: Table, written: TableDigest, bar: ProgressBar) -> None:
    """Raise `StoreError` where the table does not hold what was written to it."""
    digest = TableDigest().take(bar.watch(iter_batches(copy, table), f"verifying {table.name}"))
    if digest != written:
        raise StoreError(
            f"table {table.name} does not read back as it was copied ({digest.rows} rows of {written.rows}); "
            "nothing is kept"
        )
