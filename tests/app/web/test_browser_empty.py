"""In a browser: every page of a store of nothing says what to do first, with a link that leads
there."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from pyroshock.app.server.application import PAGES
from pyroshock.schema.session import Writer, open_store
from support.processes.browsers import Lab, at, page_of, served

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

#: Address -> the sentence that says what to do next, and where its link leads; None where the step
#: is not made by a link.
NEXT_STEPS: dict[str, tuple[str, str | None]] = {
    "/": ("The store is empty.", "/ingest"),
    "/account": ("An administrator adds users on the page Users.", "/users"),
    "/api": ("The API does with JSON what the pages do.", "/api/openapi.json"),
    "/attachments": ("Nothing is attached yet.", "/campaigns"),
    "/audit": ("Nothing was changed yet", None),
    "/campaigns": ("The store is empty. Ingest a campaign", "/ingest"),
    "/compare": ("The store has no pulses yet. Ingest a campaign.", "/ingest"),
    "/compare/spectra": ("tick them in the list of impacts.", "/impacts"),
    "/datasets": ("There is no dataset yet. First ingest a campaign", "/ingest"),
    "/deleted": ("Nothing was deleted.", "/campaigns"),
    "/diagnoses": ("There is no campaign yet: ingest one.", "/ingest"),
    "/explore": ("Ingest a campaign", "/ingest"),
    "/impacts": ("The store has no impacts yet. Ingest a campaign.", "/ingest"),
    "/ingest": ("Nothing is recorded yet? Make a plan first.", "/plans/new"),
    "/jobs": ("No jobs yet. A job begins when you ingest a campaign", "/ingest"),
    "/models": ("No model is registered yet. First build a dataset", "/datasets"),
    "/models/compare": ("No model is registered yet. Train models first.", "/models/train"),
    "/models/train": ("There is no dataset yet. Build one", "/datasets"),
    "/notes": ("No tags yet.", "/campaigns"),
    "/plans": ("There is no plan yet.", "/plans/new"),
    "/plans/new": ("Make a plan", "/plans/new?kind=hammer"),
    "/search": ("Type words into the box", None),
    "/sign-in": ("This server needs no token. Go to its first page.", "/"),
    "/shots": ("The store has no shots of a gun yet. Ingest a campaign", "/ingest"),
    "/tune": ("There is no campaign of a gun yet: ingest one", "/ingest"),
    "/twin": ("Ingest a campaign to compare the bands with measured shots.", "/ingest"),
    "/users": ("No users yet. The first one should be an administrator.", "/audit"),
    "/validations": ("There is no campaign yet: ingest one.", "/ingest"),
}
#: They answer sliders and a rectangle with data, or lead to an identity provider and back.
NO_PAGE = {
    "/explore/selection", "/sign-in/provider", "/sign-in/provider/return", "/twin/answer"
}  # fmt: skip


@pytest.fixture(scope="module")
def nothing(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    """A served store of nothing."""
    folder = tmp_path_factory.mktemp("nothing")
    url = f"sqlite:///{folder / 'lab.db'}"
    with open_store(url, Writer("test", "0"), create=True):
        pass
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("MLFLOW_TRACKING_URI", raising=False)
        with served(url, Path(folder)) as lab:
            yield lab


def test_every_page_without_a_name_in_its_address_is_known_here() -> None:
    routes = [route for module in PAGES for route in module.router.routes]
    addresses = {route.path for route in routes if "GET" in route.methods and "{" not in route.path}
    assert addresses - NO_PAGE == set(NEXT_STEPS)


@pytest.mark.parametrize("address", NEXT_STEPS)
def test_page_of_an_empty_store_says_what_to_do_next(browser, nothing, address):
    sentence, target = NEXT_STEPS[address]
    with page_of(browser, nothing, width=390, height=844) as page:
        assert at(page, address).status == 200
        assert sentence in " ".join(page.inner_text("main").split())
        assert not page.evaluate(
            "document.documentElement.scrollWidth > document.documentElement.clientWidth"
        )
        if target is None:
            return
        link = page.locator(f'main a[href="{target}"]').last
        assert link.is_visible()
        link.click()
        page.wait_for_url(f"**{target}")
        assert page.request.get(page.url).status == 200
