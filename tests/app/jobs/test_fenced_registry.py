"""Models of a training that was taken over: registered by the one that holds the lease, and not again by the other."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest
from pyroshock.app.jobs.claims import running, take_over
from pyroshock.app.jobs.kind import RunningJob
from pyroshock.app.jobs.lease import FencedStore, Lease, LeaseLostError
from pyroshock.app.train.job import FencedRegistry
from pyroshock.schema.session import Store
from pyroshock.training.registry.registry import Registry
from support.processes.odd_jobs import Odd, claimed, hand, odd
from support.stores.stores import opened

__all__ = ["odd"]


@pytest.fixture
def store(sqlite_url: str) -> Iterator[Store]:
    with opened(sqlite_url, create=True) as found:
        yield found


def registry(store: Store, lease: Lease) -> FencedRegistry:
    url = store.engine.url.render_as_string(False)
    return FencedRegistry(RunningJob(lease.job, FencedStore(store, lease, "test"), url, lambda *_: None))


def test_only_the_holder_registers_and_nobody_twice(store: Store, odd: Odd, monkeypatch: pytest.MonkeyPatch) -> None:
    registered: list[Any] = []

    def record(self: Registry, trained: Any, session: str | None = None) -> Any:
        registered.append(SimpleNamespace(task_key=trained.task.key))
        return registered[-1]

    monkeypatch.setattr(Registry, "record", record)
    monkeypatch.setattr(Registry, "versions", lambda self: registered)
    one, two = (SimpleNamespace(task=SimpleNamespace(key=key)) for key in ("one", "two"))
    odd.ask(store)
    late = registry(store, claimed(store).lease)
    late.record(one)  # of a trained model, its task's key
    taken = take_over(store, hand("next"), running(store, hand())[0])
    assert taken is not None
    mine = registry(store, taken.lease)
    assert mine.record(one) is registered[0]
    with pytest.raises(LeaseLostError):
        late.record(two)
    mine.record(two)
    assert [each.task_key for each in registered] == ["one", "two"]
