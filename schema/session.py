"""The one door to the store: opening, version check, reading and writing transactions, and the
materials that every store starts with.

SQLite is the embedded default and PostgreSQL the laboratory's server, through the same code. Nobody
else makes an engine or touches a session's commit.
"""

from __future__ import annotations

import csv
import socket
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib.resources import files
from typing import Any, TypeVar

from sqlalchemy import Connection, Engine, event, func, insert, inspect, select
from sqlalchemy.exc import DBAPIError, IntegrityError
from sqlalchemy.orm import Session, SessionTransaction

from ..plugins import with_packages
from . import migrate
from .access.permissions import refusal
from .addresses import address_for_display
from .audit import AuditEntry, ChangeMark
from .base import Base, WithProvenance
from .benches import Material, MaterialAlias
from .engine import (
    BUSY_TIMEOUT_S,
    StoreError,
    StoreVersionError,
    describe,
    make_engine,
    make_engine_of_existing,
    make_memory_engine,
    no_store,
    one_state,
)
from .person_roles import Person, system_person
from .provenance import Provenance
from .row_hashes import ROW_SHA256, hash_of_new
from .row_keys import reserve_keys
from .row_sealing import seal
from .tables import metadata
from .transactions import get_or_add, is_disconnect, is_transient, is_unique_violation, retry
from .users import SECRET_TABLES

Result = TypeVar("Result")

#: A row that came between looking and writing is seen when looked for again; a rule that is truly
#: broken stays so.
_LOOKS = 5

#: A writing transaction on a server waits as long for another's rows as one on SQLite does, and
#: does not keep its own from the others when its process sleeps (a laptop that was closed).
_WAITS = select(
    func.set_config("lock_timeout", f"{BUSY_TIMEOUT_S:.0f}s", True),
    func.set_config("idle_in_transaction_session_timeout", "300s", True),
)


#: Where a session keeps what tells whether it has changed something.
_MARK = "pyroshock_change_mark"


@dataclass(frozen=True)
class Writer:
    """Who writes: stored with every row. `person`: for whom a server writes; None for whoever runs
    this process."""

    command: str
    software_version: str
    person: Person | None = None

    def insert(self, connection: Connection) -> int:
        """Add this command's provenance row; returns its key.

        Parameters:
            connection: A connection to the store, within the transaction that the row belongs to.
        """
        person = self.person
        user = person.name if person is not None and person.user_id else system_person().name
        row = insert(Provenance).values(
            software_version=with_packages(self.software_version),
            command=self.command,
            user=user,
            host=socket.gethostname(),
            started_at=datetime.now(UTC),
        )
        return int(connection.execute(row.returning(Provenance.id)).scalar_one())


