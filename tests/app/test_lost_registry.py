"""The store knows which versions were registered: a lost registry is told in one line, and
surviving files are registered again."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
from pyroshock.app.common.model_registry import registry_of
from pyroshock.app.common.registered_models import note_registered
from pyroshock.schema.registered_models import RegisteredVersion
from pyroshock.training.fitting.fitting import fit_task, task_of
from sqlalchemy import select
from support.stores.registries import context_in, fresh_registry, without_figures
from support.stores.stores import opened, pyroshock, run_pyroshock


@pytest.fixture
def url(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A store with three versions of two splits; the registry's database is then moved away."""
    monkeypatch.delenv("MLFLOW_TRACKING_URI", raising=False)
    without_figures(monkeypatch)
    address = f"sqlite:///{tmp_path / 'lab.db'}"
    registry = fresh_registry(tmp_path)
    for seed in (0, 1):
        context = context_in(registry, seed=seed)
        for split in ("repetitions", "configurations"):
            registry.record(fit_task(task_of("linear", split, context), context))
    with opened(address, create=True) as store:
        assert note_registered(store, registry) == 2 and note_registered(store, registry) == 0
    return address


def _lose(url: str) -> None:
    """As when the file was deleted; MLflow's tables are made anew elsewhere, so that its
    connections see them."""
    database = registry_of(url).place.database
    assert database is not None
    import sqlite3
    from contextlib import closing

    with closing(sqlite3.connect(database)) as connection, connection:
        for table in (
            "model_version_tags",
            "model_versions",
            "registered_model_aliases",
            "registered_models",
        ):
            connection.execute(f"DELETE FROM {table}")


def test_a_lost_registry_is_told_and_its_files_are_registered_again(url: str) -> None:
    registry = registry_of(url)
    before = {(version.label, version.split): version for version in registry.versions()}
    predictions = {
        key: registry.held_out(version).prediction.force_n for key, version in before.items()
    }
    assert "lost" not in run_pyroshock("models", "--db", url).stderr
    _lose(url)
    lines = [
        line for line in run_pyroshock("models", "--db", url).stderr.splitlines() if "lost" in line
    ]
    assert (
        len(lines) == 1
        and "linear@1, linear@2" in lines[0]
        and "pyroshock models recover" in lines[0]
    )
    checked = pyroshock("db", "check", "--db", url, "--json")
    lost_findings = [
        finding
        for finding in json.loads(checked.stdout)["findings"]
        if finding["check"] == "models"
    ]
    assert checked.exit_code == 1 and sorted(finding["model"] for finding in lost_findings) == [
        "linear@1",
        "linear@2",
    ]

    recovery_message = run_pyroshock("models", "recover", "--db", url).stderr
    assert (
        "linear@1 registered again as linear@1" in recovery_message
        and "linear@2 registered again as linear@2" in recovery_message
    )
    after = {(version.label, version.split): version for version in registry.versions()}
    assert after.keys() == before.keys()
    for key, version in after.items():
        assert registry.damage(version) is None and version.metrics == before[key].metrics
        assert np.array_equal(registry.held_out(version).prediction.force_n, predictions[key])
        registry.load(version)
    assert "nothing is lost" in run_pyroshock("models", "recover", "--db", url).stderr
    run_pyroshock("db", "check", "--db", url)


def test_altered_or_missing_files_are_not_registered_again(url: str) -> None:
    registry = registry_of(url)
    _lose(url)
    folder = registry.place.folder
    held_out = sorted(folder.glob("*/artifacts/held_out.npz"))
    held_out[0].write_bytes(b"x")
    shutil.rmtree(held_out[1].parent)
    recovery_message = run_pyroshock("models", "recover", "--db", url).stderr
    assert "not registered again" in recovery_message
    assert len(registry.versions()) <= 2 and all(
        registry.damage(version) is None for version in registry.versions()
    )


def test_a_deleted_version_is_not_lost(url: str) -> None:
    run_pyroshock("models", "delete", "linear@1", "--yes", "--db", url)
    assert "lost" not in run_pyroshock("models", "--db", url).stderr
    with opened(url) as store, store.reading() as session:
        assert session.scalars(select(RegisteredVersion.label)).all() == ["linear@2"]
