"""Recordings without a campaign.toml lead to a form; what it writes is stored, and the written
folder gives the same store on the command line."""

from __future__ import annotations

import re
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from pyroshock.ingest.folder.description import CampaignDescription, read_description, read_rows
from pyroshock.ingest.load import ingest_folder
from support.processes.browsers import until
from support.processes.web_client import ended, post, sqlite, window
from support.records.campaigns import hammer_campaign
from support.stores.stores import content, opened
from support.stores.web_stores import Lab

pytestmark = pytest.mark.timeout(600)
EXAMPLES = Path(__file__).parents[3] / "examples"
FORM = {"X-Pyroshock-Form": "1"}


@pytest.fixture(autouse=True)
def _own_scratch(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Folders of uploads that belong to the test alone."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path_factory.mktemp("scratch")))


@pytest.fixture
def empty(tmp_path: Path) -> Iterator[Lab]:
    """The window over a store of nothing, of one test alone."""
    folder = tmp_path / "lab"
    folder.mkdir()
    with window(sqlite(folder), folders=(folder,)) as (client, store):
        yield Lab(client, store, sqlite(folder), folder)


class _Controls(HTMLParser):
    """What the controls of a page's form hold, as a browser would send them."""

    def __init__(self, form: str) -> None:
        super().__init__()
        self._form, self._inside = form, False
        self.values: dict[str, list[str]] = {}
        self._select = ""
        self._area = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        attributes = {key: value or "" for key, value in attrs}
        if tag == "form":
            self._inside = attributes.get("id") == self._form
        if not self._inside:
            return
        if (
            tag == "input"
            and attributes.get("type") in ("checkbox", "radio")
            and "checked" not in attributes
        ):
            return
        if tag == "input" and attributes.get("name"):
            self.values.setdefault(attributes["name"], []).append(attributes.get("value", ""))
        if tag == "select":
            self._select = attributes["name"]
            self.values[self._select] = [""]
        if tag == "option" and self._select and "selected" in attributes:
            self.values[self._select] = [attributes.get("value", "not used")]
        if tag == "textarea":
            self._area = attributes["name"]
            self.values[self._area] = [""]

    def handle_data(self, data: str) -> None:
        if self._area:
            self.values[self._area][0] += data

    def handle_endtag(self, tag: str) -> None:
        if tag == "form":
            self._inside = False
        if tag == "select":
            self._select = ""
        if tag == "textarea":
            self._area = ""


def controls_of(page: str) -> dict[str, list[str]]:
    parser = _Controls("campaign-form")
    parser.feed(page)
    return {name: texts for name, texts in parser.values.items() if name != "csrf"}


def bare(folder: Path) -> Path:
    """A campaign folder without its two files."""
    for name in ("campaign.toml", "runs.csv"):
        (folder / name).unlink()
    return folder


def form_page(lab: Lab, folder: Path) -> tuple[str, str]:
    """Address and text of the form that an upload of a folder leads to."""
    files = [
        ("files", (f"{folder.name}/{path.relative_to(folder)}", path.read_bytes()))
        for path in sorted(folder.rglob("*"))
        if path.is_file()
    ]
    answer = post(lab.client, "/ingest/upload", {"dry_run": "1"}, files=files)
    address = answer.headers["location"]
    assert address.startswith("/ingest/forms/"), answer.text
    assert ended(lab.client, answer)["state"] == "done"
    return address, lab.client.get(address).text


def place_of(controls: Mapping[str, list[str]], channel: str) -> str:
    return next(
        name.removesuffix(".name")
        for name, texts in controls.items()
        if name.endswith(".name") and texts == [channel] and name.startswith("channels.")
    )


def shared(controls: Mapping[str, list[str]], column: str) -> str:
    return f"all.{controls['column'].index(column)}"


def test_bare_recordings_of_a_hammer_are_stored_by_the_form(empty: Lab, tmp_path: Path) -> None:
    original = hammer_campaign(tmp_path / "spring", 3, 2, "spring")
    address, page = form_page(empty, bare(original))
    assert "Nothing is stored yet" in page and 'value="spring"' in page
    controls = controls_of(page)
    refused = post(empty.client, address, {**controls, "then": "check"}, headers=FORM).json()
    fields = {fault["field"] for fault in refused["faults"]}
    assert "campaign.date" in fields  # nobody has guessed it
    force = place_of(controls, "force")
    controls |= {
        "campaign.date": ["2026-11-01"],
        "bench.hammer.mass_kg": ["320 g"],
        f"{force}.unit": ["N"],
        shared(controls, "tip_material"): ["steel"],
        shared(controls, "tip_radius_mm"): ["30"],
    }
    answer = post(empty.client, address, {**controls, "then": "check"})
    check = answer.headers["location"]
    assert ended(empty.client, answer)["state"] == "done"
    text = empty.client.get(check).text
    assert "would be stored" in text, re.sub(r"<[^>]+>", " ", text)
    written = {
        name: empty.client.get(f"{check}/files/{name}").text
        for name in ("campaign.toml", "runs.csv")
    }
    assert ended(empty.client, post(empty.client, f"{check}/store"))["state"] == "done"
    for name, text in written.items():
        (original / name).write_text(text, encoding="utf-8")
    url = f"sqlite:///{tmp_path / 'command.db'}"
    with opened(url, create=True) as store:
        ingest_folder(store, original)
    stated = read_description(original)
    assert stated.value("bench", "hammer", "mass_kg") == 0.32
    assert content(url) == content(empty.db)
    # they can be saved after the campaign is stored, too
    assert empty.client.get(f"{check}/files/campaign.toml").text == written["campaign.toml"]


def filled(
    controls: Mapping[str, list[str]], original: CampaignDescription
) -> dict[str, list[str]]:
    """The controls as a person leaves them who knows what the original campaign.toml states."""
    texts = {name: list(own) for name, own in controls.items()}
    texts["campaign.operator"] = [""]  # the recordings may know one, the original does not
    parts = {"campaign": original.value("campaign"), **(original.value("bench") or {})}
    for stage, keys in parts.items():
        start = stage if stage == "campaign" else f"bench.{stage}"
        for key, value in keys.items():
            if (stage, key) == ("campaign", "kind"):
                continue
            text = "; ".join(f"{x}, {y}" for x, y in value) if key == "outline_m" else str(value)
            assert f"{start}.{key}" in texts, key
            texts[f"{start}.{key}"] = [text]
    for channel, facts in original.value("channels").items():
        place = place_of(texts, channel)
        role = facts["quantity"]
        if facts.get("position") == "muzzle":
            role += "@muzzle"
        texts[f"{place}.role"] = [role]
        for key, value in facts.items():
            if key != "quantity":
                assert f"{place}.{key}" in texts
                texts[f"{place}.{key}"] = [str(value)]
    rows = {row["recording"]: row for row in original.rows}
    columns = texts["column"]
    for name in [n for n in texts if re.fullmatch(r"run\.\d+\.r", n)]:
        row = rows[texts[name][0]]
        for column in row:
            if column != "recording":
                texts[f"{name[:-1]}{columns.index(column)}"] = [row[column]]
    return texts


def few_recordings(campaign: Path, folder: Path, most: int) -> Path:
    """A copy of a campaign with its first recordings alone."""
    folder.mkdir()
    shutil.copy(campaign / "campaign.toml", folder)
    header, *rows = (campaign / "runs.csv").read_text(encoding="utf-8").splitlines()
    (folder / "runs.csv").write_text("\n".join([header, *rows[:most]]) + "\n", encoding="utf-8")
    for row in read_rows(folder)[1]:
        (folder / row["recording"]).parent.mkdir(exist_ok=True)
        shutil.copy(campaign / row["recording"], folder / row["recording"])
    return folder


@pytest.mark.parametrize(("campaign", "kind"), [
    ("rehearsal", "gun"), ("modal-hammer-hit", "plate"),
])  # fmt: skip
def test_the_form_stores_what_a_hand_written_folder_stores(
    empty: Lab, tmp_path: Path, campaign: str, kind: str
) -> None:
    original = few_recordings(EXAMPLES / campaign, tmp_path / "original", 3)
    folder = tmp_path / campaign
    shutil.copytree(original, folder)
    address, page = form_page(empty, bare(folder))
    stated = read_description(original)
    controls = controls_of(page)
    for column in stated.columns:  # a factor of the laboratory's own
        if column not in (*controls["column"], "recording"):
            added = {**controls, "new_column": [column], "then": "column"}
            sent = post(empty.client, address, added)
            assert sent.headers.get("location") == address, sent.text
            controls = controls_of(empty.client.get(address).text)
    controls = filled({**controls, "kind": [kind]}, stated)
    answer = post(empty.client, address, {**controls, "then": "check"}, headers=FORM)
    assert "location" in answer.json(), answer.json()
    check = answer.json()["location"]
    job = int(check.rsplit("/", 1)[1])
    assert finished(empty, job)["state"] == "done"
    stored = post(empty.client, f"{check}/store")
    assert ended(empty.client, stored)["state"] == "done", empty.client.get(check).text
    url = f"sqlite:///{tmp_path / 'command.db'}"
    with opened(url, create=True) as store:
        ingest_folder(store, original)
    assert content(url) == content(empty.db)


def finished(lab: Lab, job: int) -> dict[str, Any]:
    """The job, once it has ended."""
    state: dict[str, Any] = {}

    def has_ended() -> bool:
        state.update(lab.client.get(f"/api/jobs/{job}").json())
        return state["state"] in ("done", "failed", "stopped")

    until(has_ended)
    return state
