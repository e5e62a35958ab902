"""In a browser: a design is made and judged, printed, and ticked off on a tablet."""

from __future__ import annotations

import pytest
from pyroshock.doe.plans import StoredPlan, UnknownPlanError, read_plan
from support.processes.browsers import Lab, at, drawn, ended, page_of, screenshot, wait_drawn

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

TABLET = {"width": 768, "height": 1024, "has_touch": True}


def plan(lab: Lab, name: str) -> StoredPlan:
    with lab.reading() as session:
        return read_plan(session, name)


def test_design_is_made_and_judged(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/plans")
        page.click("#new-plan")
        assert "aluminum, steel" in page.inner_text("#factors-shown")
        assert (
            page.is_visible("#runs") and not page.is_visible("#table") and not page.is_visible("[id='optimal.degree']")
        )
        page.select_option("#method", "import")
        assert page.is_visible("#table") and not page.is_visible("#runs") and not page.is_visible("#blocks")
        page.fill("#name", "autumn")
        page.click("#make button")
        page.locator("#table-error").wait_for()
        page.select_option("#method", "lhs")
        page.select_option("#order", "random")
        page.fill("#blocks", "2")
        page.click("#make button")
        page.locator("#blocks-error").wait_for()
        assert page.input_value("#name") == "autumn"
        page.select_option("#order", "split-plot")
        for name, value in (("name", "autumn"), ("runs", "20"), ("repetitions", "2"), ("seed", "3")):
            page.fill(f"#{name}", value)
        page.press("#seed", "Enter")
        job = ended(page, 300)
        assert (job["state"], job["error"]) == ("done", None)
        page.click("#job-result")
        wait_drawn(page)
        made = plan(lab, "autumn")
        assert (len(made.runs), made.seed, {run.repetitions for run in made.runs}) == (20, 3, {2})
        assert page.locator("#runs tbody tr").count() == 20 and "20 to do" in page.inner_text("#counts")
        assert page.locator("#quality tbody tr").count() >= 3
        changes = [row.split("\t") for row in page.locator("#changeovers tbody tr").all_inner_texts()]
        assert changes and all(0 <= int(row[1]) < 20 for row in changes)
        assert "The plan is" in page.inner_text("#verdict")
        (pairs,) = drawn(page, "pairs")
        assert (pairs["zmin"], pairs["zmax"]) == (-1, 1)
        page.click("summary:has-text('Runs of each level')")
        wait_drawn(page)
        (bars,) = drawn(page, "balance-1")
        assert sum(bars["y"]) == 20
        screenshot(page, "plan", 1250)


def test_sheet_prints_without_what_is_of_the_screen(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/plans/rehearsal/sheet")
        assert page.locator("header").is_visible()
        page.emulate_media(media="print")
        assert not page.locator("header").is_visible() and not page.locator("#run-1 form").is_visible()
        assert page.locator("#run-1 h2").is_visible()
        page.goto("/plans/rehearsal/sheet.html")
        assert page.locator("tbody tr").count() == len(plan(lab, "rehearsal").runs)


def test_runs_are_ticked_and_discarded_by_touch(browser, lab):
    before = plan(lab, "rehearsal").runs
    done = next(run.run for run in before if run.status == "done")
    with page_of(browser, lab, **TABLET) as page:
        at(page, "/plans/rehearsal/sheet")
        assert page.evaluate("matchMedia('(pointer: coarse)').matches")
        for button in page.locator(f"#run-{done} button").all():
            assert button.bounding_box()["height"] >= 44
        assert page.evaluate("document.documentElement.scrollWidth <= document.documentElement.clientWidth")
        page.fill(f"#note-{done}", "the tip was loose")
        page.locator(f"#run-{done} button[value=planned]").tap()
        page.wait_for_url(f"**#run-{done}")
        page.locator(f"#run-{done} button[value=done]").wait_for()
        assert (_run(lab, done).status, _run(lab, done).reason) == ("planned", "the tip was loose")
        page.locator(f"#run-{done} button[value=done]").tap()
        page.locator(f"#run-{done}.run-done").wait_for()
        assert _run(lab, done).status == "done"
        page.locator(f"#run-{done} button[value=discarded]").tap()
        page.locator(f"#note-{done}-error").wait_for()
        assert "say why" in page.inner_text(f"#note-{done}-error") and _run(lab, done).status == "done"
        page.fill(f"#note-{done}", "the velocity was not read")
        page.locator(f"#run-{done} button[value=discarded]").tap()
        page.locator(f"#run-{done}.run-discarded").wait_for()
    assert (_run(lab, done).status, _run(lab, done).reason) == ("discarded", "the velocity was not read")
    assert [run for run in plan(lab, "rehearsal").runs if run.run != done] == [r for r in before if r.run != done]


def _run(lab: Lab, number: int):
    return next(run for run in plan(lab, "rehearsal").runs if run.run == number)


def test_import_of_a_bad_table_makes_no_plan(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/plans/new?kind=hammer")
        page.fill("#name", "broken")
        page.select_option("#method", "import")
        page.fill("#table", "tip_material,unheard_of\nsteel,1\n")
        page.click("#make button")
        assert ended(page)["state"] == "failed" and "unheard_of" in page.inner_text("#job-error")
    with pytest.raises(UnknownPlanError):
        plan(lab, "broken")
