"""In a browser: campaigns are listed, filtered and ingested, and what a page says of them is what is stored."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.impacts import Impact
from pyroshock.schema.recordings import Recording
from sqlalchemy import func, select
from support.processes.browsers import Lab, asked, at, ended, page_of, screenshot
from support.records.campaigns import hammer_campaign

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]


def stored(lab: Lab, campaign: str) -> tuple[int, ...]:
    with lab.reading() as session:
        key = select(Campaign.id).where(Campaign.name == campaign).scalar_subquery()
        return tuple(
            session.scalar(select(func.count()).where(table.campaign_id == key)) or 0 for table in (Recording, Impact)
        )


def names(page: Any) -> list[str]:
    return page.locator("#campaigns tbody td:first-child").all_inner_texts()


def test_list_is_filtered_by_kind_and_name(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/campaigns")
        assert {"first-shots", "modal-hammer-hit", "rehearsal"} <= set(names(page))
        page.select_option("#kind", "hammer")
        page.click("#filter button")
        assert names(page) == ["modal-hammer-hit"]
        page.select_option("#kind", "")
        page.fill("#name", "first")
        page.press("#name", "Enter")
        assert names(page) == ["first-shots"]


def test_campaign_page_holds_its_plan_against_the_shots(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/campaigns/rehearsal")
        coverage = page.locator("#coverage tbody tr").inner_text()
        with lab.reading() as session:
            from pyroshock.doe.plans import read_plan

            done = sum(run.status == "done" for run in read_plan(session, "rehearsal").runs)
        assert coverage.split()[:1] == ["rehearsal"] and str(done) in coverage.split()
        assert page.locator("#achieved tbody tr").count() >= 2
        recordings, impacts = stored(lab, "rehearsal")
        assert f"{impacts} impacts" in page.inner_text("#counts")
        assert f"{recordings} recordings" in page.inner_text("#counts")
        screenshot(page, "campaign", 1150)


def test_campaign_is_ingested_by_its_path(browser, lab):
    hammer_campaign(lab.folder / "by-path", 3, 2, "by-path")
    with page_of(browser, lab) as page:
        at(page, "/campaigns")
        page.click("#to-ingest")
        page.fill("#path", str(lab.folder / "by-path"))
        page.click("#by-path button")
        job = ended(page)
        assert (job["state"], job["done"], job["total"]) == ("done", 3, 3) and stored(lab, "by-path") == (3, 6)
        page.click("#job-result")
        assert "6 impacts, 0 shots, 3 recordings" in page.inner_text("#counts")


@pytest.mark.parametrize("way", ["folder", "zip"])
def test_campaign_is_ingested_by_upload(browser, lab, tmp_path, way):
    name = f"uploaded-{way}"
    sent = hammer_campaign(tmp_path / way, 2, 2, name)
    if way == "zip":
        sent = Path(shutil.make_archive(str(tmp_path / "sent"), "zip", tmp_path, way))
    with page_of(browser, lab) as page:
        at(page, "/ingest")
        page.set_input_files(f"#upload-{way}", sent)
        page.click("#upload button")
        job = ended(page)
        assert (job["state"], job["error"]) == ("done", None) and stored(lab, name) == (2, 4)
        assert asked(page, f"/api/impacts?campaign={name}&limit=9")[3]["campaign"] == name


def test_path_outside_the_folders_is_refused_and_nothing_is_stored(browser, lab, tmp_path):
    hammer_campaign(tmp_path / "elsewhere", 1, 1)
    with lab.reading() as session:
        before = session.scalar(select(func.count()).select_from(Campaign))
    with page_of(browser, lab) as page:
        at(page, "/ingest")
        page.fill("#path", str(tmp_path / "elsewhere"))
        with page.expect_navigation() as gone:
            page.press("#path", "Enter")
        assert gone.value.status >= 400 and page.inner_text("#error")
    with lab.reading() as session:
        assert session.scalar(select(func.count()).select_from(Campaign)) == before
