"""The list of diagnoses as a picture over time: the model error of each bench, what remains with
the effects, and which diagnoses were adopted."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from sqlalchemy import select

from ....diagnosis.verdict import Verdict
from ....schema.campaigns import Campaign
from ...common.number_format import number
from ...figures.figure import (
    DIMENSIONLESS,
    ColourRole,
    LineSeries,
    Plot,
    PlotAxis,
    PlotSeries,
    PointSeries,
    ReferenceLine,
    as_floats,
    category,
)

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

#: One diagnosis needs no picture over time.
_LEAST = 2


@dataclass(frozen=True)
class ListedError:
    """A diagnosis of the list: its number, when it was made, its campaign and bench in words, the
    error before and with the effects in tolerances (NaN: not known), and what was adopted of it
    (None: nothing)."""

    number: int
    when: str
    campaign: str
    bench: str
    before: float
    after: float
    adopted: str | None


def listed_error(row: Mapping[str, Any], verdict: Verdict, bench: str) -> ListedError:
    """A row of `stored.list_diagnoses` with its verdict."""
    tolerance = verdict.gap.tolerance
    scale = 1 / tolerance if tolerance > 0 else math.nan
    remaining_error = verdict.path[-1].after if verdict.path else math.nan
    return ListedError(
        row["id"],
        str(row["diagnosed_at"])[:16].replace("T", " "),
        row["campaign"],
        bench,
        scale * verdict.gap.before,
        scale * remaining_error,
        row["adopted"],
    )


def bench_words(session: Session, campaigns: Sequence[str]) -> dict[str, str]:
    """By campaign what its shots or hits came from, in words: benches that read the same are
    numbered."""
    query = select(Campaign).where(Campaign.name.in_(list(campaigns)))
    keys: dict[str, tuple[str, int | None]] = {}
    for own in session.scalars(query):
        if own.gun is not None:
            bore, travel = number(1e3 * own.gun.bore_diameter_m), number(own.gun.travel_m)
            keys[own.name] = (f"gun, bore {bore} mm, travel {travel} m", own.gun_id)
        elif own.hammer is not None:
            keys[own.name] = (f"hammer, {number(own.hammer.mass_kg)} kg", own.hammer_id)
        else:
            keys[own.name] = (own.kind, None)
    values_by_bench: dict[str, list[int | None]] = {}
    for words, key in dict.fromkeys(keys.values()):
        values_by_bench.setdefault(words, []).append(key)
    return {
        name: words
        if len(values_by_bench[words]) == 1
        else f"{words} ({values_by_bench[words].index(key) + 1})"
        for name, (words, key) in keys.items()
    }


def errors_plot(rows: Sequence[ListedError]) -> Plot | None:
    """The picture, the oldest diagnosis first; None for fewer than two."""
    ordered = sorted(rows, key=lambda row: row.number)
    if len(ordered) < _LEAST or not any(row.before > 0 for row in ordered):
        return None
    series: list[PlotSeries] = []
    for i, bench in enumerate(dict.fromkeys(row.bench for row in ordered)):
        series += _of_bench(bench, i, [(k, r) for k, r in enumerate(ordered) if r.bench == bench])
    adopted = [(k, row) for k, row in enumerate(ordered) if row.adopted]
    if adopted:
        series.append(
            PointSeries(
                name="adopted into the twin",
                role=ColourRole.INK,
                x=as_floats([k for k, _ in adopted]),
                y=as_floats([row.before for _, row in adopted]),
                size=15.0,
                filled=False,
                labels=tuple(f"{row.campaign}: {row.adopted}" for _, row in adopted),
            )
        )
    return Plot(
        "Model errors over time",
        PlotAxis("diagnosis, in the order of time", categories=_names(ordered)),
        PlotAxis("model error in tolerances", DIMENSIONLESS, "log"),
        tuple(series),
        (ReferenceLine("y", 1.0, "tolerance", ColourRole.TOLERANCE),),
    )


def _names(rows: Sequence[ListedError]) -> tuple[str, ...]:
    return tuple(f"{row.number}: {row.when[:10]}" for row in rows)


def _of_bench(bench: str, place: int, rows: Sequence[tuple[int, ListedError]]) -> list[PlotSeries]:
    x = as_floats([k for k, _ in rows])
    campaigns = tuple(row.campaign for _, row in rows)
    errors_before = as_floats([row.before for _, row in rows])
    errors_after = as_floats([row.after for _, row in rows])
    points: list[PlotSeries] = [
        LineSeries(
            name=bench,
            detail="nominal model",
            role=category(place),
            x=x,
            y=errors_before,
            marks=True,
            width=1.2,
            labels=campaigns,
        )
    ]
    if np.isfinite(errors_after).any():
        points.append(
            PointSeries(
                name=bench,
                detail="with the effects, held out",
                role=category(place),
                x=x,
                y=errors_after,
                filled=False,
                labels=campaigns,
            )
        )
    return points
