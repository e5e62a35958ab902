"""A small lab behind the window: two examples, a hammer's campaign, a dataset, two models, a plan,
a kept diagnosis."""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from pyroshock.schema.session import Store
    from starlette.testclient import TestClient

#: A plan of four runs, cheap to make.
FACTORS = """\
name = "hammer"
kind = "hammer"

[[factors]]
name = "tip_material"
column = "tip_material"
kind = "categorical"
levels = ["aluminum", "delrin"]

[[factors]]
name = "tip_radius"
column = "tip_radius_mm"
kind = "numeric"
unit = "mm"
levels = [15, 30]
"""
GUN, HAMMER, PLAN, DATASET = "first-shots", "spring", "autumn/1", "pulses"
#: Four recordings of five hits, one of one; five shots.
IMPACTS, SHOTS = 21, 5
#: What takes a screen, not a test: a job that the server's worker runs is waited for this long.
PATIENCE_S = 90.0


@dataclass(frozen=True)
class Lab:
    """A client of the window over a filled store, and the store."""

    client: TestClient
    store: Store
    db: str
    folder: Path

    def rows(self) -> dict[str, int]:
        """Rows per table."""
        from pyroshock.schema.session import count_rows

        return count_rows(self.store)

    def added(self, before: dict[str, int]) -> dict[str, int]:
        """What has come since `before`, apart from who was asked and who wrote it."""
        return {
            name: count - before[name]
            for name, count in self.rows().items()
            if count != before[name] and name not in ("provenance", "jobs", "audit_rows")
        }


@pytest.fixture(scope="session")
def filled_lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a filled store, lab.db, and of the registry beside it."""
    from pyroshock.app.demo.demo import ingest_examples
    from pyroshock.ingest.load import ingest_folder

    from support.stores.hammer_stores import full_campaign
    from support.stores.stores import opened

    folder = tmp_path_factory.mktemp("window")
    with (
        pytest.MonkeyPatch.context() as patch,
        opened(f"sqlite:///{folder}/lab.db", create=True) as store,
    ):
        patch.delenv("MLFLOW_TRACKING_URI", raising=False)
        ingest_folder(store, full_campaign(folder / "campaigns" / HAMMER), jobs=1)
        ingest_examples(store)
        _train(store, folder, patch)
        _plan_and_diagnose(store)
    return folder


def _train(store: Store, folder: Path, patch: pytest.MonkeyPatch) -> None:
    from pyroshock.app.common.model_registry import context_of
    from pyroshock.dataset.snapshot import build_snapshot
    from pyroshock.training.fitting.session import train

    from support.stores.registries import fresh_registry, without_figures

    without_figures(patch)
    build_snapshot(store, DATASET, [HAMMER])
    registry = fresh_registry(folder)
    training_context = context_of(store, DATASET, registry, 0, "reduced")
    train(registry, training_context, ["linear", "tree"], ["repetitions"])


def _plan_and_diagnose(store: Store) -> None:
    from pyroshock.app.operations.diagnose.diagnosing import keep
    from pyroshock.app.operations.plan.planning import make_plan

    from support.records import verdicts

    make_plan(store, "factorial", PLAN, kind="hammer", factors=FACTORS, repetitions=2, seed=1)
    keep(store, verdicts.verdict(campaign=GUN))


@pytest.fixture(scope="module")
def quick_plates() -> Iterator[None]:
    """A plate of two modes in closed form: a solved one takes ten seconds."""
    from pyroshock.app.twins import building as twins

    from support.records.twin_parts import unsolved

    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("MLFLOW_TRACKING_URI", raising=False)
        patch.setattr(twins, "solved", unsolved)
        yield


@pytest.fixture(scope="module")
def filled(
    filled_lab: Path, quick_plates: None, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Lab]:
    """The window over a filled store of this module's own; who writes counts rows before and
    after."""
    from support.processes.web_client import sqlite, window

    folder = tmp_path_factory.mktemp("filled")
    shutil.copytree(filled_lab, folder, dirs_exist_ok=True)
    _move_registry(folder / "lab-models.db", filled_lab, folder)
    db = sqlite(folder)
    with window(db, folders=(folder / "campaigns",)) as (client, store):
        yield Lab(client, store, db, folder)


def _move_registry(database: Path, old: Path, new: Path) -> None:
    """MLflow keeps the whole path of each model's files."""
    with closing(sqlite3.connect(database)) as connection, connection:
        tables = connection.execute(
            "SELECT name FROM sqlite_master WHERE type = 'table'"
        ).fetchall()
        for (table,) in tables:
            for _, column, *_ in connection.execute(f'PRAGMA table_info("{table}")').fetchall():
                change = (
                    f'UPDATE "{table}" SET "{column}" = '
                    f'replace("{column}", ?, ?) WHERE "{column}" LIKE ?'
                )
                connection.execute(change, (str(old), str(new), f"%{old}%"))


@pytest.fixture(scope="module")
def empty(tmp_path_factory: pytest.TempPathFactory, quick_plates: None) -> Iterator[Lab]:
    """The window over a store of nothing."""
    from support.processes.web_client import sqlite, window

    folder = tmp_path_factory.mktemp("empty")
    with window(sqlite(folder), folders=(folder,)) as (client, store):
        yield Lab(client, store, sqlite(folder), folder)
