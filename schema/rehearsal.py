"""A dry run: what would be stored is written, told and taken back, in one transaction that never
ends well."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from sqlalchemy.orm import Session

from .engine import NoStoreError
from .session import Store, Writer, open_store


class RolledBackStore(Store):
    """A store whose transactions are parts of one, which is rolled back; what was written is read
    until then.

    The transaction begins with the first writing, and others' writers wait for it as for any other:
    read files before.
    """

    def __init__(self, store: Store, within: ExitStack) -> None:
        super().__init__(store.engine, store.writer)
        self._within = within
        self._session: Session | None = None

    @contextmanager
    def reading(self) -> Iterator[Session]:
        if self._session is not None:
            yield self._session
            return
        with super().reading() as session:
            yield session

    @contextmanager
    def writing(self) -> Iterator[Session]:
        if self._session is None:
            self._session = self._within.enter_context(super().writing())
        provenance_id = self._written_by_id
        try:
            with self._translated(), self._session.begin_nested():
                yield self._session
        except (
            BaseException
        ):  # what was written is rolled back, its provenance with it; it is raised again
            self._written_by_id = provenance_id
            raise


class _TakenBack(Exception):
    """Ends the transaction of a rehearsal."""


@contextmanager
def run_rehearsal(store: Store) -> Iterator[RolledBackStore]:
    """The store to write to in the block; at its end nothing of it is stored."""
    try:
        with ExitStack() as within:
            yield RolledBackStore(store, within)
            raise _TakenBack
    except _TakenBack:
        pass


@contextmanager
def open_for_rehearsal(url: str, writer: Writer) -> Iterator[Store]:
    """The store at `url`; where there is none, an empty one that is gone after the block, and none
    is made at `url`.

    Raises `StoreError` for an unusable address.
    """
    try:
        store = open_store(url, writer)
    except NoStoreError:
        with TemporaryDirectory(prefix="pyroshock-") as folder:
            place = f"sqlite:///{Path(folder) / 'empty.db'}"
            with open_store(place, writer, create=True) as store:
                yield store
        return
    with store:
        yield store
