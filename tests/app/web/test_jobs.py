"""Long work of the server: its order, its progress, its stop and its errors."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import pytest
from pyroshock.app.web.jobs import DONE, FAILED, RUNNING, STOPPED, Job, Jobs, Result, Step
from pyroshock.app.web.user_errors import is_for_the_user


@pytest.fixture
def jobs() -> Iterator[Jobs]:
    found = Jobs(is_for_the_user)
    yield found
    found.close()


def _ended(job: Job) -> Job:
    deadline = time.monotonic() + 10
    while job.ended_at is None or job.state == RUNNING:
        assert time.monotonic() < deadline, job
        time.sleep(0.005)
    return job


def test_jobs_run_one_after_the_other_in_the_order_asked(jobs: Jobs) -> None:
    at_work, order, most = 0, [], 0

    def work(number: int, step: Step) -> Result:
        nonlocal at_work, most
        at_work += 1
        most = max(most, at_work)
        time.sleep(0.01)
        order.append(number)
        at_work -= 1
        return Result("/")

    asked = [jobs.start(f"{i}", lambda step, i=i: work(i, step)) for i in range(5)]
    for job in asked:
        _ended(job)
    assert (order, most) == ([0, 1, 2, 3, 4], 1)


def test_progress_and_result_are_told(jobs: Jobs) -> None:
    seen, go_on = threading.Event(), threading.Event()

    def work(step: Step) -> Result:
        step(3, 7, "recordings/0003.mat")
        seen.set()
        go_on.wait(10)
        return Result("/campaigns/a", "done", {"impacts": 3})

    job = jobs.start("an ingest", work)
    assert seen.wait(10)
    told = job.as_json()
    assert (told["state"], told["done"], told["total"], told["what"]) == (RUNNING, 3, 7, "recordings/0003.mat")
    go_on.set()
    told = _ended(job).as_json()
    assert (told["state"], told["address"], told["result"]) == (DONE, "/campaigns/a", {"impacts": 3})


def test_a_stop_ends_a_job_at_its_next_step(jobs: Jobs) -> None:
    begun, steps = threading.Event(), []

    def work(step: Step) -> Result:
        for i in range(10_000):
            steps.append(i)
            begun.set()
            step(i, 10_000, "")
            time.sleep(0.001)
        return Result("/")

    job = jobs.start("long", work)
    assert begun.wait(10)
    jobs.stop(job.key)
    assert _ended(job).state == STOPPED
    assert len(steps) < 10_000


def test_a_waiting_job_can_be_stopped_before_it_begins(jobs: Jobs) -> None:
    gate, ran = threading.Event(), []
    first = jobs.start("first", lambda step: Result(str(gate.wait(10))))
    second = jobs.start("second", lambda step: Result(str(ran.append(1))))
    jobs.stop(second.key)
    gate.set()
    assert (_ended(first).state, _ended(second).state, ran) == (DONE, STOPPED, [])


def test_errors_of_the_user_keep_their_words_and_ours_say_so(jobs: Jobs, caplog: pytest.LogCaptureFixture) -> None:
    def fails(error: Exception) -> Job:
        def work(step: Step) -> Result:
            raise error

        return _ended(jobs.start("fails", work))

    assert fails(ValueError("tip radius is 0; expected above 0")).error == "tip radius is 0; expected above 0"
    ours = fails(KeyError("secret"))
    assert ours.state == FAILED
    assert "error of pyroshock itself" in str(ours.error)
    assert "Traceback" in caplog.text
    # the next one runs
    assert _ended(jobs.start("next", lambda step: Result("/"))).state == DONE


def test_an_unknown_job_is_named(jobs: Jobs) -> None:
    with pytest.raises(LookupError, match="no job 12"):
        jobs.get(12)


def test_only_the_last_jobs_are_kept(jobs: Jobs) -> None:
    for _ in range(230):
        _ended(jobs.start("short", lambda step: Result("/")))
    assert 200 <= len(jobs.listed()) <= 202
    assert jobs.listed()[0].key == 230
