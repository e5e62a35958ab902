"""The page of an impact and the comparison of spectra as the server sends them."""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from pyroshock.app.web.rendering import filled_columns
from pyroshock.schema.campaigns import Configuration
from pyroshock.schema.impacts import Impact
from pyroshock.schema.recordings import QualityFinding, RecordedChannel, Recording
from pyroshock.signals.channel import Sensor
from sqlalchemy import select
from support.stores.recorded import add_recording
from support.stores.web_stores import GUN, HAMMER, Lab

G = 9.80665


def data_of(page: str, name: str):
    match = re.search(rf'<script type="application/json" id="{name}">(.*?)</script>', page)
    assert match, f"no data of {name}"
    return json.loads(match[1])


@pytest.fixture(scope="module")
def finding(filled: Lab) -> int:
    """An impact of which a check found three samples of its force, and a note on the record."""
    with filled.store.writing() as session:
        impact = session.get_one(Impact, 6)
        force = session.scalars(
            select(RecordedChannel).where(
                RecordedChannel.recording_id == impact.recording_id,
                RecordedChannel.quantity == "force",
            )
        ).first()
        assert force is not None
        evidence = {"first_time_s": force.start_s + 0.002, "longest_s": 0.001, "runs": 1}
        own = {"recording_id": impact.recording_id, "channel_id": force.id, "impact_id": 6}
        session.add(
            QualityFinding(
                **own, check="dropouts", severity="reject", message="3 are missing",
                evidence=evidence,
            )
        )  # fmt: skip
        session.add(
            QualityFinding(
                **own | {"impact_id": None}, check="velocity", severity="note",
                message="integrates to 4 m/s", evidence={},
            )
        )  # fmt: skip
    return 6


def test_all_channels_are_one_figure_with_one_axis_of_time(filled: Lab) -> None:
    page = filled.client.get("/impacts/1").text
    grid = data_of(page, "channels-data")
    shown = filled.client.get("/api/impacts/1").json()
    assert grid["linked"] and len(grid["rows"]) == len(shown["signals"])
    assert len({tuple(row["x"]["limits"]) for row in grid["rows"]}) == 1
    (used,) = [pulse for pulse in shown["pulses"] if pulse["in_use"] == "yes"]
    begin, length = used["start_s"] * 1e3, used["contact_time_s"] * 1e3
    for row in grid["rows"]:
        assert row["x"]["first_view"] == pytest.approx([begin - length, begin + 3 * length])


def test_fetched_samples_are_drawn_in_the_unit_of_their_axis(filled: Lab) -> None:
    """The axis of an acceleration is in g, and what is fetched of it in m/s2."""
    page = filled.client.get("/impacts/21").text
    grid, facts = data_of(page, "channels-data"), data_of(page, "channels-facts")
    scales = {
        row["y"]["unit"]: channel["scale"]
        for row, channel in zip(grid["rows"], facts["channels"], strict=True)
    }
    assert scales["g"] == pytest.approx(1 / G) and scales["kN"] == pytest.approx(1e-3)


def test_findings_have_their_place_in_record_and_list(filled: Lab, finding: int) -> None:
    page = filled.client.get(f"/impacts/{finding}").text
    grid = data_of(page, "channels-data")
    regions = [region for row in grid["rows"] for region in row["regions"]]
    (region,) = [region for region in regions if "3 are missing" in region["text"]]
    assert region["stop"] - region["start"] == pytest.approx(1.0)
    items = re.findall(r"<li>(.*?)</li>", page[page.index('id="findings"') :], re.DOTALL)
    mark = int(region["mark"])
    assert "3 are missing" in items[mark - 1] and 'data-view="' in items[mark - 1]
    whole = next(item for item in items if "integrates to 4 m/s" in item)
    assert "whole record" in whole and "data-view" not in whole


def test_what_an_impact_belongs_to_stands_at_the_top_with_links(filled: Lab) -> None:
    page = filled.client.get("/impacts/6").text
    block = page[page.index('id="links"') : page.index('class="record"')]
    links = dict(
        re.findall(r"<dt>(\w[\w ]*)</dt><dd>(?:<a href=\"[^\"]*\">)?(.*?)(?:</a>)?</dd>", block)
    )
    assert {"velocity", "run", "plan"} <= links.keys()
    for address in re.findall(r'href="([^"]+)"', block):
        assert filled.client.get(address.replace("&amp;", "&")).status_code == 200, address


def test_shots_of_a_gun_show_the_prediction_that_no_shot_has_changed(filled: Lab) -> None:
    from pyroshock.app.operations.impacts.impact_links import impact_links

    view = {
        "id": 1, "campaign": GUN, "run": 3, "repetition": 1, "shot": 4, "bullet_mass_kg": 0.143,
        "tank_pressure_pa": 50_000.0, "measured_velocity_m_s": 15.0,
        "measured_velocity_u_m_s": 0.2, "predicted_velocity_m_s": 16.0,
        "impact_velocity_m_s": None, "impact_velocity_u_m_s": None, "velocity_source": None,
        "tip_material": "steel",
    }  # fmt: skip
    with filled.store.reading() as session:
        links = {link.label: link for link in impact_links(session, view)}
    assert links["velocity"].value == "15.00 ± 0.20 m/s"
    assert links["prediction"].value == "16 m/s by the nominal gun"
    assert "tank_pressure_pa=50000.0" in links["prediction"].address
    assert "where=id%3D4" in links["shot"].address


