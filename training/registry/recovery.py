"""Surviving files of a version registered again, where the registry's database was lost."""

from __future__ import annotations

import json
from collections.abc import Mapping
from contextlib import redirect_stderr
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .file_hashes import MODEL, RUN, check_files
from .locks import exclusive_lock
from .registry import Registry
from .tags import FILES_TAG, PROMOTED_TAG, SPLIT_TAG

if TYPE_CHECKING:
    from mlflow import MlflowClient


class RecoveryError(ValueError):
    """A version that cannot be registered again; the message says which file is missing or
    altered."""


def recover(registry: Registry, name: str, version: int, record: Mapping[str, Any]) -> str:
    """Register a version again from the files below the registry's folder, and return its label.

    `record` has `run_id`, `model_id` and `tags` as the registry had them. Every file is held
    against its SHA-256 first. The number is kept where it is still free. Nobody is put in use.
    Raises `RecoveryError`.
    """
    tags = {key: value for key, value in record["tags"].items() if key != PROMOTED_TAG}
    splits = {key: json.loads(value) for key, value in tags.items() if key.startswith(SPLIT_TAG)}
    folders = {
        None: _folders(
            registry, record["run_id"], record["model_id"], json.loads(tags.get(FILES_TAG, "{}"))
        )
    }
    further = {
        key: _folders(registry, split["run_id"], split["model_id"], split.get("files", {}))
        for key, split in splits.items()
    }
    with registry.connection.client() as client, exclusive_lock(registry.place, "registering"):
        import mlflow

        experiment = registry.connection.experiment
        assert experiment is not None
        _, model_id = _logged(client, experiment, name, *folders[None])
        for key, (model, run) in further.items():
            new_run, new_model = _logged(client, experiment, name, model, run)
            tags[key] = json.dumps({**splits[key], "run_id": new_run, "model_id": new_model})
        while True:
            with redirect_stderr(StringIO()):  # MLflow announces every version there
                registered = mlflow.register_model(f"models:/{model_id}", name, tags=tags)
            if int(registered.version) >= version:
                return f"{name}@{registered.version}"
            client.delete_model_version(
                name, registered.version
            )  # a number that another version had


def _folders(
    registry: Registry, run_id: str, model_id: str, files: Mapping[str, str]
) -> tuple[Path, Path]:
    """The folders of a model and its run. Raises `RecoveryError` where they are not as they were
    registered."""
    model = registry.place.folder / "models" / model_id / "artifacts"
    run = registry.place.folder / run_id / "artifacts"
    try:
        for folder, begin in ((model, MODEL), (run, RUN)):
            if not folder.is_dir():
                raise RecoveryError(f"no folder {folder}")
            check_files(folder, begin, files)
    except ValueError as error:
        raise RecoveryError(str(error)) from error
    return model, run


def _logged(
    client: MlflowClient, experiment: str, name: str, model: Path, run: Path
) -> tuple[str, str]:
    """A run and a model with copies of these files: the ids of both."""
    from mlflow.entities import LoggedModelStatus

    run_record = client.create_run(experiment, run_name=f"{name}, recovered")
    client.log_artifacts(run_record.info.run_id, str(run))
    logged = client.create_logged_model(experiment, name=name, source_run_id=run_record.info.run_id)
    client.log_model_artifacts(logged.model_id, str(model))
    client.finalize_logged_model(logged.model_id, LoggedModelStatus.READY)
    client.set_terminated(run_record.info.run_id)
    return str(run_record.info.run_id), str(logged.model_id)
