"""What is struck: an ingest, a training, a promotion, an upgrade; each in a place of its own, each
with its look."""

from __future__ import annotations

import os
import shutil
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pyroshock.schema import migrate
from pyroshock.schema.session import StoreError, make_engine
from pyroshock.training.registry.connection import EXPERIMENT
from pyroshock.training.registry.model_storage import VARIABLE, storage_for
from pyroshock.training.registry.registry import Registry
from sqlalchemy import MetaData, Table

from support.records.campaigns import hammer_campaign
from support.stores import later_revision
from support.stores.hammer_stores import full_campaign
from support.stores.many_databases import Databases
from support.stores.registries import fresh_registry
from support.stores.stored_databases import dump, stored_database
from support.stores.stores import assert_whole, content, ingested, pyroshock

HITS = 2


@dataclass
class IngestPlace:
    """A campaign on its way into an empty store."""

    url: str
    campaign: Path
    folder: Path
    jobs: str = "1"
    environment: Mapping[str, str] = field(default_factory=dict)

    @property
    def command(self) -> Sequence[str]:
        return ("ingest", str(self.campaign), "--db", self.url, "--jobs", self.jobs)

    def look(self) -> None:
        try:
            assert_whole(self.url, HITS)
        except StoreError as error:
            # killed before the first table was there: an empty place, as if nothing had begun
            assert "no store at" in str(error)

    def content(self) -> object:
        assert_whole(self.url, HITS)
        return content(self.url)


def ingest_places(databases: Databases, folder: Path) -> Callable[[str], IngestPlace]:
    """The same campaign of eight recordings for all; by turns one process reads it, and two."""
    campaign = hammer_campaign(folder / "campaign", recordings=8, hits=HITS)
    made = Counter[str]()

    def make(_name: str) -> IngestPlace:
        made["places"] += 1
        return IngestPlace(databases.empty(), campaign, folder, str(1 + made["places"] % 2))

    return make


@dataclass
class TrainPlace:
    """A dataset, and a registry that holds no model yet."""

    url: str
    registry: Registry
    environment: Mapping[str, str]
    folder: Path

    @property
    def command(self) -> Sequence[str]:
        words = "train spring --models hann,hertz,linear --split repetitions --db"
        return (*words.split(), self.url)

    def look(self) -> None:
        """What is listed is there once, whole, and as it was judged."""
        versions = self.registry.versions()
        assert max(Counter(version.task_key for version in versions).values(), default=1) == 1
        for version in versions:
            assert self.registry.load(version).version == version
            assert len(self.registry.held_out(version).keys) > 0

    def content(self) -> object:
        self.look()
        with self.registry.connection.client() as client:
            runs = client.search_runs([self.registry.connection.experiment])
        floors = {
            v.dataset.hash: self.registry.floors(v.dataset.hash, v.seed)
            for v in self.registry.versions()
        }
        models = sorted(
            (v.name, v.split, v.sha256, str(v.metrics)) for v in self.registry.versions()
        )
        return models, floors, sorted((run.info.run_name, run.info.status) for run in runs)


@dataclass
class PromotePlace:
    """A registry with a champion, and another model that is to take its place."""

    url: str
    registry: Registry
    environment: Mapping[str, str]
    folder: Path

    @property
    def command(self) -> Sequence[str]:
        return ("promote", "linear", "1", "--force", "--reason", "it is better", "--db", self.url)

    def look(self) -> None:
        """Before or after: the model in use is the one that the newest decision put there, with its
        reason."""
        (champion,) = [version.label for version in self.registry.versions() if version.champion_of]
        decisions = self.registry.decisions()
        assert decisions[0].candidate == champion, (champion, decisions)
        assert ("it is better" in decisions[0].reason) == (champion == "linear@1")

    def content(self) -> object:
        self.look()
        # A repeat after a kill that came too late to matter is told so, and kept as a decision of
        # its own.
        told = [
            (d.candidate, d.reason)
            for d in self.registry.decisions()
            if "in use already" not in d.reason
        ]
        with self.registry.connection.client() as client:
            aliases = {
                model.name: dict(model.aliases) for model in client.search_registered_models()
            }
            runs = client.search_runs([self.registry.connection.experiment])
        assert {run.info.status for run in runs} == {"FINISHED"}
        return told, aliases


