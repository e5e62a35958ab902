"""The list of impacts: menus, order, columns, thumbnails, and what is done with the ticked ones."""

from __future__ import annotations

import re
import shutil
from collections import Counter
from pathlib import Path

import pytest
from pyroshock.app.pages.impact_lists import thumbnail_points
from pyroshock.dataset.snapshot import read_snapshot
from pyroshock.ingest.load import ingest_folder
from pyroshock.schema.impacts import Impact, Shot
from pyroshock.schema.listings import iter_impacts
from sqlalchemy import func, select
from support.checks.well_formed import Page
from support.processes.web_client import post, sqlite, window
from support.records.campaigns import gun_campaign, gun_rows, write_runs
from support.stores.web_stores import HAMMER, Lab

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
pytestmark = pytest.mark.timeout(600)


def shown(lab: Lab, address: str) -> list[int]:
    """The impacts that a list shows, in its order."""
    answer = lab.client.get(address)
    assert answer.status_code == 200, answer.text
    return [int(key) for key in re.findall(r'<td><a href="/impacts/(\d+)">', answer.text)]


def stored(lab: Lab) -> list[dict]:
    with lab.store.reading() as session:
        return list(iter_impacts(session))


def test_a_list_says_how_many_impacts_match_and_which_of_them_it_shows(
    filled: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pyroshock.app.pages.impact_lists.PAGE", 6)
    materials = Counter(row["tip_material"] for row in stored(filled) if "tip_material" in row)
    ((material, count),) = materials.most_common(1)

    def positions(address: str) -> list[str]:
        sentences, listing = [], address.partition("?")[0]
        while address:
            text = filled.client.get(address).text
            sentences += re.findall(r'id="position">(.*?)</p>', text)
            following = re.search(r'rel="next"[^>]* href="([^"]*)"', text)
            address = f"{listing}{following[1]}".replace("&amp;", "&") if following else ""
        return sentences

    for sort in ("", "&sort=-peak_force_n"):
        sentences = positions(f"/impacts?campaign=&where=tip_material={material}{sort}")
        pages = [(first, min(first + 5, count)) for first in range(1, count + 1, 6)]
        assert len(pages) > 1
        assert sentences == [f"Impacts {first} to {last} of {count}" for first, last in pages]
    assert positions("/impacts?campaign=modal-hammer-hit") == ["1 impact"]
    with filled.store.reading() as session:
        shots = session.scalar(select(func.count()).select_from(Shot)) or 0
        fast = session.scalar(select(func.count()).where(Shot.measured_velocity_m_s > 12)) or 0
    assert 0 < fast < shots
    for address, count in (("/shots", shots), ("/shots?where=measured_velocity_m_s>12", fast)):
        pages = [(first, min(first + 5, count)) for first in range(1, count + 1, 6)]
        sentences = [f"Shots {first} to {last} of {count}" for first, last in pages]
        assert positions(address) == (sentences if len(pages) > 1 else [f"{count} shots"])
    monkeypatch.setattr("pyroshock.app.pages.impact_lists.COUNTED", 8)
    assert positions("/impacts")[:3] == [
        "Impacts 1 to 6 of more than 8",
        "Impacts 7 to 12 of more than 8",
        "6 of more than 8 impacts, beyond the first 8",
    ]


def test_a_shot_leads_to_its_impact_which_shows_the_velocity_of_the_shot(
    empty: Lab, tmp_path: Path
) -> None:
    """Five shots without recordings come first, so that shots and impacts have other numbers."""
    folder = tmp_path / "two"
    shutil.copytree(EXAMPLES / "rehearsal", folder)
    lines = (folder / "runs.csv").read_text(encoding="utf-8").splitlines()
    (folder / "runs.csv").write_text("\n".join(lines[:3]) + "\n", encoding="utf-8")
    for path in (EXAMPLES / "first-shots", folder):
        ingest_folder(empty.store, path, jobs=1)
    with empty.store.reading() as session:
        shots = {shot.id: shot for shot in session.scalars(select(Shot)) if shot.impact_id}
        impacts = {shot.id: shot.impact_id for shot in shots.values()}
        velocities = {
            shot.impact_id: (shot.measured_velocity_m_s, shot.measured_velocity_u_m_s)
            for shot in shots.values()
        }
    assert len(impacts) == 2 and set(impacts) != set(impacts.values())
    page = empty.client.get("/shots").text
    rows = re.findall(r'<tr><td class="number">(\d+)</td><td class="[^"]*">(.*?)</td>', page)
    impact_links = {int(shot): re.findall(r"/impacts/(\d+)", impact) for shot, impact in rows}
    assert len(impact_links) == 7
    for shot, link in impact_links.items():
        assert link == ([str(impacts[shot])] if shot in impacts else [])
    for impact, (velocity, uncertainty) in velocities.items():
        text = empty.client.get(f"/impacts/{impact}").text
        links = dict(re.findall(r"<dt>([^<]*)</dt><dd><a[^>]*>([^<]*)</a></dd>", text))
        measured, spread = map(float, links["velocity"].removesuffix(" m/s").split(" ± "))
        assert measured == pytest.approx(velocity, abs=uncertainty)
        assert spread == pytest.approx(uncertainty, rel=0.1)
        assert float(links["prediction"].removesuffix(" m/s by the nominal gun")) > 0


@pytest.mark.parametrize(
    "column", ["peak_force_n", "contact_time_s", "tip_radius_m", "tip_material", "quality", "run"]
)
def test_list_is_sorted_by_any_column_and_impacts_without_a_value_come_last(
    filled: Lab, column: str
) -> None:
    rows = {row["id"]: row for row in stored(filled)}
    ranks = {"ok": 0, "not judged": 0, "warning": 1, "reject": 2}
    for sort, falling in ((column, False), (f"-{column}", True)):
        keys = shown(filled, f"/impacts?sort={sort}")
        assert sorted(keys) == sorted(rows)
        values = [rows[key].get(column) for key in keys]
        there = [
            ranks.get(value, 0) if column == "quality" else value
            for value in values
            if value is not None
        ]
        assert there == sorted(there, reverse=falling)
        if column != "quality":
            assert values[len(there) :] == [None] * (len(values) - len(there))


def test_sorted_list_goes_through_all_impacts_page_by_page(
    filled: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pyroshock.app.pages.impact_lists.PAGE", 6)
    address, keys = "/impacts?sort=-peak_force_n", []
    while address:
        keys += shown(filled, address)
        following = re.search(r'id="next-page" href="([^"]+)"', filled.client.get(address).text)
        address = "/impacts" + following[1].replace("&amp;", "&") if following else ""
    assert sorted(keys) == sorted(row["id"] for row in stored(filled))
    answer = filled.client.get("/impacts?sort=hardness")
    assert answer.status_code == 400 and "no column or factor &#39;hardness&#39;" in answer.text


def test_menus_narrow_the_list_and_their_choice_stands_in_the_address(filled: Lab) -> None:
    rows = stored(filled)
    page = Page(filled.client.get("/impacts").text)
    values = [given.get("value", "") for tag, given in page.elements if tag == "option"]
    radius = next(value for value in values if value and value.startswith("tip_radius_m="))
    number = float(radius.partition("=")[2])
    wanted = [row["id"] for row in rows if row.get("tip_radius_m") == pytest.approx(number)]
    assert shown(filled, f"/impacts?where={radius}") == wanted and 0 < len(wanted) < len(rows)
    assert f'value="{radius}" selected' in filled.client.get(f"/impacts?where={radius}").text


def test_columns_are_chosen_and_a_bad_condition_keeps_the_page(filled: Lab) -> None:
    text = filled.client.get("/impacts?columns=peak_force_n&columns=tip_material").text
    heads = re.findall(r'<th scope="col"[^>]*>(?:<a[^>]*>)?([^<]*)', text)
    assert [head.strip() for head in heads if head.strip()] == [
        "impact",
        "quality",
        "pulse",
        "tip material",
        "peak force (kN)",
    ]
    answer = filled.client.get("/impacts?where=hardness%3D3&where=tip_material%3Dsteel")
    assert (
        answer.status_code == 400
        and 'value="hardness=3"' in answer.text
        and "field-error" in answer.text
    )


def test_thumbnail_is_as_high_as_its_peak_and_as_wide_as_its_contact() -> None:
    points = [
        tuple(map(float, pair.split(",")))
        for pair in thumbnail_points([0.0, 50.0, 100.0, 0.0]).split()
    ]
    assert points[0] == (0.0, 23.0) and points[2][1] == 1.0 and points[-1] == (76.0, 23.0)
    assert thumbnail_points([]) == thumbnail_points([0.0, 0.0]) == ""


def test_ticked_impacts_are_compared_and_rejected_with_a_reason(filled: Lab) -> None:
    first, second = shown(filled, f"/impacts?campaign={HAMMER}")[:2]
    answer = post(filled.client, "/impacts/compare", {"impact": [first, second]})
    assert (
        answer.status_code == 303
        and answer.headers["location"] == f"/compare/spectra?impacts={first},{second}"
    )
    form = {"X-Pyroshock-Form": "1"}
    refused = post(
        filled.client, "/impacts/reject", {"impact": [first], "reason": " "}, headers=form
    )
    assert refused.status_code == 422 and refused.json()["faults"][0]["field"] == "reason"
    refused = post(filled.client, "/impacts/reject", {"reason": "double hit"}, headers=form)
    assert (
        refused.status_code == 422
        and "No impact is ticked" in refused.json()["faults"][0]["message"]
    )
    refused = post(
        filled.client, "/impacts/dataset", {"impact": [first], "dataset": " "}, headers=form
    )
    assert refused.status_code == 422 and refused.json()["faults"][0]["field"] == "dataset"
    frozen = post(
        filled.client,
        "/impacts/dataset",
        {"impact": [first, second], "dataset": "a pair"},
        headers=form,
    )
    assert frozen.json() == {"location": "/datasets/a%20pair"}
    snapshot = read_snapshot(filled.store, "a pair")
    assert snapshot.definition["impacts"] == [first, second] and len(snapshot.table) == 2
    before = {row["id"] for row in stored(filled)}
    with filled.store.reading() as session:
        recording = session.get_one(Impact, first).recording_id
        together = session.scalar(select(func.count()).where(Impact.recording_id == recording))
    gone = post(
        filled.client, "/impacts/reject", {"impact": [first], "reason": "double hit"}, headers=form
    )
    assert gone.status_code == 200 and gone.json() == {"location": "/impacts"}
    after = {row["id"] for row in stored(filled)}
    assert first not in after and len(before - after) == together


def test_a_factor_of_many_levels_is_typed_and_its_levels_are_suggested(
    tmp_path: Path,
) -> None:
    """A select of 26 pressures is a list to search through; a field takes what one knows."""
    rows = [
        {
            **row,
            "tank_pressure_bar": round(0.2 + 0.013 * place, 3),
            "bullet_mass_kg": 0.1428,
            "impact_velocity_m_s": 10,
        }
        for place, row in enumerate(gun_rows(14))
    ]
    folder = gun_campaign(tmp_path / "shots", 14, "shots")
    write_runs(folder, rows)
    with window(sqlite(tmp_path)) as (client, store):
        ingest_folder(store, folder)
        page = client.get("/impacts").text
        assert 'name="level.tank_pressure_pa"' in page and '<option value="0.213">' in page
        assert '<select id="menu-2" name="where"' in page or "level.bullet_mass_kg" not in page
        for typed in ("0.213", "0.2130"):
            page = client.get("/impacts", params={"level.tank_pressure_pa": typed}).text
            assert "1 impact<" in page and "Condition" in page
        assert "No impact matches" in client.get("/impacts?level.tank_pressure_pa=9").text
