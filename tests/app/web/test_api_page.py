"""The page that describes the API: every route with parameters, units, examples and the tokens that
it needs."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from pyroshock.app.doors.python import PythonMethod
from pyroshock.app.library.experiment_store import ExperimentStore
from pyroshock.app.library.plans import PlanCollection
from pyroshock.app.operations.catalogue import OPERATIONS, operation
from pyroshock.app.web.api_examples import CLIENT_CALLS
from pyroshock.app.web.api_reference import READING_POSTS, ApiRoute, routes_by_topic
from pyroshock.schema.session import count_rows
from starlette.testclient import TestClient
from support.checks.well_formed import Page
from support.processes.web_client import post_json, sqlite, window


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    with window(sqlite(tmp_path_factory.mktemp("api")), works=False) as (client, _):
        yield client


def routes_of(client: TestClient) -> dict[tuple[str, str], ApiRoute]:
    topics = routes_by_topic(client.get("/api/openapi.json").json(), "http://lab")
    return {(route.method, route.path): route for topic in topics.values() for route in topic}


def test_every_route_has_its_place_in_the_list_and_a_page_of_its_own(client: TestClient) -> None:
    document = client.get("/api/openapi.json").json()
    page = Page(client.get("/api").text)
    operations = [
        (method.upper(), path) for path, methods in document["paths"].items() for method in methods
    ]
    routes = routes_of(client)
    assert sorted(routes) == sorted(operations)
    assert {route.anchor for route in routes.values()} <= {item.get("id") for item in page.of("li")}
    for words in ("X-CSRF-Token", "Authorization: Bearer TOKEN", "/api/openapi.json", "ps.open("):
        assert words in page.text
    for route in routes.values():
        own = client.get(f"/operations/{route.anchor}")
        assert own.status_code == 200, route.anchor
        Page(own.text)
        assert all(f"<code>{row.name}</code>" in own.text for row in route.fields)


def test_a_page_of_no_operation_is_not_found(client: TestClient) -> None:
    answer = client.get("/operations/get-api-nothing")
    assert answer.status_code == 404 and "the page /api lists them" in answer.text


def test_a_route_has_units_bounds_and_examples(client: TestClient) -> None:
    routes = routes_of(client)
    rows = {item.name: item for item in routes["GET", "/api/predict"].fields}
    assert rows["tank_pressure_pa"].unit == "Pa" and rows["tip_radius_m"].unit == "m"
    assert rows["draws"].bounds == "0 to 100000" and rows["draws"].default == "64"
    assert rows["insulator"].choices == ("none", "polymeric")
    material = {item.name: item for item in routes["POST", "/api/materials"].fields}
    assert material["youngs_modulus"].unit == "Pa"  # its name does not say so
    diagnose = routes["POST", "/api/diagnoses"]
    assert """-d '{"campaign": "NAME"}' 'http://lab/api/diagnoses'""" in diagnose.example.curl
    assert diagnose.example.python == """call("/api/diagnoses", {'campaign': 'NAME'})"""
    assert diagnose.example.client == 'store.diagnose("spring")'
    assert routes["GET", "/api/jobs/{job}"].example.curl == "curl 'http://lab/api/jobs/JOB'"
    assert routes["POST", "/api/ingest/upload"].example.python == ""


def test_a_plan_shows_the_fields_of_each_method(client: TestClient) -> None:
    plan = routes_of(client)["POST", "/api/plans"]
    assert {"lhs", "sobol", "factorial", "import"} <= set(plan.methods)
    text = {row.name: row for row in plan.fields}["table"]
    assert text.methods == ("import",) and text.required
    page = client.get(f"/operations/{plan.anchor}").text
    assert 'data-designs="import"' in page and "<option>sobol</option>" in page


def test_what_changes_the_store_is_confirmed_before_it_is_sent(client: TestClient) -> None:
    routes = routes_of(client)
    kinds = {key: route.kind for key, route in routes.items()}
    assert kinds["GET", "/api/impacts"] == kinds["POST", "/api/query"] == "reads"
    assert kinds["POST", "/api/materials"] == "changes" and kinds["POST", "/api/train"] == "job"
    assert all(kind == "reads" for (method, _), kind in kinds.items() if method == "GET")
    for route in routes.values():
        page = client.get(f"/operations/{route.anchor}").text
        takes_files = route.media.startswith("multipart/")
        assert ('id="try-confirm"' in page) == (route.kind != "reads" and not takes_files)


def test_a_post_that_reads_stores_nothing(tmp_path: Path) -> None:
    """The values are those of `test_every_door.EXAMPLES` that need nothing in the store."""
    bodies = {
        "query": {"statement": "select name from materials"},
        "series-spectrum": {
            "acceleration_m_s2": [0.0, 1.0, 0.0, -1.0],
            "sampling_rate_hz": 100.0,
            "frequency_hz": [10.0],
        },
        "calibrate": {
            "file": "reference,reading_v\n0,0.3626\n1,0.9248\n2,1.4862\n3,2.0491\n",
            "date": "2026-03-02",
            "reading_u": "1mV",
            "common_u": "5mbar",
        },
    }
    with window(sqlite(tmp_path), works=False) as (client, store):
        rows_before = count_rows(store)
        for name, body in bodies.items():
            declared = operation(name)
            _, address = declared.route or ("POST", f"/{name}")
            answer = post_json(client, f"/api{address}", body)
            assert answer.status_code == 200, answer.text
        assert count_rows(store) == rows_before
    assert set(bodies) < READING_POSTS


def test_the_calls_of_the_library_are_methods_that_it_has(client: TestClient) -> None:
    """Each method of the library that asks for an operation is an example, and each example is a
    call of a method that there is."""
    asked = {
        member.operation.name
        for owner in (ExperimentStore, PlanCollection)
        for member in vars(owner).values()
        if isinstance(member, PythonMethod)
    }
    assert asked <= set(CLIENT_CALLS) <= set(OPERATIONS)
    for call in CLIENT_CALLS.values():
        expression = ast.parse(call, mode="eval").body
        names = [part.attr for part in ast.walk(expression) if isinstance(part, ast.Attribute)]
        assert names and all(
            hasattr(ExperimentStore, name)
            or hasattr(PlanCollection, name)
            or name
            in ("predict", "tune", "quality", "between", "to_frame", "view", "cancel", "write")
            for name in names
        ), call


def test_a_guarded_server_says_that_every_request_needs_its_token(tmp_path: Path) -> None:
    with window(sqlite(tmp_path), works=False, token="only-for-this-test") as (
        client,
        _,
    ):  # of this test alone
        answer = client.get("/api", headers={"Authorization": "Bearer only-for-this-test"})
    assert "This server was started with" in answer.text and "only-for-this-test" not in answer.text


def test_footer_links_to_the_page(client: TestClient) -> None:
    assert '<a href="/api">API</a>' in client.get("/jobs").text
