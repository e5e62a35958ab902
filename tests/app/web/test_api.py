"""The API: its document, the command line's answers through it, and what values of every kind do to
it."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any
from urllib.parse import quote

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, seed, settings
from pyroshock.app.operations.diagnose.stored import kept_report
from pyroshock.signals.srs.spectrum import shock_response_spectrum
from support.processes.web_client import ADDRESS, ended, post_json, token
from support.stores.stores import run_pyroshock
from support.stores.web_stores import GUN, HAMMER, IMPACTS, PLAN, SHOTS, Lab

#: Filling a store imports much; on a busy machine that is slow.
pytestmark = pytest.mark.timeout(600)


def told(filled: Lab, *words: str) -> Any:
    """What the command line prints of the same store."""
    return json.loads(run_pyroshock(*words, "--db", filled.db, "--json").stdout)


def walked(filled: Lab, address: str, key: str, limit: int) -> Iterator[dict[str, Any]]:
    """All pages of a listing, one after the other."""
    after = ""
    while True:
        rows = filled.client.get(f"{address}?limit={limit}{after}").json()
        assert len(rows) <= limit
        yield from rows
        if len(rows) < limit:
            return
        after = f"&after={rows[-1][key]}"


def test_campaigns_are_those_of_the_command_line_and_every_route_is_described(filled: Lab) -> None:
    rows = filled.client.get("/api/campaigns").json()
    assert sorted(rows, key=str) == sorted(told(filled, "campaigns"), key=str)
    assert {row["name"] for row in rows} >= {GUN, HAMMER, "modal-hammer-hit"}
    assert list(walked(filled, "/api/campaigns", "name", 2)) == rows
    document = filled.client.get("/api/openapi.json").json()
    for path, methods in document["paths"].items():
        assert path.startswith("/api/")
        for method, operation in methods.items():
            assert operation["summary"], (method, path)
            assert operation["description"], (method, path)
            assert len(operation["tags"]) == 1, (method, path)
            assert {"403", "404", "422"} <= operation["responses"].keys(), (method, path)
    assert len({path for path in document["paths"] if "{" not in path}) > 10


@pytest.mark.parametrize(
    ("what", "limit"), [*(("impacts", n) for n in (1, 4, 7, 1000)), ("shots", 2)]
)
def test_pages_of_impacts_and_shots_join_to_the_command_line_s(
    filled: Lab, what: str, limit: int
) -> None:
    rows = list(walked(filled, f"/api/{what}", "id", limit))
    assert rows == told(filled, what) and (
        len(rows) == IMPACTS if what == "impacts" else len(rows) >= SHOTS
    )


@pytest.mark.parametrize(
    "where", ["tip_material=delrin", "peak_force_n>1200", "tip_radius_mm=15", "run!=1"]
)
def test_conditions_are_those_of_the_command_line(filled: Lab, where: str) -> None:
    rows = filled.client.get("/api/impacts", params={"where": where}).json()
    assert rows == told(filled, "impacts", "--where", where) and 0 < len(rows) < IMPACTS


def test_a_prediction_is_that_of_the_command_line_by_query_and_body(filled: Lab) -> None:
    words = "--tank-pressure 5bar --bullet-mass 0.2kg --tip aluminum --contact hertz"
    ours = filled.client.get(
        "/api/predict",
        params={
            "tank_pressure_pa": 5e5,
            "bullet_mass_kg": 0.2,
            "tip_material": "aluminum",
            "contact": "hertz",
        },
    ).json()
    assert ours == told(filled, "predict", *words.split())
    low, high = ours["velocity_m_s"]["ci90"]
    assert 0 < low < ours["velocity_m_s"]["mean"] < high
    question = {"impact_velocity_m_s": 8.0, "contact": "hertz", "draws": 16, "seed": 3}
    coupled = question | {"coupled": True, "contact": "hertz"}
    assert (
        post_json(filled.client, "/api/predict", coupled).json()["models"]["contact"]
        == "hertz + modes of the plate"
    )
    assert post_json(filled.client, "/api/predict", question).json() == (
        filled.client.get("/api/predict", params=question).json()
    )


def test_a_diagnosis_takes_the_effects_to_consider_that_there_are(filled: Lab) -> None:
    question = {
        "campaign": GUN,
        "with": ["gun.valve_flow", "gun.blow_by"],
        "without": ["gun.blow_by"],
    }
    job = ended(filled.client, post_json(filled.client, "/api/diagnoses", question))
    assert job["label"] == f"Diagnose {GUN} with gun.valve_flow, gun.blow_by without gun.blow_by"
    assert (job["state"], job["error"]) == ("done", None)
    assert (
        job["result"]["assumptions"][1]
        == "The diagnosis does not consider gun.blow_by (--without)."
    )
    jobs = len(filled.client.get("/api/jobs").json())
    answer = post_json(filled.client, "/api/diagnoses", {"campaign": GUN, "with": ["gun.magic"]})
    assert (answer.status_code, "gun.magic" in answer.json()["detail"]) == (404, True)
    assert len(filled.client.get("/api/jobs").json()) == jobs


def test_stored_data_come_as_they_are_and_a_spectrum_is_the_closed_form(filled: Lab) -> None:
    with filled.store.reading() as session:
        assert filled.client.get("/api/diagnoses/1").json() == kept_report(session, 1)
    plan_data = filled.client.get(f"/api/plans/{quote(PLAN, safe='')}").json()
    assert (plan_data["name"], len(plan_data["runs"])) == (PLAN, 4)
    channel = filled.client.get("/api/impacts/1").json()["signals"][0]
    whole = filled.client.get(f"/api/channels/{channel['key']}?points=200000").json()
    assert len(whole["values"]) == channel["samples"]
    few = filled.client.get(f"/api/channels/{channel['key']}?points=100").json()
    assert len(few["values"]) <= 200 and max(few["values"]) == max(whole["values"])
    # An undamped oscillator far stiffer than the pulse is short follows it; at fT = 1/2 it responds
    # with pi/2.
    rate, length = 100_000.0, 0.01
    time = np.arange(4000) / rate
    pulse = np.where(time < length, 100.0 * np.sin(np.pi * time / length), 0.0)
    lines = [50.0, 2000.0]
    body = {
        "acceleration_m_s2": pulse.tolist(),
        "sampling_rate_hz": rate,
        "frequency_hz": lines,
        "q": 1000,
    }
    found = post_json(filled.client, "/api/srs", body).json()
    ours = shock_response_spectrum(pulse, rate, np.array(lines), q=1000)
    for side in ("maximax", "positive", "negative", "primary", "residual", "pseudo_velocity_m_s"):
        assert found[side] == getattr(ours, side).tolist()
    assert found["primary"][0] == pytest.approx(100 * np.pi / 2, rel=0.01)
    assert found["positive"][1] == pytest.approx(100.0, rel=0.05)


@pytest.mark.parametrize(("address", "status", "words"), [
    ("/api/campaigns/winter", 404, "winter"),
    ("/api/impacts/99999", 404, "99999"),
    ("/api/impacts/0", 422, "0"),
    ("/api/impacts/99999999999999999999", 422, "99999999999999999999"),
    ("/api/impacts?where=tip_material", 400, "FIELD=VALUE"),
    ("/api/impacts?where=hardness=1", 400, "hardness"),
    ("/api/impacts?limit=0", 422, "limit"),
    ("/api/impacts?campaign=winter", 404, "winter"),
    ("/api/campaigns?name=a%00b", 400, "%00"),
    ("/api/campaigns/a%00b", 400, "%00"),
    ("/api/channels/1?start_s=nan", 422, "nan"),
    ("/api/channels/1?start_s=1&stop_s=0", 422, "rising order"),
    ("/api/models/tree/9", 404, "tree@9"),
    ("/api/models/compare?version=tree@1", 422, "needs two models"),
    ("/api/predict?bullet_mass_kg=1e-180", 422, "bullet_mass_kg"),
    ("/api/predict?tank_pressure_pa=1e5&impact_velocity_m_s=5", 422, "one of them"),
    ("/api/predict?contact=unknown", 404, "unknown"),
    ("/api/predict?colour=red", 422, "colour"),
    ("/api/predict?draws=5000", 422, "draws is 5000; expected at most 1,024"),
    ("/api/diagnoses/77", 404, "77"),
    ("/api/plans/winter", 404, "winter"),
    ("/api/spectra?impact=99999", 404, "99999"),
    ("/api/jobs/99", 404, "99"),
    ("/api/nowhere", 404, "Not Found"),
])  # fmt: skip
def test_a_bad_question_is_answered_in_words(
    filled: Lab, address: str, status: int, words: str
) -> None:
    answer = filled.client.get(address)
    assert answer.status_code == status, answer.text
    assert words in answer.json()["detail"]


@pytest.mark.parametrize(("address", "body", "words"), [
    ("/api/plans", '{"name": ""}', "name"),
    ("/api/plans", '{"name": " "}', "name is ' '; expected"),
    ("/api/plans", '{"name": ".."}', "cannot name a plan"),
    ("/api/plans", '{"name": "x", "runs": 99999}', "runs"),
    ("/api/plans", '{"name": "autumn/1"}', "in the store already"),
    ("/api/plans", '{"name": "x", "factors": "["}', "not TOML"),
    ("/api/plans", '{"name": "x\\u0000"}', "cannot be written"),
    ("/api/plans", '{"name": "x\\ud800"}', "name"),
    ("/api/plans", '{"name": "x", "description": "\\u001b[31m"}', "description"),
    ("/api/plans", '{"name": "x", "method": "magic"}',
     "method is 'magic'; expected one of lhs, sobol"),
    ("/api/plans", '{"name": "x", "options": {"face": "ccf"}}',
     "face is not known; known: name"),
    ("/api/plans", '{"name": "x", "options": {"criterion": 3}}',
     "criterion is 3; expected one of balance"),
    ("/api/plans", "{", "JSON"),
    ("/api/plans", "NaN", "nan"),
    ("/api/plans/autumn%2F1/runs/1", '{"status": "done", "note": "\\u0007"}', "note"),
    ("/api/plans/autumn%2F1/runs/1", '{"status": "lost"}', "lost"),
    ("/api/plans/autumn%2F1/runs/1", '{"status": "discarded"}', "reason"),
    ("/api/plans/autumn%2F1/runs/9", '{"status": "done"}', "no run 9"),
    ("/api/impacts/1/preview", '{"threshold": NaN}', "nan"),
    ("/api/impacts/1/extract", '{"threshold": 1e400}', "inf"),
    ("/api/impacts/1/extract", '{"segmentation": "guess"}', "guess"),
    ("/api/srs", '{"acceleration_m_s2": [0, NaN], "sampling_rate_hz": 1, "frequency_hz": [1]}',
     "nan"),
    ("/api/srs", '{"acceleration_m_s2": [0, 1], "sampling_rate_hz": 10, "frequency_hz": [9]}',
     "half the sampling"),
    ("/api/tune", '{"target": "no spectrum"}', "the target: no column frequency_hz"),
    ("/api/query", '{"statement": "select 1", "parameters": false}',
     "parameters is False; expected names with values"),
    ("/api/query", '{"statement": "select 1", "parameters": [1]}',
     "parameters is [1]; expected names with values"),
    ("/api/ingest", '{"path": "/etc"}', "/etc"),
    ("/api/ingest", '{"path": "../.."}', "../.."),
    ("/api/store/check", f'{{"repair": "{"0" * 300}"}}',
     "repair: a name in it has 300 bytes; the name of a file or folder has at most 255"),
    ("/api/diagnoses", '{"campaign": "first-shots", "seed": -1}', "seed"),
    ("/api/diagnoses", '{"campaign": "first-shots", "with": {"gun.valve_flow": 1}}', "with"),
    ("/api/models/tree/1/promote", '{"force": true}', "reason"),
])  # fmt: skip
def test_a_bad_write_is_answered_in_words_and_changes_nothing(
    filled: Lab, address: str, body: str, words: str
) -> None:
    before, jobs = filled.rows(), len(filled.client.get("/api/jobs").json())
    headers = {"X-CSRF-Token": token(filled.client), "content-type": "application/json"}
    answer = filled.client.post(address, content=body.encode(), headers=headers)
    assert answer.status_code == 422, answer.text
    assert words in answer.json()["detail"] and filled.rows() == before
    assert len(filled.client.get("/api/jobs").json()) == jobs


#: What makes a route of an unknown thing one of a known thing.
KNOWN: dict[str, Any] = {"campaign": GUN, "contact": "hertz"}
KNOWN |= dict.fromkeys(("diagnosis", "impact", "channel", "version", "run", "job"), 1)
NAMES = {"plans": PLAN, "models": "tree", "campaigns": HAMMER}
#: Where work grows with a number that the schema allows: so much is enough here.
ENOUGH = {"draws": 16, "runs": 8, "repetitions": 3, "points": 1000}


def with_known(case: Any) -> bool:
    """Point a case at what is in the store; whether there was anything to point."""
    names = {"name": quote(NAMES.get(case.path.split("/")[2], HAMMER), safe="")}
    changed = False
    for values, known in (
        (case.path_parameters, KNOWN | names),
        (case.query, KNOWN),
        (case.body, KNOWN),
    ):
        if not isinstance(values, dict) or (values is case.body and "name" in values):
            continue
        for name in values.keys() & known.keys():
            if not isinstance(values[name], list):
                values[name], changed = known[name], True
    return changed


def with_little_work(case: Any) -> None:
    if case.path == "/api/plans" and isinstance(case.body, dict):
        case.body.setdefault("runs", ENOUGH["runs"])
    for values in (case.query, case.body):
        if isinstance(values, dict):
            for name in values.keys() & ENOUGH.keys():
                if type(values[name]) is int:
                    values[name] = min(values[name], ENOUGH[name])


def asked_with_anything(filled: Lab, examples: int) -> list[str]:
    """What went wrong when every operation was asked with what its schema allows, and with what it
    does not."""
    import schemathesis
    from schemathesis import GenerationMode
    from schemathesis.checks import not_a_server_error
    from schemathesis.specs.openapi import checks

    filled.client.get("/api/csrf")
    cookies = "; ".join(f"{name}={value}" for name, value in filled.client.cookies.items())
    headers = {
        "host": ADDRESS.removeprefix("http://"),
        "cookie": cookies,
        "X-CSRF-Token": token(filled.client),
    }
    document = schemathesis.openapi.from_asgi(
        "/api/openapi.json", filled.client.app, headers=headers
    )
    held = [
        not_a_server_error,
        checks.status_code_conformance,
        checks.content_type_conformance,
        checks.response_schema_conformance,
    ]
    wrong: list[str] = []

    def ask(case: Any) -> None:
        case.validate_response(
            case.call(base_url=ADDRESS, headers=headers, timeout=60), checks=held
        )

    def check(case: Any) -> None:
        with_little_work(case)
        ask(case)
        if with_known(case):
            ask(case)

    for operation in (found.ok() for found in document.get_all_operations()):
        for mode in GenerationMode:
            if mode.is_negative and not (
                operation.path_parameters or operation.query or operation.body
            ):
                continue
            wrong += _failure(
                operation.label, check, operation.as_strategy(generation_mode=mode), examples
            )
    return wrong


def _failure(label: str, check: Callable[[Any], None], strategy: Any, examples: int) -> list[str]:
    quiet = {"deadline": None, "database": None, "suppress_health_check": list(HealthCheck)}
    run = seed(7)(
        settings(max_examples=examples, phases=[Phase.generate], **quiet)(given(strategy)(check))
    )
    try:
        run()
    except Exception as error:  # noqa: BLE001 - the next operation is asked, too
        return [f"{label}: {type(error).__name__}: {error!s:.2000}"]
    return []


def errors_of_ours(filled: Lab) -> list[str]:
    """Jobs that ended in a bug."""
    found = filled.client.get("/api/jobs").json()
    return [
        f"{job['label']}: {job['error']}"
        for job in found
        if "error of pyroshock itself" in (job["error"] or "")
    ]


@pytest.mark.parametrize(
    "examples",
    [1, pytest.param(100, marks=[pytest.mark.slow, pytest.mark.timeout(3600)], id="many")],
)
def test_no_value_is_a_server_s_error(filled: Lab, examples: int) -> None:
    assert asked_with_anything(filled, examples) == [] and errors_of_ours(filled) == []
