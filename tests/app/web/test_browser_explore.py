"""In a browser: a rectangle drawn on the chart of /explore lists exactly the rows within it, its
address shows the same, and views are saved with it."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from pyroshock.schema.value_columns import read_columns
from support.processes.browsers import Lab, at, page_of, screenshot, until, wait_drawn

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]
SCATTER = "/explore?x=contact_time_s&y=peak_force_n&colour=tip_material&limit=2000"
#: What is selected, as the address has it.
_SELECTED = (
    "[...new URLSearchParams(location.search)].filter(([name]) => name.startsWith('select'))"
)
#: The ends of the axes that a place of the chart has, in shown units.
_PLACE = """([x, y]) => { const chart = document.querySelector('#explored .plot').chart;
  return [chart.sx.back(x), chart.sy.back(y)]; }"""
_ZOOM = "([x, y]) => document.querySelector('#explored .plot').chart.zoom({ x, y })"


def frame(page: Any) -> dict[str, float]:
    """The area within the axes, in px of the chart."""
    return page.evaluate("document.querySelector('#explored .plot').chart.frame")


def drag(page: Any, start: tuple[float, float], stop: tuple[float, float]) -> list[list[float]]:
    """Draw a rectangle between two places of the chart, as shares of its axes; gives the ends of
    both axes there, in shown units, and waits for the rows."""
    area = page.locator("#explored .canvas")
    area.scroll_into_view_if_needed()
    box, ends = area.bounding_box(), frame(page)
    places = [
        (
            ends["left"] + share_x * (ends["right"] - ends["left"]),
            ends["top"] + share_y * (ends["bottom"] - ends["top"]),
        )
        for share_x, share_y in (start, stop)
    ]
    before = page.evaluate("Number(document.getElementById('selection').dataset.answers || 0)")
    (x0, y0), (x1, y1) = places
    page.mouse.move(box["x"] + x0, box["y"] + y0)
    page.mouse.down()
    page.mouse.move(box["x"] + (x0 + x1) / 2, box["y"] + (y0 + y1) / 2, steps=3)
    page.mouse.move(box["x"] + x1, box["y"] + y1, steps=3)
    page.mouse.up()
    page.wait_for_selector(f"#selection[data-answers='{before + 1}']")
    return [page.evaluate(_PLACE, list(place)) for place in places]


def listed(page: Any) -> list[int]:
    """The impacts of the table of selected rows."""
    return [
        int(text) for text in page.locator("#selected-rows tbody td:first-child").all_inner_texts()
    ]


def stored(lab: Lab) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Impact, contact time (s) and peak force (N) of all impacts of the store."""
    with lab.reading() as session:
        columns = read_columns(session, "impacts", ["contact_time_s", "peak_force_n"])
    return (
        np.array(columns["id"]),
        np.array(columns["contact_time_s"], dtype=float),
        np.array(columns["peak_force_n"], dtype=float),
    )


@pytest.mark.parametrize(
    ("start", "stop"),
    [((0.0, 0.0), (0.5, 1.0)), ((0.9, 0.8), (0.2, 0.3)), ((0.25, 0.1), (0.75, 0.9))],
)
def test_rows_of_the_table_are_exactly_those_within_the_rectangle(browser, lab, start, stop):
    impact, time_s, force_n = stored(lab)
    with page_of(browser, lab, width=1400) as page:
        at(page, SCATTER)
        (xa, ya), (xb, yb) = drag(page, start, stop)
        rows, count = listed(page), page.inner_text("#selected-count strong")
        address = page.url
        selected = dict(page.evaluate(_SELECTED))
        screenshot(page, "explore", 1150)
        # whoever opens the address sees the same rows and the same rectangle
        mark = page.locator(".brush").bounding_box()
        at(page, address)
        assert listed(page) == rows and dict(page.evaluate(_SELECTED)) == selected
        second_box = page.locator(".brush").bounding_box()
    low_s, high_s = sorted((xa / 1e3, xb / 1e3))
    low_n, high_n = sorted((ya * 1e3, yb * 1e3))
    inside = (time_s >= low_s) & (time_s <= high_s) & (force_n >= low_n) & (force_n <= high_n)
    assert rows == impact[inside].tolist() and int(count) == inside.sum()
    assert 0 < inside.sum() < impact.size
    assert second_box["width"] == pytest.approx(mark["width"], abs=1.5)
    assert second_box["height"] == pytest.approx(mark["height"], abs=1.5)


