"""Datasets: the list with what was trained on each, one dataset with its sources, building of one,
and trainings."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query
from sqlalchemy import func, select
from sqlalchemy.orm import Session
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from ...dataset.catalog import list_snapshots, list_withdrawals
from ...dataset.snapshot import SnapshotError, raw_files, read_snapshot
from ...schema.campaigns import Campaign
from ...schema.corrected_facts import corrections_since_dataset
from ...schema.impacts import DatasetSnapshot, Impact, Pulse, SnapshotPulse
from ...schema.listings import list_campaigns
from ...schema.session import Store
from ..common.model_registry import models_extra, registry_at
from ..operations.form import controls
from ..operations.train.build_dataset import DATASET_BUILD
from ..operations.train.datasets import correlation_rows, range_rows, snapshot_as_json
from ..operations.train.figures import version_rows
from ..operations.train.train import TRAIN
from ..operations.train.wording import bounded, model_sentences, share, share_range
from ..web.dependencies import Configured, Name, OpenStore
from ..web.page_sources import STORE_AND_MODELS
from ..web.rendering import page, part

router = APIRouter()

#: What a training may hold out, in the words of its form.
SPLITS = {
    "": "repetitions and configurations, as far as the dataset can be split so",
    "repetitions": "repetitions: how well it repeats configurations that it knows",
    "configurations": "configurations: how well it predicts configurations that it has not seen",
    "treatments": "treatments: as configurations, apart from the velocity",
    "materials": "materials: a figure for each tip material, which it has not seen",
    "campaigns": "campaigns: a figure for each campaign, which it has not seen",
}


def newer_pulses(session: Session, hash_: str, campaigns: list[str]) -> int:
    """How many pulses of these campaigns were extracted after the last one of a dataset, and are in
    use."""
    newest = (
        select(func.max(SnapshotPulse.pulse_id))
        .join(DatasetSnapshot, SnapshotPulse.snapshot_id == DatasetSnapshot.id)
        .where(DatasetSnapshot.content_hash == hash_)
    )
    query = (
        select(func.count())
        .select_from(Pulse)
        .join(Impact, Pulse.impact_id == Impact.id)
        .join(Campaign, Impact.campaign_id == Campaign.id)
        .where(Campaign.name.in_(campaigns), Pulse.current, Pulse.id > newest.scalar_subquery())
    )
    return session.scalar(query) or 0


def dataset_rows(store: Store, db: str) -> list[dict[str, Any]]:
    """Every dataset as a page lists it: with its models, and the pulses that its campaigns got
    since."""
    with models_extra():
        registry = registry_at(db)
        versions = [] if registry is None else registry.versions()
    with store.reading() as session:
        withdrawals = list_withdrawals(session)
        return [
            {
                "name": row["name"],
                "pulses": row["pulses"],
                "campaigns": ", ".join(row["campaigns"] or []),
                "models": sum(version.dataset.hash == row["hash"] for version in versions),
                "newer pulses": newer_pulses(session, row["hash"], row["campaigns"] or []),
                "withdrawn": withdrawals[row["hash"]].lost if row["hash"] in withdrawals else 0,
                "predictors": row["predictors"],
                "left out by quality": row["quality"],
                "hash": row["hash"][:12],
                "frozen_at": row["frozen_at"][:16].replace("T", " "),
            }
            for row in store_rows(session)
        ]


def store_rows(session: Session) -> list[dict[str, Any]]:
    """The datasets, the newest first."""
    return list_snapshots(session)[::-1]


@router.get("/datasets", dependencies=[Depends(STORE_AND_MODELS)])
def datasets(request: Request, store: OpenStore, settings: Configured) -> Response:
    return page(
        request,
        "datasets.html",
        rows=dataset_rows(store, settings.db),
        campaigns=[row for row in store.read(list_campaigns) if row["impacts"]],
        controls=controls(DATASET_BUILD, names=("quality", "velocity", "predictors")),
    )


@router.get("/datasets/{name}", dependencies=[Depends(STORE_AND_MODELS)])
def dataset(
    request: Request, name: Name, store: OpenStore, settings: Configured, existing: bool = False
) -> Response:
    with store.reading() as session:
        row = next((entry for entry in store_rows(session) if entry["name"] == name), None)
    try:
        snapshot, fault = read_snapshot(store, name), ""
    except SnapshotError as error:
        snapshot, fault = None, str(error)
    if snapshot is not None and row is None:  # asked by its hash
        return RedirectResponse(f"/datasets/{part(snapshot.name)}", 303)
    assert row is not None
    with models_extra():
        registry = registry_at(settings.db)
        versions = (
            []
            if registry is None
            else [v for v in registry.versions() if v.dataset.hash == row["hash"]]
        )
        models = [] if registry is None else version_rows(registry, versions)
    with store.reading() as session:
        corrected = corrections_since_dataset(session, row["name"])
        newer = newer_pulses(session, row["hash"], row["campaigns"] or [])
        files = [] if snapshot is None else raw_files(session, snapshot)
    return page(
        request,
        "dataset.html",
        row=row,
        existing=existing,
        corrected=corrected,
        fault=fault,
        facts=None if snapshot is None else snapshot_as_json(snapshot),
        ranges=[] if snapshot is None else range_rows(snapshot),
        correlations=[] if snapshot is None else correlation_rows(snapshot),
        files=[file | {"sha256": file["sha256"][:12]} for file in files],
        newer=newer,
        models=models,
        share=share,
        share_range=share_range,
        bounded=bounded,
    )


@router.get("/models/train")
def training_form(
    request: Request,
    store: OpenStore,
    dataset: Annotated[str, Query(max_length=1000)] = "",
) -> Response:
    rows = store.read(store_rows)
    return page(
        request,
        "models_train.html",
        datasets=[
            (
                row["name"],
                f"{row['name']}: {row['pulses']} pulses of {', '.join(row['campaigns'] or [])}",
            )
            for row in rows
        ],
        dataset=dataset,
        models=model_sentences(),
        splits=list(SPLITS.items()),
        controls=controls(TRAIN, names=("budget", "seed")),
    )
