"""Models registered, read back, promoted.

A version is written last, with all its tags in one transaction, when everything it stands for is
stored: what is listed is finished, wherever a training was killed. Models know nothing of this.
"""

from __future__ import annotations

import hashlib
import json
import tempfile
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr
from dataclasses import replace
from datetime import UTC, datetime
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...schema.transactions import is_transient, retry
from ..estimators.base import SettingValue
from ..models.serialization import ARRAYS_FILE, MODEL_FILE, ModelFileError, read_files, read_model
from ..tuning.importance import registered_searches
from ..tuning.trials import SettingsSearch
from .connection import Connection, RegistryError, patient
from .decisions import champions_of, crown, decide, decisions, next_stamp, settle
from .file_hashes import MODEL, RUN, AlteredFilesError, check_file, check_files, hash_files
from .listing import in_order
from .locks import exclusive_lock
from .logged import HELD_OUT, SEARCHES, code_version, log_figures, log_files, log_model
from .model_storage import ModelStorage
from .reader import RegistryReader, RunRecord, VersionRecord, version_record
from .records import DatasetName, Decision, HeldOutPredictions, RegisteredModel, Trained, Version
from .tags import (
    FIT,
    PREFIX,
    TASK_TAG,
    TRAINING_TAG,
    HeldOutError,
    fit_settings,
    further_splits,
    read_about,
    read_held_out,
    split_tag,
    version_from,
    version_tags,
)

if TYPE_CHECKING:
    from mlflow import MlflowClient

_SESSION_TAG, _FLOOR_TAG = PREFIX + "session", PREFIX + "floor"
_CURVE_TAG = PREFIX + "learning_curve"


