"""What was predicted of planned runs before their shots, and what was measured then.

The prediction of a run is the one that counts (`schema.run_predictions`): the newest of those that
were stored before the first shot of the run.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sqlalchemy import and_, select
from sqlalchemy.orm import Session

from ...schema.base import in_batches
from ...schema.campaigns import Plan, PlannedRun
from ...schema.impacts import BEFORE_CONTACT, ChannelFigures, Impact, Pulse, Shot, velocity_kind
from ...schema.provenance import Provenance
from ...schema.recordings import RecordedChannel
from ...schema.run_predictions import (
    QUANTITIES,
    RunPrediction,
    counting_predictions,
    lower_of,
    upper_of,
)
from ...schema.run_states import is_rejected, repetition_table
from .number_format import format_interval, format_number
from .quantities import display_of

#: Places of the ends of a 90 % band among the draws.
LOW, MIDDLE, HIGH = 0.05, 0.5, 0.95
#: Before and behind the name of a sensor: the key of its peak acceleration.
_PEAK, _UNIT = "peak_", "_m_s2"


@dataclass(frozen=True)
class ForecastBand:
    """A predicted quantity, SI: its median, the ends of its 90 % band, and the values of the draws
    in ascending order."""

    quantity: str
    median: float
    lower: float
    upper: float
    draws: tuple[float, ...]

    def rank_of(self, measured: float) -> float:
        """The place of a measured value among the draws, from 0 to 1.

        d draws part the line into d + 1 intervals that a further draw hits alike; the middle of the
        measured value's is taken. Draws that equal it count by half.
        """
        below = sum(draw < measured for draw in self.draws)
        equal = sum(draw == measured for draw in self.draws)
        return (below + 0.5 * equal + 0.5) / (len(self.draws) + 1)


@dataclass(frozen=True)
class RunForecast:
    """The prediction that counts of one planned run. `by` made it at `made_at` (UTC)."""

    plan: str
    run: int
    made_at: datetime
    by: str
    software: str
    campaign: str | None
    models: Mapping[str, str]
    adopted: Sequence[Mapping[str, Any]]
    bands: tuple[ForecastBand, ...]
    warnings: tuple[str, ...]
    remarks: tuple[str, ...]

    @property
    def model_words(self) -> str:
        """`gun: adiabatic; contact: tree@1`: what answered in each stage."""
        answered = (
            f"{stage}: {model}" for stage, model in self.models.items() if model not in _IDLE
        )
        return "; ".join(answered)

    @property
    def adopted_words(self) -> str:
        """Which adopted effects acted."""
        if not self.adopted:
            return "no adopted effects"
        return "; ".join(
            f"adopted effects of version {version['version']}: {', '.join(version['effects'])}"
            for version in self.adopted
        )

    @property
    def words(self) -> str:
        """When it was made, by whom and with what, as a sentence."""
        return (
            f"Predicted on {self.made_at:%Y-%m-%d at %H:%M} UTC by {self.by}, before the first "
            f"shot of run {self.run} of plan {self.plan} was stored ({self.model_words}; "
            f"{self.adopted_words})."
        )

    def as_json(self) -> dict[str, Any]:
        """The same for programs, without the bands."""
        return {
            "plan": self.plan,
            "run": self.run,
            "made_at": self.made_at.isoformat(),
            "made_by": self.by,
            "software_version": self.software,
            "bench_of": self.campaign,
            "models": dict(self.models),
            "adopted": [dict(version) for version in self.adopted],
            "warnings": list(self.warnings),
            "remarks": list(self.remarks),
        }


#: Models of a stage that say nothing of how it was predicted.
_IDLE = ("none", "nominal")


@dataclass(frozen=True)
class BandComparison:
    """A predicted quantity and what was measured of it; `rank` is the place of the measured value
    among the draws, from 0 to 1."""

    band: ForecastBand
    measured: float

    @property
    def rank(self) -> float:
        """The place of the measured value in the predicted distribution."""
        return self.band.rank_of(self.measured)

    @property
    def difference(self) -> float:
        """Measured less the median of the prediction."""
        return self.measured - self.band.median

    @property
    def difference_in_bands(self) -> float | None:
        """The same in widths of the 90 % band; None for a band without width."""
        width = self.band.upper - self.band.lower
        return self.difference / width if width > 0 else None

    @property
    def inside(self) -> bool:
        """Whether the measured value lies in the 90 % band."""
        return self.band.lower <= self.measured <= self.band.upper

    def as_json(self) -> dict[str, Any]:
        """A row for programs, in SI."""
        band = self.band
        return {
            "quantity": band.quantity,
            "median": band.median,
            "lower": band.lower,
            "upper": band.upper,
            "measured": self.measured,
            "difference": self.difference,
            "difference_in_bands": self.difference_in_bands,
            "rank": self.rank,
            "inside": self.inside,
        }


@dataclass(frozen=True)
class ComparedShot:
    """A shot and what was predicted of it. `impact` is the key of its impact, None without one."""

    run: int
    repetition: int
    impact: int | None
    forecast: RunForecast
    quantities: tuple[BandComparison, ...]


@dataclass(frozen=True)
class MeasuredHit:
    """What was measured of one repetition of a planned run: values by quantity, SI. `impact` is the
    key of its impact, None for a shot without one.

    A check that rejects a gun's shot takes contact time and force away, as the twin learns from
    such a shot; a hammer's impact is `rejected` as a whole.
    """

    planned_run: int
    run: int
    repetition: int
    impact: int | None
    rejected: bool
    values: Mapping[str, float]


def key_of_peak(sensor: str) -> str:
    """The quantity of a sensor's peak acceleration: `peak_acceleration_1_m_s2`."""
    return f"{_PEAK}{sensor}{_UNIT}"


