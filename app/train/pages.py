"""Models: versions side by side, one version's held-out pulses, promotions with their reasons, and their charts."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any

from fastapi import APIRouter, Form, Query
from starlette.requests import Request
from starlette.responses import Response

from ...dataset.catalog import list_withdrawals
from ..common.model_registry import models_extra, reader_of, withdrawn_words
from ..common.quantities import display_of
from ..web.dependencies import Configured, Key, Name, OpenStore, Word
from ..web.figures_base import COLOURS, Figure, categories, figure, line, points
from ..web.rendering import page
from .api import chosen_versions, needed, promote, registry_at
from .figures import held_out_figures, listed_versions, side_by_side, version_rows


def errors_figure(rows: Sequence[Mapping[str, Any]], metric: str) -> Figure:
    """One metric of versions with its 90 % interval, and the thesis's figure where there is one (`version_row`)."""
    rated = [row for row in rows if row["metrics"][metric]["mean"] is not None]
    means = [row["metrics"][metric]["mean"] for row in rated]
    ends = [row["metrics"][metric]["ci90"] or (mean, mean) for row, mean in zip(rated, means, strict=True)]
    high = [max(0.0, (end[1] or mean) - mean) for end, mean in zip(ends, means, strict=True)]
    low = [max(0.0, mean - (end[0] or mean)) for end, mean in zip(ends, means, strict=True)]
    bars = {
        "type": "bar",
        "x": [f"{row['label']} ({row['split']})" for row in rated],
        "y": means,
        "name": "mean with 90 % interval",
        "marker": {"color": "c0"},
        "error_y": {"type": "data", "symmetric": False, "array": high, "arrayminus": low, "color": "quiet"},
    }
    thesis = [row["metrics"][metric]["thesis"] for row in rated]
    marks = {**points([], [], "thesis", "c1"), "x": bars["x"], "y": thesis}
    traces = [bars, marks] if any(value is not None for value in thesis) else [bars]
    return categories(traces, "", metric.replace("_", " "))


def against_figure(held_out: Mapping[str, Any], quantity: str) -> Figure:
    """Predicted over measured of held-out pulses, by tip material (`model_figures.held_out_figures`)."""
    columns = held_out["points"]
    display = display_of(quantity)
    name, scale = display.heading, display.scale
    values, tips = columns[quantity], columns["tip_material"]
    traces = []
    for i, tip in enumerate(dict.fromkeys(tips)):
        places = [place for place, label in enumerate(tips) if label == tip]
        measured, predicted = ([values[key][place] * scale for place in places] for key in ("measured", "predicted"))
        trace = points(measured, predicted, str(tip), COLOURS[i % len(COLOURS)])
        if values["low"] is not None:
            wide = [(values["high"][place] - values["predicted"][place]) * scale for place in places]
            trace["error_y"] = {
                "type": "data",
                "array": wide,
                "color": f"{COLOURS[i % len(COLOURS)]}/0.4",
                "thickness": 1,
            }
        traces.append(trace)
    every = [value * scale for key in ("measured", "predicted") for value in values[key]]
    ends = [min(every), max(every)]
    traces.append(line(ends, ends, "measured", "quiet", dash="dash", showlegend=False))
    return figure(traces, f"measured {name}", "predicted")


def coverage_figure(held_out: Mapping[str, Any]) -> Figure | None:
    """Share of held-out points within their intervals over the nominal share; None for a model without spread."""
    coverage = held_out["coverage"]
    traces = [
        points(coverage["level"], coverage[key], name, colour, mode="lines+markers")
        for key, name, colour in (("force", "force", "c0"), ("time", "contact time", "c1"))
        if coverage[key] is not None
    ]
    if not traces:
        return None
    return figure([line([0.4, 1], [0.4, 1], "as promised", "quiet", dash="dash"), *traces], "nominal share", "held")


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
def model(
    request: Request, name: Name, version: Key, store: OpenStore, settings: Configured, split: Word = ""
) -> Response:
    return _page(request, store, settings.db, name, version, None, split)


def _page(
    request: Request, store: OpenStore, db: str, name: str, version: int, decision: Any, split: str = ""
) -> Response:
    with models_extra():
        registry = needed(db)
        chosen = chosen_versions(registry, [f"{name}@{version}"], split or None)[0]
        splits = sorted(record.split for record in registry.versions() if record.label == chosen.label)
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
        splits=splits,
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
