"""A page is made once for all readers, and shows what another process has stored right after."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from pyroshock.app.server import application as server
from pyroshock.app.web.page_sources import PageSource
from pyroshock.app.web.settings import Settings
from pyroshock.schema.session import Writer, open_store
from pyroshock.training.registry.model_storage import storage_for
from sqlalchemy import event
from starlette.testclient import TestClient
from support.processes.web_client import ADDRESS, post, token_in
from support.records.campaigns import hammer_campaign
from support.stores.stores import CLI
from support.stores.web_stores import DATASET, HAMMER, PLAN, Lab

pytestmark = pytest.mark.timeout(600)
AT = PLAN.replace("/", "%2F")
#: A page for each route that says what it rests on; `test_every_kept_page_is_tested` counts them.
PAGES = (
    "/campaigns", f"/campaigns/{HAMMER}", f"/campaigns/{HAMMER}/facts",
    "/impacts", "/impacts/1", "/shots", "/compare",
    "/compare/spectra?impacts=1", "/models", "/models/compare?version=linear@1&version=tree@1",
    "/models/linear/1", "/datasets", f"/datasets/{DATASET}", "/plans", f"/plans/{AT}",
    f"/plans/{AT}/sheet", "/diagnoses", "/diagnoses/1", "/diagnoses/1/figures", "/twin",
    "/notes", "/attachments", "/explore", "/explore/selection?select_y=0:1e9",
)  # fmt: skip
#: What pages of reading may not load: each takes tenths of seconds and tens of megabytes.
HEAVY = ("torch", "mlflow", "pandas", "matplotlib", "sklearn", "pyarrow", "gpytorch", "pint")

#: Reads pages of a store and prints what the process has loaded of the heavy libraries.
READER = """
import json, sys
from pyroshock.app.server.application import application
from pyroshock.app.web.settings import Settings
from pyroshock.schema.session import Writer, open_store
from starlette.testclient import TestClient
db, addresses, heavy = sys.argv[1], sys.argv[2].split(), sys.argv[3].split()
with open_store(db, Writer("test", "0")) as store:
    with TestClient(application(Settings(db, works=False), store),
                    base_url="http://127.0.0.1:8000") as client:
        statuses = {address: client.get(address).status_code for address in addresses}
print(json.dumps([statuses, [name for name in heavy if name in sys.modules]]))
"""


def _run(*words: str, cwd: Path) -> str:
    environment = {
        name: value for name, value in os.environ.items() if not name.startswith("MLFLOW")
    }
    process = subprocess.run(words, cwd=cwd, env=environment, capture_output=True, text=True)
    assert process.returncode == 0, process.stderr
    return process.stdout


def _statements(lab: Lab, address: str) -> int:
    """Statements that the store is asked for a page; those of the worker that looks for jobs do
    not count."""
    count = 0

    def add(*_: object) -> None:
        nonlocal count
        count += threading.current_thread().name != "pyroshock worker"

    event.listen(lab.store.engine, "before_cursor_execute", add)
    assert lab.client.get(address).status_code == 200, address
    event.remove(lab.store.engine, "before_cursor_execute", add)
    return count


def test_every_kept_page_is_tested() -> None:
    routes = [route for module in server.PAGES for route in module.router.routes]
    kept_routes = [
        route
        for route in routes
        if any(isinstance(needed.dependency, PageSource) for needed in route.dependencies)
    ]
    assert len(kept_routes) == len(PAGES)


@pytest.mark.parametrize("address", PAGES)
def test_a_page_that_stays_the_same_is_not_made_again(filled: Lab, address: str) -> None:
    assert _statements(filled, address) > 0
    assert _statements(filled, address) == 0


def test_a_page_shows_at_once_what_another_process_has_stored(filled: Lab) -> None:
    def shown() -> tuple[bool, bool]:
        addresses = "/campaigns", "/impacts?campaign=elsewhere"
        campaigns, impacts = (filled.client.get(address).text for address in addresses)
        return "elsewhere" in campaigns, "/impacts/22" in impacts

    assert shown() == shown() == (False, False)
    folder = hammer_campaign(filled.folder / "elsewhere", 1, name="elsewhere")
    _run(*CLI, "ingest", str(folder), "--jobs", "1", "--db", filled.db, cwd=filled.folder)
    assert shown() == (True, True)


def test_a_page_shows_at_once_what_this_server_has_stored(filled: Lab) -> None:
    assert "from-here" not in filled.client.get("/datasets").text
    form = {"impact": ["1", "2", "3"], "dataset": "from-here"}
    assert post(filled.client, "/impacts/dataset", form).status_code == 303
    assert "from-here" in filled.client.get("/datasets").text


def test_a_page_shows_at_once_that_a_file_of_a_model_was_altered(filled: Lab) -> None:
    page = filled.client.get("/models").text
    assert "damaged" not in page and filled.client.get("/models").text == page
    place = storage_for(filled.db, {})
    file = next(place.folder.rglob("held_out.npz"))
    content = file.read_bytes()
    file.write_bytes(content[:-1] + bytes([content[-1] ^ 1]))
    altered = filled.client.get("/models").text
    file.write_bytes(content)
    assert altered != page
    assert "damaged" in altered or "not those" in altered


def test_each_reader_has_a_token_of_its_own(filled: Lab) -> None:
    first_client, second_client = (
        TestClient(filled.client.app, base_url=ADDRESS, follow_redirects=False) for _ in range(2)
    )
    pages = [client.get("/impacts").text for client in (first_client, second_client)]
    tokens = [token_in(page) for page in pages]
    assert tokens[0] != tokens[1]
    assert pages[0].replace(tokens[0], tokens[1]) == pages[1]
    form = {"impact": "1", "csrf": tokens[0]}
    assert first_client.post("/impacts/compare", data=form).status_code == 303
    assert second_client.post("/impacts/compare", data=form).status_code == 403


def test_who_reads_no_gzip_gets_the_same_page(filled: Lab) -> None:
    for address in ("/impacts/1", "/impacts"):
        packed, plain = (
            filled.client.get(address, headers={"accept-encoding": encoding})
            for encoding in ("gzip", "identity")
        )
        assert packed.headers["content-encoding"] == "gzip"
        assert "content-encoding" not in plain.headers
        assert packed.text == plain.text
        assert int(packed.headers["content-length"]) < len(plain.content) / 2


def test_pages_of_reading_load_no_heavy_library(filled: Lab, tmp_path: Path) -> None:
    pages = ("/", "/jobs", "/deleted", "/validations", "/api/impacts", *PAGES)
    words = (sys.executable, "-c", READER, filled.db, " ".join(pages), " ".join(HEAVY))
    statuses, loaded = json.loads(_run(*words, cwd=tmp_path))
    assert set(statuses.values()) == {200}, statuses
    assert loaded == []


def test_a_page_that_is_not_there_is_told_each_time(filled: Lab) -> None:
    for _ in range(2):
        answer = filled.client.get("/impacts/4000")
        assert answer.status_code == 404 and "4000" in answer.text


def test_a_fault_of_the_software_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from pyroshock.app.pages import campaigns

    def fail(*_: object, **__: object) -> None:
        raise AssertionError("a plate is missing")

    monkeypatch.setattr(campaigns, "page", fail)
    db = f"sqlite:///{tmp_path}/lab.db"
    with open_store(db, Writer("test", "0"), create=True) as store:
        app = server.application(Settings(db, works=False), store)
        client = TestClient(app, base_url=ADDRESS, raise_server_exceptions=False)
        answer = client.get("/campaigns")
    assert answer.status_code == 500 and re.search("fault.*a plate is missing", answer.text)