def test_a_zoomed_and_a_logarithmic_chart_select_what_they_show(browser, lab):
    impact, time_s, force_n = stored(lab)
    with page_of(browser, lab, width=1400) as page:
        at(page, f"{SCATTER}&log_x=true&log_y=true")
        within = [np.nanquantile(values, [0.2, 0.9]) for values in (time_s * 1e3, force_n / 1e3)]
        page.evaluate(_ZOOM, [ends.tolist() for ends in within])
        (xa, ya), (xb, yb) = drag(page, (0.02, 0.02), (0.98, 0.98))
        rows = listed(page)
    low_s, high_s = sorted((xa / 1e3, xb / 1e3))
    low_n, high_n = sorted((ya * 1e3, yb * 1e3))
    inside = (time_s >= low_s) & (time_s <= high_s) & (force_n >= low_n) & (force_n <= high_n)
    assert rows == impact[inside].tolist() and 0 < len(rows) < impact.size


def test_a_control_chart_selects_by_order_and_a_distribution_by_its_axis_alone(browser, lab):
    _, _, force_n = stored(lab)
    with page_of(browser, lab, width=1400) as page:
        at(page, "/explore?kind=control&y=peak_force_n&limit=2000")
        (xa, _), (xb, _) = drag(page, (0.1, 0.0), (0.4, 1.0))
        places = [place for place in range(1, force_n.size + 1) if xa <= place <= xb]
        assert len(listed(page)) == len(places) > 3
        at(page, "/explore?kind=distribution&x=peak_force_n&limit=2000")
        (xa, _), (xb, _) = drag(page, (0.3, 0.5), (0.6, 0.55))
        assert [name for name, _ in page.evaluate(_SELECTED)] == ["select_x"]
        inside = (force_n >= xa * 1e3) & (force_n <= xb * 1e3)
        assert len(listed(page)) == inside.sum() > 3


def test_a_button_lets_dragging_zoom_and_clearing_takes_the_rectangle_away(browser, lab):
    with page_of(browser, lab, width=1400) as page:
        at(page, SCATTER)
        # words that a first drag selects would be dragged along by the second
        drag(page, (0.2, 0.2), (0.7, 0.7))
        drag(page, (0.1, 0.05), (0.8, 0.8))
        page.click("#clear-selection")
        page.wait_for_selector("#nothing-selected")
        assert page.evaluate(_SELECTED) == [] and not page.locator(".brush").is_visible()
        page.click("#brush-mode")
        assert page.get_attribute("#brush-mode", "aria-pressed") == "false"
        whole = page.evaluate("document.querySelector('#explored .plot').chart.range")
        page.locator("#explored .canvas").scroll_into_view_if_needed()
        area, ends = page.locator("#explored .canvas").bounding_box(), frame(page)
        page.mouse.move(area["x"] + ends["left"] + 60, area["y"] + ends["top"] + 40)
        page.mouse.down()
        page.mouse.move(area["x"] + ends["left"] + 260, area["y"] + ends["top"] + 240, steps=4)
        page.mouse.up()
        zoomed = page.evaluate("document.querySelector('#explored .plot').chart.range")
        assert zoomed["x"][0] > whole["x"][0] and zoomed["x"][1] < whole["x"][1]
        assert page.evaluate(_SELECTED) == []


def test_a_menu_redraws_the_chart_and_other_rows_have_their_own_quantities(browser, lab):
    with page_of(browser, lab, width=1400) as page:
        at(page, SCATTER)
        page.select_option("#y", "impulse_n_s")
        page.wait_for_url("**y=impulse_n_s**")
        wait_drawn(page)
        assert page.input_value("#colour") == "tip_material"
        page.select_option("#subject", "shots")
        page.wait_for_url("**subject=shots**")
        wait_drawn(page)
        assert page.input_value("#y") == "measured_velocity_m_s"
        assert page.locator("#explore-form .field-error").count() == 0


def test_a_view_is_saved_with_its_selection_and_opened_by_name(browser, lab):
    with page_of(browser, lab, width=1400) as page:
        at(page, SCATTER)
        drag(page, (0.1, 0.1), (0.6, 0.9))
        rows = listed(page)
        page.fill("#name", "short contacts")
        page.click("#save-view button")
        page.wait_for_url("**/explore?view=short%20contacts")
        wait_drawn(page)
        assert listed(page) == rows and page.locator("h1").inner_text() == "Explore: short contacts"
        with lab.reading() as session:
            from pyroshock.app.operations.explore.saved_views import get_view

            request = json.loads(json.dumps(get_view(session, "short contacts").request))
        assert request["colour"] == "tip_material" and {"select_x", "select_y"} <= request.keys()
        page.click("#views summary")
        page.click("#views a:has-text('Delete')")
        assert "All stored rows" in page.inner_text("#kept")
        page.click("#delete button")
        page.wait_for_url("**/explore#deleted-views")
        page.click("#deleted-views summary")
        page.click("#deleted-views button")
        page.wait_for_url("**/explore?view=short%20contacts")
        until(lambda: page.locator("#selected-rows").count() == 1)
        assert listed(page) == rows