def quantity_label(quantity: str) -> str:
    """What people call a predicted quantity."""
    if quantity in QUANTITIES:
        return display_of(quantity).label
    return f"peak {quantity.removeprefix(_PEAK).removesuffix(_UNIT)}"


def forecasts_of(session: Session, runs: Collection[int]) -> dict[int, RunForecast]:
    """The predictions that count of planned runs.

    Parameters:
        session: A session of the store.
        runs: Keys of planned runs.

    Returns:
        The prediction by the key of its run; a run without one is left out.
    """
    counting = counting_predictions(session, runs, with_draws=True)
    writers = {
        row.id: row
        for keys in in_batches(sorted({row.written_by_id for row in counting.values()}))
        for row in session.scalars(select(Provenance).where(Provenance.id.in_(keys)))
    }
    places = _places(session, counting)
    return {
        key: _forecast(row, *places[key], writers[row.written_by_id])
        for key, row in counting.items()
    }


def _places(session: Session, runs: Collection[int]) -> dict[int, tuple[str, int]]:
    """Plan and number of planned runs."""
    query = select(PlannedRun.id, Plan.name, PlannedRun.run).join(
        Plan, PlannedRun.plan_id == Plan.id
    )
    return {
        key: (plan, run)
        for keys in in_batches(sorted(runs))
        for key, plan, run in session.execute(query.where(PlannedRun.id.in_(keys)))
    }


def _forecast(row: RunPrediction, plan: str, run: int, writer: Provenance) -> RunForecast:
    return RunForecast(
        plan,
        run,
        row.made_at,
        writer.user,
        writer.software_version,
        row.campaign,
        row.models,
        row.adopted,
        tuple(_bands(row)),
        tuple(row.warnings),
        tuple(row.remarks),
    )


def _bands(row: RunPrediction) -> Iterator[ForecastBand]:
    for quantity in QUANTITIES:
        median = getattr(row, quantity)
        if median is not None:
            ends = getattr(row, lower_of(quantity)), getattr(row, upper_of(quantity))
            yield ForecastBand(quantity, median, *ends, tuple(row.drawn.get(quantity, ())))
    for quantity, draws in row.drawn.items():
        if quantity not in QUANTITIES:
            yield band_of(quantity, draws)


