"""Where models live is the user's choice, also while another thread asks another registry."""

from __future__ import annotations

import os
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from pyroshock.training.registry.connection import user_environment
from pyroshock.training.registry.model_storage import VARIABLE, storage_for
from support.stores.registries import fresh_registry


def test_variable_of_the_user_is_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(VARIABLE, "sqlite:////elsewhere.db")
    with fresh_registry(tmp_path, "other").connection.client() as client:
        assert os.environ[VARIABLE] == "sqlite:////elsewhere.db"
        assert client.tracking_uri == f"sqlite:///{tmp_path / 'other-models.db'}"
    assert os.environ[VARIABLE] == "sqlite:////elsewhere.db"


def test_client_of_another_thread_does_not_show(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)
    registry = fresh_registry(tmp_path, "other")
    asking, answered = threading.Event(), threading.Event()

    def ask() -> None:
        with registry.connection.client():
            asking.set()
            answered.wait(10)

    with ThreadPoolExecutor(2) as pool:
        client = pool.submit(ask)
        assert asking.wait(30) and VARIABLE not in os.environ
        place = pool.submit(lambda: storage_for(f"sqlite:///{tmp_path / 'lab.db'}", user_environment()))
        assert not place.done()
        answered.set()
        client.result(30)
        assert place.result(30).database == tmp_path / "lab-models.db"