class Store:
    """An open store; `close()` or `with` releases the engine.

    `reading()` and `writing()` give sessions. `read` and `write` run a function in one, and once
    more from the start where what stopped it passes by itself: use them wherever others are at
    work.
    """

    def __init__(self, engine: Engine, writer: Writer) -> None:
        self.engine = engine
        # Made once: with options made anew, each session would look up every event of the engine
        # again (30 µs).
        self._reads = engine.execution_options(**one_state(engine))
        self._writes = engine.execution_options(pyroshock_writes=True)
        self.writer = writer
        #: The change that is being made: its row goes with the first transaction that stores some
        #: of it.
        self.audit: AuditEntry | None = None
        #: Whether the store was made when it was opened.
        self.is_new = False
        self._written_by_id: int | None = None
        self._written_within: SessionTransaction | None = (
            None  # the savepoint that holds the provenance row
        )

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """A session that sees one state of the store and changes nothing."""
        with self._translated(), Session(self._reads) as session:
            yield session

    def read(self, work: Callable[[Session], Result]) -> Result:
        """What `work` returns of a session of `reading`, asked again where the server was lost
        meanwhile.

        Parameters:
            work: A function of the session, which changes nothing. It may be called more than once.
        """

        def attempt() -> Result:
            with self.reading() as session:
                return work(session)

        return retry(attempt, lambda error, _: is_transient(error))

    def write(self, work: Callable[[Session], Result], *, idempotent: bool = False) -> Result:
        """What `work` returns of a session of `writing`, in a transaction of its own.

        It is run again from the start, in a new transaction, after a deadlock, a lock that was not
        had in time, or a connection that was lost, for two minutes at most; and a few times after a
        unique key that another writer took first, so `work` looks for that row itself.

        Parameters:
            work: A function of the session. It must do nothing but write to the session, and keep
                no row of it.
            idempotent: Whether the work finds its own rows by their natural keys, and then leaves
                them. By default it does not. A connection lost in the midst of COMMIT leaves open
                whether all was stored. Idempotent work is run again after that too; of other work
                the error is raised, for it might be stored twice.
        """
        committing = False

        def attempt() -> Result:
            nonlocal committing
            committing = False
            with self.writing() as session:
                result = work(session)
                self._record(session)
                _seal(session)
                committing = True
            return result

        def again(error: Exception, number: int) -> bool:
            if committing and is_disconnect(error):
                return idempotent
            return is_transient(error) or (is_unique_violation(error) and number < _LOOKS)

        return retry(attempt, again)

    @contextmanager
    def writing(self) -> Iterator[Session]:
        """One transaction: everything in the block is stored, or nothing is. See `write` for others
        at work."""
        provenance_id, entry = self._written_by_id, self.audit
        recorded = entry is not None and entry.recorded
        try:
            with self._translated(), Session(self._writes) as session:
                event.listen(session, "before_flush", self._sign)
                event.listen(session, "after_rollback", self._forget_with)
                with session.begin() as transaction:
                    if self.engine.dialect.name == "postgresql":
                        session.execute(_WAITS)
                    if entry is not None and not recorded:
                        session.info[_MARK] = ChangeMark(session)
                    yield session
                    if transaction.is_active:  # the block may have rolled it back
                        self._record(session)
                        _seal(session)
        except BaseException:
            self._written_by_id = provenance_id  # its provenance row went with the transaction
            if entry is not None:
                entry.recorded = recorded  # and so did the row of the audit trail
            raise

    def _record(self, session: Session) -> None:
        """The row of the audit trail, with the first transaction of a change that stores
        something."""
        mark = session.info.get(_MARK)
        if self.audit is None or mark is None or self.audit.recorded or not mark.changed():
            return
        session.add(self.audit.row())
        self.audit.recorded = True

    def written_by(self, session: Session) -> int:
        """Key of this command's provenance row, made on the first row that needs it: a command that
        changes nothing leaves no trace.

        Parameters:
            session: A session of `writing`, in whose transaction the row is made.
        """
        if self._written_by_id is None:
            # Not through the session: this may run within a flush, and no flush runs inside
            # another.
            self._written_by_id = self.writer.insert(session.connection())
            self._written_within = session.get_nested_transaction()
        return self._written_by_id

    def add_rows(
        self, session: Session, table: type[Base], rows: Sequence[Mapping[str, Any]]
    ) -> list[int]:
        """Insert rows of one table in one statement, with this command as their writer.

        Parameters:
            session: A session of `writing`.
            table: The class of the rows.
            rows: The values of each row by column, without its key and its writer. A column that
                only some of the rows name is NULL in the others.

        Returns:
            The keys of the rows, in their order.
        """
        if not rows:
            return []
        every = {name: None for row in rows for name in row} | {
            "written_by_id": self.written_by(session)
        }
        session.flush()
        connection, row_table = session.connection(), metadata.tables[table.__tablename__]
        keys = reserve_keys(connection, row_table, len(rows))
        keyed = [{**every, **row, "id": key} for row, key in zip(rows, keys, strict=True)]
        for row in keyed:
            row[ROW_SHA256] = hash_of_new(connection, row_table, row)
        # Into the table: SQLAlchemy takes as long again for rows of a model.
        connection.execute(insert(row_table), keyed)
        return keys

    def _sign(self, session: Session, _context: Any, _instances: Any) -> None:
        unsigned = [
            row
            for row in session.new
            if isinstance(row, WithProvenance) and row.written_by_id is None
        ]
        for row in unsigned:
            row.written_by_id = self.written_by(session)

    def _forget_with(self, session: Session) -> None:
        """The provenance row went with a savepoint that another writer's row made fail."""
        if (
            self._written_within is not None
            and self._written_within is session.get_nested_transaction()
        ):
            self._written_by_id = None

    @contextmanager
    def _translated(self) -> Iterator[None]:
        try:
            yield
        except IntegrityError:
            raise  # callers resolve races on it, and say what it means
        except DBAPIError as error:
            raise refusal(self.engine, error) from error

    def close(self) -> None:
        self.engine.dispose()

    def __enter__(self) -> Store:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _seal(session: Session) -> None:
    """Give the rows that the session has changed their hashes (see `row_hashes`)."""
    session.flush()
    seal(session.connection())


