"""Stores of these tests are made as a user's are."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest


@pytest.fixture(scope="module", autouse=True)
def revision_by_revision(quick_stores: Callable[..., None]) -> Iterator[None]:
    """Not by a copy of a store's tables."""
    from pyroshock.schema import session

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(session, "_check_revision", quick_stores)
        yield
