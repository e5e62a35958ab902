"""No page, script or report names another server."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from pyroshock.app.documents.document import Document
from pyroshock.app.documents.page import html_of
from support.stores.web_stores import Lab

WEB = Path(__file__).resolve().parents[3] / "app" / "web"
#: XML's names of vocabularies, which nobody asks.
_NAMESPACES = ("http://www.w3.org/",)
#: What a policy may allow: this server, and what the page itself holds.
_OWN = {"'none'", "'self'", "'unsafe-inline'", "data:", "blob:"}


def policy_of(text: str) -> dict[str, set[str]]:
    """Directive -> sources."""
    return {
        name: set(sources)
        for name, *sources in (part.split() for part in text.split(";") if part.strip())
    }


@pytest.mark.parametrize(
    "path", ["/", "/campaigns", "/api/campaigns", "/api", "/static/style.css", "/jobs/none", "/x"]
)
def test_every_answer_allows_no_foreign_address(empty: Lab, path: str) -> None:
    policy = policy_of(empty.client.get(path).headers["content-security-policy"])
    assert policy["default-src"] == {"'none'"} and policy["base-uri"] == {"'none'"}
    assert policy["frame-ancestors"] == {"'none'"} and policy["form-action"] == policy[
        "connect-src"
    ] == {"'self'"}
    assert policy["script-src"] == {"'self'"} and set().union(*policy.values()) <= _OWN


def test_a_report_in_a_file_allows_no_address_at_all() -> None:
    page = html_of(Document("Campaign", "spring", "", {}, []))
    (text,) = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', page)
    assert policy_of(text) == {
        "default-src": {"'none'"}, "style-src": {"'unsafe-inline'"}, "form-action": {"'none'"},
        "base-uri": {"'none'"}, "img-src": {"data:"}  # photographs lie within the page
    }  # fmt: skip
    assert page.index("http-equiv") < page.index("<title>"), (
        "a policy holds for what stands after it"
    )


@pytest.mark.parametrize(
    "file", sorted([*WEB.glob("static/*"), *WEB.glob("templates/*")]), ids=lambda file: file.name
)
def test_our_own_scripts_styles_and_templates_name_no_server(file: Path) -> None:
    addresses = re.findall(
        r"(?:https?:)?//[a-z0-9][\w.-]*\.[a-z]{2,}[^\s\"'`)]*", file.read_text(encoding="utf-8")
    )
    assert [address for address in addresses if not address.startswith(_NAMESPACES)] == []
