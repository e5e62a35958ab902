"""In a browser: single sign-on at a provider of another site, from whose page the browser comes
back; and the pages of a reader, whose forms are disabled."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from typing import Any

import pytest
from pyroshock.app.operations.people.stored_identities import invite
from pyroshock.app.operations.people.stored_users import add_user
from pyroshock.app.web.sign_on.settings import SignOnSettings
from support.processes.browsers import Lab, browser, served
from support.processes.identity_provider import CLIENT, SECRET, TestProvider, running_provider
from support.processes.web_client import sqlite
from support.stores.stores import opened

__all__ = ["browser"]

pytestmark = [pytest.mark.slow, pytest.mark.timeout(600)]
PASSWORD = "four quiet grey herons"


@pytest.fixture(scope="module")
def provider() -> Iterator[TestProvider]:
    """`localhost` is another site than 127.0.0.1, to a browser."""
    with running_provider("localhost") as running:
        running.shows_page = True
        yield running


@pytest.fixture(scope="module")
def lab(provider: TestProvider, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    folder = tmp_path_factory.mktemp("people")
    db = sqlite(folder)
    with opened(db, create=True) as store, store.writing() as session:
        invite(session, "anna", "anna", "engineer", None)
        add_user(session, "rita", "reader", PASSWORD)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    sign_on = SignOnSettings(
        provider.issuer, CLIENT, f"http://127.0.0.1:{port}", client_secret=SECRET
    )
    with served(db, folder, port, sign_on=sign_on) as window:
        yield window


def test_the_page_that_was_asked_for_opens_after_the_provider(browser: Any, lab: Lab) -> None:
    """The strict cookie of the session is sent with it, though another site led here."""
    with browser.new_context() as context:
        page = context.new_page()
        page.goto(f"{lab.origin}/plans/new")
        page.click("#sign-in-provider")
        page.click("#go")
        page.wait_for_selector("form#make")
        assert page.url == f"{lab.origin}/plans/new"
        page.goto(f"{lab.origin}/account")
        assert "anna" in page.inner_text("#who")
        page.click("#sign-out button >> nth=0")
        page.wait_for_selector("#sign-in-provider")


def test_a_reader_sees_a_disabled_form_with_the_role_that_it_needs(browser: Any, lab: Lab) -> None:
    with browser.new_context() as context:
        page = context.new_page()
        page.goto(f"{lab.origin}/plans/new")
        page.fill("#name", "rita")
        page.fill("#password", PASSWORD)
        page.click("#sign-in-user button")
        page.wait_for_selector("form#make")
        assert page.is_disabled("form#make button >> nth=0")
        assert "This needs the role engineer" in page.inner_text("p.lacking-role >> nth=0")
