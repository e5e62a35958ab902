"""Models registered, read back, promoted.

A version is written last, with all its tags in one transaction, when everything it stands for is stored: what is
listed is finished, wherever a training was killed. Models know nothing of this.
"""

from __future__ import annotations

import hashlib
import json
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, redirect_stderr
from datetime import UTC, datetime
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

from ..code_version import code_version
from ..locks import locked
from ..models.pack import read_model
from ..place import Place
from ..records import DatasetName, Decision, HeldOut, RegisteredModel, Trained, Version
from .champions import ALIAS, PROMOTED_TAG, alias_of, champions_of, move_or_drop
from .connection import Connection, RegistryError
from .logged import HELD_OUT, log_model, log_run
from .written import (
    PREFIX,
    TASK_TAG,
    decision_from,
    decision_tags,
    read_about,
    read_held_out,
    version_from,
    version_tags,
)

if TYPE_CHECKING:
    from mlflow import MlflowClient

_SESSION_TAG, _DECISION_TAG, _FLOOR_TAG = PREFIX + "session", PREFIX + "decision", PREFIX + "floor"


class Registry:
    """Models registered at a place. Reading from a place where nothing was registered gives nothing, and makes none."""

    def __init__(self, place: Place) -> None:
        self.place = place
        self.connection = Connection(place)

    def versions(self) -> list[Version]:
        """All registered versions, the newest first."""
        if self.connection.nothing_there:
            return []
        with self.connection.client() as client:
            aliases = {model.name: model.aliases for model in client.search_registered_models(max_results=1000)}
            found = client.search_model_versions(max_results=10_000, order_by=["creation_timestamp DESC"])
        rows = [(v, int(v.version), v.tags) for v in found if TASK_TAG in v.tags]
        champion_of = champions_of({(v.name, number): tags for v, number, tags in rows}, aliases)
        return [
            version_from(v.name, number, v.run_id, v.creation_timestamp, tags, champion_of.get((v.name, number)))
            for v, number, tags in rows
        ]

    def champion(self, predictor_set: str) -> Version | None:
        """The version in use for impacts described by this predictor set, or None."""
        return next((version for version in self.versions() if version.champion_of == predictor_set), None)

    def load(self, version: Version) -> RegisteredModel:
        """The model of a version, from its files. Raises `ValueError` where they are gone or are not those written."""
        with self.connection.client() as client, tempfile.TemporaryDirectory() as room:
            uri = client.get_model_version_download_uri(version.name, str(version.version))
            folder = self._fetched(uri, Path(room), version.label)
            model, written = read_model(folder / "data" / "model", version.sha256)
        predictors, domain = read_about(written)
        return RegisteredModel(version, model, predictors, domain, written)

    def held_out(self, version: Version) -> HeldOut:
        """The held-out predictions that the version was judged by."""
        with self.connection.client() as client, tempfile.TemporaryDirectory() as room:
            uri = client.get_run(version.run_id).info.artifact_uri
            return read_held_out(self._fetched(f"{uri}/{HELD_OUT}", Path(room), version.label))

    def record(self, trained: Trained, session: str | None = None) -> Version:
        """Log a finished training under the run `session`, and register its model: the very last step."""
        import mlflow

        task = trained.task
        with self.connection.client() as client, tempfile.TemporaryDirectory() as room:
            self._forget_unfinished(client, task.key)
            tags = {TASK_TAG: task.key, **{PREFIX + name: value for name, value in code_version().items()}}
            name = f"{task.model}, {task.split}"
            with mlflow.start_run(
                experiment_id=self.connection.experiment,
                run_name=name,
                tags=tags,
                nested=session is not None,
                parent_run_id=session,
            ):
                log_run(trained, Path(room))
                model_uri, sha256 = log_model(trained, Path(room) / "model")
                with redirect_stderr(StringIO()):  # MLflow announces every version there
                    written = mlflow.register_model(model_uri, task.model, tags=version_tags(trained, sha256))
            number = int(written.version)
            return version_from(
                task.model, number, written.run_id, written.creation_timestamp, version_tags(trained, sha256), None
            )

    def open_session(self, dataset: DatasetName, seed: int) -> str:
        """The run over all trainings of a dataset with a seed: the one begun earlier, or a new one."""
        with self.connection.client() as client:
            key = f"{dataset.hash} {seed}"
            found = client.search_runs([self.connection.experiment], f"tags.`{_SESSION_TAG}` = '{key}'", max_results=1)
            if found:
                return str(found[0].info.run_id)
            run = client.create_run(
                self.connection.experiment, run_name=f"train {dataset.name}", tags={_SESSION_TAG: key}
            )
            client.log_param(run.info.run_id, "dataset", dataset.name)
            client.log_param(run.info.run_id, "dataset_hash", dataset.hash)
            client.log_param(run.info.run_id, "seed", seed)
            return str(run.info.run_id)

    def close_session(self, session: str, figures: Mapping[str, bytes], floors: Mapping[str, str]) -> None:
        """Log what stands over all trainings: figures by file name, and the floor (JSON) of each split."""
        with self.connection.client() as client, tempfile.TemporaryDirectory() as room:
            for name, content in figures.items():
                (Path(room) / name).write_bytes(content)
                client.log_artifact(session, str(Path(room) / name))
            for split, floor in floors.items():
                client.set_tag(session, _floor_tag(split), json.dumps([split, floor]))
            client.set_terminated(session)

    def floors(self, dataset_hash: str, seed: int) -> dict[str, str]:
        """The repeatability floor (JSON) by split, of the trainings of a dataset with a seed."""
        if self.connection.nothing_there:
            return {}
        with self.connection.client() as client:
            key = f"{dataset_hash} {seed}"
            found = client.search_runs([self.connection.experiment], f"tags.`{_SESSION_TAG}` = '{key}'", max_results=1)
            tags = found[0].data.tags if found else {}
        return dict(json.loads(text) for key, text in tags.items() if key.startswith(_FLOOR_TAG))

    @contextmanager
    def promoting(self) -> Iterator[None]:
        """Nobody else promotes meanwhile: compare, then `set_champion` and `note`, in one hold."""
        with locked(self.place.lock.with_suffix(".promotion")):
            yield

    def set_champion(self, version: Version) -> None:
        """Make this version the only champion of its predictor set."""
        alias, number = alias_of(version.dataset.predictor_set), str(version.version)
        with self.connection.client() as client:
            # The time first: should this be cut short, two carry the alias, and the one promoted last counts.
            client.set_model_version_tag(version.name, number, PROMOTED_TAG, datetime.now(UTC).isoformat())
            for name in (alias, ALIAS):
                client.set_registered_model_alias(version.name, name, number)
            for model in client.search_registered_models(max_results=1000):
                if model.name != version.name and alias in model.aliases:
                    client.delete_registered_model_alias(model.name, alias)
                    move_or_drop(client, model.name, model.aliases, alias)

    def note(self, decision: Decision) -> None:
        """Keep a promotion or its refusal: a run of its own, so that it shows beside the trainings."""
        with self.connection.client() as client:
            verb = "promote" if decision.promoted else "refuse"
            tags = decision_tags(decision)
            run = client.create_run(self.connection.experiment, run_name=f"{verb} {decision.candidate}", tags=tags)
            for name in ("candidate", "champion", "promoted", "forced", "reason", "judged_on", "who"):
                client.log_param(run.info.run_id, name, str(getattr(decision, name)))
            for name, value in decision.figures.items():
                client.log_metric(run.info.run_id, name, value)
            client.set_terminated(run.info.run_id)

    def decisions(self) -> list[Decision]:
        """Promotions and refusals, the newest first."""
        if self.connection.nothing_there:
            return []
        with self.connection.client() as client:
            order = ["attributes.start_time DESC"]
            runs = client.search_runs([self.connection.experiment], max_results=1000, order_by=order)
        return [decision_from(run.data.tags) for run in runs if _DECISION_TAG in run.data.tags]

    def _forget_unfinished(self, client: MlflowClient, task_key: str) -> None:
        """Take back what a killed training of the same task has left."""
        running = f"tags.`{TASK_TAG}` = '{task_key}' AND attributes.status != 'FINISHED'"
        registered = {version.run_id for version in client.search_model_versions(f"tags.`{TASK_TAG}` = '{task_key}'")}
        for run in client.search_runs([self.connection.experiment], running):
            if run.info.run_id in registered:
                client.set_terminated(run.info.run_id)
                continue
            for model in client.search_logged_models(
                [self.connection.experiment], f"source_run_id = '{run.info.run_id}'"
            ):
                client.delete_logged_model(model.model_id)
            client.delete_run(run.info.run_id)

    def _fetched(self, uri: str, room: Path, label: str) -> Path:
        """A local path of an artifact; where its folder was moved, the one beside the store as it stands now."""
        import mlflow

        if not uri.startswith("file:"):
            return Path(mlflow.artifacts.download_artifacts(artifact_uri=uri, dst_path=str(room)))
        path = Path(uri.removeprefix("file://"))
        parts = path.parts[path.parts.index("models") :] if "models" in path.parts else path.parts[-3:]
        for candidate in (path, self.place.folder.joinpath(*parts)):
            if candidate.exists():
                return candidate
        raise RegistryError(f"the files of {label} are gone: no {path}; train it anew with --retrain")


def _floor_tag(split: str) -> str:
    """A tag for each split, whose own text may hold signs that MLflow does not take in a tag's name."""
    return f"{_FLOOR_TAG}.{hashlib.sha256(split.encode()).hexdigest()[:16]}"