class Registry:
    """Models registered at a place. Reading from a place where nothing was registered gives
    nothing, and makes none."""

    def __init__(self, place: ModelStorage) -> None:
        self.place = place
        self.connection = Connection(place)

    @patient
    def versions(self) -> list[Version]:
        """All registered versions, each with a record for every split, the newest first."""
        if self.connection.nothing_there:
            return []
        with self.connection.reading() as reader:
            aliases = reader.aliases()
            stored = _trained_versions(reader)
        champion_of = champions_of({(v.name, v.version): v.tags for v in stored}, aliases)
        return in_order(
            record for v in stored for record in _records(v, champion_of.get((v.name, v.version)))
        )

    @patient
    def recorded(self) -> list[dict[str, Any]]:
        """What the registry says of each version: `name`, `version`, `run_id`, `model_id`,
        `registered_at`, `tags`."""
        if self.connection.nothing_there:
            return []
        with self.connection.reading() as reader:
            stored = _trained_versions(reader)
        return [
            {
                "name": v.name,
                "version": v.version,
                "run_id": v.run_id,
                "model_id": v.model_id,
                "registered_at": datetime.fromtimestamp(v.created_ms / 1000, UTC),
                "tags": v.tags,
            }
            for v in stored
        ]

    def champion(self, predictor_set: str) -> Version | None:
        """The version in use for impacts that a predictor set describes, or None.

        Parameters:
            predictor_set: The name of the predictor set, such as "hammer".
        """
        served = (version for version in self.versions() if version.is_served)
        return next((version for version in served if version.champion_of == predictor_set), None)

    @patient
    def load(self, version: Version) -> RegisteredModel:
        """The model of a version, from its files.

        Parameters:
            version: An entry of `versions()`.

        Raises:
            ValueError: Where its files are gone or are not those written.
        """
        with self._model_of(version) as folder:
            model, written = read_model(folder, version.sha256)
        predictors, domain = read_about(written)
        if (
            "pulses" not in written
        ):  # an older version: the pulses are listed beside its held-out predictions
            written = {**written, "pulses": len(self.held_out(version).trained_on)}
        return RegisteredModel(version, model, predictors, domain, written)

    @patient
    def held_out(self, version: Version) -> HeldOutPredictions:
        """The held-out predictions that a version was judged by.

        Parameters:
            version: An entry of `versions()`, which is the record of one split.
        """
        uri = self._run_of(version).artifact_uri
        with self._files_of(version) as room:
            file = self._fetched(f"{uri}/{HELD_OUT}", room, version)
            check_file(file, RUN + HELD_OUT, version.files)
            return read_held_out(file)

    @patient
    def fit_settings(self, version: Version) -> dict[str, SettingValue]:
        """What a version's training searched and found, by name; empty for a version of older
        software.

        Parameters:
            version: An entry of `versions()`, which is the record of one split.
        """
        return fit_settings(self._run_of(version).parameters)

    @patient
    def fit_histories(self, version: Version) -> dict[str, list[tuple[int, float]]]:
        """Losses and errors of a version's training by name: (step, value), the first step first.

        Parameters:
            version: An entry of `versions()`, which is the record of one split.
        """
        run = self._run_of(version)
        names = [
            name for name in run.metrics if name.startswith(FIT) and name not in run.parameters
        ]
        with self.connection.reading() as reader:
            histories = reader.histories(version.run_id, names)
        return {name.removeprefix(FIT): points for name, points in histories.items()}

    @patient
    def searches(self, version: Version) -> dict[str, SettingsSearch]:
        """The trials of a version's searches for settings with the importance of these, by the part
        of the model ("force", "time").

        Empty where nothing was searched, or older software trained the version, or its files are
        gone.

        Parameters:
            version: An entry of `versions()`, which is the record of one split.
        """
        uri = self._run_of(version).artifact_uri
        stored_here = uri.startswith("file:")
        if not stored_here:
            with self.connection.client() as client:
                files = client.list_artifacts(version.run_id)
            if all(file.path != SEARCHES for file in files):
                return {}
        with self._files_of(version) as room:
            try:
                content = self._fetched(f"{uri}/{SEARCHES}", room, version).read_bytes()
            except RegistryError:
                if not stored_here:  # it is listed: that it cannot be read is no answer
                    raise
                return {}  # trained before trials were kept
        return registered_searches(json.loads(content))

    @patient
    def keep_learning_curve(self, version: Version, points: Sequence[Mapping[str, Any]]) -> None:
        """Store the learning curve of a version with the run that trained it, in the place of an
        earlier one.

        Parameters:
            version: An entry of `versions()`, which is the record of one split.
            points: The points as plain data (`LearningPoint.as_json`).
        """
        with self.connection.client() as client:
            client.set_tag(version.run_id, _CURVE_TAG, json.dumps(list(points)))

    def learning_curve(self, version: Version) -> list[dict[str, Any]]:
        """The stored learning curve of a version; empty where none was computed.

        Parameters:
            version: An entry of `versions()`, which is the record of one split.
        """
        points: list[dict[str, Any]] = json.loads(self._run_of(version).tags.get(_CURVE_TAG, "[]"))
        return points

    def damage(self, version: Version) -> str | None:
        """What is wrong with a version's files; None where they are those written.

        A server is only asked whether they are there: what it sends is checked when it is loaded.

        Parameters:
            version: An entry of `versions()`.
        """
        try:
            if self.place.is_server:
                self._check_listed(version)
                return None
            with self._model_of(version) as folder:
                read_files(folder, version.sha256)
            self.held_out(version)
            self._check_run(version)
        except ValueError as error:
            return str(error)
        return None

    def _check_listed(self, version: Version) -> None:
        """Raises `RegistryError` where the server no longer has a file of the version."""
        import mlflow

        uri = self._address_of_model(version)
        with self.connection.client() as client:
            files = [
                *mlflow.artifacts.list_artifacts(f"{uri}/data/model"),
                *client.list_artifacts(version.run_id),
            ]
        names = {Path(file.path).name for file in files}
        if missing := [name for name in (MODEL_FILE, ARRAYS_FILE, HELD_OUT) if name not in names]:
            raise RegistryError(
                f"the server has no {', '.join(missing)} of {version.label}; {_again(version)}"
            )

    def record(self, trained: Trained, session: str | None = None) -> Version:
        """Log a finished training, and register its model: the very last step.

        Where MLflow's store is lost on the way, all of it is done again, unless the version is
        there.

        Parameters:
            trained: The model, its held-out predictions and their figures.
            session: The id of the run that the training is logged under, from `open_session`; by
                default there is none.

        Returns:
            The version. Where the same training was registered as judged on other splits, it is
            that version with a further split.
        """
        begun: list[str] = []

        def attempt() -> Version:
            with self.connection.client() as client, tempfile.TemporaryDirectory() as room:
                return _registered(self.connection.reader_of(client), begun) or self._record(
                    client, Path(room), trained, session, begun
                )

        return retry(attempt, lambda error, _: is_transient(error))

    def _record(
        self,
        client: MlflowClient,
        room: Path,
        trained: Trained,
        session: str | None,
        begun: list[str],
    ) -> Version:
        import mlflow

        task = trained.task
        self._forget_unfinished(client, task.key)
        versions = code_version(trained.packed[0]["model"])
        tags = {TASK_TAG: task.key, **{PREFIX + name: value for name, value in versions.items()}}
        name = f"{task.model}, {task.split}"
        with mlflow.start_run(
            experiment_id=self.connection.experiment,
            run_name=name,
            tags=tags,
            nested=session is not None,
            parent_run_id=session,
        ) as run:
            begun.append(run.info.run_id)
            model_uri, model_id, sha256 = log_model(trained, room / "model")
            log_figures(client, run.info.run_id, model_id, trained)
            log_files(client, run.info.run_id, trained, room / "files")
            files = self._hash_logged(client, run.info.run_id, model_id, room / "logged")
            # MLflow counts a name's versions, and gives up after three races.
            with exclusive_lock(self.place, "registering"):
                reader = self.connection.reader_of(client)
                order = _next_order(reader)
                version = _version_without_split(reader, trained)
                if version is None:
                    own = version_tags(trained, sha256, files, order)
                    with redirect_stderr(StringIO()):  # MLflow announces every version there
                        registered = mlflow.register_model(model_uri, task.model, tags=own)
                    version = replace(version_record(registered), tags=own)
                else:
                    key, value = split_tag(
                        trained, sha256, files, order, run.info.run_id, model_id, time.time()
                    )
                    client.set_model_version_tag(task.model, str(version.version), key, value)
                    version = replace(version, tags={**version.tags, key: value})
        return next(record for record in _records(version) if record.task_key == task.key)

    @patient
    def close_runs(self, versions: Iterable[Version]) -> None:
        """Close the runs that a kill left open though their models are registered: nothing was to
        be done any more.

        Parameters:
            versions: The registered versions whose runs are closed.
        """
        ours = {version.run_id for version in versions}
        with self.connection.client() as client:
            for run in (
                client.search_runs([self._experiment], "attributes.status = 'RUNNING'")
                if ours
                else ()
            ):
                if run.info.run_id in ours:
                    client.set_terminated(run.info.run_id)

    @patient
    def open_session(self, dataset: DatasetName, seed: int) -> str:
        """The run over all trainings of a dataset with a seed: the one begun earlier, or a new one.

        Parameters:
            dataset: Name and hash of the pulses that are learned from.
            seed: The seed of the trainings.

        Returns:
            The id of the run.
        """
        with self.connection.client() as client:
            key = f"{dataset.hash} {seed}"
            sessions = self.connection.reader_of(client).runs_with(_SESSION_TAG, key)
            if sessions:
                return sessions[0].run_id
            run = client.create_run(
                self.connection.experiment,
                run_name=f"train {dataset.name}",
                tags={_SESSION_TAG: key},
            )
            client.log_param(run.info.run_id, "dataset", dataset.name)
            client.log_param(run.info.run_id, "dataset_hash", dataset.hash)
            client.log_param(run.info.run_id, "seed", seed)
            return str(run.info.run_id)

    @patient
    def close_session(
        self, session: str, figures: Mapping[str, bytes], floors: Mapping[str, str]
    ) -> None:
        """Log what stands over all trainings, and end their run.

        Parameters:
            session: The id of the run, from `open_session`.
            figures: The content of pictures (PNG) by file name.
            floors: The repeatability floor (JSON) of each split, from `floor_text`.
        """
        with self.connection.client() as client, tempfile.TemporaryDirectory() as room:
            for name, content in figures.items():
                (Path(room) / name).write_bytes(content)
                client.log_artifact(session, str(Path(room) / name))
            for split, floor in floors.items():
                client.set_tag(session, _floor_tag(split), json.dumps([split, floor]))
            client.set_terminated(session)

    @patient
    def floors(self, dataset_hash: str, seed: int) -> dict[str, str]:
        """The repeatability floor (JSON) by split, of the trainings of a dataset with a seed.

        Parameters:
            dataset_hash: The hash of the dataset.
            seed: The seed of the trainings.
        """
        if self.connection.nothing_there:
            return {}
        with self.connection.reading() as reader:
            sessions = reader.runs_with(_SESSION_TAG, f"{dataset_hash} {seed}")
        tags = sessions[0].tags if sessions else {}
        return dict(json.loads(text) for key, text in tags.items() if key.startswith(_FLOOR_TAG))

    @contextmanager
    def promoting(self) -> Iterator[None]:
        """Nobody else promotes meanwhile: `settle`, compare and `decide` in one hold."""
        with exclusive_lock(self.place, "promotion"):
            yield

    def set_champion(self, version: Version) -> None:
        """Make a version the only champion of its predictor set.

        Parameters:
            version: An entry of `versions()`.
        """
        with self.connection.client() as client:
            reader = self.connection.reader_of(client)
            crown(client, reader, version, next_stamp(reader))

    def delete(self, version: Version) -> None:
        """Take a version out of the registry with its files; its number is not given again. Within
        `promoting`.

        Parameters:
            version: An entry of `versions()`.
        """
        with self.connection.client() as client:
            number = str(version.version)
            model_id = client.get_model_version(version.name, number).model_id
            client.delete_model_version(version.name, number)
            if model_id is not None:
                client.delete_logged_model(model_id)
            client.delete_run(version.run_id)

    def settle(self) -> None:
        """Complete what a killed promotion has begun, or take it back. Within `promoting`."""
        versions = self.versions()
        with self.connection.client() as client:
            settle(client, self.connection.reader_of(client), versions)

    def decide(self, decision: Decision, candidate: Version) -> None:
        """Keep a promotion or its refusal, and make the candidate champion where it is one: both,
        or nothing.

        Within `promoting`, after `settle`.

        Parameters:
            decision: The promotion or refusal.
            candidate: The version that it is about.
        """
        with self.connection.client() as client:
            reader = self.connection.reader_of(client)
            decide(client, reader, self._experiment, decision, candidate)

    @patient
    def decisions(self) -> list[Decision]:
        """Promotions and refusals, the newest first."""
        if self.connection.nothing_there:
            return []
        versions = self.versions()
        with self.connection.reading() as reader:
            return decisions(reader, versions)

    @property
    def _experiment(self) -> str:
        """Known once a client was had."""
        assert self.connection.experiment is not None
        return self.connection.experiment

    def _forget_unfinished(self, client: MlflowClient, task_key: str) -> None:
        """Take back what a killed training of the same task has left."""
        running = f"tags.`{TASK_TAG}` = '{task_key}' AND attributes.status != 'FINISHED'"
        registered = {
            record.run_id
            for record in _all_records(self.connection.reader_of(client))
            if record.task_key == task_key
        }
        for run in client.search_runs([self.connection.experiment], running):
            if run.info.run_id in registered:
                client.set_terminated(run.info.run_id)
                continue
            of_run = f"source_run_id = '{run.info.run_id}'"
            for model in client.search_logged_models([self.connection.experiment], of_run):
                client.delete_logged_model(model.model_id)
            client.delete_run(run.info.run_id)

    @contextmanager
    def _model_of(self, version: Version) -> Iterator[Path]:
        """The folder with a version's model."""
        uri = self._address_of_model(version)
        with self._files_of(version) as room:
            folder = self._fetched(uri, room, version)
            check_files(folder, MODEL, version.files)
            yield folder / "data" / "model"

    @contextmanager
    def _files_of(self, version: Version) -> Iterator[Path]:
        """Room for what is fetched. What is wrong with a version's files says whose they are."""
        try:
            with tempfile.TemporaryDirectory() as room:
                yield Path(room)
        except (ModelFileError, HeldOutError, AlteredFilesError) as error:
            raise type(error)(f"{version.label}: {error}; {_again(version)}") from error

    def _check_run(self, version: Version) -> None:
        """Hold every file of a version's run against those registered. Raises
        `AlteredFilesError`."""
        uri = self._run_of(version).artifact_uri
        with self._files_of(version) as room:
            check_files(self._fetched(uri, room, version), RUN, version.files)

    @staticmethod
    def _hash_logged(
        client: MlflowClient, run_id: str, model_id: str, room: Path
    ) -> dict[str, str]:
        """SHA-256 of every file of a model and its run, as they were stored."""
        import mlflow

        hashes: dict[str, str] = {}
        for begin, uri in (
            (MODEL, client.get_logged_model(model_id).artifact_location),
            (RUN, client.get_run(run_id).info.artifact_uri),
        ):
            if uri.startswith("file:"):
                folder = Path(uri.removeprefix("file://"))
            else:
                target = room / begin.rstrip("/")
                target.mkdir(parents=True)
                folder = Path(
                    mlflow.artifacts.download_artifacts(artifact_uri=uri, dst_path=str(target))
                )
            hashes |= hash_files(folder, begin)
        return hashes

    def _run_of(self, version: Version) -> RunRecord:
        """The run that trained a version."""
        with self.connection.reading() as reader:
            run = reader.find_run(version.run_id)
        if run is None:
            raise self._lost(version, f"no run {version.run_id}")
        return run

    def _address_of_model(self, version: Version) -> str:
        """Where the files of a version's model are: those of the registered one, or of a further
        split's."""
        with self.connection.reading() as reader:
            address = (
                reader.find_version_location(version.name, version.version)
                if version.is_served
                else reader.find_model_location(version.model_id)
            )
        if address is None:
            raise self._lost(version, "no model")
        return address

    def _lost(self, version: Version, what: str) -> RegistryError:
        return RegistryError(
            f"model registry {self.place.shown} has {what} of {version.label}; {_again(version)}"
        )

    def _fetched(self, uri: str, room: Path, version: Version) -> Path:
        """A local path of an artifact; where its folder was moved, the one beside the store as it
        stands now."""
        if not uri.startswith("file:"):
            with self.connection.client():
                import mlflow

                return Path(
                    mlflow.artifacts.download_artifacts(artifact_uri=uri, dst_path=str(room))
                )
        path = Path(uri.removeprefix("file://"))
        own = (
            path.parts[-2:] if path.name == "artifacts" else path.parts[-3:]
        )  # of a run, whole or one file
        parts = path.parts[path.parts.index("models") :] if "models" in path.parts else own
        for candidate in (path, self.place.folder.joinpath(*parts)):
            if candidate.exists():
                return candidate
        raise RegistryError(f"the files of {version.label} are gone: no {path}; {_again(version)}")


