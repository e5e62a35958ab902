"""Pages of diagnoses: sentence, shares of the stages from gun to sensors, errors beside their
fields, empty states."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest
from pyroshock.app.operations.diagnose.diagnosing import keep
from pyroshock.app.operations.diagnose.page_parts import stage_cards
from pyroshock.diagnosis.verdict import EffectShare
from pyroshock.schema.session import Store
from starlette.testclient import TestClient
from support.processes.web_client import post, sqlite, token, window
from support.records import verdicts
from support.records.campaigns import gun_campaign
from support.stores.stores import ingested, opened

Window = tuple[TestClient, Store]


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Window]:
    """A store with the campaign `spring` and a diagnosis of it; jobs wait."""
    folder = tmp_path_factory.mktemp("diagnoses")
    ingested(sqlite(folder), gun_campaign(folder / "spring", 2, "spring"))
    with opened(sqlite(folder)) as store:
        keep(store, verdicts.gun())
        keep(store, verdicts.none())
    with window(sqlite(folder), works=False) as client_and_store:
        yield client_and_store


def faults(client: TestClient, address: str, form: dict[str, Any]) -> list[dict[str, str]]:
    """What a form of a page gets back, as its script sees it."""
    headers = {"X-Pyroshock-Form": "1", "Accept": "application/json"}
    answer = client.post(address, data={"csrf": token(client), **form}, headers=headers)
    return list(answer.json().get("faults", []))


@pytest.mark.parametrize(("form", "field", "words"), [
    ({"campaign": "winter"}, "campaign", "winter"),
    ({"campaign": "spring", "tolerances": "gun=-1%"}, "tolerances", "gun=-1%"),
    ({"campaign": "spring", "tolerances": "plate=loud"}, "tolerances", "plate=loud"),
    ({"campaign": "spring", "uncertain": "friction=1"}, "uncertain", "friction=1"),
    ({"campaign": "spring", "uncertain": "gun.fricton_coefficient=0.1"}, "uncertain", "nearest"),
    ({"campaign": "spring", "seed": "x"}, "seed", "whole number"),
    ({"campaign": "spring", "simulator": "hybrid"}, "simulator", "MODEL@VERSION"),
    ({"campaign": "spring", "simulator": "models:/hybrid@9"}, "simulator", "hybrid"),
])  # fmt: skip
def test_a_wrong_value_is_named_at_its_field(
    pages: Window, form: dict[str, str], field: str, words: str
) -> None:
    (fault,) = faults(pages[0], "/diagnoses", form)
    assert fault["field"] == field and words in fault["message"]


def test_the_same_effects_are_not_diagnosed_twice(pages: Window) -> None:
    (fault,) = faults(pages[0], "/diagnoses/1/what-if", {})
    assert fault["field"] == "with_effects" and "Tick other effects" in fault["message"]


def test_an_unknown_campaign_is_named_beside_the_filter(pages: Window) -> None:
    answer = pages[0].get("/diagnoses?campaign=winter")
    assert (
        answer.status_code == 404
        and 'id="of-campaign-error"' in answer.text
        and "<option selected>winter" in answer.text
    )


def test_the_list_shows_sentence_shares_and_causes(pages: Window) -> None:
    text = pages[0].get("/diagnoses").text
    assert "The model error is 42 times the tolerance" in text and "gun 100\u00a0%" in text
    assert "flow resistance of the valve 61\u00a0%" in text and "none needed" in text


def test_the_form_is_filled_with_the_values_of_the_address(pages: Window) -> None:
    text = (
        pages[0]
        .get(
            "/diagnoses?campaign=spring&tolerances=gun%3D2%25"
            "&simulator=models:/gp@1&uncertain=gun.x%3D1"
        )
        .text
    )
    for part in (
        'name="tolerances" type="text" value="gun=2%"',
        'value="models:/gp@1"',
        "gun.x=1<",
    ):
        assert part in text


def test_the_page_begins_with_its_sentence_and_the_path_from_gun_to_sensors(pages: Window) -> None:
    text = pages[0].get("/diagnoses/1").text
    order = [
        text.index(f'id="{name}"')
        for name in ("sentence", "path", "adopt", "report", "effects", "assumptions")
    ]
    assert order == sorted(order)
    assert (
        '<details id="assumptions">' in text
        and "+gun.back_pressure" not in text.partition('id="report"')[2]
    )


def test_stages_that_were_not_compared_have_no_share() -> None:
    sensor = EffectShare("sensor.velocity_gain", 0.4, 0.04, (0.0, 0.1), 0.0)
    cards = stage_cards(verdicts.gun(effects=(*verdicts.gun().effects, sensor)))
    assert [(card.name, card.text) for card in cards] == [
        ("Gun", "100 %"), ("Contact", "not compared"), ("Plate", "not compared"), ("Sensors",
        "4 %"),
    ]  # fmt: skip
    empty = replace(verdicts.verdict(), effects=())
    assert stage_cards(empty)[-1].share is None


def test_a_plan_without_a_name_of_its_own_is_refused_at_its_field(pages: Window) -> None:
    client, store = pages
    key = keep(store, verdicts.verdict())
    assert client.get(f"/diagnoses/{key}").text.count('id="plan-next"') == 1
    assert post(client, f"/diagnoses/{key}/plan", {"name": "apart"}).status_code == 303
    (fault,) = faults(client, f"/diagnoses/{key}/plan", {"name": "apart"})
    assert fault["field"] == "name" and "in the store already" in fault["message"]
