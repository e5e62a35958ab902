"""Registered models: listed, and judged."""

from __future__ import annotations

from typing import Any

from fastapi import APIRouter

from ....training.registry.listing import chosen
from ...common.model_registry import models_extra, needed, reader_of, registry_at
from ...common.number_format import finite
from ...operations.train.figures import held_out_figures, listed_versions
from ...operations.train.service import decision_json
from ...web.dependencies import Configured, Key, Name, OpenStore

router = APIRouter(tags=["models"])


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
        record = chosen(registry.versions(), f"{name}@{version}")
        return finite(held_out_figures(registry, record, reader_of(store)))