def _again(version: Version) -> str:
    """What to do where a version's files are gone."""
    seed = f" --seed {version.seed}" if version.seed else ""
    words = f"{version.dataset.name} --models {version.name} --split {version.split}{seed}"
    return f"restore the folder, or train it again: pyroshock train {words}"


def _registered(reader: RegistryReader, runs: Sequence[str]) -> Version | None:
    """The version that one of these runs has registered, though nobody was told."""
    return (
        next((record for record in _all_records(reader) if record.run_id in runs), None)
        if runs
        else None
    )


def _trained_versions(reader: RegistryReader) -> list[VersionRecord]:
    """The registered versions that are ours."""
    return [version for version in reader.versions() if TASK_TAG in version.tags]


def _all_records(reader: RegistryReader) -> list[Version]:
    """Every version's records, without what is in use."""
    return [record for version in _trained_versions(reader) for record in _records(version)]


def _records(version: VersionRecord, champion_of: str | None = None) -> list[Version]:
    """A version's records of all of its splits, that of the model in use first."""
    served = version_from(
        version.name,
        version.version,
        version.run_id,
        version.created_ms,
        version.tags,
        champion_of,
    )
    return [served, *further_splits(served, version.tags)]


def _version_without_split(reader: RegistryReader, trained: Trained) -> VersionRecord | None:
    """The newest version of the same training that was not judged on this split yet."""
    task = trained.task
    same = [
        version
        for version in _trained_versions(reader)
        if version.name == task.model and version.tags.get(TRAINING_TAG) == task.training_key
    ]
    for version in sorted(same, key=lambda version: version.version, reverse=True):
        if all(record.split != task.split for record in _records(version)):
            return version
    return None


def _next_order(reader: RegistryReader) -> int:
    """In the turn of those who register; of a tracking server's other machines one may get the
    same: clocks tell."""
    return max((record.order for record in _all_records(reader)), default=0) + 1


def _floor_tag(split: str) -> str:
    """A tag for each split, whose own text may hold signs that MLflow does not take in a tag's
    name."""
    return f"{_FLOOR_TAG}.{hashlib.sha256(split.encode()).hexdigest()[:16]}"
