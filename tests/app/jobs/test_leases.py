"""A dead worker's job is the next one's, and what a late one still writes or registers is not
stored."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from datetime import datetime, timedelta, tzinfo
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from pyroshock.app.jobs import claims, heartbeat, queue, worker
from pyroshock.app.jobs.claims import Claimed, Sighting, running, stop, take_over
from pyroshock.app.jobs.heartbeat import fail, give_back, look, send_heartbeat, stopped
from pyroshock.app.jobs.kind import JobResult, RunningJob
from pyroshock.app.jobs.known_kinds import KINDS
from pyroshock.app.jobs.lease import FencedStore, Lease, LeaseLostError
from pyroshock.app.jobs.queue import ask, get_job
from pyroshock.app.jobs.worker import Watch, WorkerContext, attempt
from pyroshock.app.operations.diagnose.request import DiagnosisRequest
from pyroshock.app.operations.train.train import fenced_registry
from pyroshock.schema.campaigns import Plan
from pyroshock.schema.diagnoses import Diagnosis
from pyroshock.schema.engine import StoreError
from pyroshock.schema.jobs import DONE, FAILED, RUNNING, STOPPED, WAITING
from pyroshock.schema.session import Store
from pyroshock.training.registry.registry import Registry
from sqlalchemy import func, select
from support.processes.odd_jobs import LEASE_S, Odd, claimed, hand, odd, work_off, working
from support.records.campaigns import hammer_campaign
from support.records.verdicts import verdict
from support.stores.databases import fresh_database
from support.stores.stores import ingested, opened
from support.stores.web_stores import FACTORS

# --- Models of a training that was taken over: registered by the one that holds the lease, and not
# again by the other
__all__ = ["odd"]


def registry_of_holder(file_store: Store, lease: Lease) -> Registry:
    url = file_store.engine.url.render_as_string(False)
    return fenced_registry(url, FencedStore(file_store, lease, "test"))


def test_only_the_holder_registers_and_nobody_twice(
    file_store: Store, odd: Odd, monkeypatch: pytest.MonkeyPatch
):
    registered: list[Any] = []

    def record(self: Registry, trained: Any, session: str | None = None) -> Any:
        registered.append(SimpleNamespace(task_key=trained.task.key))
        return registered[-1]

    monkeypatch.setattr(Registry, "record", record)
    monkeypatch.setattr(Registry, "versions", lambda self: registered)
    first_model, two = (SimpleNamespace(task=SimpleNamespace(key=key)) for key in ("one", "two"))
    odd.ask(file_store)
    late = registry_of_holder(file_store, claimed(file_store).lease)
    late.record(first_model)  # of a trained model, its task's key
    taken = take_over(file_store, hand("next"), running(file_store, hand())[0])
    assert taken is not None
    own_registry = registry_of_holder(file_store, taken.lease)
    assert own_registry.record(first_model) is registered[0]
    with pytest.raises(LeaseLostError):
        late.record(two)
    own_registry.record(two)
    assert [version.task_key for version in registered] == ["one", "two"]
    stopped(file_store, taken.lease)


# --- A dead worker's job is the next one's, and what a late one still writes is not stored
# --------------------------
PLAN = KINDS["plan"]
PLANNED = PLAN.read(
    {
        **{"name": "spring", "method": "factorial", "kind": "hammer", "seed": 1},
        **{"repetitions": 1, "factors": {"text": FACTORS}},
    }
)


@pytest.fixture(scope="module")
def file_store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Store]:
    """For what is the same on both engines. Every test ends the jobs that it asks for."""
    with opened(f"sqlite:///{tmp_path_factory.mktemp('leases')}/lab.db", create=True) as found:
        yield found


@pytest.fixture(scope="module")
def server_store(postgres_url: str) -> Iterator[Store]:
    with fresh_database(postgres_url) as url, opened(url, create=True) as found:
        yield found


@pytest.fixture(params=["file_store", "server_store"])
def store(request: pytest.FixtureRequest) -> Store:
    """Of each engine in turn."""
    found: Store = request.getfixturevalue(request.param)
    return found


def rows(store: Store, table: type[Plan] | type[Diagnosis]) -> int:
    with store.reading() as session:
        return session.scalar(select(func.count()).select_from(table)) or 0


def test_a_late_worker_changes_nothing(store: Store) -> None:
    """Two workers at one job: the first falls silent, and wakes when the second has its job, and
    again when it is done."""
    before, key = rows(store, Plan), ask(store, PLAN, "Plan spring", PLANNED).key
    late = claimed(store, "late").lease
    second = take_over(store, hand("second"), running(store, hand())[0])
    assert second is not None and (second.lease.attempt, get_job(store, key).worker) == (
        2,
        "second",
    )
    _try_everything(store, late.job, late)
    assert attempt(WorkerContext(store, "", LEASE_S), second)
    _try_everything(store, late.job, late)
    found = get_job(store, key)
    assert (found.state, found.error, found.attempt, rows(store, Plan)) == (
        DONE,
        None,
        2,
        before + 1,
    )


def _try_everything(store: Store, key: int, late: Lease) -> None:
    before, fenced = get_job(store, key), FencedStore(store, late, "late")
    with pytest.raises(LeaseLostError), fenced.writing() as session:
        session.add(Plan(name="late", kind="gun", factors="", method="lhs"))
    with pytest.raises(LeaseLostError):
        fenced.write(
            lambda session: session.add(Plan(name="late", kind="gun", factors="", method="lhs"))
        )
    with pytest.raises(LeaseLostError):
        fenced.end(
            lambda session: heartbeat.finish(
                session, late, JobResult("/late"), heartbeat.JobProgress()
            )
        )
    for late_end in (
        lambda: fail(store, late, "late"),
        lambda: stopped(store, late),
        lambda: give_back(store, late),
    ):
        with pytest.raises(LeaseLostError):
            late_end()
    assert (
        not send_heartbeat(store, late, heartbeat.JobProgress(9, 9, "late")).held
        and not look(store, late).held
    )
    assert get_job(store, key) == before


def test_a_worker_that_writes_cannot_lose_its_job_meanwhile(store: Store, odd: Odd) -> None:
    """Its row is held: nobody waits for it, nobody takes the job, and a transaction that ends
    counts as a beat."""
    odd.ask(store)
    lease, seen = claimed(store).lease, running(store, hand())[0]
    outcome: list[object] = []
    other = threading.Thread(target=lambda: outcome.append(take_over(store, hand("second"), seen)))
    with FencedStore(store, lease, "first").writing():
        other.start()
        other.join(0.3)  # on a file it waits for its turn to write
    other.join(20)
    assert outcome == [None] and look(store, lease).held
    stopped(store, lease)


def test_a_job_without_its_worker_is_done_once_or_stopped(store: Store, odd: Odd) -> None:
    key = odd.ask(store).key
    claimed(store)
    began = time.monotonic()
    assert work_off(store) == 1 and time.monotonic() - began >= LEASE_S
    found = get_job(store, key)
    assert (found.state, found.attempt) == (DONE, 2)
    key = odd.ask(store).key
    claimed(store)
    assert stop(store, key).state == RUNNING
    work_off(store)
    assert get_job(store, key).state == STOPPED


def test_twenty_workers_get_a_job_each(store: Store, odd: Odd) -> None:
    keys = {odd.ask(store, str(i)).key for i in range(30)}
    got: list[int] = []
    start = threading.Barrier(20)

    def take(number: int) -> None:
        start.wait(20)
        while (found := claims.claim_waiting(store, hand(str(number)))) is not None:
            got.append(found.lease.job)

    threads = [threading.Thread(target=take, args=(number,)) for number in range(20)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    # With locked rows skipped, one may find nothing free while the last are being taken: none is
    # taken twice.
    assert len(got) == len(set(got)) and set(got) == keys
    for key in keys:
        stopped(store, Lease(key, 1))


def test_a_living_worker_keeps_its_job(file_store: Store, odd: Odd) -> None:
    """Four leases long, beside a worker that would take it, while the time of day runs backwards
    for both."""
    go_on = threading.Event()

    def do(work: RunningJob, _word: str) -> None:
        assert go_on.wait(20)

    odd.do = do
    with working(file_store, name="first"):
        key = odd.ask(file_store).key
        while get_job(file_store, key).state == WAITING:
            time.sleep(0.01)
        with working(file_store, name="second"):
            time.sleep(4 * LEASE_S)
            found = get_job(file_store, key)
            assert (found.state, found.attempt, found.worker) == (RUNNING, 1, "first")
            go_on.set()
            while not get_job(file_store, key).ended:
                time.sleep(0.01)


class Backwards(datetime):
    """A clock that is set back by an hour whenever somebody looks."""

    looks = 0

    @classmethod
    def now(cls, tz: tzinfo | None = None) -> datetime:  # type: ignore[override]
        cls.looks += 1
        return datetime(2026, 3, 29, 3, tzinfo=tz) - timedelta(hours=cls.looks)


def test_a_clock_that_goes_backwards_changes_nothing(
    file_store: Store, odd: Odd, monkeypatch: pytest.MonkeyPatch
):
    for module in (claims, queue, heartbeat):
        monkeypatch.setattr(module, "datetime", Backwards)
    monkeypatch.setattr(time, "time", lambda: 1e9 - Backwards.looks)
    test_a_living_worker_keeps_its_job(file_store, odd)
    odd.do = lambda *_: None
    key = odd.ask(file_store).key
    claimed(file_store)
    assert work_off(file_store) == 1
    found = get_job(file_store, key)
    assert (found.state, found.attempt) == (DONE, 2)
    assert found.ended_at is not None and found.ended_at < found.asked_at, (
        "the clock did not go backwards"
    )


def test_a_lease_is_measured_by_the_watchs_own_stopwatch() -> None:
    now = [0.0]
    watch = Watch(clock=lambda: now[0])
    seen = Sighting(1, 1, 5, 0, lease_s=30.0)
    assert watch.silent([seen]) == [] and watch.undecided
    now[0] = 29.9
    assert watch.silent([seen]) == []
    moved = Sighting(1, 1, 6, 0, lease_s=30.0)
    now[0] = 30.0
    assert watch.silent([moved]) == [] and not watch.undecided
    now[0] = 59.9
    assert watch.silent([moved]) == []
    watch.forget()  # the store was away
    now[0] = 60.0
    assert watch.silent([moved]) == []
    now[0] = 90.0
    assert watch.silent([moved]) == [moved] and watch.silent([]) == [] and not watch.undecided


def test_a_job_that_kills_its_workers_fails_with_words(file_store: Store, odd: Odd) -> None:
    key = odd.ask(file_store).key
    claimed(file_store)
    for _ in range(2):
        watch = Watch()
        while not (silent := watch.silent(running(file_store, hand()))):
            time.sleep(0.02)
        assert take_over(file_store, hand("dead too"), silent[0]) is not None
    assert get_job(file_store, key).attempt == 3 and work_off(file_store) == 0
    found = get_job(file_store, key)
    assert found.state == FAILED and "3 workers in turn were killed at it" in str(found.error)


def test_a_worker_that_wakes_too_late_ends_quietly(
    file_store: Store, odd: Odd, monkeypatch: pytest.MonkeyPatch
):
    """It sleeps in the midst of its work, and its beats with it; then it goes on as if nothing had
    been."""
    asleep, wake, steps_taken = threading.Event(), threading.Event(), []

    def do(work: RunningJob, _word: str) -> None:
        if work.store.lease.attempt == 1:
            asleep.set()
            assert wake.wait(20)
        with work.store.writing() as session:
            session.add(
                Plan(name=f"odd {work.store.lease.attempt}", kind="gun", factors="", method="lhs")
            )
        steps_taken.append(work.store.lease.attempt)

    def away(*_: object) -> None:
        raise StoreError("asleep")

    odd.do = do
    key, first = odd.ask(file_store).key, claimed(file_store, "first")
    with monkeypatch.context() as patch:
        patch.setattr(heartbeat, "send_heartbeat", away)
        patch.setattr(heartbeat, "look", away)
        over: list[bool] = []
        sleeper = threading.Thread(
            target=lambda: over.append(attempt(WorkerContext(file_store, "", LEASE_S), first))
        )
        sleeper.start()
        assert asleep.wait(20)
        second, watch = None, Watch()
        while second is None:
            time.sleep(0.02)
            for silent in watch.silent(running(file_store, hand())):
                second = take_over(file_store, hand("second"), silent)
    assert attempt(WorkerContext(file_store, "", LEASE_S), second)
    wake.set()
    sleeper.join(20)
    assert (over, steps_taken, get_job(file_store, key).state) == ([True], [2], DONE)
    with file_store.reading() as session:
        assert session.scalars(select(Plan.name).where(Plan.name.like("odd %"))).all() == ["odd 2"]


def test_a_diagnosis_and_a_plan_are_kept_once(
    store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two workers die: one when the work is done and before it is stored, one as its row is
    written, not committed."""
    url = store.engine.url.render_as_string(False)
    ingested(url, hammer_campaign(tmp_path / "spring", 1, 1, "spring"))
    monkeypatch.setattr(
        "pyroshock.app.operations.diagnose.diagnosing.run_diagnosis",
        lambda *_: verdict(campaign="spring"),
    )
    before = rows(store, Diagnosis), rows(store, Plan)
    asked = [
        ask(store, KINDS["diagnose"], "Diagnosis", DiagnosisRequest(campaign="spring")).key,
        ask(store, PLAN, "Plan", PLANNED.model_copy(update={"name": "once"})).key,
    ]
    for key in asked:
        taken: Claimed | None = claimed(store)
        for moment in ("before the end", "within the end"):
            assert taken is not None and taken.lease.job == key
            with monkeypatch.context() as patch:
                patch.setattr(worker, "give_back", lambda *_: None)  # a killed worker says nothing
                patch.setattr(worker, "finish", _killed(moment))
                with pytest.raises(KeyboardInterrupt):
                    attempt(WorkerContext(store, url, LEASE_S), taken)
            silent = next(each for each in running(store, hand()) if each.job == key)
            taken = take_over(store, hand("next"), silent) if moment == "before the end" else None
    assert (rows(store, Diagnosis), rows(store, Plan)) == before and work_off(store) == 2
    found = [get_job(store, key) for key in asked]
    assert [(job.state, job.attempt) for job in found] == [(DONE, 3)] * 2
    assert (rows(store, Diagnosis), rows(store, Plan)) == (before[0] + 1, before[1] + 1)
    with store.reading() as session:
        assert found[0].address == f"/diagnoses/{session.scalar(select(func.max(Diagnosis.id)))}"
    assert found[1].result["seed"] == 1


def _killed(moment: str):
    def finish(session, lease, result, progress):
        if moment == "within the end":
            heartbeat.finish(session, lease, result, progress)
            session.flush()
        raise KeyboardInterrupt

    return finish