def train_places(databases: Databases, folder: Path) -> Callable[[str], TrainPlace]:
    """A store with a dataset, and beside it an empty registry, copied for each."""
    store = _filled_store(databases, folder)
    registry = _empty_registry(databases, folder / "empty")

    def make(name: str) -> TrainPlace:
        place = folder / name
        place.mkdir()
        return TrainPlace(databases.copy(store), *_copied(databases, registry, place), place)

    return make


def promote_places(databases: Databases, folder: Path) -> Callable[[str], PromotePlace]:
    """The same, with two models in the registry, of which the worse one is in use."""
    trained = train_places(databases, folder / "trained")("template")
    with _environment(trained.environment, trained.folder):
        for words in (
            "train spring --models hann,linear --split repetitions",
            "promote hann 1 --force --reason first",
        ):
            result = pyroshock(*words.split(), "--db", trained.url)
            assert result.exit_code == 0, result.stderr

    def make(name: str) -> PromotePlace:
        place = folder / name
        place.mkdir()
        return PromotePlace(
            databases.copy(trained.url), *_copied(databases, trained.registry, place), place
        )

    return make


def _filled_store(databases: Databases, folder: Path) -> str:
    folder.mkdir(parents=True, exist_ok=True)
    url = databases.empty()
    ingested(url, full_campaign(folder / "spring"))
    result = pyroshock("dataset", "build", "spring", "--from", "spring", "--db", url)
    assert result.exit_code == 0, result.stderr
    return url


def _empty_registry(databases: Databases, folder: Path) -> Registry:
    folder.mkdir(parents=True)
    if databases.engine == "SQLite":
        return fresh_registry(folder, "models")
    registry = _registry_at(databases.empty(), folder)
    with registry.connection.client():
        pass
    return registry


def _registry_at(uri: str, folder: Path) -> Registry:
    """As a command finds it that is started in `folder`."""
    with _environment({VARIABLE: uri}, folder):
        return Registry(storage_for("sqlite:///lab.db", os.environ))


def _copied(
    databases: Databases, registry: Registry, folder: Path
) -> tuple[Registry, Mapping[str, str]]:
    """A registry's database and files, copied; the address that leads a command to it."""
    uri = databases.copy(registry.place.tracking_uri)
    copied = _registry_at(uri, folder)
    if registry.place.folder.exists():
        shutil.copytree(registry.place.folder, copied.place.folder)
    engine = make_engine(uri)
    with engine.begin() as connection:
        experiments = Table("experiments", MetaData(), autoload_with=connection)
        row = experiments.update().where(experiments.c.name == EXPERIMENT)
        connection.execute(row.values(artifact_location=copied.place.artifact_uri))
    engine.dispose()
    return copied, {VARIABLE: uri}


class _environment:
    """This process' variables and folder, as a command would have them."""

    def __init__(self, variables: Mapping[str, str], folder: Path) -> None:
        self.variables, self.folder = variables, folder

    def __enter__(self) -> None:
        self.before = {name: os.environ.get(name) for name in self.variables}, Path.cwd()
        os.environ.update(self.variables)
        os.chdir(self.folder)

    def __exit__(self, *_: object) -> None:
        variables, folder = self.before
        os.chdir(folder)
        for name, value in variables.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


@dataclass
class MigratePlace:
    """A store of this software's revision, which the later software upgrades."""

    url: str
    folder: Path
    before: object
    environment: Mapping[str, str]

    @property
    def command(self) -> Sequence[str]:
        return ("db", "upgrade", "--db", self.url)

    def look(self) -> None:
        """Before, with every row; or after, with the models' tables."""
        engine = make_engine(self.url)
        try:
            revision = migrate.current_revision(engine)
            assert revision in (migrate.HEAD, later_revision.REVISION)
            if revision == migrate.HEAD:
                assert dump(self.url) == self.before
            else:
                assert migrate.differences(engine) == []
        finally:
            engine.dispose()

    def content(self) -> object:
        """Every row but those that tell when the command was given."""
        rows = dump(self.url)
        return {name: rows[name] for name in rows if name not in ("audit_rows", "provenance")}


def migrate_places(databases: Databases, folder: Path) -> Callable[[str], MigratePlace]:
    """The stored database, copied for each."""
    folder.mkdir(parents=True, exist_ok=True)
    stored = stored_database(databases, folder)
    before = dump(stored)
    later = {later_revision.VARIABLE: str(later_revision.write_revision(folder / "later"))}
    return lambda _name: MigratePlace(databases.copy(stored), folder, before, later)
