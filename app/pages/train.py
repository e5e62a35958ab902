"""Models: those in use, one version with its held-out pulses, and promotions with their reasons."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from fastapi import APIRouter, Depends
from sqlalchemy import select
from starlette.requests import Request
from starlette.responses import Response

from ...dataset.catalog import list_snapshots, list_withdrawals
from ...schema.corrected_facts import corrections_since_dataset
from ...schema.impacts import Pulse
from ...schema.listings import list_campaigns
from ...schema.session import Store
from ...training.registry.listing import chosen, newest
from ..common.model_registry import (
    models_extra,
    needed,
    reader_of,
    registry_at,
    withdrawn_words,
)
from ..common.quantities import velocities_of
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
from ..operations.train.figures import (
    compared_to,
    coverage_rows,
    evaluated_figures,
    residual_columns,
    version_rows,
    worst_pulses,
)
from ..operations.train.learning_curve import curve_figure, curve_rows, curve_sentences
from ..operations.train.registered_figures import worst_pulse_figures
from ..operations.train.searches import (
    importance_sentence,
    search_sentence,
    settings_rows,
    trial_rows,
)
from ..operations.train.strengths import (
    group_errors,
    settings_of_pulses,
    strength_sentences,
    strength_tables,
    strengths_figure,
)
from ..operations.train.wording import (
    bounded,
    is_warned_of,
    metric_cell,
    share,
    share_range,
    share_with_range,
    unseen,
    version_sentences,
    version_tables,
)
from ..web.dependencies import Configured, Key, Name, OpenStore, Word
from ..web.page_sources import STORE_AND_MODELS
from ..web.rendering import page

if TYPE_CHECKING:
    from ...array_types import Floats
    from ...dataset.table import PulseTable
    from ...training.registry.evaluate import Evaluation
    from ...training.registry.records import Version
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
    "is_warned_of": is_warned_of,
    "metric_cell": metric_cell,
}


@router.get("/models", dependencies=[Depends(STORE_AND_MODELS)])
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
        versions = [] if registry is None else registry.versions()
        shown_versions = versions if every else newest(versions)
        rows = [] if registry is None else version_rows(registry, shown_versions)
        withdrawn = (
            [] if registry is None else withdrawn_words(store.read(list_withdrawals), versions)
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
        sentences=version_sentences,
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
            every = registry.versions()
            first, *following = [chosen(every, label) for label in labels]
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


@router.get("/models/{name}/{version}", dependencies=[Depends(STORE_AND_MODELS)])
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
        versions = registry.versions()
        record = chosen(versions, f"{name}@{version}", split or None)
        splits = sorted(entry.split for entry in versions if entry.label == record.label)
        rows = version_rows(registry, [entry for entry in versions if entry.name == record.name])
        row = next(entry for entry in rows if entry["run_id"] == record.run_id)
        evaluation, why_not = _evaluation(registry, record, store)
        figures = None if evaluation is None else evaluated_figures(evaluation, record.label)
        groups = (
            []
            if evaluation is None
            else group_errors(
                evaluation, record.label, *_further_inputs(registry, record, evaluation, store)
            )
        )
        curve = registry.learning_curve(record)
        fit_settings = registry.fit_settings(record)
        histories = registry.fit_histories(record)
        searches = registry.searches(record)
        decisions = [entry for entry in registry.decisions() if entry.candidate == record.label]
    corrected = store.read(lambda session: corrections_since_dataset(session, record.dataset.name))
    velocity = {"impact_velocity_m_s": 1.0, "velocity_kind": record.dataset.velocity_kind}
    with velocities_of([velocity]):
        return page(
            request,
            "model.html",
            corrected=corrected,
            row=row,
            splits=splits,
            sentences=version_sentences(row),
            tables=version_tables(row),
            found=figures,
            why_not=why_not,
            strengths=strengths_figure(groups) if groups else None,
            strength_sentences=list(map(str, strength_sentences(record.label, groups)))
            if groups
            else [],
            strength_tables=strength_tables(groups) if groups else [],
            curve=curve_figure(curve, _floor_of(row)) if curve else None,
            curve_sentences=list(map(str, curve_sentences(curve))),
            curve_rows=curve_rows(curve),
            coverage_rows=[] if figures is None else coverage_rows(figures["coverage"]),
            worst_figures=[]
            if evaluation is None
            else worst_pulse_figures(evaluation.pulses, evaluation.predictions[record.label]),
            against={}
            if figures is None
            else {q: against_figure(figures, q) for q in ("peak_force_n", "contact_time_s")},
            residuals={}
            if evaluation is None
            else residual_figures(residual_columns(evaluation, record.label)),
            coverage=None if figures is None else coverage_figure(figures),
            worst=[]
            if evaluation is None
            else _with_impacts(store, worst_pulses(evaluation, record.label)),
            history=history_figure(rows),
            training=training_figures(histories),
            searches=[_search(part, search) for part, search in searches.items()],
            decisions=decisions,
            decision=decisions[0] if decided and decisions else None,
            settings=settings_rows(fit_settings, searches),
            datasets=[entry["name"] for entry in store.read(list_snapshots)],
            campaigns=[entry["name"] for entry in store.read(list_campaigns)],
            **_WORDS,
        )


def _floor_of(row: Mapping[str, Any]) -> float | None:
    """What repeated impacts differ by, of the first scope that has it."""
    floors = row["metrics"]["force_nrmse"]["floor"].values()
    return next((float(floor) for floor in floors if floor is not None), None)


def _further_inputs(
    registry: Any, version: Version, evaluation: Evaluation, store: Store
) -> tuple[PulseTable, dict[str, Floats]]:
    """The pulses that a version learned from, and the settings of its held-out pulses that are no
    predictors."""
    table = reader_of(store)(version.dataset.hash)
    training = table.take(np.isin(table.key, registry.held_out(version).trained_on))
    with store.reading() as session:
        settings = settings_of_pulses(session, evaluation.pulses.pulse_id.tolist())
    return training, settings


def _search(part: str, search: SettingsSearch) -> dict[str, Any]:
    """What the page says and draws of a search for settings."""
    importance = search.importance
    return {
        "sentence": search_sentence(part, search),
        "figure": search_figure(search),
        "importance": None if importance is None else importance_figure(importance),
        "importance_sentence": importance_sentence(search),
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