@pytest.mark.parametrize(("source", "predicted"), [("laser", True), ("integrated", False)])
def test_only_a_velocity_before_the_contact_is_given_to_the_twin(
    filled: Lab, source: str, predicted: bool
) -> None:
    from pyroshock.app.operations.impacts.impact_links import impact_links

    view = {
        "id": 6, "campaign": HAMMER, "run": 1, "repetition": 1, "impact_velocity_m_s": 2.0,
        "impact_velocity_u_m_s": None, "velocity_source": source,
    }  # fmt: skip
    with filled.store.reading() as session:
        labels = [link.label for link in impact_links(session, view)]
    assert ("prediction" in labels) == predicted


def test_an_impact_with_accelerations_has_its_spectrum(filled: Lab) -> None:
    spectrum = data_of(filled.client.get("/impacts/21").text, "spectrum-data")
    compared = filled.client.get("/api/spectra?impact=21").json()
    for own, shown in zip(compared["spectra"], spectrum["series"], strict=True):
        assert shown["y"] == pytest.approx([level / G for level in own["maximax"]], rel=1e-5)


def test_an_impact_without_acceleration_and_pulse_shows_its_whole_record(filled: Lab) -> None:
    sensors = {Sensor("ring", "force", "N"): np.random.default_rng(3).normal(size=2000)}
    recording, _ = add_recording(filled.store, sensors, 10_000.0, campaign="forces")
    with filled.store.writing() as session:
        campaign = session.get_one(Recording, recording).campaign_id
        configuration = session.scalars(select(Configuration.id)).first()
        row = Impact(
            campaign_id=campaign, run=1, repetition=1, configuration_id=configuration,
            recording_id=recording,
        )  # fmt: skip
        session.add(row)
        session.flush()
        impact = row.id
    page = filled.client.get(f"/impacts/{impact}").text
    assert "no acceleration" in page[page.index('id="no-spectrum"') :][:200]
    assert f"impact {impact} has no pulse" in page
    (strip,) = data_of(page, "channels-data")["rows"]
    assert strip["x"]["first_view"] is None
    assert strip["x"]["limits"] == pytest.approx([0.0, 199.9])


def test_spectra_are_sent_with_their_differences_below(filled: Lab) -> None:
    specification = "frequency_hz,level_g\n100,10\n10000,10\n"
    answer = filled.client.get(
        "/compare/spectra",
        params={"impacts": "21", "specification": specification, "tolerance": "6dB"},
    )
    upper, lower = data_of(answer.text, "spectra-data")["rows"]
    (levels,) = [own for own in upper["series"] if own["name"].startswith("impact")]
    (differences,) = [own for own in lower["series"] if own["name"].startswith("impact")]
    np.testing.assert_allclose(
        differences["y"], 20 * np.log10(np.array(levels["y"]) / 10), atol=1e-3
    )
    tolerance = [own for own in upper["series"] if own["name"] == "specification's tolerance"]
    assert len(tolerance) == 2
    assert answer.text.count('data-link="frequency"') == 2


def test_a_reference_is_one_of_the_impacts_and_no_second_one(filled: Lab) -> None:
    page = filled.client.get("/compare/spectra?impacts=21&reference=21").text
    (curve,) = [
        own
        for own in data_of(page, "spectra-data")["rows"][1]["series"]
        if own["name"].startswith("impact")
    ]
    assert curve["y"] == pytest.approx([0.0] * len(curve["y"]), abs=1e-6)
    assert '<option value="21" selected>impact 21</option>' in page
    for query, words in (
        ("impacts=21&reference=6", "expected one of the impacts: 21"),
        ("impacts=21&reference=21&specification=frequency_hz,level_g%0A1,2%0A", "expected one of"),
    ):
        answer = filled.client.get(f"/compare/spectra?{query}")
        assert answer.status_code == 422 and words in answer.text


def test_a_column_without_any_value_is_left_out_of_a_table(filled: Lab) -> None:
    rows = [{"a": None, "b": 0, "c": ""}, {"a": float("nan"), "b": None, "c": "x"}]
    assert filled_columns(rows, ("a", "b", "c", "d")) == ["b", "c"]
    page = filled.client.get("/impacts/6").text
    table = page[page.index('id="channel-list"') :].partition("</table>")[0]
    for column in zip(
        *(re.findall(r"<td[^>]*>(.*?)</td>", row) for row in table.split("<tr>")[2:]), strict=True
    ):
        assert set(column) != {"–"}


def test_details_stand_below_the_pictures_and_are_folded(filled: Lab) -> None:
    page = filled.client.get("/impacts/1").text
    assert page.index('id="channels"') < page.index('id="facts"')
    for name in ("versions-box", "channels-box", "preview-box"):
        assert re.search(rf'<details id="{name}">', page), name
    assert HAMMER in page
