"""The page that describes the API: every route with parameters, units, examples and the tokens that
it needs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from pyroshock.app.web.api_reference import routes_by_topic
from starlette.testclient import TestClient
from support.checks.well_formed import Page
from support.processes.web_client import sqlite, window


@pytest.fixture(scope="module")
def client(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    with window(sqlite(tmp_path_factory.mktemp("api")), works=False) as (client, _):
        yield client


def test_every_route_has_its_place_on_the_page(client: TestClient) -> None:
    document = client.get("/api/openapi.json").json()
    page = Page(client.get("/api").text)
    operations = [
        (method, path) for path, methods in document["paths"].items() for method in methods
    ]
    topics = routes_by_topic(document, "http://lab")
    routes = [route for topic in topics.values() for route in topic]
    assert sorted((route.method.lower(), route.path) for route in routes) == sorted(operations)
    assert {route.anchor for route in routes} <= {item.get("id") for item in page.of("details")}
    for words in ("X-CSRF-Token", "Authorization: Bearer TOKEN", "/api/openapi.json"):
        assert words in page.text


def test_a_route_has_units_and_examples(client: TestClient) -> None:
    topics = routes_by_topic(client.get("/api/openapi.json").json(), "http://lab")
    routes = {(route.method, route.path): route for topic in topics.values() for route in topic}
    units = {item.name: item.unit for item in routes["GET", "/api/predict"].fields}
    assert units["tank_pressure_pa"] == "Pa" and units["tip_radius_m"] == "m"
    diagnose = routes["POST", "/api/diagnoses"]
    assert """-d '{"campaign": "NAME"}' 'http://lab/api/diagnoses'""" in diagnose.curl
    assert diagnose.python == """call("/api/diagnoses", {'campaign': 'NAME'})"""
    assert routes["GET", "/api/jobs/{job}"].curl == "curl 'http://lab/api/jobs/JOB'"
    assert routes["POST", "/api/ingest/upload"].python == ""


def test_a_guarded_server_says_that_every_request_needs_its_token(tmp_path: Path) -> None:
    with window(sqlite(tmp_path), works=False, token="only-for-this-test") as (
        client,
        _,
    ):  # of this test alone
        answer = client.get("/api", headers={"Authorization": "Bearer only-for-this-test"})
    assert "This server was started with" in answer.text and "only-for-this-test" not in answer.text


def test_footer_links_to_the_page(client: TestClient) -> None:
    assert '<a href="/api">API</a>' in client.get("/jobs").text
