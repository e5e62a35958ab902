"""In a browser: a person attaches a photograph to a campaign and to a run, sees it, and an engineer
removes it and puts it back."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.processes.browsers import Lab, at, browser, page_of, served, sign_in, until
from support.records.attached_files import HTML, PDF, picture, png_of_size
from support.stores.stores import run_pyroshock
from support.stores.team import PASSWORD, team_of

__all__ = ["browser"]

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]

RULES = {"runOnly": {"type": "tag", "values": ["wcag2a", "wcag2aa"]}}
_SCROLLS = "document.documentElement.scrollWidth > document.documentElement.clientWidth"
_OPEN = "document.querySelectorAll('details').forEach(e => { e.open = true; })"
#: Pixels of a picture that the browser has drawn; 0 of one that it could not.
_DRAWN = "document.querySelector('.pictures img')?.naturalWidth || 0"
PLACES = {
    "campaign": "/campaigns/spring",
    "run": "/plans/autumn/sheet?run=2",
    "impact": "/impacts/1",
    "plan": "/plans/autumn",
}


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    folder = tmp_path_factory.mktemp("attachments")
    people = {"olaf": "operator", "emma": "engineer"}
    with team_of(folder, people, recordings=1, hits=2) as team:
        db = team.db
    with served(db, folder, asks_people=True) as window:
        yield window


def chosen(page: Any, kind: str, name: str, content: bytes) -> None:
    """The form of a page with a file in it."""
    page.evaluate(_OPEN)
    file = {"name": name, "mimeType": "application/octet-stream", "buffer": content}
    page.set_input_files(f"#attach-file-{kind}", files=[file])


@pytest.mark.parametrize("kind", PLACES)
def test_a_photograph_is_attached_seen_removed_and_put_back(
    browser: Any, lab: Lab, kind: str
) -> None:
    with page_of(browser, lab) as page:
        sign_in(page, lab, "olaf", PASSWORD)
        at(page, PLACES[kind])
        chosen(page, kind, "plate.jpg", picture("JPEG", (900, 600), "teal"))
        page.fill(f"#attach-caption-{kind}", f"the plate of the {kind}")
        page.click(f"#attach-{kind} button")
        page.get_by_text(f"the plate of the {kind}").wait_for()
        page.eval_on_selector(f"#attachments-{kind}", "e => e.scrollIntoView()")
        until(lambda: page.evaluate(_DRAWN) == 640, 30)
        assert "plate.jpg" in page.inner_text(".pictures figcaption")
    with page_of(browser, lab) as page:
        sign_in(page, lab, "emma", PASSWORD)
        at(page, PLACES[kind])
        page.evaluate(_OPEN)
        page.fill(".pictures input[name=reason]", "another plate")
        page.click(".pictures form button")
        page.get_by_text("plate.jpg was removed").wait_for()
        assert page.query_selector(".pictures") is None
        page.evaluate(_OPEN)
        page.get_by_role("button", name="Restore plate.jpg").click()
        page.locator(".pictures img").wait_for()


def test_what_is_refused_is_told_beside_the_file_and_what_was_typed_stays(
    browser: Any, lab: Lab
) -> None:
    with page_of(browser, lab) as page:
        sign_in(page, lab, "olaf", PASSWORD)
        at(page, "/campaigns/spring")
        chosen(page, "campaign", "photo.png", HTML)
        page.fill("#attach-caption-campaign", "a caption")
        page.click("#attach-campaign button")
        until(lambda: page.query_selector("#attach-campaign .field-error") is not None, 30)
        assert "it is HTML, SVG or XML" in page.inner_text("#attach-campaign .field-error")
        assert page.input_value("#attach-caption-campaign") == "a caption"


def test_pages_with_attachments_are_read_by_everyone_at_any_width(
    browser: Any, lab: Lab, tmp_path: Path
) -> None:
    from axe_playwright_python.sync_playwright import Axe

    long = "a word " * 40 + "x" * 300
    for name, content in (
        ("a" * 190 + ".png", picture("PNG", (2000, 100))),
        ("huge.png", png_of_size(40_000, 30_000)),
        ("sensor.pdf", PDF),
    ):
        (tmp_path / name).write_bytes(content)
        for words in (("--campaign", "spring"), ("--run", "autumn/2"), ("--impact", "1")):
            run_pyroshock(
                "attachments", "add", tmp_path / name, *words, "--caption", long, "--db", lab.db
            )
    with page_of(browser, lab) as page:
        sign_in(page, lab, "olaf", PASSWORD)
        for address in (*PLACES.values(), "/attachments"):
            assert at(page, address).status == 200
            page.evaluate(_OPEN)
            for scheme in ("light", "dark"):
                page.emulate_media(color_scheme=scheme)
                page.set_viewport_size({"width": 1280, "height": 900})
                axe_results = Axe().run(page, options=RULES)
                assert axe_results.violations_count == 0, (
                    f"{address} {axe_results.generate_report()}"
                )
                for width in (390, 1400):
                    page.set_viewport_size({"width": width, "height": 844})
                    until(lambda: not page.evaluate(_SCROLLS), 10)
                    assert not page.evaluate(_SCROLLS), f"{address} scrolls at {width}"