def band_of(quantity: str, draws: Sequence[float]) -> ForecastBand:
    """Median and 90 % band of draws.

    Parameters:
        quantity: What was drawn, with its SI unit at the end.
        draws: The values in any order, one at least.
    """
    ordered = sorted(draws)
    lower, median, upper = (_hazen(ordered, share) for share in (LOW, MIDDLE, HIGH))
    return ForecastBand(quantity, median, lower, upper, tuple(ordered))


def _hazen(ordered: Sequence[float], share: float) -> float:
    """A quantile of ascending values as the bands of `twin.prediction` take it: the value of place
    k of n stands at (k - 0.5) / n, and between two places on a line."""
    place = min(max(share * len(ordered) - 0.5, 0.0), len(ordered) - 1.0)
    first = math.floor(place)
    second = min(first + 1, len(ordered) - 1)
    return ordered[first] + (place - first) * (ordered[second] - ordered[first])


def hits_of_runs(
    session: Session, runs: Collection[int], impact: int | None = None
) -> list[MeasuredHit]:
    """What was measured of planned runs, a gun's shots or a hammer's impacts.

    The velocity is the one before contact; the force is the peak of the spline through the pulse in
    use, which the twin predicts.

    Parameters:
        session: A session of the store.
        runs: Keys of planned runs.
        impact: The key of the impact whose hit alone is wanted; by default all.

    Returns:
        The hits in the order in which they were stored.
    """
    hits: list[MeasuredHit] = []
    query = select(Plan.kind, PlannedRun.id).join(PlannedRun, PlannedRun.plan_id == Plan.id)
    for keys in in_batches(sorted(runs)):
        kinds: defaultdict[str, list[int]] = defaultdict(list)
        for kind, key in session.execute(query.where(PlannedRun.id.in_(keys))):
            kinds[kind].append(key)
        for kind, own in kinds.items():
            hits += _hits(session, kind, own, impact)
    return hits


def _hits(
    session: Session, kind: str, runs: Sequence[int], impact: int | None
) -> list[MeasuredHit]:
    table = repetition_table(kind)
    velocity = Shot.measured_velocity_m_s if table is Shot else Impact.impact_velocity_m_s
    query: Any = select(  # a table more or less: no type of its own
        table.planned_run_id, table.run, table.repetition, Impact.id, is_rejected(table),
        table.velocity_source, velocity, Pulse.contact_time_s, Pulse.spline_peak_force_n,
    )  # fmt: skip
    if table is Shot:
        query = query.outerjoin(Impact, Shot.impact_id == Impact.id)
    query = query.outerjoin(Pulse, and_(Pulse.impact_id == Impact.id, Pulse.current))
    query = query.where(table.planned_run_id.in_(runs)).order_by(table.id)
    if impact is not None:
        query = query.where(Impact.id == impact)
    rows = [tuple(row) for row in session.execute(query)]
    peaks = _peaks(session, [row[3] for row in rows if row[3] is not None])
    hits = []
    for run_key, run, repetition, key, rejected, *measured in rows:
        if rejected:
            measured[2:] = None, None
        is_left_out = bool(rejected) and table is Impact
        values = _values(measured, peaks.get(key, {}))
        hits.append(MeasuredHit(run_key, run, repetition, key, is_left_out, values))
    return hits


def _values(measured: Sequence[Any], peaks: Mapping[str, float]) -> dict[str, float]:
    source, velocity, contact_time, peak_force = measured
    if velocity_kind(source) != BEFORE_CONTACT:
        velocity = None
    pairs = zip(QUANTITIES, (velocity, contact_time, peak_force), strict=True)
    return {name: value for name, value in pairs if value is not None} | dict(peaks)


def _peaks(session: Session, impacts: Sequence[int]) -> dict[int, dict[str, float]]:
    """Peak accelerations of impacts by the quantity of their channel."""
    peaks: defaultdict[int, dict[str, float]] = defaultdict(dict)
    query = select(
        ChannelFigures.impact_id, RecordedChannel.name, ChannelFigures.peak_acceleration_m_s2
    ).join(RecordedChannel, ChannelFigures.channel_id == RecordedChannel.id)
    for keys in in_batches(impacts):
        for impact, channel, peak in session.execute(
            query.where(ChannelFigures.impact_id.in_(keys))
        ):
            peaks[impact][key_of_peak(channel)] = peak
    return peaks


