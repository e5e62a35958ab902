"""Stamps that tell whether a database was written to since, by whatever process."""

from __future__ import annotations

import sqlite3
import threading
from collections.abc import Hashable
from contextlib import suppress
from pathlib import Path

from sqlalchemy import Engine, text
from sqlalchemy.exc import DBAPIError


class ChangeStamp:
    """Equal stamps: no transaction was committed to the database between them.

    SQLite counts for each connection what others have committed (`PRAGMA data_version`). The
    snapshot of PostgreSQL names the transactions that can be seen, those of other databases of the
    server too: then a stamp may differ without a change, never the other way round. For use from
    several threads.
    """

    def __init__(self, database: Path | Engine) -> None:
        """Parameters:
        database: The file of an SQLite database, or an engine. Of a file a connection stays open
            from the first stamp to `close`.
        """
        if isinstance(database, Engine) and database.dialect.name == "sqlite":
            name = database.url.database
            database = Path(name) if name and name != ":memory:" else Path()
        self._database = database
        self._lock = threading.Lock()
        self._connection: sqlite3.Connection | None = None
        self._file: tuple[int, int] | None = None
        self._openings = 0

    def read(self) -> Hashable:
        """The stamp of this moment, in some 20 µs from SQLite; None where there is none to be had:
        of a database in memory, of a file that is not there, and of one that is locked or lost.
        """
        if isinstance(self._database, Engine):
            # A server that is lost gives no stamp, and the page that asks for it tells the fault.
            with suppress(DBAPIError), self._database.connect() as connection:
                return str(connection.scalar(text("SELECT pg_current_snapshot()")))
            return None
        # The same of a file that is not there or locked.
        with self._lock, suppress(OSError, sqlite3.Error):
            return self._read(self._database)
        return None

    def close(self) -> None:
        """Close the connection to the file."""
        with self._lock:
            self._forget()

    def _read(self, file: Path) -> Hashable:
        if not file.name:
            return None
        state = file.stat()
        if self._connection is None or self._file != (state.st_dev, state.st_ino):
            # Another file has taken its place: counts of the two have nothing in common.
            self._forget()
            address = f"{file.absolute().as_uri()}?mode=ro"
            self._connection = sqlite3.connect(
                address, uri=True, timeout=0.0, isolation_level=None, check_same_thread=False
            )
            self._file, self._openings = (state.st_dev, state.st_ino), self._openings + 1
        (version,) = self._connection.execute("PRAGMA data_version").fetchone()
        return self._openings, version

    def _forget(self) -> None:
        if self._connection is not None:
            self._connection.close()
        self._connection = None
