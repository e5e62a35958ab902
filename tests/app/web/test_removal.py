"""Deleting and discarding in the window: what stands on it is shown, a reason is needed, and only a
form writes."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import quote

import pytest
from pyroshock.dataset.snapshot import build_snapshot, read_snapshot
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.impacts import Impact
from pyroshock.schema.recordings import Recording
from sqlalchemy import select
from support.processes.web_client import post, post_json, sqlite, token_in, window
from support.records.campaigns import hammer_campaign, hammer_rows, write_runs
from support.stores.stores import content
from support.stores.web_stores import DATASET, HAMMER, Lab

pytestmark = pytest.mark.timeout(600)
FIRST = "recordings/test-01.npz"
REASON = "the plate had come loose"


@pytest.fixture
def own(filled_lab: Path, quick_plates: None, tmp_path: Path) -> Iterator[Lab]:
    """The window over a copy of the filled store: what is deleted here, others need."""
    shutil.copytree(filled_lab, tmp_path / "lab")
    with window(sqlite(tmp_path / "lab")) as (client, store):
        yield Lab(client, store, sqlite(tmp_path / "lab"), tmp_path / "lab")


def first_impact(lab: Lab) -> int:
    with lab.store.reading() as session:
        query = (
            select(Impact.id)
            .join(Recording, Impact.recording_id == Recording.id)
            .where(Recording.path == FIRST)
        )
        key = session.scalar(query.order_by(Impact.id).limit(1))
    assert key is not None
    return key


def test_page_shows_what_stands_on_a_campaign_and_deletes_it(own: Lab) -> None:
    before = own.rows()
    assert f'href="/campaigns/{HAMMER}/delete"' in own.client.get(f"/campaigns/{HAMMER}").text
    shown = own.client.get(f"/campaigns/{HAMMER}/delete").text
    assert (
        f"dataset {DATASET}" in shown
        and "model " in shown
        and token_in(shown)
        and own.rows() == before
    )
    assert post(own.client, f"/campaigns/{HAMMER}/delete", {"reason": " "}).status_code == 422
    assert own.rows() == before
    answer = post(own.client, f"/campaigns/{HAMMER}/delete", {"reason": REASON})
    assert (answer.status_code, answer.headers["location"]) == (303, "/campaigns")
    assert own.client.get(f"/campaigns/{HAMMER}").status_code == 404
    (stone,) = own.client.get("/api/deleted").json()
    assert (stone["campaign"], stone["reason"]) == (HAMMER, REASON)
    assert "no longer whole" in own.client.get("/models").text


def test_page_shows_what_stands_on_a_recording_and_discards_it(own: Lab) -> None:
    impact, before = first_impact(own), own.rows()
    assert f'href="/impacts/{impact}/discard"' in own.client.get(f"/impacts/{impact}").text
    shown = own.client.get(f"/impacts/{impact}/discard").text
    assert FIRST in shown and f"dataset {DATASET}" in shown and own.rows() == before
    answer = post(own.client, f"/impacts/{impact}/discard", {"reason": REASON})
    assert (answer.status_code, answer.headers["location"]) == (
        303,
        f"/campaigns/{HAMMER}?discarded=1",
    )
    assert before["recordings"] - own.rows()["recordings"] == 1
    assert own.client.get(f"/impacts/{impact}/discard").status_code == 404


def test_api_tells_what_stands_on_it_and_discards_and_deletes(own: Lab) -> None:
    address, before = f"/api/campaigns/{HAMMER}", own.rows()
    standing = own.client.get(f"{address}/standing?recording={quote(FIRST)}").json()
    assert standing["counts"]["recordings"] == 1
    assert [dataset["name"] for dataset in standing["stood_on"]["datasets"]] == [
        DATASET
    ] and own.rows() == before
    stone = post_json(
        own.client, f"{address}/discard", {"recording": FIRST, "reason": REASON}
    ).json()
    assert (stone["recording"], stone["counts"]) == (FIRST, standing["counts"])
    assert (
        post_json(
            own.client, f"{address}/discard", {"recording": FIRST, "reason": REASON}
        ).status_code
        == 404
    )
    assert post_json(own.client, f"{address}/delete", {"reason": ""}).status_code == 422
    assert (
        post_json(own.client, f"{address}/delete", {"reason": REASON}).json()["kind"] == "campaign"
    )
    assert post_json(own.client, f"{address}/delete", {"reason": REASON}).status_code == 404
    assert len(own.client.get(f"/api/deleted?campaign={HAMMER}").json()) == 2


@pytest.mark.parametrize(
    "address",
    [f"/campaigns/{HAMMER}/delete", "/impacts/1/discard", f"/api/campaigns/{HAMMER}/delete"],
)
def test_write_without_the_token_is_refused(own: Lab, address: str) -> None:
    before = own.rows()
    assert own.client.post(address, data={"reason": REASON}).status_code == 403
    assert (
        own.client.post(address, json={"reason": REASON}).status_code == 403
        and own.rows() == before
    )


def test_a_discard_is_undone_on_the_page(tmp_path: Path) -> None:
    """What is discarded by mistake comes back with one button, with the pulses of datasets."""
    rows = [{**row, "impact_velocity_m_s": 1.5, "plate_material": "steel", "anvil_material": "none",
             "insulator": "none", "boundary_conditions": "free", "impact_position": "a"}
            for row in hammer_rows(3, 2)]  # fmt: skip
    folder = hammer_campaign(tmp_path / "spring", 3, 2, "spring")
    write_runs(folder, rows)
    with (folder / "campaign.toml").open("a", encoding="utf-8") as file:
        file.write('\n[bench.plate]\nmaterial = "steel"\nthickness_m = 0.01\n')
    with window(sqlite(tmp_path)) as (client, store):
        ingest_folder(store, folder)
        frozen = build_snapshot(store, "pulses", ["spring"]).snapshot.hash
        content_before = content(sqlite(tmp_path))
        answer = post(client, "/impacts/1/discard", {"reason": "the plate had come loose"})
        page = client.get(answer.headers["location"]).text
        assert 'id="undo"' in page and "the plate had come loose" in page
        assert content(sqlite(tmp_path))["impacts"] != content_before["impacts"]
        undo = re.search(r'action="(/deleted/\d+/restore)"', page)
        assert undo is not None and undo[1] in client.get("/deleted").text
        assert post(client, undo[1]).headers["location"] == "/campaigns/spring"
        content_after = content(sqlite(tmp_path))
        assert {k: v for k, v in content_after.items() if k != "tombstones"} == {
            k: v for k, v in content_before.items() if k != "tombstones"
        }
        assert read_snapshot(store, "pulses").hash == frozen
        assert (
            "restored" in client.get("/deleted").text and post(client, undo[1]).status_code == 404
        )
