"""Figures of each acceleration channel for each impact of a recording, and the rows that hold them.

One row of `runs.csv` is the whole record. More rows are that many shocks, the largest of those that
stand out of the envelope, in the order of time; `segmentation.find_events` tells them apart, as it
tells contacts of a force.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from math import ceil, inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...signals.channel import Channel, on_impactor
from ...signals.checks.base import Finding
from ...signals.shock_figures import ShockFigures, shock_figures
from .pulses import Hits
from .segmentation import RestLevel, find_events, rest_level
from .settings import ExtractionSettings

#: Shares of the largest peak from which on a shock counts, tried in this order until there are as
#: many as rows: a smaller one finds small shocks, a larger one tells apart those between which the
#: structure rings on.
_SHARES = (1.0, 0.5, 0.2, 2.0, 3.5, 5.0)
#: A record is cut into so many pieces for its noise, which is that of a quiet one among them.
_PIECES, _QUIET_QUANTILE = 32, 0.1
#: A shock begins where the envelope is last below this share of its first peak, as far back as half
#: of the gap.
_ONSET_SHARE = 0.05
#: Rest before a shock that its part of the record begins with: at least so long, and so many
#: samples.
_REST_S, _REST_SAMPLES = 10e-3, 64
#: Shocks that a message names; all are in the evidence.
_NAMED = 5


@dataclass(frozen=True)
class ShockParts:
    """Part of the record of each impact as (begin, end) in seconds on the record's clock, in the
    order of time; none where there are fewer shocks than rows. `findings` say what was left out or
    is missing."""

    parts_s: tuple[tuple[float, float], ...]
    findings: tuple[Finding, ...] = ()


WHOLE = (float("-inf"), float("inf"))


def parts_between(
    onsets_s: Sequence[float], wanted: Sequence[int], sampling_rate_hz: float
) -> tuple[tuple[float, float], ...]:
    """Parts of a record for some of its events.

    Each begins with some rest before its onset, at most half of the way back to the event before,
    and ends where the next event's part begins, whether that is wanted or not.

    Parameters:
        onsets_s: The times (n,) at which the events begin, ascending.
        wanted: The numbers of the events that get a part, counted from 0.
        sampling_rate_hz: The sampling rate of the record.

    Returns:
        Begin and end of each part in s on the clock of `onsets_s`. The first event's part has no
        begin (minus infinity), the last one's no end.
    """
    rest_s = max(_REST_S, _REST_SAMPLES / sampling_rate_hz)
    gaps = np.diff(onsets_s)
    begins = [
        WHOLE[0],
        *(float(b - min(rest_s, gap / 2)) for b, gap in zip(onsets_s[1:], gaps, strict=True)),
        WHOLE[1],
    ]
    return tuple((begins[i], begins[i + 1]) for i in wanted)


def shock_parts(
    channels: Sequence[Channel], expected: int, settings: ExtractionSettings
) -> ShockParts:
    """The parts of the shocks in the accelerations of one recording.

    Parameters:
        channels: The acceleration channels, at least one.
        expected: The number of shocks, 1 or more. The largest ones are taken; 1 is the whole
            record.
        settings: From which height on an excursion is a shock, and how near two belong to one.
    """
    if expected == 1:
        return ShockParts((WHOLE,))
    loudest = max(channels, key=lambda channel: float(np.ptp(_filled(channel))))
    alike = [c for c in channels if c.sampling_rate_hz == loudest.sampling_rate_hz]
    envelope = np.max([_on_samples_of(loudest, c) for c in alike], axis=0)
    rate, start = loudest.sampling_rate_hz, loudest.start_s
    events = _events(envelope, _noise(_filled(loudest)), rate, expected, settings)
    if len(events) < expected:
        return ShockParts((), (_too_few(len(events), expected, loudest.name),))
    by_height = sorted(range(len(events)), key=lambda i: -envelope[events[i][0]])
    wanted = sorted(by_height[:expected])
    parts = parts_between(
        [start + _onset(envelope, events, i) / rate for i in range(len(events))], wanted, rate
    )
    left_out = [int(events[i][0]) for i in sorted(by_height[expected:])]
    findings = (_left_out(envelope, events, wanted, left_out, loudest),) if left_out else ()
    return ShockParts(parts, findings)


def _filled(channel: Channel) -> Floats:
    """The channel less its median, lost samples at rest."""
    x = channel.readings - rest_level(channel.readings).baseline
    return np.where(np.isfinite(x), x, 0.0)


def _on_samples_of(loudest: Channel, channel: Channel) -> Floats:
    """The size of a channel at the samples of the loudest, to the nearest sample; 0 where it was
    not recorded."""
    size = np.zeros(loudest.recorded.size)
    first = round((channel.start_s - loudest.start_s) * loudest.sampling_rate_hz)
    begin, end = max(first, 0), min(first + channel.recorded.size, size.size)
    if begin < end:
        size[begin:end] = np.abs(_filled(channel))[begin - first : end - first]
    return size


def _noise(x: Floats) -> float:
    """Deviation of a quiet piece of the record: its own median deviation is that of the ringing
    where it rings long."""
    length = x.size // _PIECES
    if length < 2:
        return 0.0
    return float(
        np.quantile(x[: length * _PIECES].reshape(_PIECES, -1).std(axis=1), _QUIET_QUANTILE)
    )


def _events(
    envelope: Floats, noise: float, rate_hz: float, expected: int, settings: ExtractionSettings
) -> list[NDArray[np.int64]]:
    events: list[NDArray[np.int64]] = []
    for share in _SHARES:
        tried = replace(settings, event_share=min(1.0, share * settings.event_share))
        events = find_events(envelope, RestLevel(0.0, noise), rate_hz, tried)
        if len(events) >= expected:
            break
    return events


def _onset(envelope: Floats, events: list[NDArray[np.int64]], i: int) -> int:
    """The sample at which event `i` begins."""
    first = int(events[i].min())
    earliest = 0 if i == 0 else (int(events[i - 1].max()) + first) // 2
    below = np.flatnonzero(envelope[earliest:first] < _ONSET_SHARE * envelope[first])
    return earliest + int(below[-1]) if below.size else earliest


def _too_few(number: int, expected: int, channel: str) -> Finding:
    message = (
        f"{number} shocks found in the accelerations for {expected} rows of "
        f"runs.csv: which row lacks its shock cannot "
        "be told, so none has figures of its accelerations; give each row a recording of its own"
    )
    return Finding(
        "row-without-shock", "warning", message, channel, {"shocks": number, "rows": expected}
    )


def _left_out(
    envelope: Floats,
    events: list[NDArray[np.int64]],
    wanted: list[int],
    left_out: list[int],
    channel: Channel,
) -> Finding:
    smallest = min(float(envelope[events[i][0]]) for i in wanted)
    shocks = [
        {
            "time_s": channel.start_s + i / channel.sampling_rate_hz,
            "peak_acceleration_m_s2": float(envelope[i]),
        }
        for i in left_out
    ]
    named = ", ".join(
        f"{shock['peak_acceleration_m_s2']:.3g} m/s2 at {shock['time_s']:.4g} s"
        for shock in shocks[:_NAMED]
    )
    more = f" and {len(shocks) - _NAMED} more" if len(shocks) > _NAMED else ""
    message = (
        f"{len(events)} shocks found for {len(wanted)} rows of runs.csv; the largest are stored, "
        f"not stored: {named}{more}"
    )
    doubtful = max(shock["peak_acceleration_m_s2"] for shock in shocks) >= 0.5 * smallest
    evidence = {
        "shocks": len(events),
        "rows": len(wanted),
        "smallest_stored_peak_m_s2": smallest,
        "left_out": shocks,
    }
    return Finding(
        "shock-without-row", "warning" if doubtful else "note", message, channel.name, evidence
    )


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
    """Figures of the acceleration channels of a recording; beside a force not of those that ride on
    the impactor, whose motion its velocity tells.

    Parameters:
        channels: The channels of the recording.
        hits: The contacts that its force shows, which are its impacts.
        rows: The number of rows of runs.csv that name it. Without a contact, as many shocks of the
            accelerations are its impacts; none where it is 0.
        settings: From which height on an excursion is a shock, and how near two belong to one.
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
    """Rows of `channel_figures` for the impacts of a recording.

    Parameters:
        figures: The figures of each impact by channel.
        impacts: The keys of the impacts, in the order of `figures`.
        channels: The keys of the recording's channels by name.

    Returns:
        The values of each row by column, without its key and its writer.
    """
    rows = []
    for impact, by_channel in zip(impacts, figures, strict=True):
        largest = max(
            by_channel, key=lambda name: by_channel[name].peak_acceleration_m_s2, default=None
        )
        for name, values in by_channel.items():
            row = asdict(values) | {
                "srs_frequency_hz": list(values.srs_frequency_hz),
                "srs_maximax_m_s2": list(values.srs_maximax_m_s2),
            }
            rows.append(
                {
                    "impact_id": impact,
                    "channel_id": channels[name],
                    "largest": name == largest,
                    **row,
                }
            )
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
        first = (
            0
            if begin_s == -inf
            else max(0, ceil((begin_s - channel.start_s) * channel.sampling_rate_hz))
        )
        stop = channel.recorded.size
        if end_s != inf:
            stop = min(stop, max(first, ceil((end_s - channel.start_s) * channel.sampling_rate_hz)))
        start_s = channel.start_s + first * channel.period_s
        figures = shock_figures(channel.readings[first:stop], channel.sampling_rate_hz, start_s)
        if figures is not None:
            figures_by_channel[channel.name] = figures
    return figures_by_channel
