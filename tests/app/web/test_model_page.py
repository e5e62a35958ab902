"""The page of a model: what it is good for first, its worst pulses with their impacts, and its
learning curve, which a job computes."""

from __future__ import annotations

import json
import re
from typing import Any

import pytest
from support.processes.web_client import ended, post
from support.stores.web_stores import Lab

pytestmark = pytest.mark.timeout(300)


def figure(page: str, name: str) -> dict[str, Any]:
    data = re.search(rf'id="{name}-data">(.*?)</script>', page, re.DOTALL)
    assert data is not None, name
    figure: dict[str, Any] = json.loads(data[1])
    return figure


def test_what_it_is_good_for_stands_before_everything_else(filled: Lab) -> None:
    page = filled.client.get("/models/linear/1").text
    places = [
        page.index(f'id="{name}"')
        for name in ("strengths", "coverage", "strength-sentence", "worst-1", "figures", "promote")
    ]
    assert places == sorted(places)


def test_every_group_of_the_picture_is_a_row_with_the_same_error(filled: Lab) -> None:
    page = filled.client.get("/models/linear/1").text
    drawn = figure(page, "strengths")
    errors = [
        (drawn["y"]["categories"][int(place)], error)
        for own in drawn["series"]
        if own["kind"] == "points"
        for place, error in zip(own["y"], own["x"], strict=True)
    ]
    table = page.partition('<table id="strength-table"')[2].partition("</table>")[0]
    rows = {
        cells[0]: cells
        for row in table.split("<tr>")[2:]
        if (cells := re.findall(r"<td[^>]*>(.*?)</td>", row))
    }
    assert len(errors) == len(rows) > 0 and "all pulses" in rows
    for name, error in errors:
        assert float(rows[name][2].split()[0]) == pytest.approx(error, rel=5e-3)


def test_the_worst_pulses_are_drawn_and_lead_to_their_impacts(filled: Lab) -> None:
    page = filled.client.get("/models/linear/1").text
    table = page.partition('<table id="worst"')[2].partition("</table>")[0]
    impacts = re.findall(r'href="(/impacts/\d+)"', table)
    assert impacts and filled.client.get(impacts[0]).status_code == 200
    names = {own["name"] for own in figure(page, "worst-1")["series"]}
    assert {"predicted", "measured"} <= names


def test_the_learning_curve_is_a_job_and_stays_with_the_version(filled: Lab) -> None:
    page = filled.client.get("/models/linear/1").text
    assert 'id="curve-data"' not in page and "It trains the model ten times" in page
    answer = post(filled.client, "/models/linear/1/learning-curve", {"split": "repetitions"})
    job = ended(filled.client, answer)
    assert (job["state"], job["error"]) == ("done", None)
    assert job["address"] == "/models/linear/1?split=repetitions"
    points = job["result"]["points"]
    page = filled.client.get(job["address"]).text
    curve = next(own for own in figure(page, "curve")["series"] if own["kind"] == "points")
    assert curve["x"] == [point["pulses"] for point in points]
    assert curve["y"] == pytest.approx([100 * point["error"] for point in points], rel=1e-5)
    assert points[-1]["share"] == 1.0 and "Compute the learning curve again" in page


def test_a_learning_curve_of_a_split_that_was_not_judged_is_refused(filled: Lab) -> None:
    answer = post(filled.client, "/models/linear/1/learning-curve", {"split": "treatments"})
    assert answer.status_code in (404, 422) and "was not judged on the split" in answer.text
