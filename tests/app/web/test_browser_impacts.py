"""In a browser: an impact's pulse extracted with other settings, and actions on lists of
impacts."""

from __future__ import annotations

from pathlib import Path

import pytest
from pyroshock.app.demo.demo import HIT
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.impacts import Impact, Pulse
from sqlalchemy import select
from support.processes.browsers import Lab, at, drawn, page_of, screenshot, wait_drawn

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]


def hit(lab: Lab) -> int:
    with lab.reading() as session:
        query = (
            select(Impact.id)
            .join(Campaign, Impact.campaign_id == Campaign.id)
            .where(Campaign.name == HIT)
        )
        return session.scalars(query).one()


def versions(lab: Lab, impact: int) -> list[tuple[bool, float]]:
    """Each pulse of an impact: whether it is in use, and the threshold it was cut with."""
    with lab.reading() as session:
        pulses = session.scalars(select(Pulse).where(Pulse.impact_id == impact).order_by(Pulse.id))
        return [(pulse.current, pulse.settings.settings["threshold"]) for pulse in pulses]


def test_preview_stores_nothing_and_storing_it_makes_the_version_in_use(browser, lab):
    impact = hit(lab)
    before = versions(lab, impact)
    with page_of(browser, lab) as page:
        at(page, f"/impacts/{impact}")
        page.click("#preview-box summary")
        page.fill("#threshold", "0.05")
        page.press("#threshold", "Enter")
        page.wait_for_selector("#preview")
        wait_drawn(page)
        assert [t["name"] for t in drawn(page, "segmentation") if t["kind"] == "line"][
            -1
        ] == "preview"
        told = page.inner_text("[data-figure-key=contact_time_s]")
        assert versions(lab, impact) == before
        screenshot(page, "impact", 1150)
        page.click("#store-extraction button")
        page.wait_for_url(f"**/impacts/{impact}")
        wait_drawn(page)
        assert page.locator("#preview").count() == 0
        page.click("#versions-box summary")
        rows = page.locator("#versions tbody tr").all_inner_texts()
    after = versions(lab, impact)
    assert after == [(False, threshold) for _, threshold in before] + [(True, 0.05)]
    assert len(rows) == len(after) and told in rows[-1].split()


def test_preview_left_alone_keeps_the_version_in_use(browser, lab):
    impact = hit(lab)
    before = versions(lab, impact)
    with page_of(browser, lab) as page:
        at(page, f"/impacts/{impact}?preview=true&threshold=0.2")
        page.click("text=Leave it as it is")
        wait_drawn(page)
        assert page.locator("#preview").count() == 0
    assert versions(lab, impact) == before


