"""The page /explore: what it draws and says, its empty state, wrong input, the rows of a selection,
and views by name with a way back from their deletion."""

from __future__ import annotations

import json
import re
from typing import Any
from urllib.parse import parse_qs, urlsplit

import pytest
from support.processes.web_client import post, post_json
from support.stores.web_stores import HAMMER, IMPACTS, SHOTS, Lab

FORM = {"X-Pyroshock-Form": "1"}


def page(lab: Lab, address: str, status: int = 200) -> str:
    answer = lab.client.get(address)
    assert answer.status_code == status, answer.text
    return answer.text


def figure(text: str, chart: str = "explored") -> dict[str, Any]:
    return json.loads(re.search(rf'id="{chart}-data">(.*?)</script>', text, re.DOTALL)[1])


def sentences(text: str) -> list[str]:
    listed = re.search(r'<ul class="plain" id="sentences">(.*?)</ul>', text, re.DOTALL)[1]
    return re.findall(r"<li[^>]*>(.*?)</li>", listed)


def points(text: str) -> int:
    return sum(len(own["x"]) for own in figure(text)["series"] if own["kind"] == "points")


def test_the_page_opens_with_a_scatter_of_all_impacts(filled: Lab) -> None:
    text = page(filled, "/explore")
    plot = figure(text)
    assert (plot["x"]["heading"], plot["y"]["heading"]) == ("contact time (ms)", "peak force (kN)")
    assert points(text) == IMPACTS and sentences(text)[0] == f"{IMPACTS} impacts match."
    assert '<a id="menu-explore" href="/explore" aria-current="page">Explore</a>' in text
    assert "Draw a rectangle on the chart" in text and "No view is saved yet." in text


@pytest.mark.parametrize(
    ("query", "heading", "count"),
    [
        ("subject=shots", "measured velocity (m/s)", SHOTS),
        ("subject=channels", "frequency of the SRS peak (Hz)", 1),
        ("subject=models&kind=levels", "force NRMSE", 2),
        ("kind=control&y=impulse_n_s", "impulse (N s)", IMPACTS),
        ("kind=levels&x=tip_material&y=peak_force_n", "peak force (kN)", 20),
    ],
)
def test_every_subject_and_kind_is_drawn(filled: Lab, query: str, heading: str, count: int) -> None:
    text = page(filled, f"/explore?{query}")
    assert figure(text)["y"]["heading"] == heading
    rows = [own for own in figure(text)["series"] if own["kind"] == "points" and own["filled"]]
    assert sum(len(own["x"]) for own in rows) == count


def test_a_distribution_counts_rows_by_colour(filled: Lab) -> None:
    text = page(filled, f"/explore?kind=distribution&x=peak_force_n&colour=run&campaign={HAMMER}")
    counts = [sum(own["values"]) for own in figure(text)["series"]]
    assert sum(counts) == 20 and len(counts) == 4
    assert '<table id="groups">' in text and "percentile 95 (kN)" in text


def test_a_colour_by_numbers_is_named_by_its_ranges(filled: Lab) -> None:
    plot = figure(page(filled, "/explore?colour=impulse_n_s"))
    assert all(" to " in name and name.endswith(" N s") for name in plot["legend"][:5])


def test_points_say_which_impact_they_are(filled: Lab) -> None:
    (own,) = figure(page(filled, f"/explore?campaign={HAMMER}&where=run%3C2"))["series"]
    assert own["labels"] == [f"impact {key}" for key in range(1, 6)]


@pytest.mark.parametrize(
    ("query", "status", "field", "words"),
    [
        ("x=nonsense", 422, "x", "x is &#39;nonsense&#39;; expected one of"),
        ("x=tip_material", 422, "x", "whose values are words"),
        ("kind=pie", 422, "kind", "expected one of scatter, distribution, levels, control"),
        ("where=nonsense", 400, "where", "is not a condition"),
        ("where=nonsense%3E1", 400, "where", "no column or factor"),
        ("campaign=none-of-that-name", 422, "campaign", "no campaign"),
        ("select_x=1", 422, "select_x", "two numbers with a colon between them"),
        ("view=none", 422, "view", "no view &#39;none&#39;; there are: none yet"),
    ],
)
def test_what_cannot_be_drawn_is_said_beside_its_field(
    filled: Lab, query: str, status: int, field: str, words: str
) -> None:
    text = page(filled, f"/explore?{query}", status)
    error_text = re.search(rf'id="{field}-error" role="alert">(.*?)</span>', text, re.DOTALL)
    assert error_text and words in error_text[1]
    assert 'id="explore-form"' in text


def test_a_store_of_nothing_says_what_to_do(empty: Lab) -> None:
    for query in ("", "?subject=shots", "?kind=levels", "?kind=control", "?subject=models"):
        text = page(empty, f"/explore{query}")
        assert "matches." in sentences(text)[0] and sentences(text)[0].startswith("No ")
    assert "Ingest a campaign" in page(empty, "/explore")


# --- selection


