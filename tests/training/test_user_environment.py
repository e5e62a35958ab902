"""Where models live is the user's choice, also while another thread asks another registry."""

from __future__ import annotations

import os
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from pyroshock.training.model_storage import VARIABLE, place_beside
from pyroshock.training.registry.connection import user_environment
from support.stores.registries import fresh_registry


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
        assert asking.wait(30) and VARIABLE in os.environ
        place = pool.submit(lambda: place_beside(f"sqlite:///{tmp_path / 'lab.db'}", user_environment()))
        assert not place.done()
        answered.set()
        client.result(30)
        assert place.result(30).database == tmp_path / "lab-models.db"
