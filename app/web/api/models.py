"""Registered models: listed, compared, judged, promoted."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Query
from pydantic import BaseModel, Field

from ...finite import finite
from ...models.figures import held_out_figures, listed_versions, side_by_side
from ...models.training import models_extra, reader_of
from ..dependencies import Configured, Key, Name, OpenStore, Text
from ..registering import chosen_versions, decision_json, needed, promote, registry_at

router = APIRouter(tags=["models"])


class Promotion(BaseModel):
    """`on`: a dataset or a campaign whose pulses judge both; `force`: though it is worse, which needs a `reason`."""

    on: Text | None = Field(None, max_length=1000)
    force: bool = False
    reason: Text = Field("", max_length=4000)


@router.get("/models")
def models(settings: Configured, dataset: str | None = None, split: str | None = None, every: bool = False) -> Any:
    """Versions with their figures, floors and the thesis's; the newest of each kind unless `every`."""
    with models_extra():
        registry = registry_at(settings.db)
        rows = [] if registry is None else listed_versions(registry, dataset=dataset, split=split, every=every)
    return finite(rows)


@router.get("/models/compare")
def compare(
    store: OpenStore,
    settings: Configured,
    version: Annotated[list[Annotated[str, Field(max_length=200)]], Query(min_length=2, max_length=8)],
) -> Any:
    """Versions (NAME@VERSION) on the held-out pulses they have in common, with paired differences."""
    with models_extra():
        registry = needed(settings.db)
        return finite(side_by_side(registry, chosen_versions(registry, version), reader_of(store)))


@router.get("/models/promotions")
def promotions(settings: Configured) -> list[dict[str, Any]]:
    """Promotions and refusals, with who, when and why."""
    with models_extra():
        registry = registry_at(settings.db)
        return [] if registry is None else [decision_json(decision) for decision in registry.decisions()]


@router.get("/models/{name}/{version}")
def held_out(name: Name, version: Key, store: OpenStore, settings: Configured) -> Any:
    """Predicted against measured on held-out pulses, and how often the intervals hold."""
    with models_extra():
        registry = needed(settings.db)
        version_found = chosen_versions(registry, [f"{name}@{version}"])[0]
        return finite(held_out_figures(registry, version_found, reader_of(store)))


@router.post("/models/{name}/{version}/promote")
def promoted(name: Name, version: Key, asked: Promotion, store: OpenStore, settings: Configured) -> dict[str, Any]:
    """Make a version the one in use, or hear why not: `promoted` says."""
    decision = promote(store, settings.db, name, version, other=asked.on, forced=asked.force, reason=asked.reason)
    return decision_json(decision)
