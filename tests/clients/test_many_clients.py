"""A whole laboratory at once: twenty clients of PostgreSQL, five of a file. Nothing is lost, and
nobody is shown an error that a second try would have cured."""

from __future__ import annotations

import os
import shutil
import uuid
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from pyroshock.training.registry.model_storage import storage_for
from pyroshock.training.registry.registry import Registry
from sqlalchemy import make_url
from support.processes.crowd import COMMANDS, MODELS, Command, complaints, together
from support.records.campaigns import gun_campaign, hammer_campaign
from support.stores.databases import _execute
from support.stores.hammer_stores import full_campaign
from support.stores.stores import content, counts

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]

ROUNDS = int(os.environ.get("PYROSHOCK_ROUNDS", "1"))
MODES = "mode,frequency_hz,damping_ratio,shape_impact,shape_impact_2,shape_a\n"
MODES += "1,400,0.01,0.3,0.1,0.4\n2,1500,0.01,-0.2,0.3,0.3\n"
#: Told of a diagnosis by when it was made; everything else of the store is compared row by row.
_DATED = ("diagnoses", "twin_configurations", "dataset_snapshots", "snapshot_pulses")
SHOT = ("--campaign", "gun", "--draws", "8", "--frequencies", "200:4000:3")


@dataclass(frozen=True)
class Lab:
    """A store and MLflow's, with two datasets, a gun campaign and one registered model; folders to
    ingest."""

    store: str
    models: str
    folder: Path

    @property
    def environment(self) -> dict[str, str]:
        files = str(self.folder / "models")
        return {
            "PYROSHOCK_DB": self.store,
            "MLFLOW_TRACKING_URI": self.models,
            "PYROSHOCK_MODELS": files,
        }

    def folders(self) -> list[Path]:
        return [self.folder / name for name in ("new-1", "new-2", "new-gun")]

    def run(self, said: Path, *clients: list[Command]) -> list[str]:
        """Complaints of clients that run these commands at once."""
        found = together(
            said,
            clients,
            modules=(*COMMANDS, *MODELS),
            environment=self.environment,
            timeout_s=800.0,
        )
        return complaints(found)


@pytest.fixture(scope="module", params=["sqlite", "postgresql"])
def lab(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Lab]:
    folder = tmp_path_factory.mktemp("lab")
    for name in ("spring", "autumn"):
        full_campaign(folder / name, name, seed=len(name))
    gun_campaign(folder / "gun", 12, "gun")
    gun_campaign(folder / "new-gun", 15, "new-gun")
    hammer_campaign(folder / "cut", 3, name="cut")
    for seed in (1, 2):
        hammer_campaign(folder / f"new-{seed}", 4, name=f"new-{seed}", seed=seed)
    (folder / "modes.csv").write_text(MODES)
    if request.param == "sqlite":
        made = Lab(f"sqlite:///{folder / 'lab.db'}", f"sqlite:///{folder / 'mlflow.db'}", folder)
    else:
        server = make_url(request.getfixturevalue("postgres_url"))
        made = Lab(_database(server, "lab"), _database(server, "mlflow"), folder)
    ingests: list[Command] = [
        ("ingest", folder / name, "--jobs", "1") for name in ("spring", "autumn", "gun", "cut")
    ]
    datasets: list[Command] = [
        ("dataset", "build", name, "--from", name) for name in ("spring", "autumn")
    ]
    train: Command = ("train", "spring", "--models", "reed", "--split", "repetitions")
    assert made.run(folder / "said", [*ingests, *datasets, train]) == []
    yield made
    if request.param == "postgresql":
        for url in (made.store, made.models):
            _drop(url)


def _database(server, name: str, template: str = "template0") -> str:  # a URL
    own = f"{name}_{uuid.uuid4().hex}"
    _execute(server, f'CREATE DATABASE "{own}" TEMPLATE "{template}"')
    return server.set(database=own).render_as_string(hide_password=False)


def _drop(url: str) -> None:
    parsed = make_url(url)
    _execute(parsed.set(database="postgres"), f'DROP DATABASE "{parsed.database}" WITH (FORCE)')


