"""Figures of each acceleration channel for each impact of a recording, and the rows that hold them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from math import ceil, inf
from typing import Any

from ..signals.channel import Channel, on_impactor
from ..signals.checks.base import Finding
from ..signals.shock_figures import ShockFigures, shock_figures
from .pulses import Hits
from .settings import ExtractionSettings
from .shock_events import WHOLE, parts_between, shock_parts

#: Of one impact, by the channel's name; a channel that never moved has none.
ImpactFigures = Mapping[str, ShockFigures]


@dataclass(frozen=True)
class RecordingFigures:
    """`impacts` has an entry for each impact of a recording, in the order of time."""

    impacts: tuple[ImpactFigures, ...] = ()
    findings: tuple[Finding, ...] = ()


def measure_channels(
    channels: Sequence[Channel], hits: Hits, rows: int, settings: ExtractionSettings
) -> RecordingFigures:
    """Figures of the acceleration channels of a recording; beside a force not of those that ride on the impactor, whose
    motion its velocity tells.

    Its impacts are the contacts that its force shows (`hits`), else as many shocks of the accelerations as `rows` of
    runs.csv name it; none where they are 0.
    """
    force = bool(hits.pulses)
    accelerations = [
        channel
        for channel in channels
        if channel.quantity == "acceleration"
        and channel.recorded.size
        and not (force and on_impactor(channel.sensor.position))
    ]
    if not accelerations:
        return RecordingFigures()
    if not force and rows < 1:
        return RecordingFigures()
    findings: tuple[Finding, ...] = ()
    if force:
        parts = _parts_of_contacts(hits, accelerations[0].sampling_rate_hz)
    else:
        shocks = shock_parts(accelerations, rows, settings)
        parts, findings = shocks.parts_s, shocks.findings
    return RecordingFigures(tuple(_measured(accelerations, *part) for part in parts), findings)


def figure_rows(
    figures: Sequence[ImpactFigures], impacts: Sequence[int], channels: Mapping[str, int]
) -> list[dict[str, Any]]:
    """Rows of `channel_figures` for the impacts with these keys, in the order of `figures`; `channels`: key by name."""
    rows = []
    for impact, by_channel in zip(impacts, figures, strict=True):
        largest = max(by_channel, key=lambda name: by_channel[name].peak_acceleration_m_s2, default=None)
        for name, values in by_channel.items():
            row = asdict(values) | {
                "srs_frequency_hz": list(values.srs_frequency_hz),
                "srs_maximax_m_s2": list(values.srs_maximax_m_s2),
            }
            rows.append({"impact_id": impact, "channel_id": channels[name], "largest": name == largest, **row})
    return rows


def _parts_of_contacts(hits: Hits, sampling_rate_hz: float) -> tuple[tuple[float, float], ...]:
    if len(hits.pulses) == 1 and not hits.left_out:
        return (WHOLE,)
    contacts = [(pulse.start_s, True) for pulse in hits.pulses]
    events = sorted(contacts + [(touch.time_s, False) for touch in hits.left_out])
    wanted = [i for i, (_, stored) in enumerate(events) if stored]
    return parts_between([start for start, _ in events], wanted, sampling_rate_hz)


def _measured(channels: Sequence[Channel], begin_s: float, end_s: float) -> ImpactFigures:
    """Figures of one part of the record by channel."""
    figures_by_channel = {}
    for channel in channels:
        first = 0 if begin_s == -inf else max(0, ceil((begin_s - channel.start_s) * channel.sampling_rate_hz))
        stop = channel.recorded.size
        if end_s != inf:
            stop = min(stop, max(first, ceil((end_s - channel.start_s) * channel.sampling_rate_hz)))
        start_s = channel.start_s + first * channel.period_s
        figures = shock_figures(channel.si[first:stop], channel.sampling_rate_hz, start_s)
        if figures is not None:
            figures_by_channel[channel.name] = figures
    return figures_by_channel
