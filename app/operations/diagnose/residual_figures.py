"""The residuals of a diagnosis run by run: without effects and with them, one figure for each
observable or family of observables; each point knows its run, its configuration and its impact."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from sqlalchemy import select

from ....array_types import Floats
from ....diagnosis.verdict import Verdict
from ....diagnosis.what_if import ComputedSet, RunName, RunResiduals
from ....schema.campaigns import Campaign
from ....schema.impacts import Impact
from ...common.quantities import shown_unit
from ...figures.figure import (
    DIMENSIONLESS,
    BandSeries,
    ColourRole,
    Plot,
    PlotAxis,
    PlotSeries,
    PointSeries,
    ReferenceLine,
)
from .report import run_settings_words
from .report_charts import SIGMAS, in_percent
from .wording import observable_label

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

#: Names of the two series of points, which the page's script knows.
BEFORE, AFTER = "nominal model", "with the effects"
#: Runs of a configuration are spread over so much of the way to the next.
_SPREAD = 0.6
#: Letters of a configuration's settings beside a point.
_MOST_LETTERS = 120


@dataclass(frozen=True)
class RunPoint:
    """What a point is: in words, and the address of the page of its impact ("" for a run without
    one)."""

    words: str
    address: str


def run_points(
    verdict: Verdict, impacts: Mapping[tuple[int, int], int] | None = None
) -> tuple[RunPoint, ...]:
    """A point for each run; `impacts`: the store's number of an impact by run and repetition."""
    if verdict.what_if is None:
        return ()
    numbers = impacts or {}
    points = []
    for own in verdict.what_if.runs:
        impact = numbers.get((own.run, own.repetition))
        name = f"run {own.run}.{own.repetition}, configuration {own.configuration + 1}"
        if impact is not None:
            name += f", impact {impact}"
        settings = configuration_words(verdict, own)
        words = f"{name} ({settings})" if settings else name
        points.append(RunPoint(words, "" if impact is None else f"/impacts/{impact}"))
    return tuple(points)


def configuration_words(verdict: Verdict, run: RunName) -> str:
    """The settings of a run's configuration in words; "" where the diagnosis does not know them."""
    labels = verdict.pictures.configurations
    if run.configuration >= len(labels):
        return ""
    words = run_settings_words(labels[run.configuration])
    return words if len(words) <= _MOST_LETTERS else f"{words[: _MOST_LETTERS - 1]}…"


def impacts_of(session: Session, campaign: str) -> dict[tuple[int, int], int]:
    """The store's number of every impact of a campaign, by run and repetition."""
    query = (
        select(Impact.run, Impact.repetition, Impact.id)
        .join(Campaign, Impact.campaign_id == Campaign.id)
        .where(Campaign.name == campaign)
        .order_by(Impact.id.desc())
    )
    return {(run, repetition): key for run, repetition, key in session.execute(query)}


def residual_choices(verdict: Verdict) -> list[str]:
    """What each of the residual figures shows, by family of observables."""
    return [_title(item) for item in _items(verdict)]


def largest_residual(verdict: Verdict) -> int:
    """The place among `residual_choices` of what is off most by its tolerance; 0 where there is
    none."""
    sizes = [_size(item) for item in _items(verdict)]
    return int(np.argmax(sizes)) if sizes else 0


def _size(item: RunResiduals) -> float:
    finite = item.before[np.isfinite(item.before)]
    return float(np.sqrt(np.mean(finite**2)) / item.tolerance) if finite.size else 0.0


def _items(verdict: Verdict) -> Sequence[RunResiduals]:
    return () if verdict.what_if is None else verdict.what_if.residuals


def _title(item: RunResiduals) -> str:
    if item.is_rms:
        return f"{item.family} ({item.stage}, rms of {item.observables})"
    label = observable_label(item.name).text
    family = "" if item.family in label else f"{item.family}: "
    return f"{family}{label} ({item.stage})"


def residual_figures(
    verdict: Verdict, shown: ComputedSet | None, points: Sequence[RunPoint]
) -> Iterator[Plot]:
    """A figure for each of `residual_choices`; without `shown` the points of the nominal model
    alone (those with effects are gaps, where there are sets to tick)."""
    if verdict.what_if is None:
        return
    place = _places(verdict.what_if.runs)
    labels = tuple(point.words for point in points)
    for i, item in enumerate(_items(verdict)):
        residuals_after = None if shown is None else shown.residuals[i]
        if residuals_after is None and verdict.what_if.sets:
            residuals_after = np.full(
                len(item.before), np.nan
            )  # a place for the sets that can be ticked
        yield _figure(item, residuals_after, place, labels)


def _places(runs: Sequence[RunName]) -> Floats:
    """(R,): about the number of the configuration, runs beside each other in their order."""
    count = np.bincount([run.configuration for run in runs], minlength=1)
    next_place = np.zeros(len(count))
    places = []
    for run in runs:
        number, own = count[run.configuration], next_place[run.configuration]
        next_place[run.configuration] += 1
        offset = (own - (number - 1) / 2) / max(number, 3) * _SPREAD
        places.append(run.configuration + 1 + offset)
    return np.array(places)


def _figure(
    item: RunResiduals, after: Floats | None, place: Floats, labels: tuple[str, ...]
) -> Plot:
    label = observable_label(item.name)
    relative = label.relative and not item.is_rms
    unit, scale = ("%", 1.0) if relative else (DIMENSIONLESS, 1.0)
    if not relative and not item.is_rms:
        unit, scale = shown_unit(item.unit)

    def shown(values: Floats) -> Floats:
        return in_percent(values) if relative else scale * values

    count = int(np.round(place.max(initial=1.0)))
    last = count + 0.5
    scatter = float(np.sqrt(np.nanmean(item.scatter**2))) if np.isfinite(item.scatter).any() else 0
    ends = shown(np.array([-SIGMAS * scatter, SIGMAS * scatter]))
    low, high = (0.0, float(ends[1])) if item.is_rms else (float(ends[0]), float(ends[1]))
    series: list[PlotSeries] = [
        BandSeries(
            name="repeatability, two standard deviations",
            role=ColourRole.NOISE,
            opacity=0.8,
            x=np.array([0.5, last]),
            low=np.array([low, low]),
            high=np.array([high, high]),
        ),
        PointSeries(
            name=BEFORE,
            role=ColourRole.BEFORE,
            x=place,
            y=shown(item.before),
            filled=False,
            labels=labels,
        ),
    ]
    if after is not None:
        series.append(
            PointSeries(name=AFTER, role=ColourRole.AFTER, x=place, y=shown(after), labels=labels)
        )
    limits = shown(np.array([-item.tolerance, item.tolerance]))
    lines = [ReferenceLine("y", float(limits[1]), "tolerance", ColourRole.TOLERANCE)]
    if not item.is_rms:
        lines.append(ReferenceLine("y", float(limits[0]), "tolerance", ColourRole.TOLERANCE))
    if item.is_rms:
        quantity = "rms error in tolerances"
    else:
        quantity = f"measured {'over' if relative else 'less'} simulated"
    return Plot(
        _title(item),
        PlotAxis("configuration", DIMENSIONLESS, limits=(0.5, last), whole=True),
        PlotAxis(quantity, unit or DIMENSIONLESS, from_zero=True),
        tuple(series),
        (ReferenceLine("y", 0.0, dash="solid"), *lines),
    )
