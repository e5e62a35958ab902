"""Headless Chromium before a served window: what the tests of pages share.

Chromium is Debian's, `apt-get install chromium`; another one is named by PYROSHOCK_CHROMIUM.
"""

from __future__ import annotations

import os
import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
from pyroshock.app.server.application import application
from pyroshock.app.server.connections import server_options
from pyroshock.app.web.settings import Settings
from pyroshock.schema.session import Store, Writer, open_store

from support.missing import needs_program

ARGUMENTS = ("--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking")
#: A busy machine is given so many times the patience.
SLOW = float(os.environ.get("PYROSHOCK_SLOW", "1"))
PATIENCE_MS = 30_000 * SLOW
#: A chart that is not there yet.
_UNDRAWN = "[data-figure]:not([data-drawn])"
#: The folder that screenshots of the documentation go to; none are taken without it.
SCREENSHOTS = os.environ.get("PYROSHOCK_SCREENSHOTS")


def chromium() -> str:
    """Where Chromium is; skips the test without one."""
    if named := os.environ.get("PYROSHOCK_CHROMIUM"):
        return named
    return needs_program("chromium", "chromium-browser", "google-chrome")


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """A browser with an empty profile, of this module alone: its event loop stops with it."""
    path = chromium()
    from playwright import sync_api as sync

    with sync.sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=path, args=list(ARGUMENTS))
        yield started
        started.close()


@dataclass
class Lab:
    """A served window: its address, its store, and the folder below which it ingests."""

    origin: str
    store: Store
    folder: Path
    db: str

    def reading(self) -> Any:
        return self.store.reading()


@contextmanager
def served(db: str, folder: Path, port: int = 0, **settings: Any) -> Iterator[Lab]:
    """The application over a store, on this port or a free one, in a thread of its own."""
    import uvicorn

    tcp = socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP  # as `serve` listens
    with open_store(db, Writer("browser", "0")) as store, socket.socket(*tcp) as listener:
        listener.bind(("127.0.0.1", port))
        served_as = Settings(db, folders=(folder,), **settings)
        app = application(served_as, store)
        server = uvicorn.Server(uvicorn.Config(app, **server_options(served_as)))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]}, daemon=True)
        thread.start()
        until(lambda: server.started or not thread.is_alive(), 60 * SLOW)
        assert server.started, "the server has not started"
        try:
            yield Lab(f"http://127.0.0.1:{listener.getsockname()[1]}", store, folder, db)
        finally:
            server.should_exit = True
            thread.join(30 * SLOW)


def until(true: Callable[[], bool], patience_s: float = PATIENCE_MS / 1e3) -> None:
    """Ask again and again, until it is so or the patience ends."""
    deadline = time.monotonic() + patience_s
    while not true() and time.monotonic() < deadline:
        time.sleep(0.02)


@dataclass
class Watch:
    """What a page must not do: err in its console, ask another server, miss a file."""

    origin: str
    found: list[str] = field(default_factory=list)

    def over(self, context: Any) -> None:
        context.on("console", self._said)
        context.on("weberror", lambda error: self.found.append(f"error: {error.error}"))
        context.on("request", self._asked)
        context.on("response", self._answered)

    def _said(self, message: Any) -> None:
        # that a page itself was refused is for its test to expect; a missing file is told by its
        # response
        if message.type in ("error", "warning") and not message.text.startswith(
            "Failed to load resource"
        ):
            self.found.append(f"console: {message.text}")

    def _asked(self, request: Any) -> None:
        if not request.url.startswith((self.origin + "/", "data:", "blob:")):
            self.found.append(f"asked elsewhere: {request.url}")

    def _answered(self, response: Any) -> None:
        # the form shows them, and so does a page that tries a request of the API; 404 is of a name
        # that the store does not have
        tried = response.status == 422 and "/operations/" in response.frame.url
        faults = tried or (
            response.status in (404, 422) and "x-pyroshock-form" in response.request.headers
        )
        if response.status >= 400 and not faults and not response.request.is_navigation_request():
            self.found.append(f"{response.status}: {response.url}")


@contextmanager
def page_of(
    browser: Any, lab: Lab, *, width: int = 1280, height: int = 900, **more: Any
) -> Iterator[Any]:
    """A page of an empty profile; fails at its end if anything in it erred or asked another
    server."""
    watch = Watch(lab.origin)
    viewport = {"width": width, "height": height}
    context = browser.new_context(
        viewport=viewport, base_url=lab.origin, reduced_motion="reduce", **more
    )
    context.set_default_timeout(PATIENCE_MS)
    watch.over(context)
    page = context.new_page()
    try:
        yield page
    finally:
        context.close()
    assert not watch.found, watch.found


def at(page: Any, address: str) -> Any:
    """Go there, and wait until every chart is drawn; gives the answer of the server."""
    answer = page.goto(address)
    wait_drawn(page)
    return answer


def sign_in(page: Any, lab: Lab, name: str, password: str) -> None:
    """A person signs in, and sees the first page."""
    page.goto(lab.origin + "/sign-in")
    page.fill("#name", name)
    page.fill("#password", password)
    page.click("#sign-in-user button")
    until(lambda: page.url == lab.origin + "/", 30)


def wait_drawn(page: Any) -> None:
    """By selectors, which the page's own policy lets through; a function to wait for would be
    evaluated in it."""
    from playwright.sync_api import expect

    page.wait_for_load_state()
    expect(page.locator(_UNDRAWN)).to_have_count(0, timeout=PATIENCE_MS)


def ended(page: Any, patience_s: float = 120.0) -> dict[str, Any]:
    """The job whose page is open, once the page says that it has ended."""
    page.wait_for_url("**/jobs/*")
    states = ",".join(f"#job[data-state={state}]" for state in ("done", "failed", "stopped"))
    page.wait_for_selector(states, timeout=patience_s * 1e3 * SLOW)
    return asked(page, f"/api/jobs/{page.url.rsplit('/', 1)[1]}")


def asked(page: Any, address: str) -> Any:
    """The JSON API, as a script of this page's session asks it."""
    answer = page.request.get(address)
    assert answer.ok, f"{answer.status}: {answer.text()}"
    return answer.json()


def drawn(page: Any, chart: str) -> Any:
    """The series that a chart has: kind, name, numbers."""
    return page.evaluate("id => document.querySelector(`#${CSS.escape(id)} .plot`).data", chart)


def screenshot(page: Any, name: str, height: int | None = None) -> None:
    """For the documentation, where it is asked for: 1280 wide, of few colours, so that it stays
    small."""
    if SCREENSHOTS is None:
        return
    from PIL import Image

    folder = Path(SCREENSHOTS)
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"web-{name}.png"
    if height is not None:
        page.set_viewport_size({"width": 1280, "height": height})
        wait_drawn(page)
    page.evaluate("window.scrollTo(0, 0)")
    page.screenshot(path=path, animations="disabled")
    with Image.open(path) as whole:
        few = whole.convert("RGB").quantize(128, dither=Image.Dither.NONE)
    few.save(path, optimize=True)
    assert path.stat().st_size < 250_000, f"{path} has {path.stat().st_size} bytes"
