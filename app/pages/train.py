"""Models: those in use, versions side by side, one version's held-out pulses, and promotions with
their reasons."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

from fastapi import APIRouter, Depends, Query
from sqlalchemy import select
from starlette.requests import Request
from starlette.responses import Response

from ...dataset.catalog import list_snapshots, list_withdrawals
from ...schema.corrected_facts import corrections_since_dataset
from ...schema.impacts import Pulse
from ...schema.listings import list_campaigns
from ...schema.session import Store
from ...training.evaluation.metrics import METRICS
from ...training.registry.listing import chosen, newest
from ..common.model_registry import (
    models_extra,
    needed,
    reader_of,
    registry_at,
    withdrawn_words,
)
from ..common.quantities import velocities_of
from ..operations.faults import read
from ..operations.laboratory import Laboratory
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
from ..operations.train.compare import COMPARE, MOST_COMPARED, Comparing
from ..operations.train.comparing import MOST_EACH_WITH_EACH
from ..operations.train.figures import (
    compared_to,
    evaluated_figures,
    residual_columns,
    version_rows,
    worst_pulses,
)
from ..operations.train.searches import (
    importance_sentence,
    search_sentence,
    settings_rows,
    trial_rows,
)
from ..operations.train.wording import (
    bounded,
    common_split,
    comparison_sentences,
    comparison_tables,
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


@router.get("/models/compare", dependencies=[Depends(STORE_AND_MODELS)])
def compare(
    request: Request,
    store: OpenStore,
    settings: Configured,
    version: Annotated[list[str], Query()] = [],  # noqa: B006
    split: Word = "",
) -> Response:
    status, fault, comparison, rows = 200, "", None, []
    with models_extra():
        registry = registry_at(settings.db)
        choices = [] if registry is None else version_rows(registry, registry.versions())
        if version and registry is not None:
            try:
                values = {"version": version, "split": split or None}
                comparing = read(Comparing, values, "network")
                laboratory = Laboratory(store, settings.db)
                comparison = COMPARE.answer(comparing, laboratory, lambda *_: None)
                rows = version_rows(registry, comparison.comparisons.versions)
            except (LookupError, ValueError) as error:
                status, fault = (404 if isinstance(error, LookupError) else 422), str(error)
    plain = None if comparison is None else comparison.plain
    chosen_rows = {(row["label"], row["split"]) for row in rows}
    return page(
        request,
        "models_compare.html",
        status=status,
        choices=choices,
        chosen=chosen_rows or _ticked_rows(version, split, choices),
        split="" if plain is None else common_split(plain),
        most=MOST_COMPARED,
        fault=fault,
        found=plain,
        result=None if plain is None else _comparison(plain, rows),
        **_WORDS,
    )


def _ticked_rows(
    ticked: Sequence[str], split: str, choices: Sequence[Mapping[str, Any]]
) -> set[tuple[str, str | None]]:
    """The rows of the list to tick, of texts such as "svr@1 configurations": of a version without a
    split, the first row that it has there."""
    first_split = {row["label"]: row["split"] for row in reversed(choices)}
    pairs = (text.partition(" ")[::2] for text in ticked)
    return {(label, own or split or first_split.get(label)) for label, own in pairs}


#: What the page of a comparison draws and says.
_COMPARED = ("force_nrmse", "contact_time_error")


def _comparison(comparison: Mapping[str, Any], rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """What the page of a comparison says and draws: sentences about the best version, forest plots,
    tables, and the versions that can be promoted."""
    differences = comparison["differences"]
    best = comparison["models"][0]["label"]
    of_best = [row for row in differences if best in (row["a"], row["b"])]
    in_use = sorted(row["label"] for row in rows if row["champion"])
    compared_with_all = len(rows) <= MOST_EACH_WITH_EACH
    reference = in_use[0] if in_use and compared_with_all else best
    return {
        "sentences": list(comparison_sentences({**comparison, "differences": of_best}, _COMPARED)),
        "reference": reference,
        "figures": {
            metric: difference_figure(
                differences_to(reference, differences, metric), reference, metric
            )
            for metric in _COMPARED
        },
        "rows": rows,
        "tables": comparison_tables(comparison, METRICS),
        "candidates": [row for row in rows if not row["champion"] and not row["not_usable"]],
    }


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
