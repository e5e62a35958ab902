"""In a browser: the pages of people, notes and search are read by everyone, at any width, in light
and in dark; and a person signs in, writes a note and finds it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from pyroshock.app.operations.people.stored_users import add_user
from pyroshock.app.operations.plan.planning import make_plan
from support.processes.browsers import Lab, at, browser, page_of, served, sign_in, until
from support.processes.web_client import sqlite
from support.records.campaigns import hammer_campaign
from support.stores.stores import ingested, opened, run_pyroshock
from support.stores.team import PASSWORD

__all__ = ["browser"]

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]

RULES = {"runOnly": {"type": "tag", "values": ["wcag2a", "wcag2aa"]}}
_SCROLLS = "document.documentElement.scrollWidth > document.documentElement.clientWidth"
_OPEN = "document.querySelectorAll('details').forEach(e => { e.open = true; })"
#: What is wider than the window and does not scroll by itself.
_WIDE = """[...document.querySelectorAll('main *')].filter(
  e => e.getBoundingClientRect().right > innerWidth && !e.closest('.scroll, pre')
).map(e => e.tagName + '.' + e.className + '#' + e.id)"""
PAGES = (
    *(
        "/users",
        "/audit",
        "/account",
        "/notes",
        "/notes?tag=doubtful",
        "/search",
        "/search?words=a",
    ),
    *("/campaigns/spring", "/plans/autumn/sheet?run=1", "/impacts/1"),
)


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    folder = tmp_path_factory.mktemp("people")
    db = sqlite(folder)
    ingested(db, hammer_campaign(folder / "spring", recordings=1, hits=2, name="spring"))
    long = "a word " * 40 + "x" * 300
    for about, subject in (("campaign", "spring"), ("impact", "1")):
        run_pyroshock("notes", "add", about, subject, "--text", long, "--db", db)
        run_pyroshock("tags", "add", about, subject, "doubtful", "--db", db)
    run_pyroshock("notes", "edit", "1", "--text", "a shorter word", "--db", db)
    run_pyroshock("filters", "save", "hard hits", "/impacts?where=tag=doubtful", "--db", db)
    with opened(db) as store:
        make_plan(store, "factorial", "autumn", kind="hammer", repetitions=1)
        with store.writing() as session:
            for name, role in (("ada", "administrator"), ("olaf", "operator")):
                add_user(session, name, role, PASSWORD)
    with served(db, folder, asks_people=True) as window:
        yield window


def test_pages_of_people_are_read_by_everyone_at_any_width(browser: Any, lab: Lab) -> None:
    from axe_playwright_python.sync_playwright import Axe

    with page_of(browser, lab) as page:
        page.goto(lab.origin + "/sign-in")
        assert Axe().run(page, options=RULES).violations_count == 0
        sign_in(page, lab, "ada", PASSWORD)
        for address in PAGES:
            assert at(page, address).status == 200
            page.evaluate(_OPEN)
            for scheme in ("light", "dark"):
                page.emulate_media(color_scheme=scheme)
                page.set_viewport_size({"width": 1280, "height": 900})
                axe_results = Axe().run(page, options=RULES)
                assert axe_results.violations_count == 0, (
                    f"{address} {axe_results.generate_report()}"
                )
                for width in (390, 1400):
                    page.set_viewport_size({"width": width, "height": 844})
                    until(lambda: not page.evaluate(_SCROLLS), 10)
                    assert not page.evaluate(_SCROLLS), (
                        f"{address} scrolls at {width}: {page.evaluate(_WIDE)}"
                    )


def test_a_note_is_written_and_found_with_the_slash_key(browser: Any, lab: Lab) -> None:
    with page_of(browser, lab) as page:
        sign_in(page, lab, "olaf", PASSWORD)
        at(page, "/campaigns/spring")
        page.evaluate(
            "document.querySelectorAll('.notes details').forEach(e => { e.open = true; })"
        )
        page.fill("#note-text-campaign", "the plate was retightened / day 2")
        page.click("#note-campaign button")
        until(lambda: "retightened" in page.inner_text("#notes-campaign"), 30)
        page.keyboard.press("Escape")
        page.evaluate("document.activeElement.blur()")
        page.keyboard.press("/")
        assert page.evaluate("document.activeElement.id") == "search-words"
        page.keyboard.type("retightened")
        page.keyboard.press("Enter")
        until(lambda: "/search" in page.url, 30)
        assert page.inner_text("#count") == "1 found: 1 note."
        page.click(".hits a")
        until(lambda: page.url.endswith("/campaigns/spring"), 30)


def test_a_role_that_is_missing_is_told_beside_the_form(browser: Any, lab: Lab) -> None:
    with page_of(browser, lab) as page:
        sign_in(page, lab, "olaf", PASSWORD)
        page.goto(lab.origin + "/users")
        assert "needs the role administrator" in page.inner_text("main")
