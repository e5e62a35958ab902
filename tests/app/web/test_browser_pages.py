"""In a browser: every page can be read by everyone, on a telephone and on a wide screen, in light and in dark."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import pytest
from pyroshock.app.demo.demo import HIT
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.impacts import Impact
from sqlalchemy import select
from support.processes.browsers import SLOW, Lab, at, page_of, until

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

#: Name -> address; `{hit}` and `{first}` are impacts of the store.
PAGES = {
    "campaigns": "/campaigns",
    "campaigns-empty": "/campaigns?name=nothing-of-that-name",
    "campaign-planned": "/campaigns/rehearsal",
    "campaign-shots": "/campaigns/first-shots",
    "impacts": "/impacts",
    "shots": "/shots",
    "impact": "/impacts/{hit}",
    "impact-preview": "/impacts/{hit}?preview=true&threshold=0.05",
    "compare": "/compare?campaign=rehearsal",
    "spectra": "/compare/spectra?impacts={first}&sides=true",
    "models": "/models",
    "models-compare": "/models/compare?version=linear@1&version=hann@1",
    "model": "/models/linear/1",
    "models-train": "/models/train",
    "datasets": "/datasets",
    "dataset": "/datasets/guns",
    "dataset-delete": "/datasets/guns/delete",
    "model-delete": "/models/linear/1/delete",
    "twin": "/twin",
    "tune": "/tune?text=frequency_hz%2Clevel_g%0A100%2C30%0A1000%2C300",
    "validations": "/validations",
    "twin-model": "/twin?contact=linear@1&tank_pressure_pa=100000",
    "plans": "/plans",
    "plan": "/plans/rehearsal",
    "plan-new": "/plans/new",
    "sheet": "/plans/rehearsal/sheet",
    "sheet-print": "/plans/rehearsal/sheet.html",
    "diagnoses": "/diagnoses",
    "diagnosis": "/diagnoses/1",
    "home": "/",
    "ingest": "/ingest",
    "extract": "/campaigns/rehearsal/extract?preview=1&threshold=0.02",
    "export": "/campaigns/rehearsal/export",
    "archive": "/campaigns/rehearsal/archive",
    "deleted": "/deleted",
    "jobs": "/jobs",
    "api": "/api",
    "not-there": "/campaigns/none-of-that-name",
    "report-campaign": "/reports/campaign/rehearsal.html",
    "report-diagnosis": "/reports/diagnosis/1.html",
    "report-model": "/reports/model/linear/1.html",
}
WIDTHS = {390: 844, 1400: 900, 1920: 1080}
#: The folder that pictures of every page go to, to be looked at; none are taken without it.
PICTURES = os.environ.get("PYROSHOCK_PAGE_PICTURES")
#: A sheet of paper is as wide as it is; at the bench there is /plans/NAME/sheet.
OF_PAPER = ("sheet-print",)
RULES = {"runOnly": {"type": "tag", "values": ["wcag2a", "wcag2aa"]}}
#: Whether every chart has the width of its frame: charts follow the window in a moment.
_FOLLOWED = """[...document.querySelectorAll(".plot")].every((plot) => {
  const drawing = plot.querySelector(".main-svg");
  return !drawing || Math.abs(drawing.getBoundingClientRect().width - plot.clientWidth) < 3; })"""
_SCROLLS = "document.documentElement.scrollWidth > document.documentElement.clientWidth"
#: How many things of a page's own can be used: those in closed details, and hidden ones, cannot.
_CONTROLS = """[...document.querySelectorAll('main :is(a[href], button, input, select, textarea, summary)')]
  .filter(e => e.checkVisibility({ visibilityProperty: true }) && e.type !== 'hidden' && !e.closest('.plot')).length"""
#: Whether a focused element looks other than before: an outline, a shadow or a place.
_FOCUS = """() => { const e = document.activeElement, s = getComputedStyle(e), r = e.getBoundingClientRect();
  return { tag: e.tagName, id: e.id, text: e.textContent.trim().slice(0, 40), region: e.getAttribute('role') || '',
           outline: s.outlineStyle !== 'none' && parseFloat(s.outlineWidth) > 0, left: r.left, width: r.width }; }"""


@pytest.fixture(scope="module")
def address(lab: Lab) -> Callable[[str], str]:
    """Addresses with the impacts of this store in them."""

    def first(session: Any, campaign: str) -> int:
        query = select(Impact.id).join(Campaign, Impact.campaign_id == Campaign.id).where(Campaign.name == campaign)
        return session.scalars(query.order_by(Impact.id)).first()

    with lab.reading() as session:
        keys = {"hit": first(session, HIT), "first": first(session, "rehearsal")}
    return lambda name: PAGES[name].format(**keys)


def _in(page: Any, scheme: str) -> str:
    """Show a page in light or dark, its charts too; gives the colour behind them."""
    page.emulate_media(color_scheme=scheme)
    card = page.evaluate("getComputedStyle(document.documentElement).getPropertyValue('--card').trim()")
    behind = "[...document.querySelectorAll('[data-figure]')].map(each => each.layout.paper_bgcolor)"
    until(lambda: set(page.evaluate(behind)) <= {card})
    assert set(page.evaluate(behind)) <= {card}
    return card


@pytest.mark.parametrize("name", PAGES)
def test_page_is_read_by_everyone_at_any_width(browser, lab, address, name):
    from axe_playwright_python.sync_playwright import Axe

    with page_of(browser, lab) as page:
        assert at(page, address(name)).status == (404 if name == "not-there" else 200)
        for scheme in ("light", "dark"):
            page.set_viewport_size({"width": 1280, "height": 900})
            _in(page, scheme)
            found = Axe().run(page, options=RULES)
            assert found.violations_count == 0, f"{scheme}: {found.generate_report()}"
            for width, height in WIDTHS.items() if name not in OF_PAPER else ():
                page.set_viewport_size({"width": width, "height": height})
                until(lambda: not page.evaluate(_SCROLLS), 10 * SLOW)  # charts follow the window in a moment
                assert not page.evaluate(_SCROLLS), f"{scheme}, {width} wide: the page scrolls sideways"
                until(lambda: page.evaluate(_FOLLOWED), 10 * SLOW)
                if PICTURES and width != 1920:
                    page.screenshot(path=f"{PICTURES}/{name}-{width}-{scheme}.png", full_page=True)


@pytest.mark.parametrize("name", ["campaigns", "impact", "compare", "twin", "plan-new", "diagnosis"])
def test_keys_alone_reach_everything(browser, lab, address, name):
    """Skip link, menu, then every control of the page in its order; each shows where one is."""
    with page_of(browser, lab) as page:
        at(page, address(name))
        page.keyboard.press("Tab")
        first = page.evaluate(_FOCUS)
        assert first["text"] == "To the content" and first["left"] >= 0
        controls, seen = page.evaluate(_CONTROLS), []
        for _ in range(controls + 40):
            page.keyboard.press("Tab")
            here = page.evaluate(_FOCUS)
            if here["tag"] == "BODY":
                break
            assert here["outline"], f"no outline around {here}"
            seen.append(here)
        texts = [each["text"] for each in seen]
        menu = ["pyroshock", "Campaigns", "Impacts", "Compare", "Models", "Twin", "Plans", "Diagnoses", "Jobs"]
        assert texts[: len(menu)] == menu
        reached = [each for each in seen if each["tag"] in ("A", "BUTTON", "INPUT", "SELECT", "TEXTAREA", "SUMMARY")]
        assert len(reached) >= len(menu) + controls


def test_skip_link_leads_past_the_menu(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/campaigns")
        page.keyboard.press("Tab")
        page.keyboard.press("Enter")
        page.keyboard.press("Tab")
        assert page.evaluate("document.activeElement.id") == "to-ingest"


def test_charts_take_the_colours_of_the_scheme(browser, lab, address):
    with page_of(browser, lab) as page:
        at(page, address("compare"))
        assert len({_in(page, scheme) for scheme in ("light", "dark")}) == 2
