"""Filters as nobody means them, wherever a filter is taken: 400 with a line on pages and in the
API, one line on the command line and in the library. None is an error of the server."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any
from urllib.parse import quote, urlencode

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pyroshock.app.common.errors import PyroshockError
from pyroshock.app.common.filters import parse_where
from pyroshock.app.library.experiment_store import ExperimentStore
from pyroshock.app.operations.catalogue import operations
from pyroshock.app.server.application import _API, PAGES, application
from pyroshock.app.web.settings import Settings
from pyroshock.schema.conditions import ConditionError
from pyroshock.schema.session import Store
from starlette.testclient import TestClient
from support.processes.web_client import ADDRESS
from support.records.campaigns import hammer_campaign
from support.stores.stores import ingested, opened, pyroshock

MALFORMED = (
    "N*((((", "peak force>1N*((((", "peak_force>1kN*((((", "peak force>1(" + "(" * 40,
    "peak force>1" + ")" * 40,
    "tip radius=1mm'", "', ", ", ", ", ", ", ", "\"\"", "peak force>1 N**N",
    "peak force>1 10**10**10",
    "peak force>1 N**-99999", "peak force>1 N/0", "peak force>1 0/0*N", "peak force>1 N%N",
    "peak force>1 lambda",
    "peak force>1 N if N else N", "peak force>1 __import__('os')", "peak force>1 N;N",
    "peak force>1 N,N",
    "peak force>1 [N]", "peak force>1 {N}", "peak force>1 \u0661N", "peak force>1 \u202eN",
    "peak force>1 N\u0000",
    "tip_material=\u0000", "=", "==", ">=", "a", "<>", "!", "=steel", "peak force>1e999N",
    "peak force>1e",
    "peak force>1 1e400N", "peak_force_n>steel", "tip_material<steel", "campaign<spring",
    "quality=bad",
    "hardness=3", "peak_force_n=steel", "x" * 299, "\u0130=1", "tip radius=\u00bdmm",
)  # fmt: skip
_TEXT = st.text(max_size=60)
_PIECES = st.lists(
    st.sampled_from(
        [
            "peak force",
            "tip_radius",
            "tip_material",
            "campaign",
            "quality",
            "id",
            "=",
            "<",
            ">=",
            "!=",
            "1",
            "e9",
            "N",
            "mm",
            "(",
            ")",
            "*",
            "**",
            "/",
            "'",
            '"',
            "[",
            "{",
            "%",
            "\\",
            "#",
            "@",
            "$",
            " ",
            "\n",
            "½",
            "١",
            "\u202e",
            "é",
            "1kN",
        ]
    ),
    max_size=12,
).map("".join)
#: Of every route with a filter.
_PARTS = {"name": "hammer", "path": "x"}


@pytest.fixture(scope="module")
def store(new_database: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Store]:
    url = new_database()
    ingested(url, hammer_campaign(tmp_path_factory.mktemp("filters") / "hammer", recordings=1))
    with opened(url) as found:
        yield found


@pytest.fixture(scope="module")
def client(store: Store) -> Iterator[TestClient]:
    with ExitStack() as stack:
        app = application(Settings(store.engine.url.render_as_string(hide_password=False)), store)
        yield stack.enter_context(TestClient(app, base_url=ADDRESS, raise_server_exceptions=False))


def _routes(router: Any) -> Iterator[Any]:
    """Those of the router, and of the routers that it includes."""
    for route in router.routes:
        if (included := getattr(route, "original_router", None)) is None:
            yield route
        else:
            yield from _routes(included)


def _addresses() -> list[str]:
    """Every route that takes `where`, whatever is added later."""
    addresses = [
        f"/api{declared.route[1]}?"
        for declared in operations()
        if declared.route
        and declared.route[0] == "GET"
        and "where" in declared.request.model_fields
    ]
    # these read the whole request of their operation, as its JSON route does
    addresses += ["/explore?", "/explore/selection?"]
    for prefix, modules in (("", PAGES), ("/api", _API)):
        for route in (route for module in modules for route in _routes(module.router)):
            if "where" in {field.alias for field in route.dependant.query_params}:
                path = prefix + route.path.format_map(_PARTS)
                addresses.append(path + ("?what=impacts&" if path.endswith("/export") else "?"))
    return addresses


def test_the_routes_with_filters_are_these() -> None:
    assert sorted(_addresses()) == [
        "/api/explore?", "/api/impacts?", "/api/library/impacts?", "/api/library/shots?",
        "/api/shots?", "/campaigns/hammer/export?what=impacts&",
        "/compare?", "/explore/selection?", "/explore?", "/impacts?", "/shots?",
    ]  # fmt: skip


def _ask(client: TestClient, address: str, word: str) -> Any:
    query = urlencode({"where": word}, errors="surrogatepass")
    return client.get(address + query)


@pytest.mark.parametrize(
    "word", MALFORMED, ids=lambda word: quote(word, errors="surrogatepass")[:40]
)
def test_a_malformed_filter_is_400_with_a_line(client: TestClient, word: str) -> None:
    for address in _addresses():
        answer = _ask(client, address, word)
        assert answer.status_code == 400, (address, answer.status_code, answer.text[:300])
        if address.startswith("/api"):
            assert len(answer.json()["detail"].splitlines()) == 1


@given(
    st.one_of(
        _TEXT, _PIECES, _TEXT.map("peak force>1 ".__add__), _PIECES.map("peak force>1 ".__add__)
    )
)
@settings(
    max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_no_filter_is_a_fault_of_the_server(client: TestClient, word: str) -> None:
    for address in ("/api/impacts?", "/impacts?", "/api/shots?", "/explore?"):
        answer = _ask(client, address, word)
        assert answer.status_code in (200, 400, 404, 422), (address, answer.text[:300])


@given(
    st.one_of(
        _TEXT, _PIECES, _TEXT.map("tip radius=1".__add__), _PIECES.map("tip radius=1 ".__add__)
    )
)
@settings(max_examples=2_000, deadline=None)
def test_any_text_is_a_condition_or_an_error_that_says_so(word: str) -> None:
    try:
        parse_where((word,))
    except ConditionError as error:
        assert str(error) and len(str(error)) < 2_000


def test_the_command_line_and_the_library_refuse_in_one_line(store: Store) -> None:
    db = store.engine.url.render_as_string(hide_password=False)
    lines = {}
    for word in MALFORMED:
        for words in (("impacts",), ("shots",), ("export", "pulses", "--out", "x.csv")):
            result = pyroshock(*words, "--where", word, "--db", db)
            lines[word, words[0]] = (result.exit_code, result.stderr.count("\n"))
        with pytest.raises(PyroshockError):
            ExperimentStore(store, db).impacts(where=word)
    assert {asked: line for asked, line in lines.items() if line != (2, 1)} == {}
