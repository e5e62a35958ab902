"""What is read of MLflow's store: records of versions and runs, and how a client of MLflow gives
them.

`mlflow_tables.py` gives the same from the tables, without the import of MLflow, which takes three
seconds of processor time.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from mlflow import MlflowClient
    from mlflow.entities import Run
    from mlflow.entities.model_registry import ModelVersion

#: As many as MLflow gives in one answer.
_MOST_MODELS, _MOST_VERSIONS, _MOST_RUNS = 1000, 10_000, 50_000


@dataclass(frozen=True)
class VersionRecord:
    """A registered version as MLflow keeps it; `created_ms` is in ms since 1970."""

    name: str
    version: int
    run_id: str
    model_id: str
    created_ms: int
    tags: Mapping[str, str]


@dataclass(frozen=True)
class RunRecord:
    """A run as MLflow keeps it; `started_ms` is in ms since 1970, `metrics` are the names."""

    run_id: str
    status: str
    started_ms: int
    artifact_uri: str
    tags: Mapping[str, str]
    parameters: Mapping[str, str]
    metrics: Collection[str]


class RegistryReader(Protocol):
    """Reads MLflow's store. Deleted versions, and deleted runs in lists, are left out."""

    def versions(self) -> list[VersionRecord]:
        """All registered versions, the one that was changed last first."""
        ...

    def aliases(self) -> dict[str, dict[str, int]]:
        """The number of the version by the name of the model and by alias."""
        ...

    def runs_with(self, tag: str, value: str | None = None) -> list[RunRecord]:
        """Runs of our experiment with a tag of this value, by default of any but an empty one; the
        one that was started last first."""
        ...

    def find_run(self, run_id: str) -> RunRecord | None:
        """One run, deleted or not."""
        ...

    def histories(self, run_id: str, names: Collection[str]) -> dict[str, list[tuple[int, float]]]:
        """The values of metrics of a run by name: (step, value), the first step first."""
        ...

    def find_version_location(self, name: str, version: int) -> str | None:
        """The address of the files of a registered version's model."""
        ...

    def find_model_location(self, model_id: str) -> str | None:
        """The address of the files of a model that is logged with a run."""
        ...


class ClientReader:
    """Reads through MLflow, which raises its own error for what there is not."""

    def __init__(self, client: MlflowClient, experiment: str) -> None:
        self._client = client
        self._experiment = experiment

    def versions(self) -> list[VersionRecord]:
        listed = self._client.search_model_versions(max_results=_MOST_VERSIONS)
        return [version_record(version) for version in listed]

    def aliases(self) -> dict[str, dict[str, int]]:
        models = self._client.search_registered_models(max_results=_MOST_MODELS)
        return {
            model.name: {alias: int(number) for alias, number in model.aliases.items()}
            for model in models
            if model.aliases
        }

    def runs_with(self, tag: str, value: str | None = None) -> list[RunRecord]:
        condition = f"tags.`{tag}` != ''" if value is None else f"tags.`{tag}` = '{value}'"
        runs = self._client.search_runs([self._experiment], condition, max_results=_MOST_RUNS)
        return [_run_record(run) for run in runs]

    def find_run(self, run_id: str) -> RunRecord | None:
        return _run_record(self._client.get_run(run_id))

    def histories(self, run_id: str, names: Collection[str]) -> dict[str, list[tuple[int, float]]]:
        points = {name: self._client.get_metric_history(run_id, name) for name in sorted(names)}
        return {name: sorted((p.step, p.value) for p in points[name]) for name in points}

    def find_version_location(self, name: str, version: int) -> str | None:
        return str(self._client.get_model_version_download_uri(name, str(version)))

    def find_model_location(self, model_id: str) -> str | None:
        return str(self._client.get_logged_model(model_id).artifact_location)


def version_record(version: ModelVersion) -> VersionRecord:
    """The record of a version that MLflow has given."""
    return VersionRecord(
        version.name,
        int(version.version),
        version.run_id,
        version.model_id or model_id_in(version.source),
        version.creation_timestamp,
        dict(version.tags),
    )


def model_id_in(source: str | None) -> str:
    """The id of the model that a version was registered from: its source is "models:/ID"."""
    return str(source).removeprefix("models:/")


def _run_record(run: Run) -> RunRecord:
    info, data = run.info, run.data
    return RunRecord(
        info.run_id,
        info.status,
        info.start_time,
        info.artifact_uri,
        dict(data.tags),
        dict(data.params),
        frozenset(data.metrics),
    )
