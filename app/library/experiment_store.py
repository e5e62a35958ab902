"""The experiment store as notebooks use it: `ps.open(...)`."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from html import escape
from typing import TYPE_CHECKING, Any, Literal, overload

from ...schema.addresses import address_for_display
from ...schema.session import Store
from ..common.errors import raises_library_errors
from ..common.frames import chosen_columns, frame_of, sorted_by, titled_table
from ..doors.job_handle import JobHandle, LocalJobs
from ..doors.python import PythonMethod, StoreAnswers, with_arguments_of
from ..operations.diagnose.adopt import ADOPT
from ..operations.diagnose.blind_check import BLIND_CHECK, BlindCheckRequest
from ..operations.diagnose.delete import DELETE_DIAGNOSIS
from ..operations.diagnose.make import DIAGNOSE
from ..operations.diagnose.request import DiagnosisRequest
from ..operations.diagnose.show import SHOW_DIAGNOSIS
from ..operations.explore.explore import EXPLORE
from ..operations.explore.request import Exploration
from ..operations.faults import read
from ..operations.impacts.listing import SHOT_LIST, SelectedRows
from ..operations.ingest.extract import EXTRACT, Extraction
from ..operations.ingest.folder import INGEST
from ..operations.ingest.request import FolderIngest
from ..operations.operation import Answer, Operation, Result
from ..operations.people.attachments import (
    ATTACHMENT_ADD,
    ATTACHMENT_GET,
    ATTACHMENT_REMOVE,
    ATTACHMENT_RESTORE,
    NamedAttachment,
    NewAttachment,
    Removal,
)
from ..operations.predict.request import TwinOptions
from ..operations.store.integrity import DB_CHECK, StoreCheck
from ..operations.validate.request import ValidationRequest
from ..operations.validate.validating import VALIDATE

if TYPE_CHECKING:
    import pandas as pd

    from ...dataset.snapshot import Snapshot
    from ..doors.job_handle import JobSource
    from ..doors.python import Answers
    from ..operations.diagnose.service import GapDiagnosis
    from ..operations.explore.result import Explored
    from ..operations.impacts.service import ForcePulse, StoredRecording
    from ..operations.train.contact_model import StoredModel
    from ..operations.train.service import (
        FrozenDataset,
        ModelComparison,
        PromotionDecision,
        TrainingRuns,
    )
    from ..operations.validate.service import TwinValidation
    from .laboratory_twin import LaboratoryTwin
    from .plans import PlanCollection


class ExperimentStore:
    """Campaigns, impacts, plans, datasets, models and diagnoses of a laboratory, under one address.

    Use it in a `with` block, or call `close()`. What is read comes back as a pandas DataFrame, or
    as an object with `.to_frame()` and `.plot()`. Numbers are SI; a frame's columns bear their
    units, and `.attrs["units"]` lists them. Each error that a user can mend is a `PyroshockError`.
    `store` is the store of the database layer, for what has no method here.
    """

    def __init__(self, store: Store, url: str) -> None:
        self.store = store
        self.url = url
        self.answers: Answers = StoreAnswers(store, url)

    # --- plans

    @property
    def plan(self) -> PlanCollection:
        """The plans of campaigns, and the methods to make one: `store.plan.lhs("summer",
        runs=105)`."""
        from .plans import PlanCollection

        return PlanCollection(self.store, self.url)

    # --- campaigns, impacts, recordings

    #: Read the campaign in a folder into the store; what is stored is not stored again.
    ingest = PythonMethod(FolderIngest, INGEST)

    #: Extract the pulses of a campaign again from the stored series, with other settings.
    extract = PythonMethod(Extraction, EXTRACT)

    @raises_library_errors
    def campaigns(self, *, tag: str | None = None) -> pd.DataFrame:
        """A campaign in each row, with counts of its impacts, shots and runs.

        Parameters:
            tag: Give those that people have put this tag on. [default: all]

        Returns:
            Columns `name`, `kind`, `date`, `impacts`, `shots`, and `planned` and `done`, which
            count the runs of the campaign's plans.
        """
        return frame_of(self._campaign_rows(tag), ("name", "kind", "date"))

    def _campaign_rows(self, tag: str | None) -> Sequence[Mapping[str, Any]]:
        from ..operations.ingest.campaigns import CAMPAIGN_LIST

        return self._ask(CAMPAIGN_LIST, tag=tag).rows

    @raises_library_errors
    def impacts(
        self,
        *,
        campaign: str | None = None,
        where: str | Iterable[str] = (),
        columns: Sequence[str] | None = None,
        sort: str | None = None,
        limit: int | None = None,
    ) -> pd.DataFrame:
        """Impacts with their factors and the figures of their pulses: the rows of `pyroshock
        impacts`.

        Parameters:
            campaign: The name of the campaign whose impacts are listed; by default those of all
                campaigns.
            where: A condition or several, all of which must hold: "tip_material = steel",
                "peak_force_n > 1000". Numbers are in the unit of the column.
            columns: The columns of the result, in this order; by default all.
            sort: The column to sort by, "-column" for falling values; by default the order of
                storage.
            limit: The largest number of rows, counted after sorting; by default all.

        Returns:
            An impact in each row. Columns of quantities end in their SI unit, which
            `.attrs["units"]` holds, too.

        Raises:
            NotFoundError: For an unknown campaign, or column of `columns` and `sort`; the message
                lists those there are.
            InvalidValueError: For a condition that cannot be read or names no column, and a limit
                below 1.
        """
        values = {"campaign": campaign, "where": where, "limit": limit}
        selection = read(SelectedRows, values, "python")
        named = [*(columns or ()), *([] if sort is None else [sort.removeprefix("-")])]
        selection.conditions()  # one that cannot be read is refused before anything is asked
        frame = self._impacts(selection, limit if sort is None else None, named)
        frame = sorted_by(frame, sort)
        return chosen_columns(frame if limit is None else frame.head(limit), columns)

    def _impacts(
        self, selection: SelectedRows, limit: int | None, named: Sequence[str]
    ) -> pd.DataFrame:
        from ..operations.impacts.service import read_impacts

        return read_impacts(self.store, selection, limit, named)

    @raises_library_errors
    def shots(
        self,
        *,
        campaign: str | None = None,
        where: str | Iterable[str] = (),
        columns: Sequence[str] | None = None,
        sort: str | None = None,
        limit: int | None = None,
    ) -> pd.DataFrame:
        """Shots of the gun with their measured velocity and that of the nominal model: as
        `pyroshock shots`.

        Parameters:
            campaign: The name of the campaign whose shots are listed; by default those of all
                campaigns.
            where: A condition or several, all of which must hold, as `impacts` takes them.
            columns: The columns of the result, in this order; by default all.
            sort: The column to sort by, "-column" for falling values; by default the order of
                storage.
            limit: The largest number of rows, counted after sorting; by default all.

        Returns:
            A shot in each row. `predicted_velocity_m_s` is the nominal model's; pressures are
            gauge, in Pa.

        Raises:
            NotFoundError: For an unknown campaign, or column of `columns` and `sort`; the message
                lists those there are.
            InvalidValueError: For a condition that cannot be read or names no column, and a limit
                below 1.
        """
        from ...schema.conditions import SHOT_COLUMNS

        listed = ("campaign", *SHOT_COLUMNS, "predicted_velocity_m_s")
        read(SelectedRows, {"limit": limit}, "python")
        selection = read(SelectedRows, {"campaign": campaign, "where": where}, "python")
        frame = sorted_by(frame_of(self._shot_rows(selection), listed), sort)
        return chosen_columns(frame if limit is None else frame.head(limit), columns)

    def _shot_rows(self, selection: SelectedRows) -> Sequence[Mapping[str, Any]]:
        return self.answers.answer(SHOT_LIST, selection, False).rows

    #: A stored quantity against another, coloured by a third: a chart with its numbers and rows.
    explore: PythonMethod[Explored] = PythonMethod(Exploration, EXPLORE)

    @raises_library_errors
    def pulse(self, impact: int) -> ForcePulse:
        """The contact force of an impact: the pulse in use.

        Parameters:
            impact: The `id` of the impact in `impacts()`.

        Raises:
            NotFoundError: For an unknown impact, and for one without a pulse.
        """
        from ..operations.impacts.service import read_pulse

        with self.store.reading() as session:
            return read_pulse(session, impact)

    @raises_library_errors
    def recording(self, impact: int) -> StoredRecording:
        """The recording of an impact: channels by name, of which only the samples that are used are
        read.

        Parameters:
            impact: The `id` of the impact in `impacts()`.

        Raises:
            NotFoundError: For an unknown impact, and for one of which only the figures were
                ingested.
        """
        from ..operations.impacts.service import read_recording

        return read_recording(self.store, impact)

    # --- photographs and documents

    #: Attach a photograph or a document to a campaign, a run, an impact or a plan.
    attach = PythonMethod(NewAttachment, ATTACHMENT_ADD)

    #: An attached file, whose SHA-256 is compared: `.content` are its bytes, `.write(path)` writes
    #: it.
    attachment = PythonMethod(NamedAttachment, ATTACHMENT_GET)

    #: Take an attached file off, with a reason.
    remove_attachment = PythonMethod(Removal, ATTACHMENT_REMOVE)

    #: Put an attached file back that was removed.
    restore_attachment = PythonMethod(NamedAttachment, ATTACHMENT_RESTORE)

    @raises_library_errors
    def attachments(self, **settings: Any) -> pd.DataFrame:
        """Attached photographs and documents, the newest first.

        Parameters:
            settings: The options of `pyroshock attachments list`: `campaign` (with its impacts),
                `run`, `impact` or `plan` (by default all), `removed` (also those that were removed,
                by default False) and `limit` (at most so many, by default all).

        Returns:
            An attached file in each row: its number, what it is attached to, name, media type, size
            in bytes, SHA-256, size of a picture in pixels, caption, author and time.

        Raises:
            NotFoundError: For an unknown campaign, run, impact or plan.
            InvalidValueError: For an unknown option, and for two of the four.
        """
        from ..operations.people.attachments import ATTACHMENT_LIST

        rows = self._ask(ATTACHMENT_LIST, **settings).rows
        return frame_of(rows, ("attachment", "about", "subject", "file_name"))

    # --- datasets and models

    @raises_library_errors
    def datasets(self) -> pd.DataFrame:
        """A frozen dataset in each row: name, hash, pulses, campaigns."""
        from ..operations.train.stored_datasets import DATASET_LIST

        listed = self._ask(DATASET_LIST)
        return frame_of(listed.to_json(), ("name", "hash", "pulses", "campaigns"))

    @raises_library_errors
    def dataset(
        self, name: str, *, campaigns: str | Sequence[str] | None = None, **settings: Any
    ) -> FrozenDataset:
        """The dataset of this name (or hash); with `campaigns`, their usable pulses frozen under
        it.

        The same content again is the same dataset.

        Parameters:
            name: The name of the dataset, or the beginning of its hash where it is read.
            campaigns: The name or names of the campaigns whose pulses are frozen; by default a
                stored dataset is read.
            settings: The options of `pyroshock dataset build`: `predictors` ("hammer", "gun" or the
                path of a TOML file; by default the kind of the campaigns), `quality` (impacts with
                this verdict are left out: "reject", which is the default, "warning" or "none"),
                `extraction` (the fingerprint of an extraction; by default the pulses in use) and
                `velocity` ("before-contact" or "integrated", to which velocities are converted; by
                default they stay as stored).

        Raises:
            NotFoundError: For an unknown dataset or campaign.
            InvalidValueError: For a name in use with other content, and for campaigns without a
                usable pulse.
        """
        from ..operations.train.build_dataset import DATASET_BUILD, DatasetBuilding
        from ..operations.train.service import FrozenDataset

        if campaigns is None:
            return FrozenDataset(self._snapshot(name))
        values = {"name": name, "campaigns": _names(campaigns), **settings}
        request = read(DatasetBuilding, values, "python")
        return FrozenDataset(self.answers.answer(DATASET_BUILD, request).built.snapshot)

    def _snapshot(self, name: str) -> Snapshot:
        from ...dataset.snapshot import read_snapshot

        return read_snapshot(self.store, name)

    @raises_library_errors
    def train(
        self,
        dataset: FrozenDataset | str,
        *,
        splits: str | Sequence[str] = (),
        jobs: int = 1,
        progress: bool = True,
        **settings: Any,
    ) -> TrainingRuns:
        """Train models on a dataset and register them, each judged on pulses that it has not seen:
        `pyroshock train`.

        What is registered already is not trained again.

        Parameters:
            dataset: The dataset, or its name.
            splits: What is held out: "repetitions", "configurations", "treatments", "materials",
                "campaigns", "material=NAME" or "campaign=NAME", or several of these; by default
                repetitions and configurations, as far as the dataset can be split so.
            jobs: The number of processes that train at once.
            progress: Whether a bar shows the progress.
            settings: The options of `pyroshock train`: `models` (names of the catalogue or "all";
                by default "usual": linear, tree, gp, coregional-gp and nn-ga), `seed` (the same
                seed gives the same models, by default 0), `budget` ("small", "reduced" or "full":
                the size of the search of settings; by default small for the usual models, reduced
                for others) and `retrain` (also what is registered already, by default False).

        Raises:
            NotFoundError: For an unknown dataset or model.
            InvalidValueError: For a split that the dataset does not allow.
        """
        from ...parallel.executor import ExecutorConfig
        from ..operations.train.train import TRAIN, Training

        name = dataset if isinstance(dataset, str) else dataset.name
        request = read(Training, {"dataset": name, "split": splits, **settings}, "python")
        return self.answers.answer(TRAIN, request, progress, executor=ExecutorConfig(jobs=jobs))

    @raises_library_errors
    def models(self, *, dataset: str | None = None, split: str | None = None) -> pd.DataFrame:
        """Every registered version in a row, the newest first, with its errors; `in_use` says for
        which bench.

        Parameters:
            dataset: The name or hash of the dataset whose models are listed; by default those of
                all datasets.
            split: The split that the models were judged on, such as "configurations"; by default
                all splits.

        Returns:
            A version in each row, with the mean of each metric and the ends of its 90 % interval,
            and the duration of the training in s.
        """
        from ..operations.train.listed_models import MODEL_LIST
        from ..operations.train.service import versions_frame

        return versions_frame(self._ask(MODEL_LIST, dataset=dataset, split=split).versions)

    @raises_library_errors
    def model(self, name: str, *, split: str | None = None) -> StoredModel:
        """A registered model that predicts the pulses of a DataFrame.

        Parameters:
            name: "hybrid@3", "hybrid@champion" for the version in use, or "hybrid" for the newest
                one.
            split: The split that the newest version was judged on; by default any.

        Raises:
            NotFoundError: For an unknown model; the message lists those there are.
            InvalidValueError: For a damaged model.
        """
        from ..operations.train.contact_model import read_model

        return read_model(self.url, name, split)

    @raises_library_errors
    def compare(self, *models: str, **choice: Any) -> ModelComparison:
        """Versions on the held-out pulses that they have in common: which is better, and whether by
        chance.

        Parameters:
            models: Versions ("hybrid@3") or models; without any, the newest version of each model.
            choice: The options of `pyroshock compare`: `dataset` (by default the newest that was
                trained on), `split` (by default the first that all have in common) and `metric`
                ("force_nrmse" by default, or "all").

        Raises:
            NotFoundError: For an unknown model or dataset.
            InvalidValueError: For fewer than two versions, and versions of several splits.
        """
        from ..operations.train.compare import COMPARE, Comparing

        request = read(Comparing, {"version": models, **choice}, "python")
        return self.answers.answer(COMPARE, request)

    @raises_library_errors
    def promote(self, model: str, **settings: Any) -> PromotionDecision:
        """Put a version in use for the benches of its kind, if it predicts unseen configurations
        better.

        The decision is kept either way.

        Parameters:
            model: The version: "hybrid@3".
            settings: The options of `pyroshock promote`: `reason` (kept beside the figures, by
                default none), `on` (the dataset or campaign whose pulses decide; by default the
                held-out configurations) and `force` (put the version in use though it is worse,
                which needs a `reason`; by default False).

        Raises:
            NotFoundError: For an unknown version, dataset or campaign.
            InvalidValueError: For `force` without a `reason`, and a damaged version.
        """
        from ..operations.train.promote import PROMOTE, Promoting

        request = read(Promoting, {"model": model, **settings}, "python")
        return self.answers.answer(PROMOTE, request)

    # --- twin and diagnosis

    @with_arguments_of(TwinOptions)
    @raises_library_errors
    def twin(self, **options: Any) -> LaboratoryTwin:
        """The twin of a campaign's bench (without one, the newest of a gun), taught by its measured
        shots.

        Raises:
            NotFoundError: For an unknown campaign, material, effect or contact model.
            InvalidValueError: For a value that is out of its bounds, and a file with other content.
            StorageError: For a file that cannot be read.
        """
        from .laboratory_twin import laboratory_twin

        return laboratory_twin(self.store, self.url, **options)

    #: Each measured shot of a campaign beside a prediction of the twin that had not seen it.
    validate: PythonMethod[TwinValidation] = PythonMethod(ValidationRequest, VALIDATE)

    #: Where the gap between measurement and twin lies, which effect causes it, and how far it
    #: shrinks with it. A campaign of the store keeps its diagnosis.
    if TYPE_CHECKING:

        @overload
        def diagnose(
            self, campaign: str | os.PathLike[str], *, wait: Literal[False], **options: Any
        ) -> JobHandle[GapDiagnosis]: ...
        @overload
        def diagnose(
            self,
            campaign: str | os.PathLike[str],
            *,
            progress: bool = True,
            wait: Literal[True] = True,
            **options: Any,
        ) -> GapDiagnosis: ...
        def diagnose(self, campaign: Any, **options: Any) -> Any: ...
    else:
        diagnose = PythonMethod(DiagnosisRequest, DIAGNOSE)

    #: The diagnosis scored on virtual campaigns whose cause is withheld from it.
    blind_check = PythonMethod(BlindCheckRequest, BLIND_CHECK)

    @raises_library_errors
    def diagnoses(self, *, campaign: str | None = None) -> pd.DataFrame:
        """Diagnoses that the store keeps, the newest first: first answer, gap, and whether an
        effect was adopted.

        Parameters:
            campaign: The name of the campaign whose diagnoses are listed; by default those of all
                campaigns.

        Raises:
            NotFoundError: For an unknown campaign.
        """
        return frame_of(self._diagnosis_rows(campaign), ("id", "diagnosed_at", "campaign", "first"))

    def _diagnosis_rows(self, campaign: str | None) -> Sequence[Mapping[str, Any]]:
        from ..operations.diagnose.stored import list_diagnoses

        with self.store.reading() as session:
            return list_diagnoses(session, campaign, limit=None)

    @raises_library_errors
    def diagnosis(self, number: int) -> GapDiagnosis:
        """A diagnosis that the store keeps.

        Parameters:
            number: Its `id` in `diagnoses()`.

        Raises:
            NotFoundError: For a number that the store does not have.
        """
        return self._ask(SHOW_DIAGNOSIS, diagnosis=number).complete

    @raises_library_errors
    def adopt(self, diagnosis: GapDiagnosis, *, effect: str | None = None) -> GapDiagnosis:
        """Let predictions use an effect of a diagnosis from now on.

        Parameters:
            diagnosis: A diagnosis of a campaign of the store.
            effect: The effect ("gun.valve_flow"), several ("a+b"), or "none" to end an adoption; by
                default what the diagnosis says first.

        Returns:
            The same diagnosis, whose `version` is the new version of the bench's twin.

        Raises:
            InvalidValueError: For a diagnosis of a folder, which the store does not keep, and for
                an effect that the diagnosis has not fitted.
        """
        if diagnosis.number is None:
            raise ValueError(
                f"the diagnosis of {diagnosis.verdict.campaign} is of a folder; ingest it, and "
                "diagnose the campaign"
            )
        adopted = self._ask(ADOPT, diagnosis=diagnosis.number, effect=effect)
        return replace(diagnosis, version=adopted.version)

    @raises_library_errors
    def delete_diagnosis(self, number: int) -> None:
        """Delete a diagnosis.

        Parameters:
            number: Its `id` in `diagnoses()`.

        Raises:
            NotFoundError: For a number that the store does not have.
            InvalidValueError: For a diagnosis from which an effect was adopted.
        """
        self._ask(DELETE_DIAGNOSIS, diagnosis=number)

    def _ask(self, operation: Operation[Any, Answer], **given: Any) -> Answer:
        return self.answers.answer(operation, read(operation.request, given, "python"), False)

    # --- the store itself

    #: Whether everything in the store is as it was stored: hashes, references, counts, models.
    check = PythonMethod(StoreCheck, DB_CHECK)

    @raises_library_errors
    def query(self, statement: str, **settings: Any) -> pd.DataFrame:
        """The answer to one SELECT statement in SQL, which cannot change anything.

        Parameters:
            statement: The statement.
            settings: `parameters` (the values of :NAME in it), `limit` (most rows) and `timeout`
                ("60s"), as options of `pyroshock query`.
        """
        from ..operations.store.question import QUERY

        answer = self._ask(QUERY, statement=statement, **settings)
        return frame_of(answer.rows, answer.columns)

    @raises_library_errors
    def materials(self) -> pd.DataFrame:
        """A known material in each row: its constants, other names, and their source."""
        from ..operations.store.materials import MATERIAL_LIST

        return frame_of(self._ask(MATERIAL_LIST).rows, ("name",))

    @raises_library_errors
    def jobs(self, *, limit: int | None = None) -> pd.DataFrame:
        """The long work that was asked for, the newest first.

        Parameters:
            limit: At most so many jobs; by default 20.
        """
        from ..jobs.job_operations import JOB_LIST

        return frame_of(self._ask(JOB_LIST, limit=limit).rows, ("id", "state", "label"))

    @raises_library_errors
    def job(self, number: int) -> JobHandle[Result]:
        """Long work that was asked for: its state, and its result once it is done.

        Parameters:
            number: Its `id` in `jobs()`.

        Raises:
            NotFoundError: For a number that the store does not have.
        """
        handle: JobHandle[Result] = JobHandle(self._job_source(), number)
        handle.view  # noqa: B018  an unknown number is told at once
        return handle

    def _job_source(self) -> JobSource:
        return LocalJobs(self.store, self.url)

    @raises_library_errors
    def plugins(self) -> pd.DataFrame:
        """Readers, effects and models that other installed packages add, and whether they can be
        used."""
        from ..operations.store.plugins import PLUGINS

        return frame_of(self._ask(PLUGINS).rows, ("adds", "name", "package", "version", "state"))

    def close(self) -> None:
        """Release the connection to the database."""
        self.store.close()

    def __enter__(self) -> ExperimentStore:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<experiment store {address_for_display(self.url)}>"

    def _repr_html_(self) -> str:
        return titled_table(f"experiment store {escape(repr(self)[18:-1])}", self.campaigns())


def _names(given: str | Sequence[str]) -> tuple[str, ...]:
    return (given,) if isinstance(given, str) else tuple(given)
