"""The search box: it finds by words what people name, says how many, and shows it as text."""

from __future__ import annotations

import json
from collections.abc import Iterator

import pytest
from pyroshock.app.operations.plan.planning import make_plan
from pyroshock.app.operations.store import search
from starlette.testclient import TestClient
from support.processes.web_client import sqlite, window
from support.records.campaigns import hammer_campaign
from support.stores.stores import ingested, run_pyroshock

Lab = tuple[TestClient, str]


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    folder = tmp_path_factory.mktemp("search")
    db = sqlite(folder)
    ingested(db, hammer_campaign(folder / "spring", recordings=3, hits=1, name="Spring 100%"))
    words = ("--db", db)
    note = "The plate was LOOSE <b>here</b>"
    run_pyroshock("notes", "add", "campaign", "Spring 100%", "--text", note, *words)
    run_pyroshock("notes", "add", "impact", "1", "--text", "an old word", *words)
    run_pyroshock("notes", "edit", "2", "--text", "a new word", *words)
    run_pyroshock("notes", "add", "impact", "1", "--text", "a gone word", *words)
    run_pyroshock("notes", "withdraw", "4", "--reason", "r", *words)
    run_pyroshock("tags", "add", "impact", "1", "doubtful", *words)
    run_pyroshock("filters", "save", "hard hits", "/impacts?where=peak_force_n%3E1", *words)
    for name, place in (("bench.txt", "Spring 100%"), ("gone.txt", "Spring 100%")):
        (folder / name).write_text(name)
        run_pyroshock(
            *("attachments", "add", folder / name, "--campaign", place),
            *("--caption", f"a calliper beside the {name[:4]}", *words),
        )
    run_pyroshock("attachments", "remove", "2", "--reason", "r", *words)
    with window(db, works=False) as (client, store):
        make_plan(store, "factorial", "spring-plan", kind="hammer", repetitions=1)
        yield client, db


@pytest.mark.parametrize(("words", "hits"), [
    ("spring", {("campaign", "/campaigns/Spring%20100%25"), ("plan", "/plans/spring-plan")}),
    ("calliper", {("attachment", "/campaigns/Spring%20100%25")}),
    ("bench.txt", {("attachment", "/campaigns/Spring%20100%25")}),
    ("loose PLATE", {("note", "/campaigns/Spring%20100%25")}),
    ("loose nowhere", set()),
    ("new word", {("note", "/impacts/1")}),
    ("old word", set()),
    ("gone word", set()),
    ("doubt", {("tag", "/notes?tag=doubtful")}),
    ("hard", {("filter", "/impacts?where=peak_force_n%3E1")}),
    ("2", {("impact", "/impacts/2"), ("recording", "/campaigns/Spring%20100%25")}),
    ("#2", {("impact", "/impacts/2")}),
    ("delrin", {("material", "/ask/material-list")}),
    ("100%", {("campaign", "/campaigns/Spring%20100%25")}),
    ("_", set()),
    ("' or 1=1 --", set()),
])  # fmt: skip
def test_all_words_must_appear_and_each_hit_leads_to_its_page(
    lab: Lab, words: str, hits: set[tuple[str, str]]
) -> None:
    client, db = lab
    rows = client.get("/api/search", params={"words": words}).json()
    assert {(row["kind"], row["address"]) for row in rows} >= hits
    assert {row["kind"] for row in rows} - {"recording", "material"} == {
        kind for kind, _ in hits
    } - {"recording", "material"}
    typed = json.loads(run_pyroshock("search", "--json", "--db", db, "--", words).stdout)
    assert typed == rows
    page = client.get("/search", params={"words": words})
    assert page.status_code == 200 and "<b>here" not in page.text
    for row in rows:
        assert client.get(row["address"]).status_code == 200


def test_the_page_says_how_many_there_are_and_that_there_are_more(
    lab: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    client, _ = lab
    assert "Nothing was found." in client.get("/search?words=nowhere").text
    assert "2 found: 1 campaign, 1 plan." in client.get("/search?words=spring").text
    rows = client.get("/api/search", params={"words": "npz", "limit": 2}).json()
    assert len(rows) == 2
    question = search.SearchQuestion(words="a", limit=1)
    hits = search.FoundThings([{"kind": "note"}], "", ("note",))
    assert hits.count_words() == "At least 1 found: at least 1 note."
    assert question.limit == 1


def test_an_empty_box_is_told_what_can_be_found(lab: Lab) -> None:
    client, _ = lab
    for address in ("/search", "/search?words=", "/search?words=%20"):
        assert "number of an impact" in client.get(address).text
    assert client.get("/api/search", params={"words": " "}).status_code == 422
    assert 'role="search"' in client.get("/campaigns").text
