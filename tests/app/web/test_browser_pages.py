"""In a browser: every page can be read by everyone, on a telephone and on a wide screen, in light
and in dark."""

from __future__ import annotations

import os
from typing import Any

import pytest
from support.checks.page_text import command_words
from support.processes.browsers import SLOW, at, page_of, until
from support.processes.served_pages import PAGES

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

WIDTHS = {390: 844, 1400: 900, 1920: 1080}
#: The folder that pictures of every page go to, to be looked at; none are taken without it.
PICTURES = os.environ.get("PYROSHOCK_PAGE_PICTURES")
#: A sheet of paper is as wide as it is; at the bench there is /plans/NAME/sheet.
OF_PAPER = ("sheet-print",)
#: Pages for programs say how a request is sent, and a report is read beside the command line, too.
OF_COMMANDS = ("api", "api-read", "api-plan", "report-diagnosis")
RULES = {"runOnly": {"type": "tag", "values": ["wcag2a", "wcag2aa"]}}
#: Whether every chart has the width of its frame: charts follow the window in a moment.
_FOLLOWED = """[...document.querySelectorAll(".plot")].every((plot) => {
  const drawing = plot.querySelector(".drawing");
  return !drawing || Math.abs(drawing.getBoundingClientRect().width - plot.clientWidth) < 3; })"""
_SCROLLS = "document.documentElement.scrollWidth > document.documentElement.clientWidth"
#: How many things of a page's own can be used: those in closed details, and hidden ones, cannot.
_CONTROLS = """[...document.querySelectorAll(
    'main :is(a[href], button, input, select, textarea, summary)')]
  .filter(e => e.checkVisibility({ visibilityProperty: true })
    && e.type !== 'hidden' && !e.closest('.plot')).length"""
#: Whether a focused element looks other than before: an outline, a shadow or a place.
_FOCUS = """() => {
  const e = document.activeElement, s = getComputedStyle(e), r = e.getBoundingClientRect();
  return { tag: e.tagName, id: e.id, text: e.textContent.trim().slice(0, 40),
           region: e.getAttribute('role') || '',
           outline: s.outlineStyle !== 'none' && parseFloat(s.outlineWidth) > 0,
           left: r.left, width: r.width }; }"""


def _in(page: Any, scheme: str) -> str:
    """Show a page in light or dark, its charts too; gives the colour behind them."""
    page.emulate_media(color_scheme=scheme)
    card = page.evaluate(
        "getComputedStyle(document.documentElement).getPropertyValue('--card').trim()"
    )
    drawn = (
        "[...document.querySelectorAll('.plot')].filter(e => e.chart).map(e => e.chart.markup())"
    )
    markups = page.evaluate(drawn)
    assert all(f'fill="{card}"' in markup for markup in markups)
    return card


#: Pages that are printed, and those that are a reference, may be long.
OF_ANY_LENGTH = ("sheet-print", "report-campaign", "report-model", *OF_COMMANDS)
SCREENS = 3
#: The height of a page without its tables and its list of runs, each with a row left of it.
_HEIGHT_WITHOUT_TABLES = """(() => {
  const rows = [...document.querySelectorAll('main :is(tbody tr, ol.sheet > li)')];
  const further = rows.filter((row) => row.previousElementSibling && row.checkVisibility());
  return document.documentElement.scrollHeight
    - further.reduce((height, row) => height + row.getBoundingClientRect().height, 0); })()"""


@pytest.mark.parametrize("name", [name for name in PAGES if name not in OF_ANY_LENGTH])
def test_page_is_three_screens_long_at_most_but_for_tables(browser, lab, address, name):
    with page_of(browser, lab) as page:
        page.set_viewport_size({"width": 1400, "height": WIDTHS[1400]})
        assert at(page, address(name)).status == (404 if name == "not-there" else 200)
        until(lambda: page.evaluate(_FOLLOWED), 10 * SLOW)
        height = page.evaluate(_HEIGHT_WITHOUT_TABLES)
        print(f"{name}: {height:.0f} px without tables")
        assert height <= SCREENS * WIDTHS[1400]


@pytest.mark.parametrize("name", PAGES)
def test_page_is_read_by_everyone_at_any_width(browser, lab, address, name):
    from axe_playwright_python.sync_playwright import Axe

    with page_of(browser, lab) as page:
        assert at(page, address(name)).status == (404 if name == "not-there" else 200)
        for scheme in ("light", "dark"):
            page.set_viewport_size({"width": 1280, "height": 900})
            _in(page, scheme)
            assert not command_words(page.inner_text("main")) or name in OF_COMMANDS
            found = Axe().run(page, options=RULES)
            assert found.violations_count == 0, f"{scheme}: {found.generate_report()}"
            for width, height in WIDTHS.items() if name not in OF_PAPER else ():
                page.set_viewport_size({"width": width, "height": height})
                until(
                    lambda: not page.evaluate(_SCROLLS), 10 * SLOW
                )  # charts follow the window in a moment
                assert not page.evaluate(_SCROLLS), (
                    f"{scheme}, {width} wide: the page scrolls sideways"
                )
                until(lambda: page.evaluate(_FOLLOWED), 10 * SLOW)
                if PICTURES and width != 1920:
                    page.screenshot(path=f"{PICTURES}/{name}-{width}-{scheme}.png", full_page=True)


@pytest.mark.parametrize(
    "name", ["campaigns", "impact", "compare", "twin", "plan-new", "diagnosis"]
)
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
        menu = [
            "pyroshock",
            "Campaigns",
            "Impacts",
            "Compare",
            "Explore",
            "Models",
            "Twin",
            "Plans",
            "Diagnoses",
            "Jobs",
        ]
        assert texts[: len(menu)] == menu
        reached = [
            each
            for each in seen
            if each["tag"] in ("A", "BUTTON", "INPUT", "SELECT", "TEXTAREA", "SUMMARY")
        ]
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
