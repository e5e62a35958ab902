"""Registries for tests: MLflow's tables are made once and copied, for making them takes a second or
more."""

from __future__ import annotations

import atexit
import shutil
import sqlite3
import tempfile
from contextlib import closing
from functools import cache
from pathlib import Path

import numpy as np
from pyroshock.dataset.table import PulseTable
from pyroshock.training.fitting.fitting import TrainingContext, TrainingFigures
from pyroshock.training.registry import promotion
from pyroshock.training.registry.connection import EXPERIMENT
from pyroshock.training.registry.model_storage import storage_for
from pyroshock.training.registry.records import DatasetName
from pyroshock.training.registry.registry import Registry

from support.records.pulse_tables import pulse_table


def fresh_registry(folder: Path, store: str = "lab") -> Registry:
    """An empty registry beside the store `folder`/lab.db, with MLflow's tables in it."""
    registry = Registry(storage_for(f"sqlite:///{folder / store}.db", {}))
    database = registry.place.database
    assert database is not None
    shutil.copy(_template(), database)
    return at_its_place(registry)


def at_its_place(registry: Registry) -> Registry:
    """A registry whose database was copied to its place: what is trained from now on keeps its
    files there too."""
    database = registry.place.database
    assert database is not None
    with closing(sqlite3.connect(database)) as connection, connection:
        where = (registry.place.artifact_uri, EXPERIMENT)
        connection.execute("UPDATE experiments SET artifact_location = ? WHERE name = ?", where)
    return registry


@cache
def _template() -> Path:
    folder = Path(tempfile.mkdtemp(prefix="pyroshock-registry-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    registry = Registry(storage_for(f"sqlite:///{folder / 'lab.db'}", {}))
    with registry.connection.client():
        pass
    assert registry.place.database is not None
    return registry.place.database


def context_in(
    registry: Registry, table: PulseTable | None = None, name: str = "spring", seed: int = 0
) -> TrainingContext:
    """Three repetitions of 60 configurations; the hash tells tables of different names apart."""
    table = pulse_table(np.random.default_rng(1), repetitions=3) if table is None else table
    digest = "".join(f"{ord(letter) % 16:x}" for letter in name).ljust(64, "0")
    return TrainingContext(
        DatasetName(name, digest, "hammer"),
        table,
        seed,
        "reduced",
        registry.place.work,
        DrawnFigures(),
    )


def without_figures(monkeypatch) -> None:  # pytest's fixture
    """A training draws for a second; what it draws is tested with the figures."""
    drawing = "pyroshock.app.operations.train.registered_figures.RegisteredFigures"
    monkeypatch.setattr(f"{drawing}.of_model", DrawnFigures.of_model)
    monkeypatch.setattr(f"{drawing}.of_split", DrawnFigures.of_split)


class DrawnFigures(TrainingFigures):
    """Files of one word, in place of pictures."""

    def of_model(self, *_: object) -> dict[str, bytes]:
        return {"pulses.png": b"drawn"}

    def of_split(self, _: object, split: str) -> dict[str, bytes]:
        return {f"summary_{split}.png": b"drawn"}


def without_judging_the_first(monkeypatch) -> None:  # pytest's fixture
    """Judging a first model takes ten seconds, of a law that learns from all shots five times;
    forced, it is in use.

    `test_first_model_that_learned_nothing_of_other_configurations_is_refused` has it judged, and so
    has `test_campaign_to_promoted_model`.
    """
    monkeypatch.setattr(promotion, "updated_law_draws", _not_judged)


def _not_judged(*_: object) -> None:
    raise ValueError("no law is asked here")
