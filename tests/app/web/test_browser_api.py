"""In a browser: the pages of the API find an operation, and send its request."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from pyroshock.schema.session import Writer, open_store
from support.processes.browsers import Lab, asked, at, page_of, served

pytestmark = [pytest.mark.slow, pytest.mark.timeout(300)]

_SCROLLS = "document.documentElement.scrollWidth > document.documentElement.clientWidth"
_SHOWN = "document.querySelectorAll('[data-words]:not([hidden])').length"


@pytest.fixture
def fresh(tmp_path: Path) -> Iterator[Lab]:
    """A served store of nothing."""
    url = f"sqlite:///{tmp_path / 'lab.db'}"
    with open_store(url, Writer("test", "0"), create=True):
        pass
    with served(url, tmp_path) as lab:
        yield lab


def answered(page: Any) -> str:
    """What is said of an answer, once it is there."""
    page.wait_for_selector("#try-answer:not([hidden])")
    return page.inner_text("#try-status")


def test_search_shows_the_operations_that_have_all_words(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/api")
        every = page.evaluate(_SHOWN)
        page.fill("#api-words", "PREVIEW smoothing")
        assert 0 < page.evaluate(_SHOWN) < every
        assert page.locator("#post-api-impacts-impact-preview").is_visible()
        assert page.inner_text("#search-count").startswith(f"{page.evaluate(_SHOWN)} of {every}")
        page.fill("#api-words", "no such words")
        assert page.evaluate(_SHOWN) == 0 and page.locator("#topic-jobs").is_hidden()
        page.fill("#api-words", "")
        assert page.evaluate(_SHOWN) == every
        page.click("#get-api-impacts a")
        page.wait_for_url("**/operations/get-api-impacts")


def test_a_read_is_sent_at_once_and_its_answer_can_be_folded(browser, lab):
    with page_of(browser, lab, width=390, height=844) as page:
        at(page, "/operations/get-api-impacts")
        page.fill("#try-limit", "3")
        page.fill("#try-where", "peak_force_n > 1\ntip_material = steel")
        assert page.inner_text("#try-request") == (
            "GET /api/impacts?where=peak_force_n+%3E+1&where=tip_material+%3D+steel&limit=3"
        )
        page.click("#try-send")
        assert answered(page).startswith("Status 200, ")
        answer = asked(page, "/api/impacts?where=peak_force_n>1&where=tip_material=steel&limit=3")
        tree = page.locator("#try-tree > details")
        assert tree.locator("> summary").inner_text() == f"list of {len(answer)}"
        first = tree.locator("> details").first
        assert first.locator(".api-leaf").count() == 0  # what is folded is not made
        first.locator("> summary").click()
        first.locator(".api-leaf").first.wait_for()  # a browser tells of the unfolding afterwards
        assert f"id: {answer[0]['id']}" in first.inner_text()
        assert not page.evaluate(_SCROLLS)


def test_a_name_of_the_path_is_needed(browser, lab):
    with page_of(browser, lab) as page:
        at(page, "/operations/get-api-impacts-impact")
        page.click("#try-send")
        assert page.get_attribute("#try-impact", "aria-invalid") == "true"
        assert page.locator("#try-answer").is_hidden()
        page.fill("#try-impact", "1")
        page.click("#try-send")
        assert answered(page).startswith("Status 200")


def test_a_change_is_sent_once_it_is_confirmed(browser, fresh):
    values = {
        "name": "bronze",
        "youngs_modulus": "110 GPa",
        "poisson_ratio": "0.34",
        "density": "8800",
        "yield_strength": "3e8",
        "source": "data sheet 3",
    }
    with page_of(browser, fresh) as page:
        at(page, "/operations/post-api-materials")
        for name, value in values.items():
            page.locator(f"#try-{name}").evaluate(
                "e => { const d = e.closest('details'); if (d) d.open = true; }"
            )
            page.fill(f"#try-{name}", value)
        page.click("#try-send")
        names = [row["name"] for row in asked(page, "/api/materials")]
        assert page.locator("#try-confirm").is_visible() and "bronze" not in names
        page.click("#try-no")
        assert page.locator("#try-confirm").is_hidden()
        page.click("#try-send")
        page.click("#try-yes")
        assert answered(page).startswith("Status 200"), page.inner_text("#try-tree")
        stored = {row["name"]: row for row in asked(page, "/api/materials")}["bronze"]
        assert stored["youngs_modulus_pa"] == pytest.approx(110e9)
        assert stored["density_kg_m3"] == pytest.approx(8800)


def test_long_work_leads_to_the_page_of_its_job(browser, fresh):
    with page_of(browser, fresh) as page:
        at(page, "/operations/post-api-plans")
        page.select_option("#try-method", "factorial")
        assert '"method": "factorial"' in page.inner_text("#try-body")
        page.fill("#try-name", "tried")
        page.locator("#try-form details").first.evaluate("e => { e.open = true; }")
        page.select_option("#try-kind", "hammer")
        assert page.locator("[data-designs='import']").first.is_hidden()
        page.click("#try-send")
        page.click("#try-yes")
        assert answered(page).startswith("Status 200")
        page.click("#try-link a")
        page.wait_for_selector("#job[data-state=done]")


def test_a_refusal_is_shown_with_its_words(browser, lab):
    context = browser.new_context(base_url=lab.origin)
    try:
        page = context.new_page()
        at(page, "/operations/get-api-impacts")
        page.fill("#try-campaign", "none-of-that-name")
        page.click("#try-send")
        assert answered(page).startswith("Status 404")
        assert "none-of-that-name" in page.inner_text("#try-tree")
    finally:
        context.close()
