"""Everything that the store knows of one impact, as plain data."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from sqlalchemy import or_, select
from sqlalchemy.orm import Session

from ....schema.column_kinds import NUMBER, kind_of
from ....schema.impacts import ChannelFigures, Impact, Pulse, Shot, velocity_kind
from ....schema.listings import Condition, iter_impacts, iter_shots
from ....schema.provenance import Provenance
from ....schema.recordings import VALVE_OPENING, QualityFinding, RecordedChannel, Recording
from ....schema.tables import metadata

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

#: Figures of a gun's shot that its impact shows, SI.
SHOT_FIGURES = (
    "tank_pressure_pa",
    "bullet_mass_kg",
    "measured_velocity_m_s",
    "measured_velocity_u_m_s",
    "predicted_velocity_m_s",
)


#: Keys of what was predicted before the shot: by which model and when, and the quantities that were
#: measured.
PREDICTION, PREDICTED = "prediction", "predicted"


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
        **_shot(session, key),
        **_predicted(session, key),
        "pulses": [_pulse(session, pulse) for pulse in pulses],
        "channel_figures": list_channel_figures(session, [key]).get(key, []),
        "findings": _findings(session, impact),
        "channels": _channels(impact),
    }


def _shot(session: Session, impact: int) -> dict[str, Any]:
    """The shot of a gun's impact: its number, pressure and mass, its velocity before the contact
    and that of the nominal gun; nothing for other impacts."""
    shot = session.scalar(select(Shot.id).where(Shot.impact_id == impact))
    if shot is None:
        return {}
    from ...common.nominal_velocity import with_predictions  # NumPy, for impacts of a gun alone

    rows = iter_shots(session, where=(Condition("id", "=", shot),))
    (row,) = with_predictions(session, rows)
    return {"shot": shot, **{name: row[name] for name in SHOT_FIGURES}}


def _predicted(session: Session, impact: int) -> dict[str, Any]:
    """What was predicted of the impact's run before its first shot was stored, beside what was
    measured; nothing for an impact without a prediction."""
    from ...common.run_forecasts import forecast_of_impact

    predicted = forecast_of_impact(session, impact)
    if predicted is None:
        return {}
    forecast, comparisons = predicted
    return {
        PREDICTION: {**forecast.as_json(), "sentence": forecast.words},
        PREDICTED: [comparison.as_json() for comparison in comparisons],
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


def _channels(impact: Impact) -> list[dict[str, Any]]:
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
        for c in (impact.recording.channels if impact.recording else ())
    ]


def _valve_opening(channel: RecordedChannel) -> dict[str, float]:
    """When the gun's valve opened, on the recording's clock, by the drop of the tank's pressure."""
    opening = channel.header.get(VALVE_OPENING)
    return (
        {"valve_opening_s": opening["time_s"], "valve_opening_u_s": opening["time_u_s"]}
        if opening
        else {}
    )


def list_signals(session: Session, recording_key: int) -> list[dict[str, Any]]:
    """The channels of a recording by name, with the keys that `channel_window` takes; no sample is
    read."""
    return [
        {
            "key": row.id,
            "channel": row.name,
            "quantity": row.quantity,
            "unit": row.unit,
            "si_unit": row.si_unit,
            "position": row.position,
            "axis": row.axis,
            "sampling_rate_hz": row.sampling_rate_hz,
            "samples": row.samples,
            "start_s": row.start_s,
            "stop_s": row.start_s + (row.samples - 1) / row.sampling_rate_hz,
        }
        for row in session.get_one(Recording, recording_key).channels
    ]
