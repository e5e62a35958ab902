"""Notes, tags and saved filters: who writes and changes them, where they are shown, and that they
are text."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyroshock as ps
import pytest
from pyroshock.schema.notes import Note
from sqlalchemy import func, select
from starlette.testclient import TestClient
from support.processes.web_client import post, post_json, sqlite
from support.records.campaigns import hammer_campaign
from support.stores.stores import ingested, run_pyroshock
from support.stores.team import Team, team_of

PEOPLE = {"rita": "reader", "olaf": "operator", "otto": "operator", "ada": "administrator"}
EVIL = "<script>alert(1)</script> & 'x' =1+1\nline two"


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Team]:
    with team_of(tmp_path_factory.mktemp("notes"), PEOPLE) as team:
        yield team


def write(client: TestClient, about: str, subject: str, text: str) -> Any:
    return post_json(client, "/api/notes", {"about": about, "subject": subject, "text": text})


@pytest.mark.parametrize(("about", "subject", "page", "named"), [
    ("campaign", "spring", "/campaigns/spring", "spring"),
    ("impact", "1", "/impacts/1", "spring/1/1"),
    ("impact", "spring/2/1", "/impacts/2", "spring/2/1"),
    ("run", "autumn/3", "/plans/autumn/sheet?run=3", "autumn/3"),
])  # fmt: skip
def test_a_note_stands_on_the_page_of_its_subject_with_author_and_time_as_text(
    lab: Team, about: str, subject: str, page: str, named: str
) -> None:
    client = lab.browser("olaf")
    note = write(client, about, subject, f"{EVIL} {about}").json()
    assert note["subject"] == named and note["author"] == "olaf"
    shown = lab.browser("rita").get(page).text
    assert "<script>alert(1)" not in shown
    assert "&lt;script&gt;alert(1)&lt;/script&gt; &amp; &#39;x&#39; =1+1" in shown
    assert f"olaf, {note['written_at'][:10]}" in shown
    assert named in lab.browser("rita").get("/notes").text


@pytest.mark.parametrize(("about", "subject"), [
    ("campaign", "nowhere"), ("impact", "99"), ("impact", "spring/9/9"), ("run", "autumn"),
    ("run", "autumn/9999"), ("model", "gp@1"), ("impact", "1; drop table notes"),
])  # fmt: skip
def test_a_note_on_nothing_is_refused_with_what_there_is(
    lab: Team, about: str, subject: str
) -> None:
    answer = write(lab.browser("olaf"), about, subject, "x")
    assert answer.status_code == 404 and f"no {about} '{subject}'" in answer.json()["detail"]


def test_an_edit_keeps_the_earlier_text_and_a_withdrawal_the_note(lab: Team) -> None:
    client = lab.browser("olaf")
    key = write(client, "campaign", "spring", "the first text").json()["note"]
    changed = post_json(client, f"/api/notes/{key}", {"text": "the second text"}).json()
    assert changed["text"] == "the second text"
    assert [version["text"] for version in changed["earlier"]] == ["the first text"]
    page = client.get("/campaigns/spring").text
    assert "the second text" in page and "Earlier texts" in page and "the first text" in page
    answer = post_json(client, f"/api/notes/{key}/withdraw", {"reason": "another plate"})
    assert answer.json()["text"] is None and answer.json()["reason"] == "another plate"
    assert "A note of olaf was withdrawn" in client.get("/campaigns/spring").text
    with lab.store.reading() as session:
        rows = session.scalars(select(Note.text).where((Note.id == key) | (Note.first_id == key)))
        assert list(rows) == ["the first text", "the second text", None]


def test_a_note_of_another_is_neither_changed_nor_withdrawn(lab: Team) -> None:
    key = write(lab.browser("olaf"), "campaign", "spring", "mine").json()["note"]
    other_browser = lab.browser("otto")
    for address, body in (
        (f"/api/notes/{key}", {"text": "yours"}),
        (f"/api/notes/{key}", {"text": "yours", "author": "olaf"}),
        (f"/api/notes/{key}/withdraw", {"reason": "no"}),
    ):
        assert post_json(other_browser, address, body).status_code in (403, 422)
    assert post(other_browser, f"/notes/{key}", {"text": "yours"}).status_code == 403
    administrator = lab.browser("ada")
    assert post_json(administrator, f"/api/notes/{key}", {"text": "no"}).status_code == 403
    withdrawal = post_json(administrator, f"/api/notes/{key}/withdraw", {"reason": "wrong"})
    assert withdrawal.status_code == 200 and withdrawal.json()["author"] == "ada"


def test_a_reader_writes_nothing(lab: Team) -> None:
    client = lab.browser("rita")
    with lab.store.reading() as session:
        count_before = session.scalar(select(func.count()).select_from(Note))
    assert write(client, "campaign", "spring", "x").status_code == 403
    tag = {"about": "campaign", "subject": "spring", "tag": "x"}
    assert post_json(client, "/api/tags", tag).status_code == 403
    assert post(client, "/tags", tag).status_code == 403
    assert post(client, "/filters", {"name": "x", "address": "/impacts"}).status_code == 403
    with lab.store.reading() as session:
        assert session.scalar(select(func.count()).select_from(Note)) == count_before


def test_a_tag_filters_impacts_at_every_door(lab: Team) -> None:
    client = lab.browser("olaf")
    body = {"about": "impact", "subject": "2", "tag": "Doubtful"}
    assert post_json(client, "/api/tags", body).json()["tags"] == ["doubtful"]
    assert post_json(client, "/api/tags", body).json()["tags"] == ["doubtful"]  # once
    for condition, impacts in (("tag=doubtful", [2]), ("tag!=doubtful", [1]), ("tag=none", [])):
        words = ("impacts", "--where", condition, "--json", "--db", lab.db)
        assert [row["id"] for row in json.loads(run_pyroshock(*words).stdout)] == impacts
        rows = client.get("/api/impacts", params={"where": condition}).json()
        assert [row["id"] for row in rows] == impacts
        page = client.get("/impacts", params={"where": condition})
        assert page.status_code == 200 and ('href="/impacts/2"' in page.text) is (2 in impacts)
    assert client.get("/api/impacts", params={"where": "tag>doubtful"}).status_code == 400
    assert "spring/2/1" in client.get("/notes?tag=doubtful").text
    assert post(client, "/tags/remove", body).status_code == 303
    assert client.get("/api/impacts", params={"where": "tag=doubtful"}).json() == []


def test_a_tag_filters_campaigns_at_every_door(lab: Team) -> None:
    client = lab.browser("olaf")
    page = client.get("/campaigns").text
    assert 'href="/campaigns/spring"' in page and 'name="tag"' not in page
    body = {"about": "campaign", "subject": "spring", "tag": "Doubtful"}
    assert post_json(client, "/api/tags", body).status_code == 200
    impact = {"about": "impact", "subject": "2", "tag": "loud"}
    assert post_json(client, "/api/tags", impact).status_code == 200
    for tag, campaigns in (("doubtful", ["spring"]), ("Doubtful", ["spring"]), ("loud", [])):
        words = ("campaigns", "list", "--tag", tag, "--json", "--db", lab.db)
        assert [row["name"] for row in json.loads(run_pyroshock(*words).stdout)] == campaigns
        for address in ("/api/campaigns", "/api/library/campaigns"):
            answer = client.get(address, params={"tag": tag})
            assert answer.status_code == 200 and ("spring" in answer.text) is bool(campaigns)
        page = client.get("/campaigns", params={"tag": tag}).text
        assert ('href="/campaigns/spring"' in page) is bool(campaigns)
        assert 'id="tag"' in page and ("No campaign matches." in page) is not campaigns
        with ps.open(lab.db) as library:
            assert list(library.campaigns(tag=tag)["name"]) == campaigns
    refused = client.get("/api/campaigns", params={"tag": "two words"})
    assert refused.status_code == 422 and "expected one word" in refused.text


@pytest.mark.parametrize("word", ["two words", "", "a" * 41, "<b>", "-x", "a/b", "x'--"])
def test_a_tag_is_one_word(lab: Team, word: str) -> None:
    body = {"about": "campaign", "subject": "spring", "tag": word}
    assert post_json(lab.browser("olaf"), "/api/tags", body).status_code == 422


def test_a_saved_filter_is_an_address_of_this_server_and_its_authors_to_delete(
    lab: Team,
) -> None:
    client, other_browser = lab.browser("olaf"), lab.browser("otto")
    body = {"name": "hard", "address": "http://lab:8000/impacts?where=peak_force_n%3E1"}
    assert post_json(client, "/api/filters", body).status_code == 200
    assert post_json(client, "/api/filters", body).status_code == 422  # the name is taken
    assert 'href="/impacts?where=peak_force_n%3E1"' in other_browser.get("/notes").text
    for address in ("javascript:alert(1)", "//evil.example/x", "/\\evil.example", "evil", "/a b"):
        bad = {"name": "bad", "address": address}
        assert post_json(client, "/api/filters", bad).status_code == 422
    assert post(other_browser, "/filters/hard/delete").status_code == 403
    assert post(client, "/filters/hard/delete").status_code == 303
    assert "hard" not in other_browser.get("/notes").text


def test_a_note_stays_while_its_campaign_is_archived_and_is_there_again(
    tmp_path: Path,
) -> None:
    db = sqlite(tmp_path)
    ingested(db, hammer_campaign(tmp_path / "spring", recordings=2, hits=1, name="spring"))
    words = ("--db", db)
    run_pyroshock("notes", "add", "impact", "2", "--text", "loose plate", *words)
    out = tmp_path / "spring.pyroshock"
    run_pyroshock("campaigns", "archive", "spring", "--out", out, "--reason", "r", *words)
    run_pyroshock("campaigns", "restore", out, *words)
    listed = run_pyroshock(
        "notes", "list", "--about", "impact", "--subject", "spring/2/1", "--json", *words
    )
    assert [note["text"] for note in json.loads(listed.stdout)] == ["loose plate"]
    assert json.loads(listed.stdout)[0]["author_kind"] == "system"
