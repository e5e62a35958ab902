"""The stores that reports are written of: each is filled once."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from pyroshock.schema.session import Store
from support.stores.hammer_stores import copied, filled_store, full_campaign
from support.stores.report_stores import ModelLab, model_lab, planned_store
from support.stores.stores import opened


@pytest.fixture(scope="session")
def fired(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The store of `planned_store`, which no test changes."""
    folder = tmp_path_factory.mktemp("planned")
    planned_store(folder)
    return folder / "lab.db"


@pytest.fixture
def planned(fired: Path, tmp_path: Path) -> str:
    """A gun plan of six runs of which four were fired, with one discarded, that a test may
    change."""
    return copied(fired, tmp_path)


@pytest.fixture(scope="session")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("filled")
    return filled_store(folder, full_campaign(folder / "hits", "hits"))


@pytest.fixture
def hits(filled: Path, tmp_path: Path) -> Iterator[Store]:
    """A store of four configurations with five pulses each, that a test may change."""
    with opened(copied(filled, tmp_path)) as store:
        yield store


@pytest.fixture(scope="session")
def lab(tmp_path_factory: pytest.TempPathFactory) -> ModelLab:
    """A registry with a law and a statistical model on both splits, and the pulses."""
    return model_lab(tmp_path_factory.mktemp("models"))
