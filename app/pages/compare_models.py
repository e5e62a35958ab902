"""Versions of models side by side, pulse by pulse, and the rows of the list that are compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query
from starlette.requests import Request
from starlette.responses import Response

from ...schema.session import Store
from ...training.evaluation.metrics import METRICS
from ..common.model_registry import models_extra, registry_at
from ..operations.faults import read
from ..operations.laboratory import Laboratory
from ..operations.train.charts import difference_figure, differences_to
from ..operations.train.compare import COMPARE, MOST_COMPARED, Comparing
from ..operations.train.comparing import MOST_EACH_WITH_EACH
from ..operations.train.figures import version_rows
from ..operations.train.paired_errors import (
    paired_errors,
    paired_figure,
    paired_sentences,
    paired_tables,
)
from ..operations.train.service import ModelComparison
from ..operations.train.ticked_versions import TickedGroup, comparable_group, ticked_groups
from ..operations.train.wording import (
    common_split,
    comparison_sentences,
    comparison_tables,
    metric_cell,
    share_with_range,
)
from ..web.dependencies import Configured, OpenStore, Word
from ..web.page_sources import STORE_AND_MODELS
from ..web.rendering import page, query

router = APIRouter()
#: What the page of a comparison draws and says.
_COMPARED = ("force_nrmse", "contact_time_error")


@dataclass(frozen=True)
class _Answer:
    """A comparison with the rows of its versions, or the status and the fault for which there is
    none."""

    status: int = 200
    fault: str = ""
    comparison: ModelComparison | None = None
    rows: Sequence[Mapping[str, Any]] = ()


@router.get("/models/compare", dependencies=[Depends(STORE_AND_MODELS)])
def compare(
    request: Request,
    store: OpenStore,
    settings: Configured,
    version: Annotated[list[str], Query()] = [],  # noqa: B006  FastAPI copies it
    split: Word = "",
) -> Response:
    with models_extra():
        registry = registry_at(settings.db)
        choices = [] if registry is None else version_rows(registry, registry.versions())
        groups = () if split else ticked_groups(version, choices)
        group = comparable_group(groups)
        named = version if group is None else group.rows
        answer = (
            _answer(store, settings.db, named, split)
            if version and registry is not None
            else _Answer()
        )
    plain = None if answer.comparison is None else answer.comparison.plain
    compared = {(row["label"], row["split"]) for row in answer.rows}
    return page(
        request,
        "models_compare.html",
        status=answer.status,
        choices=choices,
        chosen=compared if compared and group is None else _ticked_rows(version, split, choices),
        split="" if plain is None else common_split(plain),
        most=MOST_COMPARED,
        fault=answer.fault,
        found=plain,
        result=None if answer.comparison is None else _shown(answer.comparison, answer.rows),
        others=() if group is None else _other_groups(group, groups),
        share_with_range=share_with_range,
        metric_cell=metric_cell,
    )


def _answer(store: Store, db: str, version: Sequence[str], split: str) -> _Answer:
    from ..common.model_registry import needed

    try:
        comparing = read(Comparing, {"version": version, "split": split or None}, "network")
        comparison = COMPARE.answer(comparing, Laboratory(store, db), lambda *_: None)
        return _Answer(
            comparison=comparison,
            rows=version_rows(needed(db), comparison.comparisons.versions),
        )
    except (LookupError, ValueError) as error:
        return _Answer(404 if isinstance(error, LookupError) else 422, str(error))


def _ticked_rows(
    ticked: Sequence[str], split: str, choices: Sequence[Mapping[str, Any]]
) -> set[tuple[str, str | None]]:
    """The rows of the list to tick, of texts such as "svr@1 configurations": of a version without a
    split, the first row that it has there."""
    first_split = {row["label"]: row["split"] for row in reversed(choices)}
    pairs = (text.partition(" ")[::2] for text in ticked)
    return {(label, own or split or first_split.get(label)) for label, own in pairs}


def _other_groups(shown: TickedGroup, groups: Sequence[TickedGroup]) -> list[dict[str, str]]:
    """The other ticked groups in words, with the address that compares each; none for a single
    version, which has nothing beside it."""
    return [
        {
            "words": group.words,
            "address": f"/models/compare{query({'version': group.rows})}"
            if len(group.labels) > 1
            else "",
        }
        for group in groups
        if group is not shown
    ]


def _shown(comparison: ModelComparison, rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """What the page of a comparison says and draws: the best version beside the one in use (else
    the second best) pulse by pulse, forest plots, sentences, tables, and the versions that can be
    promoted."""
    plain = comparison.plain
    differences = plain["differences"]
    best = plain["models"][0]["label"]
    of_best = [row for row in differences if best in (row["a"], row["b"])]
    in_use = sorted(row["label"] for row in rows if row["champion"])
    compared_with_all = len(rows) <= MOST_EACH_WITH_EACH
    reference = in_use[0] if in_use and compared_with_all else best
    second = next((label for label in in_use if label != best), plain["models"][1]["label"])
    pair = paired_errors(comparison.comparisons.judged, best, second)
    return {
        "sentences": [
            *comparison_sentences({**plain, "differences": of_best}, _COMPARED),
            *paired_sentences(pair),
        ],
        "pair": pair,
        "paired": paired_figure(pair),
        "paired_tables": paired_tables(pair),
        "reference": reference,
        "figures": {
            metric: difference_figure(
                differences_to(reference, differences, metric), reference, metric
            )
            for metric in _COMPARED
        },
        "rows": rows,
        "tables": comparison_tables(plain, METRICS),
        "candidates": [row for row in rows if not row["champion"] and not row["not_usable"]],
    }
