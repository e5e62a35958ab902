"""A client of the window, as a browser or a script speaks to it: the token of its session goes with
every write."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pyroshock.app.library.server_connection import ServerConnection
from pyroshock.app.server.application import application
from pyroshock.app.web.settings import Settings
from pyroshock.schema.session import Store, Writer, open_store
from starlette.testclient import TestClient

ADDRESS = "http://127.0.0.1:8000"
_TOKEN = re.compile(r'name="csrf" value="([0-9a-f]+)"')


@contextmanager
def window(db: str, **settings: Any) -> Iterator[tuple[TestClient, Store]]:
    """A client of an application over the store at `db`, which is made if there is none."""
    with open_store(db, Writer("test", "0"), create=True) as store:
        app = application(Settings(db, **settings), store)
        with TestClient(app, base_url=ADDRESS, follow_redirects=False) as client:
            yield client, store


class TestConnection(ServerConnection):
    """The connection of the Python library, whose requests a test client sends."""

    __test__ = False

    def __init__(self, client: TestClient) -> None:
        super().__init__(ADDRESS)
        self.client = client

    def _sent(self, method, target, body, headers):
        answer = self.client.request(method, target, content=body, headers=headers)
        self._keep_session(answer.headers.get_list("set-cookie"))
        kind = answer.headers.get("content-type", "").partition(";")[0]
        return answer.status_code, kind, answer.content


def token(client: TestClient) -> str:
    """The token of the client's session."""
    return str(client.get("/api/csrf").json()["token"])


def post(client: TestClient, address: str, form: dict[str, Any] | None = None, **more: Any) -> Any:
    """A form as a page sends it."""
    return client.post(address, data={"csrf": token(client), **(form or {})}, **more)


def post_json(client: TestClient, address: str, body: Any) -> Any:
    """A write as a script sends it."""
    return client.post(address, json=body, headers={"X-CSRF-Token": token(client)})


def ended(client: TestClient, answer: Any, patience_s: float = 90.0) -> dict[str, Any]:
    """The job that an answer leads to, once it has ended."""
    job = (
        answer.headers["location"].rsplit("/", 1)[1]
        if answer.status_code == 303
        else answer.json()["id"]
    )
    deadline = time.monotonic() + patience_s
    while time.monotonic() < deadline:
        found: dict[str, Any] = client.get(f"/api/jobs/{job}").json()
        if found["state"] in ("done", "failed", "stopped"):
            return found
        time.sleep(0.02)
    raise AssertionError(f"job {job} has not ended after {patience_s} s: {found}")


def token_in(page: str) -> str:
    """The token that a page's forms carry."""
    found = _TOKEN.search(page)
    assert found is not None, "no form with a token"
    return found[1]


def sqlite(folder: Path) -> str:
    """The address of a store in a folder."""
    return f"sqlite:///{folder}/lab.db"
