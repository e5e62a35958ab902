"""In a browser: campaigns are listed, filtered and ingested, and what a page says of them is what
is stored."""

from __future__ import annotations

import base64
import shutil
from pathlib import Path
from typing import Any

import pytest
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.impacts import Impact
from pyroshock.schema.recordings import QualityFinding, Recording
from sqlalchemy import func, select
from support.processes.browsers import Lab, asked, at, ended, page_of, screenshot
from support.records.campaigns import hammer_campaign, recording_name, replace_in

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]


def stored(lab: Lab, campaign: str) -> tuple[int, ...]:
    with lab.reading() as session:
        key = select(Campaign.id).where(Campaign.name == campaign).scalar_subquery()
        return tuple(
            session.scalar(select(func.count()).where(table.campaign_id == key)) or 0
            for table in (Recording, Impact)
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


CHECK, STORE = 'button[name="dry_run"]', "button.second"
#: Files that are dropped: a script cannot make the entries of a folder, hence their names hold the
#: path.
_DROP = """async (files) => {
  const transfer = new DataTransfer();
  for (const [name, content] of files)
    transfer.items.add(new File([Uint8Array.from(atob(content), c => c.charCodeAt(0))], name));
  const options = { dataTransfer: transfer, bubbles: true, cancelable: true };
  const zone = document.getElementById("drop");
  zone.dispatchEvent(new DragEvent("dragover", options));
  zone.dispatchEvent(new DragEvent("drop", options)); }"""


def dropped(page: Any, folder: Path) -> str:
    """Drop a folder, and wait for what its check says."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    content = [
        [f"{folder.name}/{f.relative_to(folder)}", base64.b64encode(f.read_bytes()).decode()]
        for f in files
    ]
    page.evaluate(_DROP, content)
    page.wait_for_url("**/ingest/checks/*")
    return verdict(page)


def verdict(page: Any) -> str:
    page.wait_for_selector("#verdict")
    return str(page.inner_text("#verdict"))


def error_at(page: Any, field: str) -> str:
    """The message beside a field, which is marked."""
    page.wait_for_selector(f"{field}[aria-invalid]")
    return str(
        page.locator(".field", has=page.locator(field)).last.locator(".field-error").inner_text()
    )


def test_dropped_folder_is_checked_then_stored(browser, lab, tmp_path):
    folder = hammer_campaign(tmp_path / "dropped", 3, 2, "dropped")
    damaged = folder / recording_name(2)
    damaged.write_bytes(damaged.read_bytes()[:100])
    with page_of(browser, lab) as page:
        at(page, "/ingest")
        words = dropped(page, folder)
        assert (
            "Nothing is stored yet" in words
            and "4 impacts would be stored" in words
            and stored(lab, "dropped") == (0, 0)
        )
        assert page.locator("#recordings tbody tr").count() == 3
        assert recording_name(2) in page.inner_text("#set-aside")
        screenshot(page, "check", 1000)
        page.click("#store button")
        assert ended(page)["state"] == "done" and stored(lab, "dropped") == (3, 4)
        page.click("#job-result")
        assert "could not be read and was set aside" in page.inner_text("#quality-words")


def test_dropped_folder_with_faults_names_all_of_them(browser, lab, tmp_path):
    folder = hammer_campaign(tmp_path / "faulty", 2, 2, "faulty")
    replace_in(folder / "campaign.toml", "kind =", "knid =")
    replace_in(folder / "runs.csv", "\n1,1,", "\nx,one,")
    with page_of(browser, lab) as page:
        at(page, "/ingest")
        assert "faults" in dropped(page, folder)
        faults = page.locator(".faults li").all_inner_texts()
        assert (
            any("knid" in fault for fault in faults)
            and sum("'x'" in f or "'one'" in f for f in faults) == 2
        )
        assert page.locator("#store").count() == 0
        job = page.url.rsplit("/", 1)[1]
        page.click("#again")
        page.wait_for_url(f"**/ingest?again={job}")


def drop_by_hand(page: Any, path: Path) -> None:
    """Drag a file or folder of this disk over the page and let it go, as the browser gets it from a
    file manager."""
    box = page.locator("#drop").bounding_box()
    place = {"x": box["x"] + box["width"] / 2, "y": box["y"] + 20}
    data = {"items": [], "files": [str(path)], "dragOperationsMask": 1}
    session = page.context.new_cdp_session(page)
    for step in ("dragEnter", "dragOver", "drop"):
        session.send("Input.dispatchDragEvent", {"type": step, **place, "data": data})


def test_folder_that_is_dropped_by_hand_is_mended_and_stored(browser, lab, tmp_path):
    """The browser walks the folder itself: what is wrong is shown, nothing is stored, then the
    mended folder is."""
    folder = hammer_campaign(tmp_path / "by-hand", 2, 2, "by-hand")
    (folder / ".hidden").write_text("left alone")
    good = (folder / "runs.csv").read_text(encoding="utf-8")
    replace_in(folder / "runs.csv", "\n1,1,", "\nx,1,")
    with page_of(browser, lab) as page:
        at(page, "/ingest")
        drop_by_hand(page, folder / "runs.csv")
        page.wait_for_url("**/ingest/forms/*")  # without campaign.toml, the form that writes it
        assert "0 recordings with 0 channels were read" in page.inner_text("main")
        assert stored(lab, "by-hand") == (0, 0)
        at(page, "/ingest")
        drop_by_hand(page, folder)
        page.wait_for_url("**/ingest/checks/*")
        assert (
            "1 fault" in verdict(page)
            and "'x'" in page.inner_text(".faults")
            and page.locator("#store").count() == 0
        )
        (folder / "runs.csv").write_text(good, encoding="utf-8")
        page.click("#again")
        page.wait_for_selector("#filled")
        drop_by_hand(page, folder)
        page.wait_for_url("**/ingest/checks/*")
        assert "Nothing is stored yet" in verdict(page) and stored(lab, "by-hand") == (0, 0)
        assert page.locator("#recordings tbody tr").count() == 2
        page.click("#store button")
        assert ended(page)["state"] == "done" and stored(lab, "by-hand") == (2, 4)


@pytest.mark.parametrize("upload", ["folder", "zip"])
def test_chosen_folder_is_checked_and_discarded_or_stored(browser, lab, tmp_path, upload):
    name = f"uploaded-{upload}"
    sent = hammer_campaign(tmp_path / upload, 2, 2, name)
    if upload == "zip":
        sent = Path(shutil.make_archive(str(tmp_path / "sent"), "zip", tmp_path, upload))
    with page_of(browser, lab) as page:
        at(page, "/ingest")
        page.set_input_files(f"#upload-{upload}", sent)
        assert "MB" in page.inner_text("#upload-chosen")
        page.click(f"#upload {CHECK}")
        assert "4 impacts would be stored" in verdict(page)
        page.click("#discard button")
        page.wait_for_url("**/ingest")
        page.set_input_files(f"#upload-{upload}", sent)
        page.click(f"#upload {STORE}")
        job = ended(page)
        assert (job["state"], job["error"]) == ("done", None) and stored(lab, name) == (2, 4)
        assert asked(page, f"/api/impacts?campaign={name}&limit=9")[3]["campaign"] == name


def test_campaign_is_ingested_by_its_path(browser, lab):
    hammer_campaign(lab.folder / "by-path", 3, 2, "by-path")
    with page_of(browser, lab) as page:
        at(page, "/campaigns")
        page.click("#to-ingest")
        page.fill("#path", str(lab.folder / "by-path"))
        page.press("#path", "Enter")  # checks first
        assert "6 impacts would be stored" in verdict(page) and stored(lab, "by-path") == (0, 0)
        page.click("#store button")
        job = ended(page)
        assert (job["state"], job["done"], job["total"]) == ("done", 3, 3) and stored(
            lab, "by-path"
        ) == (3, 6)
        page.click("#job-result")
        assert "6 impacts, 0 shots, 3 recordings" in page.inner_text("#counts")


def test_wrong_input_stands_at_its_field_and_nothing_typed_is_lost(browser, lab, tmp_path):
    hammer_campaign(tmp_path / "elsewhere", 1, 1)
    with lab.reading() as session:
        before = session.scalar(select(func.count()).select_from(Campaign))
    with page_of(browser, lab) as page:
        at(page, "/ingest")
        page.click("#by-path summary")
        page.fill("#path-threshold", "9")
        page.fill("#path", str(tmp_path / "elsewhere"))
        page.click("#by-path summary")
        page.press("#path", "Enter")
        page.wait_for_selector("#path-threshold:focus")  # the browser says it there
        assert "0.5" in page.locator("#path-threshold").evaluate(
            "control => control.validationMessage"
        )
        page.fill("#path-threshold", "0.01")
        page.fill("#path-separation_s", "much")
        page.press("#path", "Enter")
        assert "separation_s is 'much'" in error_at(page, "#path-separation_s")
        page.fill("#path-separation_s", "50ms")
        page.press("#path-separation_s", "Enter")
        page.wait_for_selector("#path-separation_s:not([aria-invalid])")
        assert "no campaign folder" in error_at(page, "#path")
        assert page.input_value("#path") == str(tmp_path / "elsewhere")
        assert page.input_value("#path-threshold") == "0.01"
        assert page.input_value("#path-separation_s") == "50ms"
        page.click(f"#upload {CHECK}")
        assert "no file was sent" in error_at(page, "#upload-folder")
    with lab.reading() as session:
        assert session.scalar(select(func.count()).select_from(Campaign)) == before


@pytest.mark.parametrize(("page_name", "field"), [("delete", "#reason"), ("archive", "#reason")])
def test_blank_reason_is_refused_at_its_field(browser, lab, page_name, field):
    with page_of(browser, lab) as page:
        at(page, f"/campaigns/first-shots/{page_name}")
        page.fill(field, "   ")
        page.click("#removal button")
        assert "reason is missing" in error_at(page, field) and page.input_value(field) == "   "
    assert stored(lab, "first-shots") == (0, 0)


@pytest.mark.parametrize(("address", "field", "typed", "button", "words"), [
    ("/campaigns/rehearsal/extract", "#threshold", "9", "#try button", "threshold is 9"),
    ("/campaigns/rehearsal/extract", "#smoothing", "7", "#try button", "smoothing is 7"),
    ("/campaigns/rehearsal/export", "#where", "hardness=3", "#export button", "hardness"),
])  # fmt: skip
def test_form_that_only_asks_shows_the_fault_at_its_field(
    browser, lab, address, field, typed, button, words
):
    with page_of(browser, lab) as page:
        at(page, address)
        page.fill(field, typed)
        page.click(button)
        assert words in error_at(page, field) and page.input_value(field) == typed


def test_campaign_is_extracted_again_after_a_trial(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/campaigns/modal-hammer-hit")
        page.click("#extract")
        page.fill("#threshold", "0.03")
        page.click("#try button")
        assert "Of 1 recordings 1 were tried" in page.inner_text("#preview")
        page.click("#extract button")
        assert ended(page)["state"] == "done"


def test_campaign_is_saved_archived_and_restored(browser, lab):
    hammer_campaign(lab.folder / "shelf", 1, 2, "shelf")
    with page_of(browser, lab) as page:
        at(page, "/ingest")
        page.fill("#path", "shelf")
        page.click(f"#by-path {STORE}")
        ended(page)
        at(page, "/campaigns/shelf/export")
        with page.expect_download() as table:
            page.click("#export button")
        assert Path(table.value.path()).read_text().count("\n") == 3
        at(page, "/campaigns/shelf")
        page.click("#archive")
        page.fill("#reason", "finished")
        page.click("#removal button")
        assert ended(page)["state"] == "done" and stored(lab, "shelf") == (0, 0)
        page.click("#job-result")
        page.click("#deleted button")
        assert ended(page)["state"] == "done" and stored(lab, "shelf") == (1, 2)


def test_telephone_shows_name_impacts_and_quality(browser, lab):
    with page_of(browser, lab, width=390, height=844) as page:
        for address, table in (("/", "#recent"), ("/campaigns", "#campaigns")):
            at(page, address)
            heads = page.locator(f"{table} thead th").evaluate_all(
                "all => all.filter(h => h.offsetWidth).map(h => h.innerText)"
            )
            assert heads == ["campaign", "impacts", "quality"]
            assert (
                page.evaluate(
                    "table => document.querySelector(table).getBoundingClientRect().right", table
                )
                <= 390
            )
        page.click("[data-unfold]")
        assert page.locator("#campaigns thead th").last.is_visible()


def test_first_page_leads_to_where_one_acts(browser, lab):
    with lab.store.writing() as session:
        campaign = select(Campaign.id).where(Campaign.name == "rehearsal").scalar_subquery()
        recording = session.scalars(
            select(Recording.id).where(Recording.campaign_id == campaign).limit(1)
        ).one()
        finding = {"check": "clipping", "severity": "reject", "message": "clipped", "evidence": {}}
        session.add(QualityFinding(recording_id=recording, **finding))
    with page_of(browser, lab) as page:
        at(page, "/campaigns")
        page.click(".brand")
        assert page.url.rstrip("/") == lab.origin and page.locator("#recent tbody tr").count() > 0
        page.click("#attention li:has-text('rehearsal') a")
        assert page.url.endswith("/campaigns/rehearsal#quality")
        screenshot(page, "campaign-quality", 900)
