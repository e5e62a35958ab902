"""In a browser: a design is made and judged, printed, and ticked off on a tablet."""

from __future__ import annotations

import pytest
from pyroshock.app.common.plan_tables import run_counts
from pyroshock.app.operations.plan.planning import make_plan
from pyroshock.doe.plans import StoredPlan, StoredRun, UnknownPlanError, read_plan
from support.processes.browsers import Lab, at, drawn, ended, page_of, screenshot, wait_drawn
from support.stores.planned_runs import find_fault, record_run

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

TABLET = {"width": 768, "height": 1024, "has_touch": True}
TELEPHONE = {"width": 390, "height": 844, "has_touch": True}


def plan(lab: Lab, name: str) -> StoredPlan:
    with lab.reading() as session:
        return read_plan(session, name)


def test_design_is_made_and_judged(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/plans")
        page.click("#new-plan")
        assert "aluminum, steel" in page.inner_text("#factors-shown")
        assert (
            page.is_visible("#runs-lhs")
            and not page.is_visible("#table-import")
            and page.locator("#degree-optimal").is_hidden()
        )
        page.select_option("#method", "import")
        assert (
            page.is_visible("#table-import")
            and not page.is_visible("#runs-lhs")
            and not page.is_visible("#blocks-lhs")
        )
        page.fill("#name", "autumn")
        page.click("#make button")
        page.locator("#table-import-error").wait_for()
        page.select_option("#method", "lhs")
        page.select_option("#order-lhs", "random")
        page.fill("#blocks-lhs", "2")
        page.click("#make button")
        page.locator("#blocks-lhs-error").wait_for()
        assert page.input_value("#name") == "autumn"
        page.select_option("#order-lhs", "split-plot")
        for name, value in (
            ("name", "autumn"),
            ("runs-lhs", "20"),
            ("repetitions", "2"),
            ("seed", "3"),
        ):
            page.fill(f"#{name}", value)
        page.press("#seed", "Enter")
        job = ended(page, 300)
        assert (job["state"], job["error"]) == ("done", None)
        page.click("#job-result")
        wait_drawn(page)
        made = plan(lab, "autumn")
        assert (len(made.runs), made.seed, {run.repetitions for run in made.runs}) == (20, 3, {2})
        assert page.locator("#runs tbody tr").count() == 20 and "20 to do" in page.inner_text(
            "#counts"
        )
        assert page.locator("#quality tbody tr").count() >= 3
        changes = [
            row.split("\t") for row in page.locator("#changeovers tbody tr").all_inner_texts()
        ]
        assert changes and all(0 <= int(row[1]) < 20 for row in changes)
        assert "The plan is" in page.inner_text("#verdict")
        (pairs,) = drawn(page, "pairs")
        assert pairs["limits"] == [-1, 1]
        page.click("summary:has-text('Runs of each level')")
        wait_drawn(page)
        (bars,) = drawn(page, "balance-1")
        assert sum(bars["end"]) == 20
        screenshot(page, "plan", 1250)


def test_sheet_prints_without_what_is_of_the_screen(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/plans/rehearsal/sheet")
        assert page.locator("header").is_visible()
        page.emulate_media(media="print")
        assert not page.locator("header").is_visible() and page.locator("form:visible").count() == 0
        assert page.locator("#run-1").is_visible()
        page.goto("/plans/rehearsal/sheet.html")
        assert page.locator("tbody tr").count() == len(plan(lab, "rehearsal").runs)


@pytest.fixture(scope="module")
def winter(lab: Lab) -> str:
    """A plan of four runs of three repetitions: one is done, one has a rejected repetition, one is
    begun."""
    make_plan(lab.store, "lhs", "winter", runs=4, repetitions=3, seed=3)
    for run, repetitions in ((1, (1, 2, 3)), (2, (1, 2, 3)), (3, (1, 2))):
        record_run(lab.store, "winter", run, repetitions)
    find_fault(lab.store, "winter", 2, 2)
    return "winter"


def test_the_next_run_is_large_with_what_to_repeat(browser, lab, winter):
    with page_of(browser, lab, **TELEPHONE) as page:
        at(page, f"/plans/{winter}/sheet")
        assert page.inner_text("#shown-title").split("\n")[0].startswith("Next: run 2")
        assert "repeat 1 of 3: repetition 2 is rejected" in page.inner_text("#shown-title")
        assert page.inner_text("#boxes") == "☑↻☑" and "1 to repeat" in page.inner_text("#progress")
        assert (
            page.locator("#run-1.run-done").count() == 1
            and page.locator("ol.sheet li").count() == 4
        )
        assert not page.evaluate(
            "document.documentElement.scrollWidth > document.documentElement.clientWidth"
        )
        targets = page.locator("#shown :is(summary, a.button, form > button):visible").all()
        assert len(targets) >= 4 and all(
            target.bounding_box()["height"] >= 44 for target in targets
        )
        assert all(link.bounding_box()["height"] >= 44 for link in page.locator("ol.sheet a").all())
        page.locator("#later").tap()
        page.wait_for_url("**?run=3")
        assert (
            "2 of 3 recorded" in page.inner_text("#shown-title")
            and page.inner_text("#boxes") == "☑☑☐"
        )
        stored = plan(lab, winter).runs
        changed = page.locator("#shown dd:has(strong)").all_inner_texts()
        assert changed == _changed(stored[1], stored[2])


def _changed(before: StoredRun, run: StoredRun) -> list[str]:
    """Settings of a run that differ from the run before, as the sheet writes them."""
    rows = [
        {**stored.row, **{key: f"{value:.4g}" for key, value in stored.settings.items()}}
        for stored in (before, run)
    ]
    return [value for key, value in rows[1].items() if value != rows[0][key]]


def test_run_is_done_when_it_is_recorded_and_not_when_somebody_says_so(browser, lab, winter):
    with page_of(browser, lab, **TABLET) as page:
        at(page, f"/plans/{winter}/sheet?run=4")
        # Nothing is recorded of run 4: its page offers what makes it done.
        assert page.locator("#done").count() == 0
        assert (
            page.get_attribute("#to-ingest", "href")
            == "/ingest?plan=" + page.url.split("/plans/")[1].split("/")[0]
        )
        at(page, f"/plans/{winter}/sheet?run=3")
        page.locator("#done summary").tap()
        page.locator("#done button").tap()
        page.locator("#enough-error").wait_for()
        assert "2 of 3 repetitions" in page.inner_text("#enough-error")
        page.fill("#enough", "the barrel is worn")
        page.locator("#done button").tap()
        page.locator("#run-3.run-done").wait_for()
        assert "done with 2 of 3" in page.inner_text(
            "#run-3"
        ) and "the barrel is worn" in page.inner_text("#run-3")
        record_run(lab.store, winter, 2, (4,))
        page.reload()
        assert page.locator("#run-2.run-done").count() == 1 and page.inner_text(
            "#shown-title"
        ).startswith("Next: run 4")


def test_a_discard_asks_for_its_reason_in_place(browser, lab, winter):
    with page_of(browser, lab, **TABLET) as page:
        at(page, f"/plans/{winter}/sheet?run=4")
        assert not page.locator("#why").is_visible()
        page.locator("#discard summary").tap()
        page.locator("#discard button").tap()
        page.locator("#why-error").wait_for()
        assert (
            "say why" in page.inner_text("#why-error")
            and plan(lab, winter).runs[3].status == "planned"
        )
        page.fill("#why", "the tip broke")
        page.press("#why", "Enter")
        page.locator("#run-4.run-discarded").wait_for()
        assert (plan(lab, winter).runs[3].status, plan(lab, winter).runs[3].reason) == (
            "discarded",
            "the tip broke",
        )
        assert "Every run is done or discarded." in page.inner_text("main")
        at(page, f"/plans/{winter}/sheet?run=4")
        page.locator("#reopen button").tap()
        page.locator("#run-4:not(.run-discarded)").wait_for()
        assert (plan(lab, winter).runs[3].status, plan(lab, winter).runs[3].reason) == (
            "planned",
            None,
        )
        assert page.locator("#to-ingest").count() == 1


def test_a_discard_without_javascript_says_what_is_missing(browser, lab, winter):
    with page_of(browser, lab, java_script_enabled=False) as page:
        page.goto(f"/plans/{winter}/sheet?run=4")
        page.click("#discard summary")
        page.click("#discard button")
        assert "say why run 4 is discarded" in page.inner_text("main")
    assert plan(lab, winter).runs[3].status == "planned"


def test_list_of_plans_shows_states_on_a_telephone(browser, lab, winter):
    with page_of(browser, lab, **TELEPHONE) as page:
        at(page, "/plans")
        row = page.locator("#plans tr", has_text=winter)
        counts = run_counts(plan(lab, winter))
        assert f"{counts['done']} of {counts['done'] + counts['planned']} done" in row.inner_text()
        assert (
            row.locator(".states").is_visible()
            and not row.locator("td", has_text="lhs").is_visible()
        )
        assert not page.evaluate(
            "(e => e.scrollWidth > "
            "e.clientWidth)(document.querySelector('#plans').closest('.scroll'))"
        )
        page.locator("[data-unfold]").tap()
        assert row.locator("td", has_text="lhs").is_visible()


def test_import_of_a_bad_table_makes_no_plan(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/plans/new?kind=hammer")
        page.fill("#name", "broken")
        page.select_option("#method", "import")
        page.fill("#table-import", "tip_material,unheard_of\nsteel,1\n")
        page.click("#make button")
        assert ended(page)["state"] == "failed" and "unheard_of" in page.inner_text("#job-error")
    with pytest.raises(UnknownPlanError):
        plan(lab, "broken")
