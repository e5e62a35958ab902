"""In a browser: the three daily jobs and a diagnosis, done with the pages alone, from an empty
store.

Clicks, choices and typed words are counted, and so is everything that the next step needs and no
page in sight says.
"""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from pyroshock.schema.campaigns import Campaign
from sqlalchemy import select
from support.processes.browsers import Lab, at, ended, page_of, served, wait_drawn
from support.stores.hammer_stores import full_campaign
from support.stores.stores import run_pyroshock

from .test_browser_campaigns import dropped

pytestmark = [pytest.mark.slow, pytest.mark.timeout(1800)]

SHOTS = Path(__file__).resolve().parents[3] / "examples" / "first-shots"


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    """A server over an empty store."""
    folder = tmp_path_factory.mktemp("empty")
    (folder / "campaigns").mkdir()
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("MLFLOW_TRACKING_URI", raising=False)
        run_pyroshock("init", "--db", f"sqlite:///{folder / 'lab.db'}")
        with served(f"sqlite:///{folder / 'lab.db'}", folder / "campaigns") as window:
            yield window


@dataclass
class Walk:
    """A person who goes through a job and knows nothing but what the page in sight says."""

    page: Any
    clicks: int = 0
    choices: int = 0
    words: list[str] = field(default_factory=list)
    looked_up: list[str] = field(default_factory=list)
    begun: float = field(default_factory=time.monotonic)

    def click(self, selector: str) -> None:
        self.clicks += 1
        self.page.click(selector)
        wait_drawn(self.page)

    def tick(self, selector: str) -> None:
        self.choices += 1
        self.page.check(selector)

    def choose(self, selector: str, value: str) -> None:
        if self.page.input_value(selector) != value:
            self.choices += 1
            self.page.select_option(selector, value)

    def name(self, selector: str, word: str) -> None:
        """Type a word of one's own."""
        self.words.append(word)
        self.page.fill(selector, word)

    def job(self, patience_s: float = 900) -> None:
        """Wait for the job whose page is open, and see its result."""
        job = ended(self.page, patience_s)
        assert (job["state"], job["error"]) == ("done", None)
        self.click("#job-result")

    def reads(self, *texts: str) -> None:
        """What the page must say by itself for the next step to be clear; what it does not say is
        looked up."""
        shown = self.page.inner_text("body").lower()
        self.looked_up += [text for text in texts if text.lower() not in shown]


def told(walk: Walk, job: str, most_clicks: int) -> None:
    print(
        f"{job}: {walk.clicks} clicks, {walk.choices} choices, "
        f"{len(walk.words)} typed, {walk.looked_up} looked up, "
        f"{time.monotonic() - walk.begun:.1f} s of the pages"
    )
    assert walk.looked_up == []
    assert walk.clicks <= most_clicks


def test_campaign_is_ingested(browser, lab, tmp_path):
    folder = full_campaign(tmp_path / "my-campaign", "my-campaign")
    with page_of(browser, lab) as page:
        walk = Walk(page)
        at(page, "/")
        walk.reads("Ingest a campaign", "drop its folder")
        walk.click("#first-steps a[href='/ingest']")
        walk.clicks += 1  # the folder is dragged
        dropped(page, folder)
        walk.reads("nothing is stored yet", "would then have")
        walk.click("#store button")
        walk.job()
        walk.reads("my-campaign", "quality")
        assert page.url.endswith("/campaigns/my-campaign")
    told(walk, "ingest a campaign", 4)


def test_models_are_trained_compared_and_promoted(browser, lab):
    with page_of(browser, lab) as page:
        walk = Walk(page)
        at(page, "/")
        walk.click("nav a[href='/models']")
        walk.reads("build a dataset")
        walk.click("#none a[href='/datasets']")
        walk.name("#name", "spring")
        walk.tick("#build input[value='my-campaign']")
        walk.click("#build button")
        page.wait_for_url("**/datasets/spring*")
        walk.reads("pulses", "train models on it")
        walk.click("#to-train")
        walk.tick("#model-linear")
        walk.tick("#model-tree")
        walk.click("#train button")
        walk.job()
        if "/models/compare" not in page.url:
            walk.click("#to-compare")
            for label in ("linear@1", "tree@1"):
                walk.tick(f"#picker input[value^='{label} ']")
            walk.click("#compare-chosen")
        page.wait_for_selector("#sentences")
        walk.reads("linear@1", "tree@1", "reason for")
        walk.name("#promote-1 input[name=reason]", "the first model of this bench")
        walk.click("#promote-1 button")
        page.wait_for_load_state()
        assert "in use" in page.inner_text("body")
    told(walk, "train, compare and promote", 10)


def test_campaign_of_105_runs_is_planned(browser, lab):
    with page_of(browser, lab) as page:
        walk = Walk(page)
        at(page, "/")
        walk.click("nav a[href='/plans']")
        walk.click("#new-plan")
        walk.reads("plate material", "Latin hypercube")
        assert page.input_value("#runs-lhs") == "105"
        walk.name("#name", "summer")
        walk.click("#make button")
        walk.job()
        walk.reads(
            "the plan is usable",
            "drift of the bench",
            "make the plan with “blocks” set to 2",
            "best possible",
            "print the sheet",
        )
        walk.click("text=Print the sheet")
        assert page.locator("tbody tr").count() == 105
    told(walk, "plan 105 runs", 5)


def with_first_shots(browser: Any, lab: Lab) -> None:
    """The five measured shots are in the store: not a part of the job that is counted."""
    with lab.reading() as session:
        stored = set(session.scalars(select(Campaign.name)))
    if "first-shots" in stored:
        return
    shutil.copytree(SHOTS, lab.folder / "first-shots")
    with page_of(browser, lab) as page:
        at(page, "/ingest")
        dropped(page, lab.folder / "first-shots")
        page.click("#store button")
        assert ended(page)["state"] == "done"


def test_gap_of_a_campaign_is_diagnosed(browser, lab):
    with_first_shots(browser, lab)
    with page_of(browser, lab) as page:
        walk = Walk(page)
        at(page, "/")
        walk.click("nav a[href='/diagnoses']")
        walk.choose("#campaign", "first-shots")
        walk.click("#diagnose button")
        walk.job()
        walk.reads("what to do next", "stage")
    told(walk, "diagnose a campaign", 3)


def test_settings_are_searched_for_a_spectrum(browser, lab):
    with_first_shots(browser, lab)
    with page_of(browser, lab) as page:
        walk = Walk(page)
        at(page, "/")
        walk.click("nav a[href='/twin']")
        walk.reads("Search settings for a spectrum", "Give a specification")
        walk.click("#to-tune")
        walk.reads("frequency_hz and level_g", "a header and one line for each break point")
        walk.name("#target", "frequency_hz,level_g\n100,30\n1000,300\n10000,300")
        page.wait_for_selector("#target-sentence:has-text('The specification reaches')")
        walk.click("#begin-search")
        walk.job()
        walk.reads("the next shot", "bar", "target met", "What to try next")
    told(walk, "search settings for a spectrum", 4)