def open_store(url: str, writer: Writer, *, create: bool = False) -> Store:
    """Open a store.

    Parameters:
        url: Its address, as SQLAlchemy spells it.
        writer: The program that writes, of which every row keeps a note.
        create: Whether an empty place becomes a store first.

    Raises:
        StoreError: Where there is no store.
        StoreVersionError: Where its tables are not this software's.
    """
    return _opened(
        make_engine(url) if create else make_engine_of_existing(url), url, writer, create
    )


def open_scratch_store(writer: Writer) -> Store:
    """An empty store in memory, for figures that nobody keeps: it is gone when it is closed.

    Parameters:
        writer: The program that writes, of which every row keeps a note.
    """
    return _opened(make_memory_engine(), ":memory:", writer, create=True)


def _opened(engine: Engine, url: str, writer: Writer, create: bool) -> Store:
    try:
        is_new = _check_revision(engine, url, create)
        store = Store(engine, writer)
        store.is_new = is_new
        if create:
            seed_materials(store)
        return store
    except DBAPIError as error:
        engine.dispose()
        raise refusal(engine, error, f"cannot use {describe(engine)} as a store") from error
    except UnicodeDecodeError as error:  # SQLite's own message, of a table whose name was damaged
        engine.dispose()
        raise StoreError(
            f"{describe(engine)} is damaged: its names are no text; restore it from its backup"
        ) from error
    except BaseException:  # an interruption, too, leaves no connection open; it is raised again
        engine.dispose()
        raise


def _check_revision(engine: Engine, url: str, create: bool) -> bool:
    """Whether the tables were made; they are those of this software afterwards."""
    revision = migrate.current_revision(engine)
    if revision is None and inspect(engine).get_table_names():
        # Looked at twice: between the two looks another process may have made the store.
        revision = migrate.current_revision(engine)
        if revision is None:
            raise StoreError(f"{describe(engine)} holds tables that are not a pyroshock store")
    if revision == migrate.HEAD:
        return False
    if revision is not None:
        raise migrate.version_error(describe(engine), address_for_display(url), revision)
    if not create:
        raise no_store(engine, url)
    migrate.upgrade(engine)
    return True


def count_rows(store: Store) -> dict[str, int]:
    """Rows per table: what a check or a test compares.

    Parameters:
        store: The open store.

    Returns:
        The number of rows of each table of the store, by the table's name; not of those by which
        people sign in, where the login is a reader's, who may not read them.
    """
    with store.reading() as session:
        return {
            table.name: session.scalar(select(func.count()).select_from(table)) or 0
            for table in metadata.sorted_tables
            if table.name not in SECRET_TABLES or _may_read(session, table.name)
        }


def _may_read(session: Session, table: str) -> bool:
    if session.get_bind().dialect.name != "postgresql":
        return True
    return bool(session.scalar(select(func.has_table_privilege(table, "SELECT"))))


__all__ = [
    "Store",
    "StoreError",
    "StoreVersionError",
    "Writer",
    "count_rows",
    "describe",
    "make_engine",
    "open_scratch_store",
    "open_store",
]


def seed_materials(store: Store) -> None:
    """Add the materials of Table 4.2, and PLA, that the store lacks; a lab's own values stay.

    Parameters:
        store: The open store, which is written to where a material is missing.
    """
    with store.reading() as session:
        material_names = set(session.scalars(select(Material.name)))
    rows = [row for row in _rows() if row["name"] not in material_names]
    if not rows:
        return
    store.write(lambda session: _add(session, rows), idempotent=True)


def _add(session: Session, rows: list[dict[str, str]]) -> None:
    for row in rows:
        # Another process may be making the same store at this moment.
        get_or_add(session, Material, {"name": row["name"]}, _values(row))


def _rows() -> list[dict[str, str]]:
    text = (files(__package__) / "data" / "materials.csv").read_text(encoding="utf-8")
    return list(csv.DictReader(text.splitlines()))


def _values(row: dict[str, str]) -> dict[str, Any]:
    return {
        "youngs_modulus_pa": float(row["youngs_modulus_gpa"]) * 1e9,
        "poisson_ratio": float(row["poisson_ratio"]),
        "density_kg_m3": float(row["density_kg_m3"]),
        "yield_strength_pa": float(row["yield_strength_mpa"]) * 1e6,
        "source": row["source"],
        "aliases": [MaterialAlias(alias=alias) for alias in row["aliases"].split(";") if alias],
    }
