"""Models: versions side by side, one version's held-out pulses, promotions with their reasons."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import APIRouter, Form, Query
from starlette.requests import Request
from starlette.responses import Response

from ....dataset.catalog import list_withdrawals
from ...models.figures import held_out_figures, listed_versions, side_by_side, version_rows
from ...models.training import models_extra, reader_of
from ...models.withdrawn import withdrawn_words
from ..dependencies import Configured, Key, Name, OpenStore
from ..figures.models import against_figure, coverage_figure, errors_figure
from ..registering import chosen_versions, needed, promote, registry_at
from ..rendering import page

router = APIRouter()
#: Metrics in the list; a version's page has all.
_SHOWN = ("force_nrmse", "peak_force_error", "contact_time_error", "impulse_error", "cost")
_MOST = 300


@router.get("/models")
def models(
    request: Request,
    store: OpenStore,
    settings: Configured,
    dataset: str = "",
    split: str = "",
    every: bool = False,
) -> Response:
    with models_extra():
        registry = registry_at(settings.db)
        rows = [] if registry is None else listed_versions(registry, every=every)
        withdrawn = [] if registry is None else withdrawn_words(store.read(list_withdrawals), registry.versions())
        decisions = [] if registry is None else registry.decisions()[:50]
    datasets = list(dict.fromkeys(row["dataset"] for row in rows))
    splits = list(dict.fromkeys(row["split"] for row in rows))
    shown = [row for row in rows if dataset in ("", row["dataset"]) and split in ("", row["split"])]
    shown.sort(key=lambda row: (row["dataset"], row["split"], _rank(row)))
    return page(
        request,
        "models.html",
        rows=shown[:_MOST],
        left_out=max(0, len(shown) - _MOST),
        datasets=datasets,
        splits=splits,
        dataset=dataset,
        split=split,
        every=every,
        metrics=_SHOWN,
        decisions=decisions,
        withdrawn=withdrawn,
        figure=errors_figure(shown[:24], "force_nrmse") if shown else None,
    )


def _rank(row: dict[str, Any]) -> float:
    mean = row["metrics"]["force_nrmse"]["mean"]
    return float("inf") if mean is None else float(mean)


@router.get("/models/compare")
def compare(
    request: Request,
    store: OpenStore,
    settings: Configured,
    version: Annotated[list[str], Query(max_length=20)] = [],  # noqa: B006
) -> Response:
    with models_extra():
        registry = needed(settings.db)
        chosen = chosen_versions(registry, version)
        rows = version_rows(registry, chosen)
        comparison = side_by_side(registry, chosen, reader_of(store))
    return page(
        request,
        "models_compare.html",
        rows=rows,
        found=comparison,
        metrics=list(rows[0]["metrics"]),
        figures={name: errors_figure(rows, name) for name in ("force_nrmse", "contact_time_error")},
    )


@router.get("/models/{name}/{version}")
def model(request: Request, name: Name, version: Key, store: OpenStore, settings: Configured) -> Response:
    return _page(request, store, settings.db, name, version, None)


def _page(request: Request, store: OpenStore, db: str, name: str, version: int, decision: Any) -> Response:
    with models_extra():
        registry = needed(db)
        chosen = chosen_versions(registry, [f"{name}@{version}"])[0]
        row = version_rows(registry, [chosen])[0]
        try:
            figures, why_not = held_out_figures(registry, chosen, reader_of(store)), ""
        except ValueError as error:
            figures, why_not = None, str(error)
        settings = registry.fit_settings(chosen)
        decisions = [decision for decision in registry.decisions() if decision.candidate == chosen.label]
    return page(
        request,
        "model.html",
        status=200 if decision is None or decision.promoted else 409,
        row=row,
        found=figures,
        why_not=why_not,
        against={} if figures is None else {q: against_figure(figures, q) for q in ("peak_force_n", "contact_time_s")},
        coverage=None if figures is None else coverage_figure(figures),
        decisions=decisions,
        decision=decision,
        settings=settings,
    )


@router.post("/models/{name}/{version}/promote")
def promoted(
    request: Request,
    name: Name,
    version: Key,
    store: OpenStore,
    settings: Configured,
    reason: Annotated[str, Form(max_length=4000)],
    on: Annotated[str, Form(max_length=1000)] = "",
    force: Annotated[bool, Form()] = False,
) -> Response:
    if not reason.strip():
        raise ValueError("no reason given; a promotion is kept with its reason")
    decision = promote(store, settings.db, name, version, other=on.strip() or None, forced=force, reason=reason.strip())
    return _page(request, store, settings.db, name, version, decision)
