"""In a browser: pulses over each other, and spectra with bands and on four-coordinate paper."""

from __future__ import annotations

import pytest
from pyroshock.schema.campaigns import Campaign
from pyroshock.schema.impacts import Impact, Pulse
from sqlalchemy import func, select
from support.processes.browsers import asked, at, drawn, page_of, screenshot, wait_drawn

#: Standard gravity, m/s2.
G = 9.80665
pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]


def levels(page):
    """The curves of the upper plot by name; the lower one has the differences."""
    series = page.evaluate("document.querySelector('#spectra .plot').chart.charts[0].figure.series")
    return {trace["name"]: trace for trace in series}


def test_overlay_has_each_level_with_its_pulses(browser, lab):
    with lab.reading() as session:
        query = select(func.count()).select_from(Pulse).join(Impact, Pulse.impact_id == Impact.id)
        query = query.join(Campaign, Impact.campaign_id == Campaign.id)
        pulses = session.scalar(query.where(Pulse.current, Campaign.name == "rehearsal"))
    with page_of(browser, lab) as page:
        at(page, "/compare?campaign=rehearsal&rejected=true")
        groups = [row.split("\t") for row in page.locator("#groups tbody tr").all_inner_texts()]
        assert sum(int(row[1]) for row in groups) == pulses
        shown = {trace["name"] for trace in drawn(page, "overlay")}
        assert {f"{level} ({count})" for level, count, *_ in groups} <= shown
        assert any("standard deviation" in own["detail"] for own in drawn(page, "overlay"))
        screenshot(page, "compare", 1000)
        page.select_option("#factor", "tip_radius")
        page.click("#filter button")
        wait_drawn(page)
        assert all(
            row.split("\t")[0].endswith("mm")
            for row in page.locator("#groups tbody tr").all_inner_texts()
        )


def test_spectra_are_those_of_the_api_with_bands_and_decibels(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/compare?campaign=rehearsal")
        page.click("#to-spectra")
        wait_drawn(page)
        impacts = page.input_value("#impacts").split(",")
        found = asked(page, "/api/spectra?" + "&".join(f"impact={each}" for each in impacts))
        traces = levels(page)
        assert {"±3 dB", "±6 dB", "reference"} <= traces.keys()
        for each in found["spectra"]:
            trace = traces[f"impact {each['impact']}, {each['channel']}"]
            assert trace["y"] == pytest.approx([level / G for level in each["maximax"]], rel=1e-5)
            assert len(trace["labels"]) == len(trace["y"])
            assert any(label.endswith(" dB") for label in trace["labels"])
        assert page.locator("#held tbody tr").count() == len(found["spectra"])
        paper = {trace["name"] or trace["detail"]: trace for trace in drawn(page, "paper")}
        each = found["spectra"][0]
        curve = paper[f"impact {each['impact']}, {each['channel']}"]
        assert curve["y"] == pytest.approx(each["pseudo_velocity_m_s"], rel=1e-5)
        assert any(name.endswith(" g") for name in paper) and any(
            name.endswith("mm") for name in paper
        )


def test_sides_and_a_specification_are_shown(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/compare?campaign=rehearsal")
        page.click("#to-spectra")
        wait_drawn(page)
        page.select_option("#sides", "true")
        page.click("summary")
        page.fill("#specification", "frequency_hz,level_g\n100,30\n1000,1000\n10000,1000\n")
        page.fill("#tolerance", "6dB")
        page.press("#tolerance", "Enter")
        page.wait_for_url("**specification=*")
        wait_drawn(page)
        traces = levels(page)
        assert traces["reference"]["y"][0] == pytest.approx(30, rel=1e-4)
        sides = [name for name in traces if name.endswith((" positive", " negative"))]
        assert len(sides) == 2 * page.locator("#held tbody tr").count()
