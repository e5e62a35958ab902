"""Models: those in use, versions side by side, one version's held-out pulses, and promotions with
their reasons."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

from fastapi import APIRouter, Form, Query
from sqlalchemy import select
from starlette.requests import Request
from starlette.responses import RedirectResponse, Response

from ...dataset.catalog import list_snapshots, list_withdrawals
from ...schema.impacts import Pulse
from ...schema.listings import list_campaigns
from ...schema.session import Store
from ..common.model_registry import models_extra, reader_of, withdrawn_words
from ..common.quantities import velocities_of
from ..doors.api.train import chosen_versions, needed, promote, registry_at
from ..operations.faults import FieldError
from ..operations.train.charts import (
    against_figure,
    coverage_figure,
    difference_figure,
    differences_to,
    history_figure,
    importance_figure,
    residual_figures,
    search_figure,
    training_figures,
)
from ..operations.train.comparing import UNSEEN_SPLITS
from ..operations.train.figures import (
    compared_to,
    evaluated_figures,
    listed_versions,
    residual_columns,
    side_by_side,
    version_rows,
    worst_pulses,
)
from ..operations.train.searches import (
    importance_of,
    importance_sentence,
    search_sentence,
    trial_rows,
)
from ..operations.train.wording import (
    bounded,
    error_sentence,
    lead_sentence,
    share,
    share_range,
    share_with_range,
    unseen,
)
from ..web.dependencies import Configured, Key, Name, OpenStore, Word
from ..web.rendering import page, part

if TYPE_CHECKING:
    from ...training.tuning.trials import SettingsSearch

router = APIRouter()
#: Metrics in the list that are relative errors; a version's page has all.
_SHOWN = {
    "force_nrmse": "force error",
    "peak_force_error": "peak force error",
    "contact_time_error": "contact time error",
    "impulse_error": "impulse error",
}
_MOST = 300
#: A chart of differences has so many versions besides the one that they are compared to.
_MOST_DIFFERENCES = 12
#: A version whose error is larger by so many errors of the reference would hide the differences of
#: all others.
_WORST = 10
#: Functions of `wording` that the templates of models call.
_WORDS: dict[str, Any] = {
    "share": share,
    "share_range": share_range,
    "share_with_range": share_with_range,
    "bounded": bounded,
    "unseen": unseen,
}


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
        withdrawn = (
            []
            if registry is None
            else withdrawn_words(store.read(list_withdrawals), registry.versions())
        )
        decisions = [] if registry is None else registry.decisions()[:50]
    datasets = list(dict.fromkeys(row["dataset"] for row in rows))
    splits = list(dict.fromkeys(row["split"] for row in rows))
    shown = [row for row in rows if dataset in ("", row["dataset"]) and split in ("", row["split"])]
    shown.sort(key=lambda row: (not row["champion"], row["dataset"], row["split"], _rank(row)))
    chart = _differences(store, settings.db, shown)
    return page(
        request,
        "models.html",
        rows=shown[:_MOST],
        in_use=[row for row in rows if row["champion"]],
        left_out=max(0, len(shown) - _MOST),
        datasets=datasets,
        splits=splits,
        dataset=dataset,
        split=split,
        every=every,
        metrics=_SHOWN,
        decisions=decisions,
        withdrawn=withdrawn,
        has_datasets=bool(store.read(list_snapshots)),
        chart_=chart,
        sentence=error_sentence,
        **_WORDS,
    )


def _rank(row: Mapping[str, Any]) -> float:
    mean = row["metrics"]["force_nrmse"]["mean"]
    return float("inf") if mean is None else float(mean)


def _differences(store: Store, db: str, rows: Sequence[Mapping[str, Any]]) -> dict[str, Any] | None:
    """The version that the others of its dataset and split are compared to ("reference"), their
    differences as a chart ("figure"), and the versions that are too bad for its axis ("beyond").

    The reference is the one in use, else the first one; None where nothing can be compared to it.
    """
    whole = [row for row in rows if not row["damaged"]]
    for reference in [row for row in whole if row["champion"]] or whole[:1]:
        same = ("dataset_hash", "split", "seed")
        others = [
            row
            for row in whole
            if row is not reference and all(row[name] == reference[name] for name in same)
        ][:_MOST_DIFFERENCES]
        if not others:
            continue
        with models_extra():
            registry = needed(db)
            labels = [row["label"] for row in (reference, *others)]
            first, *following = [
                version for label in labels for version in chosen_versions(registry, [label])
            ]
            try:
                differences = compared_to(registry, first, following, reader_of(store))
            except (ValueError, LookupError):  # pulses were deleted; the note of the page says so
                continue
        leads = differences_to(first.label, differences, "force_nrmse")
        near = [
            row
            for row in leads
            if row["difference"] < _WORST * reference["metrics"]["force_nrmse"]["mean"]
        ]
        near = near or leads  # a chart of nothing says less than one with a long axis
        return {
            "reference": reference,
            "figure": difference_figure(near, first.label, "force_nrmse"),
            "beyond": [row["label"] for row in leads if row not in near],
        }
    return None


@router.get("/models/compare")
def compare(
    request: Request,
    store: OpenStore,
    settings: Configured,
    version: Annotated[list[str], Query(max_length=20)] = [],  # noqa: B006
) -> Response:
    status, fault, comparison, rows = 200, "", None, []
    ticked = [_ticked(text) for text in version]
    splits = {split for _, split in ticked}
    with models_extra():
        registry = registry_at(settings.db)
        choices = [] if registry is None else listed_versions(registry, every=True)
        if version and registry is not None:
            try:
                if len(splits) > 1:
                    raise ValueError(
                        "versions of several splits are chosen; choose versions of one split"
                    )
                chosen = chosen_versions(
                    registry, [label for label, _ in ticked], min(splits) or None
                )
                comparison = side_by_side(registry, chosen, reader_of(store))
                rows = version_rows(registry, chosen)
            except (LookupError, ValueError) as error:
                status, fault = (404 if isinstance(error, LookupError) else 422), str(error)
    return page(
        request,
        "models_compare.html",
        status=status,
        choices=choices,
        chosen={(row["label"], row["split"]) for row in rows} or _ticked_rows(ticked, choices),
        split=min((row["split"] for row in rows), default="")
        if len({row["split"] for row in rows}) == 1
        else "",
        fault=fault,
        found=comparison,
        result=None if comparison is None else _comparison(comparison, rows),
        **_WORDS,
    )


def _ticked(text: str) -> tuple[str, str]:
    """A version and the split of its row in the list, "" for an address without one: "svr@1
    configurations"."""
    label, _, split = text.partition(" ")
    return label, split


