"""In a browser: no control of any page leads to another server, and no page reaches one whatever it
is made to hold."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest
from pyroshock.app.documents.document import Document, Paragraph, Section
from pyroshock.app.documents.page import html_of
from support.processes.browsers import at, page_of, wait_drawn
from support.processes.served_pages import PAGES

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900), pytest.mark.usefixtures("quick_plates")]

#: Addresses that a click may lead to: of links (in drawings, too), of forms, and of buttons that
#: send them elsewhere.
_ADDRESSES = """[...document.querySelectorAll('a, area, form, [formaction]')]
  .map(e => e.formAction || e.action || (e.href?.baseVal ?? e.href) || '').filter(a => a)"""
#: Buttons that send no form; those of a form lead to its address. A click may take other buttons
#: away.
_CLICK_ALL = """[...document.querySelectorAll('main :is(button[type=button], summary)')]
  .filter(e => !e.closest('.chart-tools'))
  .forEach(e => e.isConnected && e.dispatchEvent(
    new MouseEvent('click', { bubbles: true, cancelable: true })))"""
_RECORD_OPENED = (
    "window.opened = []; window.open = (address) => { "
    "window.opened.push(String(address)); return null; };"
)


@pytest.fixture
def elsewhere() -> Iterator[tuple[str, list[str]]]:
    """Another server on this machine, by its address, and what it was asked."""
    requested_addresses: list[str] = []

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            requested_addresses.append(self.path)
            self.send_response(200)
            self.end_headers()

        do_POST = do_GET

        def log_message(self, *_: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{server.server_port}", requested_addresses
    server.shutdown()
    server.server_close()
    thread.join(10)


@pytest.mark.parametrize("name", PAGES)
def test_no_control_of_a_page_leads_to_another_server(
    browser: Any, lab: Any, address: Any, name: str
) -> None:
    """Every button is clicked, those of charts among them. `page_of` fails for every request to
    another server."""
    with page_of(browser, lab, accept_downloads=True) as page:
        page.add_init_script(_RECORD_OPENED)
        popups: list[str] = []
        page.context.on("page", lambda popup: popups.append(popup.url))
        at(page, address(name))
        foreign = [
            a for a in page.evaluate(_ADDRESSES) if not a.startswith((f"{lab.origin}/", "#", "/"))
        ]
        assert [a for a in foreign if a != lab.origin] == []
        page.evaluate(_CLICK_ALL)
        page.wait_for_timeout(300)
        assert page.url.startswith(f"{lab.origin}/")
        wait_drawn(page)
        assert popups == [] and page.evaluate("window.opened") == []


def test_charts_have_buttons_and_none_of_them_shares(browser: Any, lab: Any, address: Any) -> None:
    """Saving a chart makes a file of what the page holds, and asks nobody."""
    with page_of(browser, lab, accept_downloads=True) as page:
        at(page, address("compare"))
        tools = page.locator(".chart-tools").first
        for words in ("PNG", "SVG", "CSV"):
            with page.expect_download() as download:
                tools.get_by_role("button", name=words).click()
            assert download.value.url.startswith("blob:")
            assert Path(download.value.path()).stat().st_size > 1_000


#: Ways in which markup or a script of a page asks another server.
_ATTEMPTS = {
    "image": "const e = new Image(); e.src = a; document.body.append(e);",
    "script": "const e = document.createElement('script'); e.src = a; document.body.append(e);",
    "style": "const e = document.createElement('link'); e.rel = 'stylesheet'; e.href "
    "= a; document.head.append(e);",
    "frame": "const e = document.createElement('iframe'); e.src = a; document.body.append(e);",
    "fetch": "fetch(a, {mode: 'no-cors'}).catch(() => 0);",
    "beacon": "navigator.sendBeacon(a, 'x');",
    "form": "const e = document.createElement('form'); e.action = a; "
    "document.body.append(e); e.submit();",
    "font": "new FontFace('x', `url(${a})`).load().catch(() => 0);",
    "media": "const e = document.createElement('video'); e.src = a; document.body.append(e);",
    "object": "const e = document.createElement('object'); e.data = a; document.body.append(e);",
}


@pytest.mark.parametrize("attempt", _ATTEMPTS)
def test_a_page_that_tries_to_reach_another_server_is_stopped(
    browser: Any, lab: Any, elsewhere: tuple[str, list[str]], attempt: str
) -> None:
    url, requested_addresses = elsewhere
    context = browser.new_context()
    page = context.new_page()
    refused: list[str] = []
    page.on("console", lambda message: refused.append(message.text))
    page.goto(f"{lab.origin}/campaigns")
    page.evaluate(f"a => {{ {_ATTEMPTS[attempt]} }}", f"{url}/{attempt}")
    page.wait_for_timeout(500)
    context.close()
    assert requested_addresses == [] and any("Content Security Policy" in text for text in refused)


def test_the_other_server_is_reached_without_a_policy(
    browser: Any, elsewhere: tuple[str, list[str]]
) -> None:
    """The tests above and below can fail."""
    url, requested_addresses = elsewhere
    context = browser.new_context()
    page = context.new_page()
    page.set_content(f"<img src='{url}/image'>")
    page.wait_for_timeout(500)
    context.close()
    assert requested_addresses == ["/image"]


def test_a_report_in_a_file_asks_nobody_whatever_it_is_made_to_hold(
    browser: Any, elsewhere: tuple[str, list[str]], tmp_path: Path
) -> None:
    url, requested_addresses = elsewhere
    page_text = html_of(Document("Campaign", "spring", "x", {}, [Section("s", [Paragraph("p")])]))
    evil = (
        f"<img src='{url}/image'><script src='{url}/script'></script><iframe "
        f"src='{url}/frame'></iframe>"
        f"<link rel=stylesheet href='{url}/style'><form "
        f"action='{url}/form'><button>send</button></form>"
        f"<script>fetch('{url}/fetch')</script><style>body {{ background: "
        f"url({url}/background) }}</style>"
    )
    file = tmp_path / "report.html"
    file.write_text(page_text.replace("<main>", f"<main>{evil}"), encoding="utf-8")
    context = browser.new_context()
    page = context.new_page()
    page.goto(file.as_uri())
    page.locator("button").evaluate("button => button.click()")
    page.wait_for_timeout(500)
    context.close()
    assert requested_addresses == [] and "<main>" in page_text
