"""Tables of models for people: splits beside each other, the floor, and the thesis's figures
(Tables 4.4 to 4.9, 5.2 and 5.3) under our models' names.

Its Tables 5.2 and 5.3 are of the two optimised models, `coregional-gp` and `nn-ga`, and of the
analytic pulses. Where it gives a figure twice, the first row of `data/thesis_tables.csv` counts:
the optimised, more precise one. Table 4.8's time model, tuned by Bayesian optimisation, goes with
its network (section 4.4) and tells of `gp` too, behind Table
4.4's. The last three of Table 4.4 (SVM, kernel, linear: hundreds and more) stand as printed, as
relative errors.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from ....training.evaluation.floor import SCOPES, floor_metrics
from ....training.evaluation.metrics import METRICS
from ....training.registry.listing import finite, newest, row_of
from ....training.registry.records import Version
from ....training.registry.registry import Registry
from ....training.registry.usability import unusable_record

#: In the order in which their figures are read.
USUAL_SPLITS = ("repetitions", "configurations", "treatments")


@dataclass(frozen=True)
class ThesisFigure:
    """A figure as printed, and the table that prints it."""

    model: str
    metric: str
    value: float
    table: str


@cache
def all_figures() -> tuple[ThesisFigure, ...]:
    """Every figure, those that count first."""
    text = (files(__package__) / "data" / "thesis_tables.csv").read_text(encoding="utf-8")
    rows = list(csv.DictReader(text.splitlines()))
    return tuple(
        ThesisFigure(row["model"], row["metric"], float(row["value"]), row["table"]) for row in rows
    )


def thesis_figures(model: str) -> dict[str, ThesisFigure]:
    """By metric, what the thesis reports of a model; empty for one that it does not have."""
    figures: dict[str, ThesisFigure] = {}
    for figure in all_figures():
        if figure.model == model:
            figures.setdefault(figure.metric, figure)
    return figures


#: Metric -> heading; the others stand in the JSON.
_SHOWN = {
    "force_nrmse": "NRMSE",
    "contact_time_error": "time",
    "impulse_error": "impulse",
    "cost": "cost",
}
#: The thesis's cost is not ours: it depends on a number of elements that the thesis does not print.
_OF_THESIS = ("force_nrmse", "contact_time_error", "impulse_error")


def table_of(versions: Sequence[Version], floors: Mapping[str, str]) -> list[dict[str, Any]]:
    """Rows of one dataset's models, the best force NRMSE of the first split first, floors where
    they rank.

    `floors` by split, as the registry keeps them. Means over held-out pulses, errors as shares.
    """
    splits = list(dict.fromkeys(version.split for version in _in_usual_order(versions)))
    by_model: dict[str, dict[str, Version]] = {}
    for version in newest(versions):
        by_model.setdefault(version.name, {}).setdefault(version.split, version)
    rows = [_row(name, splits, splits_of_model) for name, splits_of_model in by_model.items()]
    rows += _floor_rows(splits, floors)
    return sorted(rows, key=lambda row: _rank(row, splits))


def floors_by_ground(
    registry: Registry, versions: Iterable[Version]
) -> dict[tuple[str, int], dict[str, str]]:
    """The floors by split of each dataset and seed that versions were trained with, in their
    order."""
    grounds = dict.fromkeys((version.dataset.hash, version.seed) for version in versions)
    return {ground: registry.floors(*ground) for ground in grounds}


def json_row(version: Version, floors: Mapping[str, str]) -> dict[str, Any]:
    """A version in JSON, beside it what repetitions allow on its split, and the thesis's figures of
    its kind."""
    row = row_of(version)
    if version.split in floors:
        scopes = {scope: floor_metrics(floors[version.split], scope) for scope in SCOPES}
        row["floor"] = {
            scope: {name: finite(metrics[name].mean) for name in METRICS} if metrics else None
            for scope, metrics in scopes.items()
        }
    exceeded = unusable_record(version, floors)
    row["exceeded_limit"] = (
        None
        if exceeded is None
        else {"error": exceeded.error, "limit": exceeded.limit, "rule": exceeded.rule}
    )
    row["not_usable"] = None if exceeded is None else str(exceeded)
    row["thesis"] = {name: figure.value for name, figure in _thesis(version).items()} or None
    return row


def _thesis(version: Version) -> dict[str, ThesisFigure]:
    """The thesis trained on a hammer's pulses: its figures say nothing of a gun's."""
    return thesis_figures(version.name) if version.dataset.predictor_set == "hammer" else {}


def _in_usual_order(versions: Iterable[Version]) -> list[Version]:
    return sorted(versions, key=lambda v: (_place(v.split), v.split))


def _place(split: str) -> int:
    return USUAL_SPLITS.index(split) if split in USUAL_SPLITS else len(USUAL_SPLITS)


def _row(
    name: str, splits: Sequence[str], versions_by_split: Mapping[str, Version]
) -> dict[str, Any]:
    crown = " *" if any(version.champion_of for version in versions_by_split.values()) else ""
    row: dict[str, Any] = {
        "model": name + crown,
        "version": _joined(versions_by_split.get(split) for split in splits),
    }
    thesis = _thesis(next(iter(versions_by_split.values())))
    for metric, heading in _SHOWN.items():
        for split in splits:
            row[f"{heading} {short(split)}"] = (
                _short(versions_by_split[split].metrics[metric].mean)
                if split in versions_by_split
                else None
            )
        if metric in _OF_THESIS:
            row[f"{heading} thesis"] = _short(thesis[metric].value) if metric in thesis else None
    row["cover 90 %"] = _joined_numbers(versions_by_split.get(split) for split in splits)
    row["seconds"] = f"{sum(version.cost.seconds for version in versions_by_split.values()):.1f}"
    return row


def _floor_rows(splits: Sequence[str], floors: Mapping[str, str]) -> list[dict[str, Any]]:
    """What repetitions allow: of the configuration, and of what the predictors tell apart."""
    rows = []
    for scope in SCOPES:
        of_split = {
            split: floor_metrics(floors[split], scope) for split in splits if split in floors
        }
        if not any(of_split.values()):
            continue
        row: dict[str, Any] = {"model": f"(floor by {scope})", "version": None}
        for metric, heading in _SHOWN.items():
            for split in splits:
                metrics = of_split.get(split, {})
                row[f"{heading} {short(split)}"] = (
                    _short(metrics[metric].mean) if metric in metrics else None
                )
            if metric in _OF_THESIS:
                row[f"{heading} thesis"] = None
        rows.append(row)
    return rows


def _rank(row: Mapping[str, Any], splits: Sequence[str]) -> tuple[float, ...]:
    figures = [row.get(f"{_SHOWN['force_nrmse']} {short(split)}") for split in splits]
    return tuple(float(figure) if figure else float("inf") for figure in figures)


def short(split: str) -> str:
    """A split as part of a heading."""
    name, _, value = split.partition("=")
    return value or {"repetitions": "rep.", "configurations": "conf.", "treatments": "treat."}.get(
        name, name
    )


def _short(value: float) -> str:
    return f"{value:.4f}" if abs(value) < 1 else f"{value:.4g}"


def _joined(versions: Iterable[Version | None]) -> str:
    numbers = ["-" if version is None else str(version.version) for version in versions]
    return numbers[0] if len(set(numbers)) == 1 else " ".join(numbers)


def _joined_numbers(versions: Iterable[Version | None]) -> str | None:
    covered = [version.metrics.get("force_covered") if version else None for version in versions]
    return (
        " ".join("-" if interval is None else f"{interval.mean:.2f}" for interval in covered)
        if any(covered)
        else None
    )
