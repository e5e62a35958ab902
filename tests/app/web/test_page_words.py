"""Pages speak of fields, buttons and pages, and never of options and commands; they show no path of
the server, and no date that nobody knows."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from pyroshock.app.web.page_words import in_page_words
from pyroshock.ingest.load import ingest_folder
from support.checks.page_text import PageText, command_words
from support.processes.web_client import ended, post, sqlite, window
from support.records.campaigns import gun_campaign, hammer_campaign, replace_in
from support.stores.web_stores import Lab

EXAMPLES = Path(__file__).parents[3] / "examples"


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[Lab]:
    folder = tmp_path / "lab"
    (folder / "campaigns").mkdir(parents=True)
    with window(sqlite(folder), folders=(folder / "campaigns",)) as (client, store):
        ingest_folder(store, EXAMPLES / "first-shots")
        ingest_folder(store, hammer_campaign(tmp_path / "spring", 2, 1, "spring"))
        yield Lab(client, store, sqlite(folder), folder)


@pytest.mark.parametrize(("said", "shown"), [
    ("lower --event-share, or delete the row", "lower “Event share”, or delete the row"),
    ("no models yet; train some: pyroshock train DATASET",
     "no models yet; train some: the page “Train models”"),
    ("correct the row, or, if it is true, confirm it with --confirm negative-size or with "
     'confirmed = ["negative-size"] in [bench] of campaign.toml',
     "correct the row, or, if it is true, tick the rule negative-size in the form of the campaign"),
    ("give it a name of its own, or replace it: pyroshock runs replace a b.npz --from FOLDER "
     "--reason TEXT",
     "give it a name of its own, or discard the recording on the page of one of its impacts, and "
     "ingest the folder again"),
    ("a material of the store (pyroshock materials lists and adds them)",
     "a material of the store"),
    ("Add --replicates 2.", "Make the plan with “Replicates” set to 2."),
    ("Make the plan with --blocks 2, which visits every set-up twice",
     "Make the plan with “Blocks” set to 2, which visits every set-up twice"),
    ("Adopt these effects: pyroshock diagnose 'spring 2' --adopt gun.valve_flow,gun.blow_by.",
     "Adopt these effects: choose gun.valve_flow,gun.blow_by and press “Adopt” on the page of the "
     "diagnosis."),
    ("It holds no shares of effects: diagnose again (pyroshock diagnose first-shots).",
     "It holds no shares of effects: diagnose it again."),
    ("a sentence -- with dashes, and a-b", "a sentence -- with dashes, and a-b"),
])  # fmt: skip
def test_a_message_of_the_command_line_is_put_into_the_words_of_pages(
    said: str, shown: str
) -> None:
    assert in_page_words(said) == shown
    assert not command_words(in_page_words(said))


def test_folders_of_the_server_are_called_by_their_last_part(tmp_path: Path) -> None:
    folder = tmp_path / "shots"
    folder.mkdir()
    assert in_page_words(f"no folder '{folder}/spring' any more", (folder,)) == (
        "no folder 'shots/spring' any more"
    )


@pytest.mark.parametrize("address", [
    "/", "/campaigns", "/campaigns/spring", "/campaigns/first-shots", "/campaigns/spring/facts",
    "/campaigns/spring/delete", "/campaigns/spring/archive", "/campaigns/spring/export",
    "/campaigns/spring/extract", "/deleted", "/impacts", "/impacts/1", "/impacts/1/discard",
    "/shots", "/ingest", "/plans", "/plans/new", "/jobs", "/datasets", "/nowhere",
])  # fmt: skip
def test_a_page_names_no_option_no_command_no_path_and_no_year_1970(lab: Lab, address: str) -> None:
    text = PageText(lab.client.get(address).text).text
    assert not command_words(text), command_words(text)
    assert str(lab.folder) not in text
    assert "1970" not in text


def test_an_unknown_date_is_told_and_comes_last(lab: Lab) -> None:
    page = lab.client.get("/campaigns").text
    assert page.index(">spring<") < page.index(">first-shots<")
    assert "not known" in page.partition(">first-shots<")[2]
    assert "date not known" in lab.client.get("/campaigns/first-shots").text
    listed = lab.client.get("/api/campaigns").json()
    assert {row["name"]: row["date"] for row in listed} == {
        "spring": "2026-03-02", "first-shots": None,
    }  # fmt: skip


def test_a_folder_of_the_server_is_called_by_its_place_below_what_may_be_read(
    lab: Lab, tmp_path: Path
) -> None:
    folder = gun_campaign(lab.folder / "campaigns" / "shots", 2, "shots")
    page = lab.client.get("/ingest").text
    assert '<option value="shots">' in page and str(lab.folder) not in page
    answer = post(lab.client, "/ingest/path", {"path": "shots", "dry_run": "1"})
    assert ended(lab.client, answer)["state"] == "done"
    page = lab.client.get(answer.headers["location"]).text
    assert str(lab.folder) not in page and "The folder shots of the server" in page
    refused = post(
        lab.client, "/ingest/path", {"path": "../lab"}, headers={"X-Pyroshock-Form": "1"}
    )
    assert str(lab.folder) not in refused.text
    # a fault of the folder is told in words of pages
    (folder / "runs.csv").unlink()
    answer = post(lab.client, "/ingest/path", {"path": "shots", "dry_run": "1"})
    ended(lab.client, answer)
    page = lab.client.get(answer.headers["location"]).text
    assert "no runs.csv" in page and str(lab.folder) not in page


def test_a_rule_is_ticked_and_not_confirmed_by_an_option(lab: Lab) -> None:
    folder = gun_campaign(lab.folder / "campaigns" / "shots", 2, "shots")
    replace_in(folder / "runs.csv", "0.25", "25")
    answer = post(lab.client, "/ingest/path", {"path": "shots", "dry_run": "1"})
    ended(lab.client, answer)
    text = PageText(lab.client.get(answer.headers["location"]).text).text
    assert "pressure-above-regulator" in text and not command_words(text)
