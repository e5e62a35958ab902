"""The four pictures of the first page: what was recorded and how good it is, by day; the error of
the model in use beside its earlier versions; the error of the twin on each campaign, as its newest
diagnosis found it; and how far each plan is."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from ...doe.plans import list_plans
from ...schema.campaigns import UNKNOWN_DATE, Campaign
from ...schema.diagnoses import Diagnosis
from ..common.number_format import format_number
from ..figures.figure import BarSeries, ColourRole, Plot, PlotAxis, PointSeries, as_floats
from ..operations.diagnose.stored import adopted_words
from ..operations.ingest.recording_quality import RecordingQuality, recording_quality

if TYPE_CHECKING:
    from ...training.registry.records import Version

#: Bars of a picture: as many as can be read at one glance.
DAYS, VERSIONS, DIAGNOSES, PLANS = 14, 8, 8, 8
#: Campaigns whose recordings are counted for the days.
_CAMPAIGNS = 60
#: Of a model's errors the one that is drawn.
ERROR = "force_nrmse"
_ROW_PX = 26
_AXES_PX = 90


def recordings_plot(session: Session) -> Plot | None:
    """Recordings of the newest days that have any, by the worst finding of each; a campaign counts
    for its own day. None without recordings."""
    newest = (
        select(Campaign.id, Campaign.date)
        .where(Campaign.date != UNKNOWN_DATE)
        .order_by(Campaign.date.desc(), Campaign.id.desc())
        .limit(_CAMPAIGNS)
    )
    dates: dict[int, Any] = dict(iter(session.execute(newest)))
    by_day: defaultdict[Any, list[RecordingQuality]] = defaultdict(list)
    for key, quality in recording_quality(session, list(dates)).items():
        if quality.stored or quality.set_aside:
            by_day[dates[key]].append(quality)
    if not by_day:
        return None
    days = sorted(by_day)[-DAYS:]
    counts = {
        "accepted": [
            sum(quality.stored - quality.rejected - quality.warned for quality in by_day[day])
            for day in days
        ],
        "with warnings": [sum(quality.warned for quality in by_day[day]) for day in days],
        "rejected": [sum(quality.rejected for quality in by_day[day]) for day in days],
        "not readable": [sum(quality.set_aside for quality in by_day[day]) for day in days],
    }
    roles = (ColourRole.AFTER, ColourRole.NOISE, ColourRole.BEFORE, ColourRole.QUIET)
    return _stacked(
        "Recordings by day",
        tuple(day.isoformat() for day in days),
        "day",
        "recordings",
        dict(zip(counts, zip(counts.values(), roles, strict=True), strict=True)),
    )


def plans_plot(session: Session) -> Plot | None:
    """Runs of the plans by state, unfinished plans first; None without plans."""
    plans = sorted(list_plans(session), key=lambda plan: (plan["planned"] == 0, plan["name"]))
    plans = [plan for plan in plans if plan["runs"]][:PLANS]
    if not plans:
        return None
    roles = {
        "done": ("done", ColourRole.AFTER),
        "planned": ("to do", ColourRole.NOISE),
        "discarded": ("discarded", ColourRole.BEFORE),
    }
    return _stacked(
        "Runs of each plan",
        tuple(plan["name"] for plan in plans),
        "plan",
        "runs",
        {name: ([plan[state] for plan in plans], role) for state, (name, role) in roles.items()},
    )


def _stacked(
    title: str,
    categories: tuple[str, ...],
    quantity: str,
    counted: str,
    counts: Mapping[str, tuple[Sequence[int], ColourRole]],
) -> Plot:
    """Horizontal bars of whole numbers, one part after the other; parts that are nowhere are left
    out."""
    position = np.arange(len(categories), dtype=np.float64)
    starts, bars = np.zeros(len(categories)), []
    for name, (values, role) in counts.items():
        if not any(values):
            continue
        ends = starts + np.asarray(values, dtype=np.float64)
        labels = tuple(f"{value} {name}" for value in values)
        bars.append(
            BarSeries(position, ends, starts, name=name, horizontal=True, labels=labels, role=role)
        )
        starts = ends
    names = PlotAxis(quantity, categories=categories, reversed=True)
    axis = PlotAxis(counted, "1", from_zero=True, whole=True)
    height = _AXES_PX + _ROW_PX * len(categories)
    return Plot(title, axis, names, tuple(bars), height=max(height, 160))


def model_plot(versions: Sequence[Version]) -> Plot | None:
    """The force error of each model in use, and of its versions before and after that were judged
    on the same dataset and split; None where no model is in use."""
    rows = []
    for champion in versions:
        if champion.champion_of is None:
            continue
        comparable_versions = [
            version
            for version in versions
            if version.name == champion.name
            and (version.dataset.hash, version.split) == (champion.dataset.hash, champion.split)
        ]
        comparable_versions.sort(key=lambda version: version.version)
        place = comparable_versions.index(champion)
        begin = max(0, min(place, len(comparable_versions) - VERSIONS))
        rows += comparable_versions[begin : begin + VERSIONS]
    rows = [version for version in rows if ERROR in version.metrics][: 2 * VERSIONS]
    if not rows:
        return None
    series = []
    for name, in_use, role in (
        ("in use", True, ColourRole.MODEL),
        ("other versions", False, ColourRole.QUIET),
    ):
        places = [
            place
            for place, version in enumerate(rows)
            if (version.champion_of is not None) is in_use
        ]
        if not places:
            continue
        errors = [rows[place].metrics[ERROR] for place in places]
        series.append(
            PointSeries(
                as_floats([100 * error.mean for error in errors]),
                as_floats([float(place) for place in places]),
                x_low=as_floats([100 * error.low for error in errors]),
                x_high=as_floats([100 * error.high for error in errors]),
                name=name,
                role=role,
                labels=tuple(rows[place].label for place in places),
            )
        )
    names = PlotAxis(
        "version",
        categories=tuple(
            f"{version.label}, {version.champion_of}" if version.champion_of else version.label
            for version in rows
        ),
        reversed=True,
    )
    axis = PlotAxis("force error on pulses not learned from", "% of the peak", from_zero=True)
    return Plot(
        "Model in use and its versions",
        axis,
        names,
        tuple(series),
        height=max(_AXES_PX + _ROW_PX * len(rows), 160),
    )


def gaps_plot(session: Session) -> Plot | None:
    """The model error in tolerances that the newest diagnosis of each campaign found, and what is
    left of it with the effects found, on configurations not fitted; None without diagnoses."""
    newest = select(func.max(Diagnosis.id)).group_by(Diagnosis.campaign_id)
    query = (
        select(Diagnosis.id, Campaign.name, Diagnosis.report)
        .join(Campaign, Diagnosis.campaign_id == Campaign.id)
        .where(Diagnosis.id.in_(newest))
        .order_by(Diagnosis.id.desc())
        .limit(DIAGNOSES)
    )
    rows = [
        (key, name, report)
        for key, name, report in session.execute(query)
        if report["gap"].get("tolerance")
    ]
    if not rows:
        return None
    adopted = adopted_words(session, [key for key, _, _ in rows])
    errors_before = [report["gap"]["before"] / report["gap"]["tolerance"] for _, _, report in rows]
    errors_after = [_remaining(report) for _, _, report in rows]
    position = np.arange(len(rows), dtype=np.float64)
    bars = (
        BarSeries(
            position - 0.2,
            as_floats(errors_before),
            name="without effects",
            width=0.36,
            horizontal=True,
            labels=tuple(format_number(value, 3) for value in errors_before),
            role=ColourRole.BEFORE,
        ),
        BarSeries(
            position + 0.2,
            as_floats(errors_after),
            name="with the effects found",
            width=0.36,
            horizontal=True,
            labels=tuple(
                "not computed" if value is None else format_number(value, 3)
                for value in errors_after
            ),
            role=ColourRole.AFTER,
        ),
    )
    categories = tuple(
        f"{name}, {'adopted' if key in adopted else 'not adopted'}" for key, name, _ in rows
    )
    names = PlotAxis("campaign", categories=categories, reversed=True)
    return Plot(
        "Error of the twin by campaign",
        PlotAxis("model error", "tolerances", from_zero=True),
        names,
        bars,
        height=max(_AXES_PX + 2 * _ROW_PX * len(rows), 180),
    )


def _remaining(report: Mapping[str, Any]) -> float | None:
    """What the diagnosis's own answer leaves, in tolerances; None where it computed none."""
    shrinkage = report.get("shrinkage") or []
    return shrinkage[0]["after"] / report["gap"]["tolerance"] if shrinkage else None
