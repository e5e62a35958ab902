"""Everything that the store knows of one impact, as plain data, as a picture, and as accelerations
that are cut out of a recording of several impacts."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from sqlalchemy import or_, select
from sqlalchemy.orm import Session

from ....array_types import Floats
from ....ingest.extraction.channel_figures import parts_between
from ....ingest.extraction.recording import VALVE_OPENING
from ....ingest.storing.stored_channels import list_channels, read_channel
from ....schema.column_kinds import NUMBER, kind_of
from ....schema.impacts import ChannelFigures, Impact, Pulse, velocity_kind
from ....schema.listings import Condition, iter_impacts
from ....schema.provenance import Provenance
from ....schema.recordings import QualityFinding, RecordedChannel
from ....schema.tables import metadata
from ....signals.record_rest import without_rest

#: Figures of a pulse, SI with the unit in the name.
PULSE_FIGURES = (
    *("contact_time_s", "compression_time_s", "peak_force_n", "spline_peak_force_n", "impulse_n_s"),
    *(
        "compression_impulse_n_s",
        "width_half_s",
        "width_tenth_s",
        "samples_in_contact",
        "spline_nrmse",
    ),
)


def impact_page(session: Session, key: int) -> dict[str, Any]:
    """One impact: its listing's row, then lists of pulse versions, figures of its acceleration
    channels, findings and channels. `LookupError` if unknown."""
    impact = get_impact(session, key)
    row = next(iter_impacts(session, where=(Condition("id", "=", key),)))
    pulses = session.scalars(select(Pulse).where(Pulse.impact_id == key).order_by(Pulse.id))
    return {
        **row,
        "impact_velocity_u_m_s": impact.impact_velocity_u_m_s,
        "velocity_source": impact.velocity_source,
        "velocity_kind": velocity_kind(impact.velocity_source),
        "recording": impact.recording.path if impact.recording else None,
        "pulses": [_pulse(session, pulse) for pulse in pulses],
        "channel_figures": list_channel_figures(session, [key]).get(key, []),
        "findings": _findings(session, impact),
        "channels": _channels(session, impact),
    }


def get_impact(session: Session, key: int) -> Impact:
    """The impact with this key; `LookupError` otherwise."""
    impact = session.get(Impact, key)
    if impact is None:
        raise LookupError(f"no impact {key} in the store; pyroshock impacts lists them")
    return impact


def _pulse(session: Session, pulse: Pulse) -> dict[str, Any]:
    writer = session.get_one(Provenance, pulse.written_by_id)
    return {
        "in_use": "yes" if pulse.current else "no",
        **{
            name: pulse.settings.settings[name]
            for name in ("segmentation", "threshold", "smoothing")
        },
        "start_s": pulse.start_s,
        "contact_time_s": pulse.contact_time_s,
        "peak_force_n": pulse.peak_force_n,
        "spline_peak_force_n": pulse.spline_peak_force_n,
        "impulse_n_s": pulse.impulse_n_s,
        "width_half_s": pulse.width_half_s,
        "samples_in_contact": pulse.samples_in_contact,
        "spline_nrmse": pulse.spline_nrmse,
        "segmentation_difference": pulse.segmentation_difference,
        "written_by": f"{writer.software_version}: {writer.command}",
    }


#: Figures of a channel as they are listed: one number each.
LISTED_FIGURES = tuple(
    column.name
    for column in metadata.tables[ChannelFigures.__tablename__].columns
    if kind_of(column) == NUMBER
)


def list_channel_figures(
    session: Session, impacts: Sequence[int]
) -> dict[int, list[dict[str, Any]]]:
    """Figures of the acceleration channels of impacts, by the impact's key: the channel's name,
    then its figures, and the lines of the spectrum's summary as `srs_10hz_m_s2` and so on."""
    query = (
        select(ChannelFigures, RecordedChannel.name)
        .join(RecordedChannel, ChannelFigures.channel_id == RecordedChannel.id)
        .where(ChannelFigures.impact_id.in_(impacts))
        .order_by(ChannelFigures.impact_id, RecordedChannel.name)
    )
    findings: dict[int, list[dict[str, Any]]] = {}
    for row, channel in session.execute(query):
        lines = zip(row.srs_frequency_hz, row.srs_maximax_m_s2, strict=True)
        findings.setdefault(row.impact_id, []).append(
            {
                "channel": channel,
                **{name: getattr(row, name) for name in LISTED_FIGURES},
                **{f"srs_{frequency:.0f}hz_m_s2": value for frequency, value in lines},
            }
        )
    return findings


