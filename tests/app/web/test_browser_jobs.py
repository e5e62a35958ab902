"""In a browser: long work is followed, its failure is read and tried again, and its form takes back
what was typed."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pyroshock.app.jobs.kind import JobResult, RunningJob
from pyroshock.app.jobs.known_kinds import KINDS
from pyroshock.app.jobs.operation_kind import kind_of
from pyroshock.app.jobs.queue import ask
from pyroshock.app.operations.ingest.request import FolderIngest
from pyroshock.app.operations.machine_paths import MachinePath
from pyroshock.app.operations.train.train import TRAIN, Training
from pyroshock.schema.session import Writer, open_store
from support.processes.browsers import Lab, at, page_of, served
from support.processes.odd_jobs import Odd, odd

__all__ = ["odd"]
pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

TELEPHONE = {"width": 390, "height": 844}
_SCROLLS = "document.documentElement.scrollWidth > document.documentElement.clientWidth"


@pytest.fixture
def fresh(tmp_path: Path, odd: Odd) -> Iterator[Lab]:
    """A served store of nothing, whose worker knows the jobs of the test."""
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    with open_store(url, Writer("test", "0"), create=True):
        pass
    (tmp_path / "campaigns").mkdir()
    with served(url, tmp_path / "campaigns") as lab:
        yield lab


def state(page: Any, words: str) -> None:
    page.wait_for_selector(f"#job[data-state={words}]")


def test_empty_list_says_what_will_be_there_and_a_wrong_state_is_marked(browser, fresh):
    with page_of(browser, fresh, **TELEPHONE) as page:
        at(page, "/jobs")
        assert "No jobs yet." in page.inner_text("main") and page.locator("#jobs").count() == 0
        page.select_option("#state", "failed")
        page.click("#filter button")
        page.wait_for_url("**/jobs?state=failed")
        assert "No job is failed." in page.inner_text("main")
        assert at(page, "/jobs?state=lost").status == 422
        assert page.get_attribute("#state", "aria-invalid") == "true" and "lost" in page.inner_text(
            "#state-error"
        )


def test_running_job_shows_progress_and_then_its_result(browser, fresh, odd):
    proceed, begun = threading.Event(), threading.Event()

    def do(work: RunningJob, _: str) -> JobResult:
        work.step(3, 12, "recordings")
        begun.set()
        assert proceed.wait(60)
        return JobResult("/plans", "12 recordings were read.")

    odd.do = do
    key = odd.ask(fresh.store, "reading").key
    try:
        with page_of(browser, fresh, **TELEPHONE) as page:
            at(page, f"/jobs/{key}")
            assert begun.wait(60)
            page.wait_for_selector("#job-progress[value='3'][max='12']")
            assert (
                page.inner_text("#job-count") == "3 of 12"
                and page.inner_text("#job-what") == "recordings"
            )
            assert "It has run for" in page.inner_text(
                "#job-times"
            ) and "remain" in page.inner_text("#job-times")
            assert (
                page.locator("#job-result").count() == 0 and page.locator("#job-stop").is_visible()
            )
            at(page, "/jobs")
            assert "running" in page.locator("#jobs tbody tr", has_text="odd reading").inner_text()
            assert not page.evaluate(_SCROLLS)
            page.click(f"#jobs a[href='/jobs/{key}']")
            page.wait_for_selector("#job[data-state=running]")
            proceed.set()
            state(page, "done")
            assert page.inner_text(
                "#job-words"
            ) == "12 recordings were read." and "It took" in page.inner_text("#job")
            assert (
                not page.locator("#job-stop").is_visible()
                and page.locator("#job-progress").count() == 0
            )
            page.click("#job-result")
            page.wait_for_url("**/plans")
    finally:
        proceed.set()


def test_failed_job_says_why_and_is_tried_again(browser, fresh, odd):
    def fail(*_: object) -> JobResult:
        raise ValueError("the tolerance is 0; enter a number above 0")

    odd.do = fail
    key = odd.ask(fresh.store, "search").key
    with page_of(browser, fresh, **TELEPHONE) as page:
        at(page, f"/jobs/{key}")
        state(page, "failed")
        assert (
            "the tolerance is 0" in page.inner_text("#job-error")
            and page.locator("#job-result").count() == 0
        )
        assert "Correct what the message names." in page.inner_text("#job-next")
        at(page, "/jobs?state=failed")
        assert page.locator("#jobs tbody tr").count() == 1
        page.click(f"#jobs a[href='/jobs/{key}']")
        odd.do = lambda *_: JobResult("/plans", "found")
        page.click("#job-again button")
        page.wait_for_url(lambda url: url.rsplit("/", 1)[1] not in ("jobs", str(key)))
        state(page, "done")
        assert page.inner_text("#job-words") == "found"


def test_stopped_job_says_what_became_of_it(browser, fresh, odd):
    begun = threading.Event()

    def until_stopped(work: RunningJob, _: str) -> JobResult:
        for number in range(3000):
            begun.set()
            work.step(number, 3000, "shots")
            threading.Event().wait(0.02)
        raise AssertionError("nobody stopped it")

    odd.do = until_stopped
    key = odd.ask(fresh.store, "long").key
    with page_of(browser, fresh) as page:
        at(page, f"/jobs/{key}")
        assert begun.wait(60)
        page.click("#job-stop button")
        state(page, "stopped")
        assert "What it had stored until then is whole." in page.inner_text("#job-next")
        assert page.locator("#job-again").is_visible()


def refilled(page: Any, lab: Lab, kind: Any, arguments: Any) -> None:
    """Open the form of a job that fails, from its page."""
    key = ask(lab.store, kind, "wrong", arguments).key
    at(page, f"/jobs/{key}")
    state(page, "failed")
    page.click("#job-form")
    page.wait_for_selector("#filled")
    assert f"The values of job {key} are filled in." in page.inner_text("#filled")


def test_form_of_a_plan_is_filled_with_its_long_texts_and_options(browser, fresh):
    factors = 'name = "broken"\nkind = "hammer"\n' + "# " + "x" * 20_000
    wanted = KINDS["plan"].read(
        {
            **{"name": "winter", "method": "lhs", "kind": "hammer", "runs": 12, "seed": 7},
            **{"repetitions": 3, "factors": {"text": factors}, "description": "cold hall"},
            "criterion": "maximin",
        }
    )
    with page_of(browser, fresh) as page:
        refilled(page, fresh, KINDS["plan"], wanted)
        # the factors that the page shows are those of the job's kind
        query = [part.split("=")[0] for part in page.url.split("?")[1].split("&")]
        assert query == ["kind", "again"] and "kind=hammer" in page.url
        typed = {
            name: page.locator(f"[name='{name}']:enabled").input_value()
            for name in ("name", "method", "runs", "repetitions", "seed")
        }
        assert typed == {
            "name": "winter",
            "method": "lhs",
            "runs": "12",
            "repetitions": "3",
            "seed": "7",
        }
        assert page.input_value("#factors") == factors and page.locator("#factors").is_visible()
        assert page.input_value("#criterion-lhs") == "maximin"
        assert page.input_value("#criterion-optimal") == "D"  # its own default, of other choices
        assert page.input_value("#description") == "cold hall"


def test_form_of_an_ingest_is_filled_with_folder_and_settings(browser, fresh):
    gone = fresh.folder / "gone"
    with page_of(browser, fresh) as page:
        refilled(
            page,
            fresh,
            KINDS["ingest"],
            FolderIngest(path=MachinePath(path=gone), segmentation="mask", threshold=0.03),
        )
        assert (
            page.input_value("#path") == "gone" and page.input_value("#path-segmentation") == "mask"
        )
        assert (
            page.input_value("#path-threshold") == "0.03"
            and page.locator("#path-threshold").is_visible()
        )


def test_form_of_a_training_is_filled_with_its_models(browser, lab):
    """The dataset is there, so that the form is; its models cannot be held out as they are asked
    for."""
    wanted = Training(
        dataset="guns",
        models=("linear", "hann"),
        split=("nothing-of-that-name",),
        seed=5,
        budget="full",
    )
    with page_of(browser, lab) as page:
        refilled(page, lab, kind_of(TRAIN), wanted)
        ticked = page.locator("#train input[type=checkbox]:checked")
        assert sorted(box.input_value() for box in ticked.all()) == ["hann", "linear"]
        assert (page.input_value("#dataset"), page.input_value("#budget")) == ("guns", "full")
        assert page.input_value("#seed") == "5"