def _ticked_rows(
    ticked: Sequence[tuple[str, str]], choices: Sequence[Mapping[str, Any]]
) -> set[tuple[str, str | None]]:
    """The rows of the list to tick: of a version without a split, the first row that it has
    there."""
    first_split = {row["label"]: row["split"] for row in reversed(choices)}
    return {(label, split or first_split.get(label)) for label, split in ticked}


def _comparison(comparison: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """What the page of a comparison says and draws: sentences, forest plots, and the versions that
    can be promoted."""
    metrics = ("force_nrmse", "contact_time_error")
    means = {
        metric: {model["label"]: model["metrics"][metric] for model in comparison["models"]}
        for metric in metrics
    }
    splits = {row["split"] for row in rows}
    split = splits.pop() if len(splits) == 1 else ""
    best = comparison["models"][0]["label"]
    paired = {row["a"] for row in comparison["differences"]} & {
        row["label"] for row in rows if row["champion"]
    }
    complete = len(rows) <= 4  # of more versions, the best alone was compared with all
    reference = next(iter(sorted(paired)), best) if complete else best
    return {
        "sentences": [
            lead_sentence(row, means[row["metric"]], split)
            for metric in metrics
            for row in comparison["differences"]
            if row["metric"] == metric and best in (row["a"], row["b"])
        ],
        "reference": reference,
        "figures": {
            metric: difference_figure(
                differences_to(reference, comparison["differences"], metric), reference, metric
            )
            for metric in metrics
        },
        "rows": rows,
        "advice": _advice(comparison, split),
        "candidates": [row for row in rows if not row["champion"] and not row["not_usable"]],
    }


def _advice(comparison: Mapping[str, Any], split: str) -> str:
    """What follows from the verdict on unseen configurations."""
    if (label := comparison["promotable"]) is not None:
        return f"{label} is better beyond chance on unseen configurations."
    if split not in UNSEEN_SPLITS:
        return (
            "These held-out pulses are of configurations that the versions have "
            "seen: they do not decide."
        )
    return (
        "No version is better than the others beyond chance on unseen "
        "configurations: measure further ones."
    )


@router.get("/models/{name}/{version}")
def model(
    request: Request,
    name: Name,
    version: Key,
    store: OpenStore,
    settings: Configured,
    decided: bool = False,
    split: Word = "",
) -> Response:
    with models_extra():
        registry = needed(settings.db)
        chosen = chosen_versions(registry, [f"{name}@{version}"], split or None)[0]
        versions = registry.versions()
        splits = sorted(record.split for record in versions if record.label == chosen.label)
        rows = version_rows(registry, [entry for entry in versions if entry.name == chosen.name])
        row = next(entry for entry in rows if entry["run_id"] == chosen.run_id)
        evaluation, why_not = _evaluation(registry, chosen, store)
        figures = None if evaluation is None else evaluated_figures(evaluation, chosen.label)
        fit_settings = registry.fit_settings(chosen)
        histories = registry.fit_histories(chosen)
        searches = registry.searches(chosen)
        decisions = [entry for entry in registry.decisions() if entry.candidate == chosen.label]
    velocity = {"impact_velocity_m_s": 1.0, "velocity_kind": chosen.dataset.velocity_kind}
    with velocities_of([velocity]):
        return page(
            request,
            "model.html",
            row=row,
            splits=splits,
            sentence=error_sentence(row),
            found=figures,
            why_not=why_not,
            against={}
            if figures is None
            else {q: against_figure(figures, q) for q in ("peak_force_n", "contact_time_s")},
            residuals={}
            if evaluation is None
            else residual_figures(residual_columns(evaluation, chosen.label)),
            coverage=None if figures is None else coverage_figure(figures),
            worst=[]
            if evaluation is None
            else _with_impacts(store, worst_pulses(evaluation, chosen.label)),
            history=history_figure(rows),
            training=training_figures(histories),
            searches=[_search(part, search) for part, search in searches.items()],
            decisions=decisions,
            decision=decisions[0] if decided and decisions else None,
            settings=fit_settings,
            datasets=[entry["name"] for entry in store.read(list_snapshots)],
            campaigns=[entry["name"] for entry in store.read(list_campaigns)],
            **_WORDS,
        )


def _search(part: str, search: SettingsSearch) -> dict[str, Any]:
    """What the page says and draws of a search for settings."""
    importance = importance_of(search)
    return {
        "sentence": search_sentence(part, search),
        "figure": search_figure(search),
        "importance": None if importance is None else importance_figure(importance),
        "importance_sentence": importance_sentence(search, importance),
        "trials": trial_rows(search),
    }


def _evaluation(registry: Any, version: Any, store: Store) -> tuple[Any, str]:
    """A version's held-out pulses with its predictions, or None and why not."""
    from ...training.registry.evaluate import evaluate_held_out

    try:
        return evaluate_held_out(registry, [version], reader_of(store)), ""
    except (ValueError, LookupError) as error:
        return None, str(error)


def _with_impacts(store: Store, rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The same with the impact of each pulse, which has a page, in place of the pulse."""
    keys = [row["pulse_id"] for row in rows]
    with store.reading() as session:
        query = select(Pulse.id, Pulse.impact_id).where(Pulse.id.in_(keys))
        impacts: dict[int, int] = dict(iter(session.execute(query)))
    return [
        {"impact": impacts.get(row["pulse_id"])}
        | {key: value for key, value in row.items() if key != "pulse_id"}
        for row in rows
    ]


@router.post("/models/{name}/{version}/promote")
def promoted(
    name: Name,
    version: Key,
    store: OpenStore,
    settings: Configured,
    reason: Annotated[str, Form(max_length=4000)] = "",
    on: Annotated[str, Form(max_length=1000)] = "",
    force: Annotated[bool, Form()] = False,
) -> Response:
    with models_extra():
        chosen_versions(needed(settings.db), [f"{name}@{version}"])
    if not reason.strip():
        raise FieldError(
            "reason", "There is no reason given. The registry keeps every decision with its reason."
        )
    try:
        promote(
            store,
            settings.db,
            name,
            version,
            other=on.strip() or None,
            forced=force,
            reason=reason.strip(),
        )
    except LookupError as error:
        raise FieldError("on", str(error)) from error
    return RedirectResponse(f"/models/{part(name)}/{version}?decided=true", 303)
