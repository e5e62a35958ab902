"""The page of a campaign shows which facts are missing, and its form adds or corrects them; what
was made with the earlier values says so."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from pyroshock.app.operations.ingest.correctable import runs_of_text
from pyroshock.ingest.load import ingest_folder
from support.processes.web_client import post, post_json, sqlite, window
from support.records.campaigns import hammer_campaign, hammer_rows, write_runs
from support.stores.web_stores import Lab

FORM = {"X-Pyroshock-Form": "1"}


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[Lab]:
    """A campaign of three runs, of which the tip's radius and the plate are not known."""
    folder = tmp_path / "lab"
    folder.mkdir()
    rows = [
        {**{k: v for k, v in row.items() if k != "tip_radius_mm"}, "impact_velocity_m_s": 1.5}
        for row in hammer_rows(3, 2)
    ]
    campaign = hammer_campaign(tmp_path / "spring", 3, 2, "spring")
    write_runs(campaign, rows)
    with window(sqlite(folder), folders=(folder,)) as (client, store):
        ingest_folder(store, campaign)
        yield Lab(client, store, sqlite(folder), folder)


def test_what_is_missing_stays_on_the_page_until_it_is_added(lab: Lab) -> None:
    page = lab.client.get("/campaigns/spring").text
    assert "6 impacts have no" in page and "tip radius" in page
    assert 'href="/campaigns/spring/facts"' in page
    form = lab.client.get("/campaigns/spring/facts").text
    assert "tip radius" in form and 'name="fact:tip_radius_mm"' in form
    facts = {
        "fact:tip_radius_mm": "30", "fact:plate_material": "steel",
        "fact:anvil_material": "none", "fact:insulator": "none",
        "fact:boundary_conditions": "free", "fact:impact_position": "centre",
        "fact:bench.plate.material": "steel", "fact:bench.plate.thickness_m": "10 mm",
        "only_missing": "true", "reason": "read from the drawing",
    }  # fmt: skip
    answer = post(lab.client, "/campaigns/spring/facts", facts)
    assert answer.headers["location"] == "/campaigns/spring#corrections"
    page = lab.client.get("/campaigns/spring").text
    assert "tip radius" not in page.partition("<h2>Impacts")[0].partition('id="missing-facts"')[2]
    assert "read from the drawing" in page and "not stated" in page


def test_a_corrected_value_stands_beside_the_earlier_one(lab: Lab) -> None:
    form = {"fact:bench.hammer.mass_kg": "330 g", "reason": "weighed again"}
    assert post(lab.client, "/campaigns/spring/facts", form).status_code == 303
    page = lab.client.get("/campaigns/spring").text
    row = page.partition('id="corrected"')[2].partition("</table>")[0]
    assert "<td>0.32</td><td>0.33</td>" in row and "weighed again" in row


@pytest.mark.parametrize(("form", "field"), [
    ({"reason": "why"}, "reason"),
    ({"fact:tip_radius_mm": "30"}, "reason"),
    ({"fact:tip_radius_mm": "wide", "reason": "why"}, "fact:tip_radius_mm"),
    ({"fact:tip_radius_mm": "30", "runs": "x", "reason": "why"}, "runs"),
    ({"fact:tip_radius_mm": "30", "runs": "99", "reason": "why"}, "runs"),
    ({"fact:bench.hammer.mass_kg": "", "reason": "why"}, "fact:bench.hammer.mass_kg"),
    ({"fact:bench.hammer.mass_kg": "-1", "reason": "why"}, "fact:bench.hammer.mass_kg"),
    ({"fact:bench.plate.material": "cheese", "reason": "why"}, "fact:bench.plate.material"),
])  # fmt: skip
def test_a_fault_stands_at_its_field(lab: Lab, form: dict[str, str], field: str) -> None:
    answer = post(lab.client, "/campaigns/spring/facts", form, headers=FORM)
    (fault,) = answer.json()["faults"]
    assert fault["field"] == field and fault["message"]


def test_a_dataset_and_its_models_say_that_a_fact_was_corrected(lab: Lab) -> None:
    facts = {
        "facts": {
            "tip_radius_mm": "30", "plate_material": "steel", "anvil_material": "none",
            "insulator": "none", "boundary_conditions": "free", "impact_position": "centre",
            "bench.plate.material": "steel", "bench.plate.thickness_m": "0.01",
        },
        "reason": "first",
    }  # fmt: skip
    answer = post_json(lab.client, "/api/campaigns/spring/facts", facts)
    assert answer.status_code == 200, answer.text
    from pyroshock.dataset.snapshot import build_snapshot

    build_snapshot(lab.store, "pulses", ["spring"])
    assert "rests on the earlier value" not in lab.client.get("/datasets/pulses").text
    second_correction = {
        "facts": {"tip_radius_mm": "45"},
        "run": [2],
        "reason": "the label was wrong",
    }
    answer = post_json(lab.client, "/api/campaigns/spring/facts", second_correction).json()
    assert answer["corrected"][0]["earlier"] == "30 (2)"
    assert any(line.startswith("dataset pulses") for line in answer["stands_on"])
    page = lab.client.get("/datasets/pulses").text
    assert "rests on the earlier value" in page and "the label was wrong" in page


def test_runs_are_listed_as_people_do() -> None:
    assert runs_of_text("1-4, 7") == (1, 2, 3, 4, 7) and runs_of_text("") == ()
    for text in ("x", "4-1", "1-99999"):
        with pytest.raises(ValueError, match="expected runs such as"):
            runs_of_text(text)
