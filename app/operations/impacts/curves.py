"""One impact's segmentation as a page draws it: the force about the contact, and each version of
the pulse over it.

All forces are at the record's own level, turned so that compression is positive: a version's spline
lies on the record that it was cut from, and `rest_n` less it is the pulse that the store holds.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session, undefer

from ....array_types import Floats
from ....ingest.extraction.channels import total_force
from ....ingest.extraction.pulses import ExtractedPulse
from ....ingest.extraction.segmentation import RestLevel, delimit, orientation, record_rest
from ....ingest.extraction.settings import ExtractionSettings
from ....ingest.storing.stored_channels import list_channels, read_channel
from ....schema.impacts import Pulse as PulseRow
from ....schema.series import as_floats
from ....signals.channel import Channel
from .impact import PULSE_FIGURES, get_impact
from .signals import envelope

#: Of the longest contact, on either side; at least so many samples.
MARGIN, LEAST_MARGIN = 0.5, 8

_FIGURES = (*PULSE_FIGURES, "segmentation_difference")


@dataclass(frozen=True, eq=False)
class PulseCurve:
    """One version of a pulse. `key` is None for a preview, which the store does not hold.

    Contact from `start_s` to `stop_s` on the recording's clock, cut where the force passes
    `threshold_n`; `time_s` and `force_n` (m,) are the spline, `points_time_s` and `points_n` (p,)
    what the models take. `settings` and `figures` (SI, unit in the key) are plain data.
    `threshold_n` is None where this software cannot read the old settings.
    """

    key: int | None
    in_use: bool
    settings: dict[str, Any]
    start_s: float
    stop_s: float
    rest_n: float
    threshold_n: float | None
    time_s: Floats
    force_n: Floats
    points_time_s: Floats
    points_n: Floats
    figures: dict[str, Any]


@dataclass(frozen=True, eq=False)
class ForceRecord:
    """A force record (n,), upright, and its rest."""

    upright: Floats
    channel: Channel
    level: RestLevel

    def place(self, time_s: float) -> int:
        """The sample at an instant of the recording's clock, within the record."""
        at = round((time_s - self.channel.start_s) * self.channel.sampling_rate_hz)
        return min(max(at, 0), self.upright.size - 1)

    def stored(self, row: PulseRow) -> PulseCurve:
        """The curve of a version in the store."""
        rest, threshold = self._delimited(row)
        fine = as_floats(row.fine_force_n, f"the force of pulse {row.id}")
        points = np.asarray(row.force_points_n, dtype=np.float64)
        return _curve(row, row.id, row.settings.settings, rest, threshold, fine, points)

    def _delimited(self, row: PulseRow) -> tuple[float, float | None]:
        """Rest before the contact and threshold, as the extraction found them: neither is
        stored."""
        first, last = self.place(row.start_s), self.place(row.start_s + row.contact_time_s)
        peak = first + int(np.nanargmax(self.upright[first : last + 1]))
        try:
            settings = ExtractionSettings(**row.settings.settings)
        except (TypeError, ValueError):  # of another version of the code
            return self.level.baseline, None
        rate = self.channel.sampling_rate_hz
        rest, extent = delimit(self.upright, np.array([peak]), self.level, rate, settings)
        return rest.baseline, extent.threshold

    def span(self, curves: Sequence[PulseCurve]) -> slice:
        """Samples about all contacts."""
        margin_s = MARGIN * max(curve.stop_s - curve.start_s for curve in curves)
        margin_s = max(margin_s, LEAST_MARGIN / self.channel.sampling_rate_hz)
        first = self.place(min(curve.start_s for curve in curves) - margin_s)
        return slice(first, self.place(max(curve.stop_s for curve in curves) + margin_s) + 1)


def preview_curve(pulse: ExtractedPulse, settings: ExtractionSettings) -> PulseCurve:
    """The curve of a pulse that is not stored."""
    threshold = pulse.rest_n + pulse.threshold_n
    return _curve(
        pulse,
        None,
        settings.as_json(),
        pulse.rest_n,
        threshold,
        pulse.fine_force_n,
        pulse.force_points_n,
    )


def _curve(
    pulse: PulseRow | ExtractedPulse,
    key: int | None,
    settings: dict[str, Any],
    rest_n: float,
    threshold_n: float | None,
    fine_n: Floats,
    points_n: Floats,
) -> PulseCurve:
    return PulseCurve(
        key=key,
        in_use=isinstance(pulse, PulseRow) and pulse.current,
        settings=settings,
        start_s=pulse.start_s,
        stop_s=pulse.start_s + pulse.contact_time_s,
        rest_n=rest_n,
        threshold_n=threshold_n,
        time_s=pulse.start_s + np.arange(fine_n.size, dtype=np.float64) * pulse.fine_period_s,
        force_n=rest_n + fine_n,
        points_time_s=pulse.start_s + np.linspace(0, pulse.contact_time_s, points_n.size),
        points_n=rest_n + points_n,
        figures={name: getattr(pulse, name) for name in _FIGURES},
    )


#: A contact has tens to hundreds of samples; one of very many is shown by its outline.
MOST_POINTS = 20_000


@dataclass(frozen=True, eq=False)
class PulseView:
    """The record about a contact, `time_s` and `force_n` (n,), and the versions of its pulse, by
    their keys.

    `channels` are the force channels (cells of an array are summed); `sign` is -1 where the record
    shows compression as negative. `preview` is what other settings would make of it.
    """

    impact: int
    recording: str
    channels: tuple[str, ...]
    sampling_rate_hz: float
    sign: int
    time_s: Floats
    force_n: Floats
    versions: tuple[PulseCurve, ...]
    preview: PulseCurve | None


def pulse_view(
    session: Session,
    impact_key: int,
    preview: tuple[ExtractedPulse, ExtractionSettings] | None = None,
) -> PulseView:
    """The segmentation of an impact; `preview` is drawn beside it
    (`ingest.reextract.preview_impacts` makes them).

    Raises `LookupError` for an unknown impact, and for one without pulse or force record.
    """
    impact = get_impact(session, impact_key)
    rows = session.scalars(
        select(PulseRow)
        .where(PulseRow.impact_id == impact_key)
        .options(undefer(PulseRow.fine_force_n))
        .order_by(PulseRow.id)
    ).all()
    channels = list(_force_channels(session, impact.recording_id))
    force = total_force(channels)
    if not rows or force is None or impact.recording is None:
        raise LookupError(f"impact {impact_key} has no pulse with a force record to show")
    recorded, channel = force
    level = record_rest(recorded)
    sign = orientation(recorded, level)
    record = ForceRecord(sign * recorded, channel, RestLevel(sign * level.baseline, level.noise))
    versions = tuple(record.stored(row) for row in rows)
    shown = None if preview is None else preview_curve(*preview)
    span = record.span([*versions, *([shown] if shown else [])])
    kept = span.start + envelope(record.upright[span], MOST_POINTS)
    return PulseView(
        impact=impact_key,
        recording=impact.recording.path,
        channels=tuple(channel.name for channel in channels),
        sampling_rate_hz=channel.sampling_rate_hz,
        sign=sign,
        time_s=channel.start_s + kept / channel.sampling_rate_hz,
        force_n=record.upright[kept],
        versions=versions,
        preview=shown,
    )


def _force_channels(session: Session, recording: int | None) -> Iterator[Channel]:
    if recording is not None:
        for row in list_channels(session, recording):
            if row.quantity == "force":
                yield read_channel(session, row)
