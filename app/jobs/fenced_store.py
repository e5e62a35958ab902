"""The store in the hands of one attempt at a job: it writes while the lease is held, and not a row after."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeVar

from sqlalchemy.orm import Session

from ...schema.session import Store, Writer
from .lease import Lease, hold

Result = TypeVar("Result")


class FencedStore(Store):
    """Each of its transactions begins by holding the lease; one that cannot raises `LeaseLostError`, nothing stored.

    For one thread. Closing it is its maker's who owns the engine.
    """

    def __init__(self, store: Store, lease: Lease, what: str) -> None:
        super().__init__(store.engine, Writer(what, store.writer.software_version))
        self.lease = lease
        self._last: Session | None = None

    @contextmanager
    def reading(self) -> Iterator[Session]:
        if self._last is not None:
            yield self._last
            return
        with super().reading() as session:
            yield session

    @contextmanager
    def writing(self) -> Iterator[Session]:
        if self._last is not None:
            yield self._last
            return
        with super().writing() as session:
            hold(session, self.lease)
            yield session

    def read(self, work: Callable[[Session], Result]) -> Result:
        return super().read(work) if self._last is None else work(self._last)

    def write(self, work: Callable[[Session], Result], *, idempotent: bool = False) -> Result:
        return super().write(work, idempotent=idempotent) if self._last is None else work(self._last)

    def end(self, work: Callable[[Session], Result]) -> Result:
        """What `work` returns of the transaction that ends the job. All that is read and written meanwhile joins it, so
        that a row without a natural key is there exactly where the job is done. Run again as `Store.write` does."""

        def joined(session: Session) -> Result:
            self._last = session
            try:
                return work(session)
            finally:
                self._last = None

        return super().write(joined)