def test_ticked_impacts_are_compared_and_an_empty_choice_stays_on_the_page(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/impacts?campaign=rehearsal")
        page.click("#bulk-compare")
        page.wait_for_selector("#bulk .field-error")
        assert "No impact is ticked" in page.locator("#bulk .field-error").inner_text()
        boxes = page.locator("#rows tbody input[type=checkbox]")
        keys = [boxes.nth(place).get_attribute("value") for place in (0, 2)]
        for place in (0, 2):
            boxes.nth(place).check()
        page.click("#bulk-reject")
        page.wait_for_selector("#reason-error")
        assert "Say why" in page.locator("#reason-error").inner_text()
        assert (
            page.locator("#reason").get_attribute("aria-invalid") == "true"
            and boxes.nth(2).is_checked()
        )
        page.click("#bulk-compare")
        page.wait_for_url(f"**/compare/spectra?impacts={keys[0]},{keys[1]}")
        wait_drawn(page)


def test_ticked_impacts_are_rejected_with_their_reason(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/impacts?campaign=rehearsal&sort=-run")
        key = page.locator("#rows tbody td:first-child a").first.inner_text()
        before = page.locator("#rows tbody tr").count()
        page.locator("#rows tbody input[type=checkbox]").first.check()
        page.fill("#reason", "the bullet hit the rim")
        page.click("#bulk-reject")
        page.wait_for_url("**/impacts")
        at(page, "/impacts?campaign=rehearsal&sort=-run")
        assert page.locator("#rows tbody tr").count() == before - 1
        assert page.locator("#rows tbody td:first-child a").first.inner_text() != key


def test_keys_go_through_the_impacts_of_a_campaign(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/impacts?campaign=rehearsal")
        first, second = page.locator("#rows tbody td:first-child a").all_inner_texts()[:2]
        at(page, f"/impacts/{first}")
        page.keyboard.press("j")
        page.wait_for_url(f"**/impacts/{second}")
        wait_drawn(page)
        page.keyboard.press("k")
        page.wait_for_url(f"**/impacts/{first}")
        wait_drawn(page)


def test_chart_is_saved_as_csv_with_headed_columns(browser, lab):
    with page_of(browser, lab) as page:
        at(page, f"/impacts/{hit(lab)}")
        with page.expect_download() as download:
            page.locator("#segmentation .chart-tools button", has_text="CSV").click()
        lines = Path(download.value.path()).read_text(encoding="utf-8").splitlines()
        (record, *_) = drawn(page, "segmentation")
    assert lines[0].startswith('"record: time since contact (ms)","record: force (kN)"')
    x, y = (float(text) for text in lines[1].split(",")[:2])
    assert (x, y) == (record["x"][0], record["y"][0])


def test_conditions_narrow_the_list_as_the_api_does(browser, lab):
    from support.processes.browsers import asked

    with page_of(browser, lab) as page:
        at(page, "/impacts")
        every = page.locator("#rows tbody tr").count()
        steel = page.locator("option[value='tip_material=steel']")
        page.locator("#filter select").filter(has=steel).select_option("tip_material=steel")
        page.click("#filter button")
        page.wait_for_url("**/impacts?where=tip_material%3Dsteel")
        few = [
            int(api_row)
            for api_row in page.locator("#rows tbody tr td:first-child a").all_inner_texts()
        ]
        found = asked(page, "/api/impacts?where=tip_material%3Dsteel")
        assert few == [api_row["id"] for api_row in found] and 0 < len(few) < every


def test_the_address_holds_the_view_of_a_chart(browser, lab):
    """Zoom by keys and hide an entry of the legend; whoever opens the address sees the same."""
    range_of = "() => document.querySelector('#segmentation .plot').chart.range"
    entries = "#segmentation .legend button"
    with page_of(browser, lab) as page:
        at(page, f"/impacts/{hit(lab)}")
        whole = page.evaluate(range_of)
        page.focus("#segmentation .canvas")
        page.keyboard.press("+")
        page.keyboard.press("Shift+ArrowLeft")
        page.locator(entries).first.click()
        zoomed_range, address = page.evaluate(range_of), page.url
        assert (
            zoomed_range != whole
            and "segmentation.x=" in address
            and "segmentation.hide=" in address
        )
        hidden_name = page.locator(entries).first.inner_text()
        page.goto("about:blank")
        page.goto(address)
        wait_drawn(page)
        restored_range = page.evaluate(range_of)
        for key in ("x", "y"):
            assert restored_range[key] == pytest.approx(zoomed_range[key], rel=1e-5, abs=1e-9)
        assert page.get_attribute(entries, "aria-pressed") == "false"
        assert page.locator(entries).first.inner_text() == hidden_name
        page.focus("#segmentation .canvas")
        page.keyboard.press("0")
        page.locator(entries).first.click()
        assert "#" not in page.url and page.evaluate(range_of) == whole


def test_an_address_that_holds_nonsense_shows_the_usual_view(browser, lab):
    range_of = "() => document.querySelector('#segmentation .plot').chart.range"
    with page_of(browser, lab) as page:
        at(page, f"/impacts/{hit(lab)}")
        whole = page.evaluate(range_of)
        for text in ("segmentation.x=1", "segmentation.x=9~1", "segmentation.x=a~b", "other.x=1~2"):
            at(page, f"/impacts/{hit(lab)}#{text}")
            page.reload()
            wait_drawn(page)
            assert page.evaluate(range_of) == whole