def _findings(session: Session, impact: Impact) -> list[dict[str, Any]]:
    if impact.recording_id is None:
        return []
    of_impact = or_(QualityFinding.impact_id == impact.id, QualityFinding.impact_id.is_(None))
    query = (
        select(
            QualityFinding.severity,
            QualityFinding.check,
            RecordedChannel.name,
            QualityFinding.message,
        )
        .outerjoin(RecordedChannel, QualityFinding.channel_id == RecordedChannel.id)
        .where(QualityFinding.recording_id == impact.recording_id, of_impact)
    )
    heads = ("severity", "check", "channel", "message")
    return [
        dict(zip(heads, row, strict=True))
        for row in session.execute(query.order_by(QualityFinding.id))
    ]


def _channels(session: Session, impact: Impact) -> list[dict[str, Any]]:
    query = select(RecordedChannel).where(RecordedChannel.recording_id == impact.recording_id)
    return [
        {
            "channel": c.name,
            "quantity": c.quantity,
            "unit": c.unit,
            "sampling_rate_hz": c.sampling_rate_hz,
            "samples": c.samples,
            "sha256": c.sha256[:12],
            **_valve_opening(c),
        }
        for c in session.scalars(query.order_by(RecordedChannel.name))
    ]


def _valve_opening(channel: RecordedChannel) -> dict[str, float]:
    """When the gun's valve opened, on the recording's clock, by the drop of the tank's pressure."""
    opening = channel.header.get(VALVE_OPENING)
    return (
        {"valve_opening_s": opening["time_s"], "valve_opening_u_s": opening["time_u_s"]}
        if opening
        else {}
    )


@dataclass(frozen=True, eq=False)
class ImpactRecord:
    """A channel's record of one impact, (n,), less its rest; `start_s` on the recording's clock."""

    impact: int
    channel: str
    values_m_s2: Floats
    rate_hz: float
    start_s: float


def impact_records(
    session: Session, key: int, channel: str | None, left_out: list[str]
) -> Iterator[ImpactRecord]:
    """The acceleration channels of an impact (or the one named `channel`), between its neighbours
    in the recording.

    A recording of one impact is taken whole, else from the rest before this contact up to that of
    the next one, as an ingest divides it. The rest before the shock is its zero, where there is
    one. What there is not is added to `left_out`. `LookupError` for an unknown impact.
    """
    impact = get_impact(session, key)
    rows = [] if impact.recording_id is None else list_channels(session, impact.recording_id)
    rows = [row for row in rows if row.quantity == "acceleration" and channel in (None, row.name)]
    if not rows:
        left_out.append(
            f"impact {key}: no acceleration"
            + (f" {channel!r}" if channel else "")
            + " was recorded"
        )
        return
    begin_s, end_s = _window(session, impact)
    for row in rows:
        first = (
            max(0, math.ceil((begin_s - row.start_s) * row.sampling_rate_hz))
            if begin_s > -math.inf
            else 0
        )
        stop = row.samples
        if end_s < math.inf:
            stop = min(stop, math.ceil((end_s - row.start_s) * row.sampling_rate_hz))
        if stop - first < 2:
            left_out.append(
                f"impact {key}: {row.name} has no samples between this contact and the next"
            )
            continue
        yield ImpactRecord(key, row.name, *_values(session, row, first, stop))


def _values(
    session: Session, row: RecordedChannel, first: int, stop: int
) -> tuple[Floats, float, float]:
    read = read_channel(session, row, first, stop)
    return (
        without_rest(read.readings, row.sampling_rate_hz, read.start_s)[0],
        row.sampling_rate_hz,
        read.start_s,
    )


def _window(session: Session, impact: Impact) -> tuple[float, float]:
    """When an impact's own stretch of the recording begins and ends; infinite where it has the
    recording alone."""
    query = (
        select(Pulse.impact_id, Pulse.start_s)
        .join(Impact, Pulse.impact_id == Impact.id)
        .where(Impact.recording_id == impact.recording_id, Pulse.current)
        .order_by(Pulse.start_s)
    )
    starts: dict[int, float] = dict(iter(session.execute(query)))
    if len(starts) < 2 or impact.id not in starts or impact.recording_id is None:
        return -math.inf, math.inf
    onsets = sorted(starts.values())
    rate_hz = min(row.sampling_rate_hz for row in list_channels(session, impact.recording_id))
    return parts_between(onsets, [onsets.index(starts[impact.id])], rate_hz)[0]
