"""What passes by itself is tried again; what stays wrong is told at once."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from threading import Barrier

import pytest
from pyroshock.schema.campaigns import Factor
from pyroshock.schema.session import Store, StoreError, Writer, make_engine, open_store
from pyroshock.schema.transactions import RetryPolicy, retry
from sqlalchemy import event, func, select, text, update
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

WRITER = Writer("pyroshock test", "1.2.3")


@pytest.fixture
def store(tables_url: str) -> Iterator[Store]:
    with open_store(tables_url, WRITER, create=True) as store:
        yield store


@pytest.fixture
def server(store: Store) -> Store:
    if store.engine.dialect.name != "postgresql":
        pytest.skip("a file has no server that may be lost")
    return store


def names(store: Store) -> list[str]:
    return store.read(
        lambda session: list(session.scalars(select(Factor.name).order_by(Factor.name)))
    )


class Clock:
    def __init__(self) -> None:
        self.now_s = 0.0

    def sleep(self, seconds: float) -> None:
        self.now_s += seconds


def test_patience_ends() -> None:
    clock, attempts = Clock(), []

    def attempt() -> None:
        attempts.append(clock.now_s)
        raise OSError("still away")

    with pytest.raises(OSError, match="still away"):
        retry(
            attempt,
            lambda *_: True,
            RetryPolicy(10.0),
            sleep=clock.sleep,
            clock=lambda: clock.now_s,
        )
    pauses = [b - a for a, b in pairwise(attempts)]
    assert 5.0 < clock.now_s <= 10.0
    assert max(pauses) <= 5.0 and pauses[0] < 0.05


def test_taken_key_is_looked_for_again(store: Store) -> None:
    """Another writer adds the row between the look and the write."""
    looks, taken = [], _orig_of(store)

    def add(session: Session) -> int:
        known = session.scalar(select(Factor.id).where(Factor.name == "speed"))
        looks.append(known)
        if known is None:
            session.add(Factor(name="speed"))
            if len(looks) == 1:
                raise IntegrityError("INSERT", {}, taken)
        return len(looks)

    assert store.write(add) == 2
    assert names(store) == ["speed"]


def _orig_of(store: Store) -> BaseException:
    """What the driver says of a key that is taken."""
    with pytest.raises(IntegrityError) as caught, store.writing() as session:
        session.add_all([Factor(name="twice"), Factor(name="twice")])
        session.flush()
    assert caught.value.orig is not None
    return caught.value.orig


def test_broken_rule_is_told(store: Store) -> None:
    attempts = []

    def add(session: Session) -> None:
        attempts.append(1)
        session.add_all([Factor(name="twice"), Factor(name="twice")])

    with pytest.raises(IntegrityError):
        store.write(add)
    assert len(attempts) == 5
    assert names(store) == []


def test_two_that_wait_for_each_other_both_write(server: Store) -> None:
    server.write(lambda session: session.add_all([Factor(name="a"), Factor(name="b")]))
    both = Barrier(2)

    def change(order: str) -> None:
        first = True

        def work(session: Session) -> None:
            nonlocal first
            for name in order:
                session.execute(update(Factor).where(Factor.name == name).values(si_unit=order))
                if first:
                    first = False
                    both.wait(30)

        Store(server.engine, WRITER).write(work)

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(change, ("ab", "ba")))
    units = server.read(lambda session: set(session.scalars(select(Factor.si_unit))))
    assert len(units) == 1


@pytest.mark.parametrize("writes", [True, False], ids=["write", "read"])
def test_lost_connection_is_made_anew(server: Store, writes: bool) -> None:
    attempts = []

    def work(session: Session) -> None:
        attempts.append(1)
        if writes:
            session.add(Factor(name="speed"))
            session.flush()
        if len(attempts) == 1:
            session.execute(text("SELECT pg_terminate_backend(pg_backend_pid())"))
        session.scalar(select(func.count()).select_from(Factor))

    (server.write if writes else server.read)(work)
    assert (len(attempts), names(server)) == (2, ["speed"] * writes)


@pytest.mark.parametrize("idempotent", [True, False])
def test_connection_lost_at_commit(server: Store, idempotent: bool) -> None:
    """Nobody knows whether it was stored: only work that finds its own rows is done again."""
    attempts = []
    url = server.engine.url.render_as_string(hide_password=False)

    def add(session: Session) -> None:
        attempts.append(1)
        if session.scalar(select(Factor.id).where(Factor.name == "speed")) is None:
            session.add(Factor(name="speed"))
        if len(attempts) == 1:
            pid = session.scalar(select(func.pg_backend_pid()))
            event.listen(session, "before_commit", lambda _: _ended(url, pid))

    if idempotent:
        server.write(add, idempotent=True)
        assert (len(attempts), names(server)) == (2, ["speed"])
    else:
        with pytest.raises(StoreError):
            server.write(add)
        assert len(attempts) == 1


def _ended(url: str, pid: int | None) -> None:
    engine = make_engine(url)
    with engine.connect() as connection:
        connection.execute(select(func.pg_terminate_backend(pid, 5000)))
    engine.dispose()


def test_reader_sees_one_state(store: Store) -> None:
    with store.reading() as session:
        before = session.scalar(select(func.count()).select_from(Factor))
        Store(store.engine, WRITER).write(lambda other: other.add(Factor(name="speed")))
        assert session.scalar(select(func.count()).select_from(Factor)) == before
    assert names(store) == ["speed"]


def test_reader_changes_nothing_on_a_server(server: Store) -> None:
    with pytest.raises(StoreError, match="read-only"), server.reading() as session:
        session.execute(text("DELETE FROM factors"))
