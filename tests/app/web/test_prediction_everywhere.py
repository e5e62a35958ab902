"""A prediction is the same in the command, the API and the page: numbers, warnings, notes, what its
bands rest on."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from pyroshock.app.common.number_format import format_interval
from pyroshock.app.operations.predict.controls import VELOCITY_M_S
from pyroshock.app.twins import building
from pyroshock.app.twins.benches import bench_of_campaign
from pyroshock.app.twins.building import BuiltTwin, TwinRequest
from pyroshock.app.twins.twin_cache import TwinCache
from pyroshock.twin.chain import Twin
from pyroshock.twin.contact_interface import Extrapolation
from pyroshock.twin.prediction import Prediction, RestsOn
from support.checks.well_formed import Page
from support.processes.web_client import post_json
from support.records.twin_parts import unsolved
from support.stores.stores import pyroshock, run_pyroshock
from support.stores.web_stores import GUN, HAMMER, Lab

#: Filling a store imports much; on a busy machine that is slow.
pytestmark = pytest.mark.timeout(600)

LOWEST_PA, HIGHEST_PA, HEAVIEST_KG = 0.5e5, 6.7e5, 0.8
#: Of a valve: 0.1 s to open, 0.1 s to close.
PROFILE = "0:0 0.1:1 0.3:1 0.4:0"
#: Standard gravity, m/s2.
G = 9.80665
SENTENCE = "The bands rest on 5 measured shots of first-shots."
#: Options of the command, and the same question to the API and the page.
SHOTS: dict[str, tuple[str, dict[str, Any]]] = {
    "within": ("--tank-pressure 3bar --contact hertz", {"tank_pressure_pa": 3e5,
    "contact": "hertz"}),
    "beyond the pressure": (
        "--tank-pressure 10bar --bullet-mass 0.2kg --contact hann",
        {"tank_pressure_pa": 1e6, "bullet_mass_kg": 0.2, "contact": "hann"},
    ),
    "beyond pressure and mass": (
        f"--tank-pressure 50bar --bullet-mass 1.2kg --campaign {GUN} --contact hertz",
        {"tank_pressure_pa": 5e6, "bullet_mass_kg": 1.2, "campaign": GUN, "contact": "hertz"},
    ),
    "outside of the contact's domain": (
        "--velocity 30m/s --contact hertz --anvil steel --insulator polymeric",
        {"impact_velocity_m_s": 30.0, "contact": "hertz", "anvil_material": "steel",
        "insulator": "polymeric"},
    ),
    "registered model": (
        "--velocity 9m/s --contact linear@1 --tip delrin --tip-radius 30mm",
        {"impact_velocity_m_s": 9.0, "contact": "linear@1", "tip_material": "delrin",
        "tip_radius_m": 0.03},
    ),
    "plate that hangs higher": (
        "--tank-pressure 3bar --contact hertz --chain-height 112mm",
        {"tank_pressure_pa": 3e5, "contact": "hertz", "chain_height_m": 0.112},
    ),
    "valve profile": (
        f"--tank-pressure 4bar --contact hertz --valve-profile '{PROFILE}'",
        {"tank_pressure_pa": 4e5, "contact": "hertz", "valve_profile": PROFILE},
    ),
    "coupled": (
        "--velocity 8m/s --contact hertz --coupled",
        {"impact_velocity_m_s": 8.0, "contact": "hertz", "coupled": True},
    ),
    "hammer, held plate, registered model": (
        f"--campaign {HAMMER} --velocity 1.5m/s --contact linear@1 --tip delrin --tip-radius 30mm "
        "--anvil steel --insulator polymeric --boundary-conditions fixed",
        {"campaign": HAMMER, "impact_velocity_m_s": 1.5, "contact": "linear@1",
         "tip_material": "delrin", "tip_radius_m": 0.03, "anvil_material": "steel",
         "insulator": "polymeric", "boundary_conditions": "fixed"},
    ),
}  # fmt: skip
PARAMETERS = pytest.mark.parametrize("name", SHOTS)


@pytest.fixture(autouse=True)
def recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    """The twin says what its bands rest on, and which settings are beyond the shots of a small
    campaign."""
    predict = Twin.predict

    def with_ranges(twin: Twin, setting: Any, **options: Any) -> Prediction:
        pressure, mass = setting.tank_pressure_pa, setting.impactor_mass_kg
        beyond = []
        if pressure is not None and not LOWEST_PA <= pressure <= HIGHEST_PA:
            beyond.append(Extrapolation("tank_pressure_pa", pressure, LOWEST_PA, HIGHEST_PA))
        if mass > HEAVIEST_KG:
            beyond.append(Extrapolation("bullet_mass_kg", mass, 0.2, HEAVIEST_KG))
        prediction = predict(twin, setting, **options)
        return replace(
            prediction,
            extrapolation=tuple(beyond),
            rests_on=RestsOn(5, twin.contact.label, SENTENCE),
        )

    monkeypatch.setattr(Twin, "predict", with_ranges)


_answers: dict[tuple[str, ...], Any] = {}


def of_command(filled: Lab, name: str, *more: str) -> Any:
    """What the command prints of a shot; asked once, for it builds its twin anew each time."""
    if (name, *more) not in _answers:
        result = run_pyroshock(
            "predict", *shlex.split(SHOTS[name][0]), *more, "--seed", "3", "--db", filled.db
        )
        _answers[name, *more] = json.loads(result.stdout) if more else result
    return _answers[name, *more]


def question(name: str) -> dict[str, Any]:
    return {**SHOTS[name][1], "seed": 3}


def of_page(filled: Lab, name: str) -> dict[str, Any]:
    answer = filled.client.get("/twin/answer", params=question(name))
    assert answer.status_code == 200, answer.text
    return answer.json()


@PARAMETERS
def test_command_api_and_page_say_the_same(filled: Lab, name: str) -> None:
    command = of_command(filled, name, "--json")
    api = filled.client.get("/api/predict", params=question(name)).json()
    body = post_json(filled.client, "/api/predict", question(name)).json()
    answer = of_page(filled, name)
    page = answer["prediction"]
    assert {"extrapolation", "rests_on", "warnings", "notes", "outside_domain"} <= command.keys()
    for key in command:
        assert api[key] == command[key], key
        assert body[key] == command[key], key
    assert page == {
        key: value for key, value in command.items() if key not in ("force", "acceleration", "srs")
    }
    figures = answer["figures"]
    (force,) = [own for own in figures["force"]["series"] if own["name"] == "mean"]
    assert 1e3 * np.array(force["y"]) == pytest.approx(command["force"]["mean"], rel=1e-4, abs=1e-2)
    for sensor in ("acceleration_1", "acceleration_2"):
        (spectrum,) = [own for own in figures["spectrum"]["series"] if own["name"] == sensor]
        assert spectrum["y"] == pytest.approx(
            [level / G for level in command["srs"][sensor]["mean"]], rel=1e-4
        )
    acceleration = command["acceleration"]["acceleration_1"]
    lowest_hz, highest_hz = acceleration["band_hz"]
    peak = f"peak acceleration_1, {1e-3 * lowest_hz:g} to {1e-3 * highest_hz:.3g} kHz"
    expected = {
        "impact velocity": (command["velocity_m_s"], 1.0),
        "contact time": (command["contact_time_s"], 1e3),
        "peak force": (command["peak_force_n"], 1e-3),
        "impulse": (command["impulse_n_s"], 1.0),
        peak: (acceleration["peak_m_s2"], 1 / G),
    }
    rows = {row["quantity"]: row for row in answer["numbers"]}
    printed = of_command(filled, name)
    # the command says of shots at this setting what the page says
    assert answer["here"] in " ".join(printed.stdout.split())
    for quantity, (value, scale) in expected.items():
        numbers = [scale * value["mean"], *(scale * end for end in value["ci90"])]
        mean, low, high = format_interval(*numbers)
        shown = rows[quantity]["mean"], rows[quantity]["band"]
        assert shown == tuple(text.replace("-", "−") for text in (mean, f"{low} to {high}"))
        (line,) = [line for line in printed.stdout.splitlines() if line.startswith(quantity)]
        assert {mean, low, high} <= set(line.split())
    html = filled.client.get("/twin", params=question(name))
    assert html.status_code == 200, html.text
    visible = " ".join(Page(html.text).text.split())
    assert all(quantity in visible for quantity in expected)
    assert SENTENCE == command["rests_on"]["sentence"] == printed.stdout.splitlines()[0]
    assert visible.index("This shot, with 90 % bands") < visible.index(SENTENCE)
    for sentence in (*command["warnings"], *command["notes"]):
        assert sentence in visible and sentence in printed.stdout + printed.stderr


def test_warning_stands_beside_the_number_and_beside_the_slider(filled: Lab) -> None:
    pressure = (
        "Tank pressure 50 bar is above the 0.5 to 6.7 bar of the shots that were learned from."
    )
    mass = "Bullet mass 1.2 kg is above the 0.2 to 0.8 kg of the shots that were learned from."
    name = "beyond pressure and mass"
    (line,) = [
        row
        for row in of_command(filled, name).stdout.splitlines()
        if row.startswith("impact velocity")
    ]
    assert pressure in line and mass in line
    assert of_page(filled, name)["beside"] == {"tank_pressure_pa": pressure, "bullet_mass_kg": mass}
    html = filled.client.get("/twin", params=question(name)).text
    assert f'id="tank_pressure_pa-warning" role="status">{pressure}</span>' in html
    assert f'id="bullet_mass_kg-warning" role="status">{mass}</span>' in html
    assert of_page(filled, "within")["beside"] == {}
    assert not any(
        "beyond the" in sentence for sentence in of_command(filled, "within", "--json")["warnings"]
    )
    assert of_command(filled, name, "--json")["extrapolation"] == [
        {"quantity": "tank_pressure_pa", "asked": 5e6, "low": LOWEST_PA, "high": HIGHEST_PA},
        {"quantity": "bullet_mass_kg", "asked": 1.2, "low": 0.2, "high": HEAVIEST_KG},
    ]


def campaigns_of(html: str) -> Iterator[str]:
    select = html[html.index('<select id="campaign"') :]
    yield from select[: select.index("</select>")].split("<option")[1:]


def test_twin_is_chosen_by_campaign_and_a_table_has_what_the_bands_rest_on(
    filled: Lab, tmp_path: Any
) -> None:
    options = list(campaigns_of(filled.client.get("/twin", params={"contact": "hertz"}).text))
    assert any(f'value="{HAMMER}"' in option and "(hammer)" in option for option in options)
    assert any(f'value="{GUN}"' in option and "(gun)" in option for option in options)
    chosen = filled.client.get("/twin", params={"campaign": HAMMER, "contact": "hertz"})
    assert chosen.status_code == 200
    assert any("selected" in option and HAMMER in option for option in campaigns_of(chosen.text))
    table = tmp_path / "shots.csv"
    table.write_text("run,tank_pressure_bar,bullet_mass_kg\n1,3,0.5\n2,10,0.5\n")
    words = ("--shots", str(table), "--contact", "hertz", "--draws", "4", "--db", filled.db)
    rows = json.loads(run_pyroshock("predict", *words, "--json").stdout)
    assert [row["rests_on_shots"] for row in rows] == [5, 5]
    beyond = "Tank pressure 10 bar is above the 0.5 to 6.7 bar of the shots that were learned from."
    assert [row["extrapolation"] for row in rows] == ["", beyond] and beyond in pyroshock(
        "predict", *words
    ).stdout


def test_bench_without_a_gun_is_asked_by_its_velocity(
    filled: Lab, monkeypatch: pytest.MonkeyPatch
) -> None:
    get = TwinCache.get

    def gunless(shelf: TwinCache, request: TwinRequest) -> BuiltTwin:
        built = get(shelf, request)
        return replace(built, twin=replace(built.twin, gun=None))

    monkeypatch.setattr(TwinCache, "get", gunless)
    html = filled.client.get("/twin", params={"campaign": HAMMER, "contact": "hertz"}).text
    assert 'id="impact_velocity_m_s"' in html and 'id="tank_pressure_pa"' not in html
    answer = filled.client.get(
        "/twin/answer", params={"campaign": HAMMER, "contact": "hertz"}
    ).json()
    assert answer["prediction"]["velocity_m_s"]["mean"] == pytest.approx(VELOCITY_M_S)


def peak_m_s2(answer: dict[str, Any]) -> float:
    return float(answer["acceleration"]["acceleration_1"]["peak_m_s2"]["mean"])


def test_plate_that_hangs_higher_is_another_plate_to_command_and_api(
    filled: Lab, monkeypatch: pytest.MonkeyPatch
):
    """A plate whose answer is as high as the place of impact: 112 mm lower of some 280 mm."""

    def by_height(drawing: Any, *others: Any) -> Any:
        plate = unsolved(drawing, *others)
        heights = [drawing.impact_points[name][1] for name in plate.impact_points]
        return replace(plate, shape_impact=np.array(heights)[:, None] * plate.shape_impact)

    monkeypatch.setattr(building, "solved", by_height)
    shot = {"impact_velocity_m_s": 8.0, "contact": "hertz", "q": 12.5, "seed": 3}
    usual, higher = (
        filled.client.get("/api/predict", params={**shot, "chain_height_m": height}).json()
        for height in (0.0, 0.112)
    )
    words = "predict --velocity 8m/s --contact hertz --q 12.5 --seed 3 --chain-height 112mm --json"
    command = json.loads(pyroshock(*words.split(), "--db", filled.db).stdout)
    with filled.store.reading() as session:
        y = bench_of_campaign(session, None).drawing.impact_points["#1"][1]
    assert peak_m_s2(higher) / peak_m_s2(usual) == pytest.approx((y - 0.112) / y, rel=1e-6)
    assert command["srs"] == higher["srs"]


def test_valve_and_held_plate_change_the_prediction_and_fields_stand_where_they_apply(
    filled: Lab,
) -> None:
    def told(name: str, without: str) -> tuple[dict[str, Any], dict[str, Any]]:
        other = {key: value for key, value in question(name).items() if key != without}
        return tuple(
            filled.client.get("/api/predict", params=params).json()
            for params in (question(name), other)
        )

    with_valve, open_tank = told("valve profile", "valve_profile")
    assert with_valve["velocity_m_s"]["mean"] < open_tank["velocity_m_s"]["mean"] - 0.2
    fixed, free = told("hammer, held plate, registered model", "boundary_conditions")
    assert fixed["peak_force_n"]["mean"] != pytest.approx(free["peak_force_n"]["mean"], rel=1e-6)
    coupled, rigid = told("coupled", "coupled")
    assert coupled["impulse_n_s"]["mean"] != pytest.approx(rigid["impulse_n_s"]["mean"], rel=1e-6)

    def fields(**params: Any) -> set[str]:
        html = filled.client.get("/twin", params=params).text
        names = {"chain_height_m", "valve_profile", "boundary_conditions"}
        return {name for name in names if re.search(rf'<(input|select) id="{name}"', html)}

    html = filled.client.get("/twin", params=question("plate that hangs higher")).text
    assert re.search(r'<option value="0\.112" selected>112</option>', html)
    assert (
        filled.client.get("/twin", params=question("valve profile")).text.count(
            f'value="{PROFILE}"'
        )
        == 1
    )
    html = filled.client.get("/twin", params=question("hammer, held plate, registered model")).text
    assert '<option value="fixed" selected>' in html
    assert fields(contact="hertz") == {"chain_height_m", "valve_profile"}
    assert fields(contact="hertz", impact_velocity_m_s=8.0) == {"chain_height_m"}
    assert fields(campaign=HAMMER, contact="hertz", impact_velocity_m_s=1.5) == set()
    assert fields(campaign=HAMMER, contact="linear@1", impact_velocity_m_s=1.5) == {
        "boundary_conditions"
    }


@pytest.mark.parametrize(
    ("height_m", "words"), [(0.1, "expected a multiple of 56"), (0.56, "outside of the plate")]
)
def test_height_that_the_plate_cannot_hang_at_is_refused(
    filled: Lab, height_m: float, words: str
) -> None:
    answer = filled.client.get(
        "/api/predict", params={"contact": "hertz", "chain_height_m": height_m}
    )
    assert answer.status_code == 422 and words in answer.text
