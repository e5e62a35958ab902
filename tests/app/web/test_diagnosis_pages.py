"""Pages of diagnoses: sentence, shares of the stages from gun to sensors, errors beside their
fields, empty states."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pyroshock.app.figures.figure import PointSeries
from pyroshock.app.operations.diagnose.diagnosing import keep
from pyroshock.app.operations.diagnose.headline import headline
from pyroshock.app.operations.diagnose.list_figure import ListedError, bench_words, errors_plot
from pyroshock.app.operations.diagnose.page_parts import stage_cards
from pyroshock.app.operations.diagnose.residual_figures import impacts_of
from pyroshock.diagnosis.verdict import EffectShare
from pyroshock.schema.diagnoses import Diagnosis
from pyroshock.schema.jobs import Job
from pyroshock.schema.session import Store
from sqlalchemy import select
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
        keep(store, verdicts.explored())
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
        "<option selected>models:/gp@1</option>",
        "gun.x=1<",
    ):
        assert part in text


def test_the_page_has_its_pictures_before_its_text(pages: Window) -> None:
    text = pages[0].get("/diagnoses/3").text
    names = ("sentence", "path", "waterfall", "shares", "residuals", "boxes", "places", "adopt")
    folded = ("folded", "sentences", "numbers", "effects", "assumptions")
    order = [text.index(f'id="{name}"') for name in (*names, *folded) if name != "boxes"]
    assert order == sorted(order)
    assert text.index('class="boxes"') < text.index('id="places"')
    below = text[text.index('id="folded"') :]
    assert below.count("<details") == below.count("<summary") >= 8 and "<details open" not in below
    assert "+gun.back_pressure" not in below


def data_of(text: str, name: str) -> Any:
    start = text.index(">", text.index(f'id="{name}"')) + 1
    return json.loads(text[start : text.index("</script>", start)])


def waterfall_of(figure: dict[str, Any]) -> dict[str, float]:
    """The end of each bar by its name."""
    return {
        own["detail"]: own["base"][0] if own["detail"].startswith("+") else own["end"][0]
        for own in figure["series"]
        if own["kind"] == "bars"
    }


def test_the_waterfall_goes_from_the_error_over_each_effect_to_the_repeatability(
    pages: Window,
) -> None:
    figure = data_of(pages[0].get("/diagnoses/3").text, "waterfall-data")
    assert waterfall_of(figure) == {
        "nominal model": 42.0,
        "+ flow resistance of the valve": 16.4,
        "+ atmosphere ahead of the projectile": 5.0,
        "+ leak past the projectile": 1.26,
        "what remains": 1.26,
        "with a learned correction (no cause)": 0.85,
        "repeatability (measurement noise)": 0.424,
    }
    (remains,) = [own for own in figure["series"] if own["detail"] == "what remains"]
    assert (remains["low"], remains["high"]) == ([1.134], [1.512])
    lines = {line["name"]: line["at"] for line in figure["lines"]}
    assert lines == {"tolerance": 1.0, "repeatability": 0.424}


@pytest.mark.parametrize(("effects", "levels"), [
    (("gun.back_pressure",), {"+ atmosphere ahead of the projectile": 31.0, "what remains": 31.0}),
    (
        ("gun.blow_by", "gun.back_pressure"),
        {
            "+ atmosphere ahead of the projectile": 31.0,
            "+ leak past the projectile": 27.0,
            "what remains": 27.0,
        },
    ),
    ((), {}),
])  # fmt: skip
def test_ticked_effects_have_the_error_that_was_computed_with_exactly_these(
    pages: Window, effects: tuple[str, ...], levels: dict[str, float]
) -> None:
    whole = {"nominal model": 42.0, **levels, "repeatability (measurement noise)": 0.424}
    answer = pages[0].get("/diagnoses/3/figures", params={"effect": list(effects)}).json()
    assert waterfall_of(answer["waterfall"]) == whole
    page = pages[0].get("/diagnoses/3", params={"effect": list(effects) or [""]}).text
    assert waterfall_of(data_of(page, "waterfall-data")) == whole
    shown = data_of(page, "residuals-all")
    for own, figure in zip(answer["residuals"], shown, strict=True):
        values_after = own["after"] or [None] * 12
        assert figure["series"][-1]["y"] == values_after and figure["series"][-1]["name"] == (
            "with the effects"
        )
        assert figure["y"]["limits"] == own["limits"]
    assert page.count('value="gun.back_pressure" checked') == ("gun.back_pressure" in effects)


def test_effects_that_were_not_computed_together_are_said_and_not_shown(pages: Window) -> None:
    chosen = {"effect": ["gun.blow_by", "gun.valve_flow"]}
    answer = pages[0].get("/diagnoses/3/figures", params=chosen, headers={"X-Pyroshock-Form": "1"})
    assert answer.status_code == 404 and "was not computed" in answer.text
    page = pages[0].get("/diagnoses/3", params=chosen).text
    assert "This combination was not computed. Shown: the effects of the report" in page
    assert waterfall_of(data_of(page, "waterfall-data"))["what remains"] == 1.26


def test_the_residuals_name_the_run_its_configuration_and_its_impact(pages: Window) -> None:
    client, store = pages
    with store.reading() as session:
        impacts = impacts_of(session, "spring")
    text = client.get("/diagnoses/3").text
    figure, addresses = (
        data_of(text, "residuals-all")[0],
        data_of(text, "residuals-addresses"),
    )
    rings = figure["series"][1]
    assert (
        rings["labels"][2].startswith("run 2.1, configuration 2")
        and "steel" in (rings["labels"][2])
    )
    assert rings["y"][0] == pytest.approx(100 * np.expm1(-0.5), rel=1e-4)
    assert addresses == [
        f"/impacts/{impacts[key]}" if key in impacts else ""
        for key in [(i // 2 + 1, i % 2 + 1) for i in range(12)]
    ]


def test_the_map_of_places_has_one_scale_from_the_tolerance_on(pages: Window) -> None:
    figure = data_of(pages[0].get("/diagnoses/3").text, "places-data")
    (heat,) = figure["series"]
    assert figure["y"]["categories"] == [
        "gun: velocity",
        "force 0.1 to 0.4 ms",
        "force 800 to 1600 Hz",
    ]
    assert figure["x"]["categories"] == [
        "all runs", "0.3 to 0.6 bar: tank pressure", "PLA: tip material"
    ]  # fmt: skip
    assert heat["limits"] == [1.0, 50.0] and heat["values"][1] == [0.4, 0.3, None]


def test_a_diagnosis_of_an_earlier_version_says_what_it_lacks(pages: Window) -> None:
    client, store = pages
    text = client.get("/diagnoses/1").text
    assert 'id="lacks"' in text and "holds no residuals of single runs" in text
    assert waterfall_of(data_of(text, "waterfall-data"))["what remains"] == 1.26
    assert 'id="residuals"' not in text and 'id="places"' not in text
    key = keep(store, verdicts.gun())
    with store.writing() as session:
        session.get_one(Diagnosis, key).details = None
    text = client.get(f"/diagnoses/{key}").text
    assert "was kept without what its page draws" in text and "gun.valve_flow" in text
    assert client.get(f"/diagnoses/{key}/figures").status_code == 404


def test_the_headline_says_what_how_sure_and_on_which_data(pages: Window) -> None:
    size, cause = (item.text for item in headline(verdicts.explored()))
    assert size == (
        "The model error is 42 times the tolerance and 99 times the measurement noise; it arises "
        "in the gun."
    )
    assert cause == (
        "The flow resistance of the valve, the atmosphere ahead of the projectile and the leak "
        "past the projectile cause it; that this is the whole answer has a probability of 93 %, "
        "and 97 % of the error above the noise disappears on configurations that the fit has not "
        "seen."
    )
    assert headline(verdicts.unknown())[1].text == (
        "No effect of the catalogue explains it: that the cause is unknown, outside of the "
        "catalogue, has a probability of 90 %."
    )
    assert headline(verdicts.none())[0].text.startswith("Model and measurement agree")
    text = pages[0].get("/diagnoses/3").text
    assert f"{size} {cause}".replace(" %", "\u00a0%") in text


def test_a_job_considers_the_ticked_effects_and_each_of_a_set(pages: Window) -> None:
    client, store = pages
    ticked = ["gun.barrel_loss or gun.valve_flow", "effects that are not established"]
    answer = post(client, "/diagnoses/3/what-if", {"with_effects": ticked})
    assert answer.status_code == 303
    with store.reading() as session:
        job = session.scalars(select(Job).order_by(Job.id.desc())).first()
        assert job is not None
        assert job.arguments["with_effects"] == ["gun.barrel_loss", "gun.valve_flow"]


def test_the_list_is_a_picture_of_errors_over_time_by_bench(pages: Window) -> None:
    client, store = pages
    with store.reading() as session:
        words = bench_words(session, ["spring"])["spring"]
    figure = data_of(client.get("/diagnoses?campaign=spring").text, "over-time-data")
    before, after = (own for own in figure["series"] if own["name"] == words)
    assert before["y"][:3] == [42.0, 0.8, 42.0] and after["y"][:3] == [1.26, None, 1.26]
    assert figure["x"]["categories"][0].startswith("1: ") and figure["y"]["scale"] == "log"


def test_what_was_adopted_is_marked_in_the_picture() -> None:
    rows = [
        ListedError(1, "2026-01-01", "a", "gun", 40.0, 2.0, None),
        ListedError(2, "2026-01-02", "a", "gun", 9.0, math.nan, "version 1: gun.valve_flow"),
        ListedError(3, "2026-01-03", "b", "hammer", 5.0, 1.0, None),
    ]
    plot = errors_plot(rows[::-1])
    assert plot is not None and plot.legend()[:2] == ("gun", "hammer")
    (adopted,) = [own for own in plot.series if own.name == "adopted into the twin"]
    assert isinstance(adopted, PointSeries)
    assert (list(adopted.x), list(adopted.y)) == ([1.0], [9.0])
    assert adopted.labels == ("a: version 1: gun.valve_flow",)
    assert errors_plot(rows[:1]) is None


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