def test_a_selection_lists_its_rows_with_links_and_further_pages(filled: Lab) -> None:
    text = page(filled, f"/explore?campaign={HAMMER}&select_y=0:1e9&select_x=0:1&where=run%3C2")
    rows = re.search(r'<table id="selected-rows">.*?</table>', text, re.DOTALL)[0]
    assert re.findall(r'<a href="/impacts/(\d+)">', rows) == ["1", "2", "3", "4", "5"]
    assert "<strong>5</strong> rows are selected: contact time 0 to 1000 ms" in text

    def link(name: str) -> str:
        return re.search(rf'id="{name}" href="([^"]+)"', text)[1].replace("&amp;", "&")

    assert link("to-spectra") == "/compare/spectra?impacts=1%2C2%2C3%2C4%2C5"
    assert filled.client.get(link("to-spectra")).status_code == 200
    assert "5 of 5 pulses that match" in page(filled, link("to-pulses"))
    assert sentences(page(filled, link("narrow")))[0] == "5 impacts match."
    assert "Selected rows: " not in page(filled, link("clear-selection"))


def test_the_script_gets_the_same_rows_as_the_page(filled: Lab) -> None:
    query = "kind=levels&x=tip_material&y=peak_force_n&select_x=-0.5:0.5&select_y=0:1e9"
    part, whole = page(filled, f"/explore/selection?{query}"), page(filled, f"/explore?{query}")
    table = re.compile(r'<table id="selected-rows">.*?</table>', re.DOTALL)
    assert table.search(part)[0] == table.search(whole)[0]
    assert "<html" not in part and 'id="narrow"' not in part


def test_a_rectangle_without_rows_says_so(filled: Lab) -> None:
    text = page(filled, "/explore?select_y=1e8:1e9")
    assert "<strong>0</strong> rows are selected" in text
    assert "no row lies within the rectangle" in text and 'id="to-spectra"' not in text


# --- views


def test_a_view_is_saved_opened_renamed_deleted_and_restored(filled: Lab) -> None:
    fields = {
        "kind": "levels", "x": "tip_material", "y": "peak_force_n", "log_y": "true",
        "where": ["peak_force_n>1", "run<4"], "name": "force & tip", "creator": "Ada",
    }  # fmt: skip
    saved = post(filled.client, "/explore/views", fields)
    assert saved.status_code == 303
    address = saved.headers["location"]
    text = page(filled, address)
    assert "Explore: force &amp; tip" in text and "saved" in text and "by Ada" in text
    plot = figure(text)
    assert plot["title"] == "peak force (kN) by tip material" and plot["y"]["scale"] == "log"
    assert 'value="peak_force_n&gt;1"' in text and 'value="run&lt;4"' in text
    # the address of a view takes further fields
    assert "<strong>" in page(filled, f"{address}&select_y=0:1e9")

    second_answer = post(filled.client, "/explore/views", fields, headers=FORM)
    assert second_answer.json()["faults"][0]["field"] == "name" and "already" in second_answer.text
    renamed = post(filled.client, "/explore/views/force%20&%20tip/rename", {"new_name": "by tip"})
    assert parse_qs(urlsplit(renamed.headers["location"]).query)["view"] == ["by tip"]
    listed = filled.client.get("/api/views").json()
    assert [view["name"] for view in listed] == ["by tip"]
    assert listed[0]["request"]["where"] == ["peak_force_n>1", "run<4"]

    deletion_page = page(filled, "/explore/views/by%20tip/delete")
    assert (
        "levels of impacts: peak_force_n, tip_material" in deletion_page
        and "All stored rows." in deletion_page
    )
    assert len(filled.client.get("/api/views").json()) == 1, "asking deletes nothing"
    deleted = post(filled.client, "/explore/views/by%20tip/delete")
    assert deleted.headers["location"] == "/explore#deleted-views"
    text = page(filled, "/explore")
    assert "1 deleted view" in text and filled.client.get("/api/views").json() == []
    restored = post(filled.client, "/explore/views/by%20tip/restore")
    assert restored.status_code == 303
    assert [view["name"] for view in filled.client.get("/api/views").json()] == ["by tip"]


def test_a_view_that_replaces_another_can_be_taken_back(filled: Lab) -> None:
    for x in ("contact_time_s", "impulse_n_s"):
        body = {"name": "mine", "x": x, "replace": True}
        assert post_json(filled.client, "/api/views", body).status_code == 200
    shown = filled.client.get("/api/explore?view=mine").json()
    assert shown["x"] == "impulse_n_s"
    refused = post_json(filled.client, "/api/views/mine/restore", {})
    assert refused.status_code == 422 and "another view has meanwhile" in refused.text
    post_json(filled.client, "/api/views/mine/rename", {"new_name": "newer"})
    assert post_json(filled.client, "/api/views/mine/restore", {}).status_code == 200
    assert filled.client.get("/api/views/mine").json()["x"] == "contact_time_s"


def test_a_view_that_cannot_be_drawn_is_not_saved(filled: Lab) -> None:
    rows_before = filled.rows()
    refused = post_json(filled.client, "/api/views", {"name": "bad", "x": "tip_material"})
    assert refused.status_code == 422 and "whose values are words" in refused.text
    assert filled.added(rows_before) == {}


def test_a_name_is_shown_as_it_is_and_not_as_markup(filled: Lab) -> None:
    name = "<script>alert(1)</script>/..%2F"
    saved = post(filled.client, "/explore/views", {"name": name})
    text = page(filled, saved.headers["location"])
    assert "<script>alert" not in text and "&lt;script&gt;" in text
    address = re.search(r'href="(/explore/views/[^"]*script[^"]*/delete)"', text)[1]
    assert "&lt;script&gt;" in page(filled, address)
    assert post(filled.client, address).status_code == 303