@pytest.fixture
def fresh(lab: Lab, tmp_path: Path) -> Iterator[Lab]:
    if lab.store.startswith("sqlite"):
        for name in ("lab.db", "mlflow.db"):
            shutil.copy(lab.folder / name, tmp_path / name)
        yield Lab(
            f"sqlite:///{tmp_path / 'lab.db'}", f"sqlite:///{tmp_path / 'mlflow.db'}", lab.folder
        )
        return
    server = make_url(lab.store).set(database="postgres")
    databases = [
        _database(server, "round", str(make_url(url).database)) for url in (lab.store, lab.models)
    ]
    yield Lab(databases[0], databases[1], lab.folder)
    for url in databases:
        _drop(url)


def _trains(dataset: str, *models: str) -> Command:
    return ("train", dataset, "--models", ",".join(models), "--split", "repetitions")


def _work(lab: Lab, out: Path, rng: np.random.Generator) -> list[list[Command]]:
    """Twenty clients, in an order of the round's own; the first five of them do a bit of
    everything."""
    modes = ("--modes", lab.folder / "modes.csv")

    def ingests() -> list[Command]:
        folders = lab.folders()
        return [("ingest", folders[i], "--jobs", "1") for i in rng.permutation(len(folders))]

    predict: Command = ("predict", *modes, *SHOT)
    few: list[list[Command]] = [
        ingests(),
        [_trains("spring", "hann", "hertz"), ("models",)],
        [predict, ("promote", "reed", "1", "--force", "--reason", "to try it")],
        [("diagnose", "gun", *modes), ("export", "impacts", "--out", out / "impacts.csv")],
        [
            ("extract", "cut", "--threshold", "0.02"),
            ("dataset", "build", "all", "--from", "spring"),
        ],
    ]
    more: list[list[Command]] = [
        *(ingests() for _ in range(4)),
        [_trains("spring", "hertz", "hann")],
        [_trains("spring", "hann", "reed"), ("models", "--dataset", "spring")],
        [_trains("autumn", "hann", "hertz"), ("models",)],
        [_trains("autumn", "hertz", "hann")],
        [predict],
        [predict, predict],
        [("diagnose", "gun", *modes)],
        [("diagnose", "gun", *modes, "--adopt", "none")],
        [
            ("extract", "cut", "--threshold", "0.02"),
            ("promote", "reed", "1", "--force", "--reason", "to try it"),
        ],
        [("dataset", "build", "all", "--from", "spring"), ("impacts", "--json")],
        [("campaigns",), ("shots", "--json"), ("materials",)],
    ]
    clients = few if lab.store.startswith("sqlite") else few + more
    return [clients[i] for i in rng.permutation(len(clients))]


@pytest.mark.parametrize("seed", range(ROUNDS))
def test_laboratory_at_once(fresh: Lab, tmp_path: Path, seed: int) -> None:
    work = _work(fresh, tmp_path, np.random.default_rng(seed))
    assert fresh.run(tmp_path / "said", *work) == []
    _assert_nothing_lost(fresh, work, tmp_path)


def _assert_nothing_lost(lab: Lab, work: list[list[Command]], folder: Path) -> None:
    words = [command for client in work for command in client]
    alone = Lab(f"sqlite:///{folder / 'alone.db'}", lab.models, lab.folder)
    campaigns = [lab.folder / name for name in ("spring", "autumn", "gun", "cut")] + lab.folders()
    one_by_one: list[Command] = [("ingest", each, "--jobs", "1") for each in campaigns]
    assert (
        alone.run(folder / "alone", [*one_by_one, ("extract", "cut", "--threshold", "0.02")]) == []
    )
    expected = {table: rows for table, rows in content(alone.store).items() if table not in _DATED}
    assert {
        table: rows for table, rows in content(lab.store).items() if table not in _DATED
    } == expected
    assert counts(lab.store)["diagnoses"] == sum(command[0] == "diagnose" for command in words)
    assert counts(lab.store)["twin_configurations"] == sum(
        "--adopt" in command for command in words
    )
    assert counts(lab.store)["dataset_snapshots"] == 2
    asked = {
        (m, command[1])
        for command in words
        if command[0] == "train"
        for m in str(command[3]).split(",")
    }
    registered = Registry(storage_for(lab.store, lab.environment)).versions()
    assert Counter((v.name, v.dataset.name) for v in registered) == Counter(
        asked | {("reed", "spring")}
    )
    assert [version.label for version in registered if version.champion_of] == ["reed@1"]