def compared_with(forecast: RunForecast, hit: MeasuredHit) -> tuple[BandComparison, ...]:
    """The quantities of a prediction that were measured in a hit of its run."""
    return tuple(
        BandComparison(band, hit.values[band.quantity])
        for band in forecast.bands
        if band.quantity in hit.values
    )


def forecast_of_impact(
    session: Session, impact: int
) -> tuple[RunForecast, tuple[BandComparison, ...]] | None:
    """The prediction that was made before an impact, and what was measured then.

    Parameters:
        session: A session of the store.
        impact: The key of the impact.

    Returns:
        The prediction with the quantities that were measured; None where the impact belongs to no
        planned run, or nothing was predicted before the first shot of the run.
    """
    for key, forecast in forecasts_of(session, _runs_of_impact(session, impact)).items():
        hits = hits_of_runs(session, [key], impact)
        return forecast, tuple(pair for hit in hits for pair in compared_with(forecast, hit))
    return None


def _runs_of_impact(session: Session, impact: int) -> set[int]:
    """The key of the planned run that an impact, or the shot that it is of, is linked to."""
    query = select(Impact.planned_run_id, Shot.planned_run_id).outerjoin(
        Shot, Shot.impact_id == Impact.id
    )
    rows = session.execute(query.where(Impact.id == impact))
    return {key for row in rows for key in row if key is not None}


def spectra_before(session: Session, impact: int) -> dict[str, Any] | None:
    """The spectra that were predicted before an impact (`RunPrediction.spectra`).

    Parameters:
        session: A session of the store.
        impact: The key of the impact.

    Returns:
        The spectra; None where nothing was predicted before, or no spectrum.
    """
    for row in counting_predictions(session, _runs_of_impact(session, impact)).values():
        return row.spectra
    return None


def velocities_before(
    session: Session, shots: Sequence[int]
) -> dict[int, tuple[float, float | None]]:
    """The velocity that was predicted before shots.

    Parameters:
        session: A session of the store.
        shots: Keys of shots.

    Returns:
        By the key of the shot the median (m/s), and the rank of the measured velocity among the
        predicted ones, from 0 to 1, None where none was measured; a shot without a prediction that
        was made before it is left out.
    """
    links: list[tuple[int, int, float | None]] = []
    for keys in in_batches(shots):
        query = select(Shot.id, Shot.planned_run_id, Shot.measured_velocity_m_s)
        query = query.where(Shot.id.in_(keys), Shot.planned_run_id.is_not(None))
        links += [
            (key, run, value) for key, run, value in session.execute(query) if run is not None
        ]
    bands = {
        run: band
        for run, forecast in forecasts_of(session, {run for _, run, _ in links}).items()
        for band in forecast.bands
        if band.quantity == QUANTITIES[0]
    }
    return {
        key: (bands[run].median, None if value is None else bands[run].rank_of(value))
        for key, run, value in links
        if run in bands
    }


def comparison_rows(comparisons: Sequence[BandComparison]) -> list[dict[str, Any]]:
    """Compared quantities as rows for people, in the units of the field."""
    return rows_of_json([comparison.as_json() for comparison in comparisons])


def rows_of_json(comparisons: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The same of what `BandComparison.as_json` gives."""
    return [_shown_row(row) for row in comparisons]


def _shown_row(row: Mapping[str, Any]) -> dict[str, Any]:
    shown = display_of(row["quantity"])
    numbers = (shown.scale * row[name] for name in ("median", "lower", "upper"))
    median, lower, upper = format_interval(*numbers)
    return {
        "quantity": quantity_label(row["quantity"]),
        "unit": shown.unit,
        "predicted": median,
        "90 % band": f"{lower} to {upper}",
        "measured": format_number(shown.scale * row["measured"]),
        "difference": format_number(shown.scale * row["difference"], 3),
        "difference in band widths": format_number(row["difference_in_bands"], 2),
        "rank": format_number(row["rank"], 3),
        "in the band": "yes" if row["inside"] else "no",
    }
