"""What a page with charts weighs on the wire, and what a browser keeps of it."""

from __future__ import annotations

import re

import pytest
from support.stores.web_stores import Lab

#: Bytes of all scripts of a page, and of a page with everything that it asks for, compressed.
SCRIPTS, PAGE = 400_000, 500_000


def sent_bytes(answer) -> int:
    """As they travel: the client has unpacked the content."""
    assert answer.status_code == 200, answer.text
    return int(answer.headers["content-length"])


def parts_of(page: str) -> list[str]:
    """Scripts, styles and pictures that a page asks for."""
    return re.findall(r'(?:src|href)="(/static/[^"]+)"', page)


@pytest.mark.parametrize(
    "address", ["/impacts/1", "/compare", "/explore", "/twin", "/plans/autumn%2F1"]
)
def test_a_page_with_charts_is_small(filled: Lab, address: str) -> None:
    page = filled.client.get(address)
    parts = {part: sent_bytes(filled.client.get(part)) for part in parts_of(page.text)}
    scripts = sum(size for part, size in parts.items() if ".js?" in part)
    assert {"figure.js", "charts.js", "style.css"} <= {
        re.sub(r"^/static/|\?.*$", "", part) for part in parts
    }
    assert page.headers["content-encoding"] == "gzip"
    assert scripts < SCRIPTS
    assert sent_bytes(page) + sum(parts.values()) < PAGE


def test_a_browser_asks_for_a_file_of_this_content_once(filled: Lab) -> None:
    parts = parts_of(filled.client.get("/impacts/1").text)
    assert len(parts) > 4
    for part in parts:
        answer = filled.client.get(part)
        assert answer.headers["content-encoding"] == "gzip"
        assert "immutable" in answer.headers["cache-control"]
        tag = answer.headers["etag"]
        plain = part.partition("?")[0]
        assert filled.client.get(plain).headers["cache-control"] == "no-cache"
        again = filled.client.get(plain, headers={"if-none-match": tag})
        assert (again.status_code, again.content) == (304, b"")


def test_who_reads_no_gzip_gets_the_same_text(filled: Lab) -> None:
    for address in ("/static/style.css", "/impacts/1"):
        packed = filled.client.get(address, headers={"accept-encoding": "gzip"})
        plain = filled.client.get(address, headers={"accept-encoding": "identity"})
        assert "content-encoding" not in plain.headers
        assert packed.headers["content-encoding"] == "gzip"
        assert packed.headers["vary"].lower() == "accept-encoding"
        assert packed.text == plain.text


def test_a_file_that_is_not_there_is_not_found(filled: Lab) -> None:
    for name in ("none.js", "..%2Fguard.py", "%2e%2e/guard.py"):
        assert filled.client.get(f"/static/{name}").status_code == 404
