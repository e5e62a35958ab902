"""MLflow's tables, read without MLflow where their revision is known.

A store is read from its tables only where MLflow would read the same: an SQLite file or a
PostgreSQL database whose tables have the revision that this file was written for, with our
experiment in it.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

from sqlalchemy import (
    URL,
    ColumnElement,
    Connection,
    Engine,
    NullPool,
    Select,
    column,
    create_engine,
    exists,
    func,
    select,
    table,
)
from sqlalchemy.exc import DatabaseError

from ...schema.engine import make_engine
from ...schema.transactions import is_transient
from .model_storage import ModelStorage
from .reader import RunRecord, VersionRecord, model_id_in

if TYPE_CHECKING:
    from sqlalchemy import TableClause

#: The tables of MLflow 3.17.2. Others are read through MLflow. Before you name a newer revision,
#: read in `mlflow/store/db_migrations` what it changes in the tables below.
REVISION = "dc11669786a5"
#: MLflow's own names: of the workspace where nobody has set one up, and of a deleted version.
_WORKSPACE, _DELETED = "default", "Deleted_Internal"
#: As long as MLflow waits for another's lock on an SQLite file.
_BUSY_S = 20.0


def _table(name: str, columns: str) -> TableClause:
    return table(name, *(column(column_name) for column_name in columns.split()))


_REVISIONS = _table("alembic_version", "version_num")
_EXPERIMENTS = _table("experiments", "experiment_id name workspace")
_MODELS = _table("registered_models", "name workspace")
_ALIASES = _table("registered_model_aliases", "name alias version workspace")
_VERSIONS = _table(
    "model_versions",
    "name version creation_time last_updated_time current_stage source run_id storage_location "
    "workspace",
)
_VERSION_TAGS = _table("model_version_tags", "name version key value workspace")
_RUNS = _table("runs", "run_uuid status start_time lifecycle_stage artifact_uri experiment_id")
_TAGS = _table("tags", "run_uuid key value")
_PARAMETERS = _table("params", "run_uuid key value")
_LATEST = _table("latest_metrics", "run_uuid key value")
_METRICS = _table("metrics", "run_uuid key step value is_nan")
_LOGGED_MODELS = _table("logged_models", "model_id artifact_location lifecycle_stage")


@contextmanager
def known_tables(place: ModelStorage, experiment: str) -> Iterator[TableReader | None]:
    """A reader of the tables of a place that has this experiment; None where MLflow must be asked.

    Raises `sqlalchemy.exc.DatabaseError` where another one's lock is held for too long, and for
    tables that are damaged.
    """
    engine = _engine_of(place)
    if engine is None:
        yield None
        return
    with ExitStack() as stack:
        stack.callback(engine.dispose)
        try:
            connection = stack.enter_context(engine.connect())
            experiment_id = _find_experiment(connection, experiment)
        except DatabaseError as error:
            if is_transient(error):
                raise
            # No tables yet, or no database: MLflow makes them, or says what is wrong.
            experiment_id = None
        yield None if experiment_id is None else TableReader(connection, experiment_id)


def _engine_of(place: ModelStorage) -> Engine | None:
    if place.is_postgresql:
        return make_engine(place.tracking_uri)
    if place.database is None:
        return None
    # `mode=rw` makes no file, and takes back what a killed writer left half written.
    address = URL.create(
        "sqlite", database=place.database.as_uri(), query={"mode": "rw", "uri": "true"}
    )
    return create_engine(address, connect_args={"timeout": _BUSY_S}, poolclass=NullPool)


def _find_experiment(connection: Connection, name: str) -> int | None:
    """The id of an experiment, where the tables are those that this file knows and MLflow would
    not refuse them."""
    if connection.scalars(select(_REVISIONS.c.version_num)).all() != [REVISION]:
        return None
    other_workspace = exists().where(_MODELS.c.workspace != _WORKSPACE)
    experiment: int | None = connection.scalar(
        select(_EXPERIMENTS.c.experiment_id).where(
            _EXPERIMENTS.c.name == name, _of_workspace(_EXPERIMENTS), ~other_workspace
        )
    )
    return experiment


def _of_workspace(rows: TableClause) -> ColumnElement[bool]:
    return rows.c.workspace == _WORKSPACE


#: Versions that are not deleted.
_PRESENT = (_of_workspace(_VERSIONS), _VERSIONS.c.current_stage != _DELETED)


class TableReader:
    """Reads the tables as MLflow would."""

    def __init__(self, connection: Connection, experiment: int) -> None:
        self._connection = connection
        self._experiment = experiment

    def versions(self) -> list[VersionRecord]:
        tags: dict[tuple[str, int], dict[str, str]] = {}
        for row in self._rows(select(_VERSION_TAGS).where(_of_workspace(_VERSION_TAGS))):
            tags.setdefault((row.name, row.version), {})[row.key] = row.value
        listed = select(_VERSIONS).where(
            _of_workspace(_VERSIONS), _VERSIONS.c.current_stage != _DELETED
        )
        newest_first = (
            _VERSIONS.c.last_updated_time.desc(),
            _VERSIONS.c.name,
            _VERSIONS.c.version.desc(),
        )
        return [
            VersionRecord(
                row.name,
                row.version,
                row.run_id,
                model_id_in(row.source),
                row.creation_time,
                tags.get((row.name, row.version), {}),
            )
            for row in self._rows(listed.order_by(*newest_first))
        ]

    def aliases(self) -> dict[str, dict[str, int]]:
        aliases: dict[str, dict[str, int]] = {}
        for row in self._rows(select(_ALIASES).where(_of_workspace(_ALIASES))):
            aliases.setdefault(row.name, {})[row.alias] = row.version
        return aliases

    def runs_with(self, tag: str, value: str | None = None) -> list[RunRecord]:
        has_value = _TAGS.c.value != "" if value is None else _TAGS.c.value == value
        tagged_runs = select(_TAGS.c.run_uuid).where(_TAGS.c.key == tag, has_value)
        runs = select(_RUNS).where(
            _RUNS.c.experiment_id == self._experiment,
            _RUNS.c.lifecycle_stage == "active",
            _RUNS.c.run_uuid.in_(tagged_runs),
        )
        return self._runs(runs)

    def find_run(self, run_id: str) -> RunRecord | None:
        return next(iter(self._runs(select(_RUNS).where(_RUNS.c.run_uuid == run_id))), None)

    def histories(self, run_id: str, names: Collection[str]) -> dict[str, list[tuple[int, float]]]:
        points = select(_METRICS).where(_METRICS.c.run_uuid == run_id, _METRICS.c.key.in_(names))
        histories: dict[str, list[tuple[int, float]]] = {name: [] for name in sorted(names)}
        for row in self._rows(points):
            histories[row.key].append((row.step, math.nan if row.is_nan else row.value))
        return {name: sorted(points) for name, points in histories.items()}

    def find_version_location(self, name: str, version: int) -> str | None:
        location = select(func.coalesce(_VERSIONS.c.storage_location, _VERSIONS.c.source)).where(
            *_PRESENT,
            _VERSIONS.c.name == name,
            _VERSIONS.c.version == version,
        )
        return self._find_text(location)

    def find_model_location(self, model_id: str) -> str | None:
        models = _LOGGED_MODELS
        location = select(models.c.artifact_location).where(
            models.c.model_id == model_id, models.c.lifecycle_stage != "deleted"
        )
        return self._find_text(location)

    def _runs(self, runs: Select[Any]) -> list[RunRecord]:
        run_ids = select(runs.subquery().c.run_uuid)
        tags, parameters, metrics = (
            self._values_by_run(rows, run_ids) for rows in (_TAGS, _PARAMETERS, _LATEST)
        )
        newest_first = (_RUNS.c.start_time.desc(), _RUNS.c.run_uuid)
        return [
            RunRecord(
                row.run_uuid,
                row.status,
                row.start_time,
                row.artifact_uri,
                tags.get(row.run_uuid, {}),
                parameters.get(row.run_uuid, {}),
                frozenset(metrics.get(row.run_uuid, {})),
            )
            for row in self._rows(runs.order_by(*newest_first))
        ]

    def _values_by_run(self, rows: TableClause, run_ids: Select[Any]) -> dict[str, dict[str, Any]]:
        """Values by key of the runs with these ids."""
        values: dict[str, dict[str, Any]] = {}
        for row in self._rows(select(rows).where(rows.c.run_uuid.in_(run_ids))):
            values.setdefault(row.run_uuid, {})[row.key] = row.value
        return values

    def _find_text(self, query: Select[Any]) -> str | None:
        text: str | None = self._connection.scalar(query)
        return text

    def _rows(self, query: Select[Any]) -> list[Any]:
        return list(self._connection.execute(query))
