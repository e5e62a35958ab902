"""Registered models: listed, compared, judged, promoted. Trainings and extractions: each answers
with its job."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any, Literal

from fastapi import APIRouter, Query
from pydantic import BaseModel, Field

from ....dataset.snapshot import read_snapshot
from ....ingest.extraction.settings import ExtractionSettings
from ....schema.listings import get_campaign_id
from ....schema.session import Store
from ....training.registry.listing import chosen
from ...common.model_registry import models_extra, reader_of, registry_of, splits_of
from ...common.number_format import finite
from ...jobs.job_kinds.ingest import EXTRACT, ExtractArguments
from ...jobs.job_kinds.train import TRAIN, TrainArguments
from ...jobs.queue import JobView
from ...operations.train.figures import held_out_figures, listed_versions, side_by_side
from ...operations.train.service import promote_version
from ...operations.train.tables import USUAL_SPLITS
from ...web.dependencies import Configured, Key, Name, OpenStore, Running, Text
from ...web.jobs import Jobs
from .impacts import ExtractionOptions

if TYPE_CHECKING:
    from ....training.registry.records import Decision, Version
    from ....training.registry.registry import Registry


#: Versions beside each other on one page.
MOST_COMPARED = 8


def registry_at(db: str) -> Registry | None:
    """The registry of a store; None where nothing was trained yet, without a look at MLflow."""
    registry = registry_of(db)
    return None if registry.connection.nothing_there else registry


def needed(db: str) -> Registry:
    """Raises `LookupError` where nothing was trained yet."""
    registry = registry_at(db)
    if registry is None:
        raise LookupError("no model is registered; train some: pyroshock train DATASET")
    return registry


def chosen_versions(
    registry: Registry, labels: list[str], split: str | None = None
) -> list[Version]:
    """Versions by their labels, as they were judged on `split`; without one, on the first that all
    have in common.

    Raises `LookupError` for unknown ones, `ValueError` for too many.
    """
    if len(labels) > MOST_COMPARED:
        raise ValueError(f"{len(labels)} versions to compare; expected at most {MOST_COMPARED}")
    every = registry.versions()
    served = [chosen(every, label, split) for label in dict.fromkeys(labels)]
    if split is not None or len(served) < 2:
        return served
    splits = [{v.split: v for v in every if v.label == version.label} for version in served]
    common = [
        name
        for name in (*USUAL_SPLITS, *sorted(splits[0]))
        if all(name in records for records in splits)
    ]
    return [records[common[0]] for records in splits] if common else served


def promote(
    store: Store, db: str, model: str, version: int, *, other: str | None, forced: bool, reason: str
) -> Decision:
    """Promote or refuse, and keep why. Raises as `training.promotion.promote`."""
    with models_extra():
        needed(db)
    promotion = promote_version(
        store, db, f"{model}@{version}", on=other or None, force=forced, reason=reason
    )
    return promotion.decision


def decision_json(decision: Decision) -> dict[str, Any]:
    """As `promote --json`, its time as text."""
    return {**asdict(decision), "when": decision.when.isoformat(timespec="seconds")}


router = APIRouter(tags=["models"])


class Promotion(BaseModel):
    """`on`: a dataset or a campaign whose pulses judge both; `force`: though it is worse, which
    needs a `reason`."""

    on: Text | None = Field(None, max_length=1000)
    force: bool = False
    reason: Text = Field("", max_length=4000)


@router.get("/models")
def models(
    settings: Configured, dataset: str | None = None, split: str | None = None, every: bool = False
) -> Any:
    """Versions with their figures, floors and the thesis's; the newest of each kind unless
    `every`."""
    with models_extra():
        registry = registry_at(settings.db)
        rows = (
            []
            if registry is None
            else listed_versions(registry, dataset=dataset, split=split, every=every)
        )
    return finite(rows)


@router.get("/models/compare")
def compare(
    store: OpenStore,
    settings: Configured,
    version: Annotated[
        list[Annotated[str, Field(max_length=200)]], Query(min_length=2, max_length=8)
    ],
) -> Any:
    """Versions (NAME@VERSION) on the held-out pulses they have in common, with paired
    differences."""
    with models_extra():
        registry = needed(settings.db)
        return finite(side_by_side(registry, chosen_versions(registry, version), reader_of(store)))


@router.get("/models/promotions")
def promotions(settings: Configured) -> list[dict[str, Any]]:
    """Promotions and refusals, with who, when and why."""
    with models_extra():
        registry = registry_at(settings.db)
        return (
            []
            if registry is None
            else [decision_json(decision) for decision in registry.decisions()]
        )


@router.get("/models/{name}/{version}")
def held_out(name: Name, version: Key, store: OpenStore, settings: Configured) -> Any:
    """Predicted against measured on held-out pulses, and how often the intervals hold."""
    with models_extra():
        registry = needed(settings.db)
        version_found = chosen_versions(registry, [f"{name}@{version}"])[0]
        return finite(held_out_figures(registry, version_found, reader_of(store)))


@router.post("/models/{name}/{version}/promote")
def promoted(
    name: Name, version: Key, promotion: Promotion, store: OpenStore, settings: Configured
) -> dict[str, Any]:
    """Make a version the one in use, or hear why not: `promoted` says."""
    decision = promote(
        store,
        settings.db,
        name,
        version,
        other=promotion.on,
        forced=promotion.force,
        reason=promotion.reason,
    )
    return decision_json(decision)


def train_job(jobs: Jobs, store: Store, arguments: TrainArguments) -> JobView:
    """Queue a training; its result is `train --json`. Raises `LookupError`, `ValueError` for what
    there is not."""
    splits_of(read_snapshot(store, arguments.dataset).table, arguments.split)
    return jobs.ask(store, TRAIN, f"Training on {arguments.dataset}", arguments)


def extract_job(jobs: Jobs, store: Store, campaign: str, settings: ExtractionSettings) -> JobView:
    """Queue an extraction; its result is `extract --json`. Raises `LookupError` for an unknown
    campaign."""
    with store.reading() as session:
        get_campaign_id(session, campaign)
    arguments = ExtractArguments(campaign, settings.as_json())
    return jobs.ask(store, EXTRACT, f"Extraction of {campaign}", arguments)


class TrainingOptions(BaseModel):
    """As the options of `pyroshock train`; what is registered already is not trained again."""

    dataset: Text = Field(max_length=1000)
    models: Text = Field(
        "all", max_length=1000, description="names with commas between them, or all"
    )
    split: Text = Field("repetitions,configurations", max_length=1000)
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = 0
    budget: Literal["reduced", "full"] = "reduced"

    def asked(self) -> TrainArguments:
        """Raises `ValueError` for a model that there is not."""
        from ....training.models.catalogue import models_of

        return TrainArguments(
            self.dataset, list(models_of(self.models)), self.split, self.seed, self.budget
        )


class RepeatedExtraction(ExtractionOptions):
    """As the options of `pyroshock extract`."""


@router.post("/train")
def train(options: TrainingOptions, store: OpenStore, running: Running) -> dict[str, Any]:
    """Train models on a dataset; answers with the job, whose result is `train --json`."""
    return train_job(running, store, options.asked()).as_json()


@router.post("/campaigns/{name}/extract")
def extract(
    name: Name, options: RepeatedExtraction, store: OpenStore, running: Running
) -> dict[str, Any]:
    """Cut a campaign's pulses anew; answers with the job, whose result is `extract --json`."""
    return extract_job(running, store, name, options.settings()).as_json()
