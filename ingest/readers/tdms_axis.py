"""The x axis of TDMS channels: rate, absolute start and gaps, from waveform properties or from a
channel of times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from .base import rate_from_step
from .contents import RATE_NAMES
from .start_times import absolute_start, clock_zero, seconds_between, starts_on_one_clock
from .x_axis import seconds_per_unit_of_x

_AGREEMENT = 1e-3


@dataclass(frozen=True)
class WaveformAxis:
    """Of one channel. `offset_s` is after `start`; `obstacle` says why the channel is no series
    over time."""

    rate_hz: Any = None
    start: np.datetime64 | None = None
    offset_s: float = 0.0
    gaps: tuple[tuple[int, int], ...] = ()
    times_s: Floats | None = None  # from the first, where the rate follows from them
    zero: dict[str, str] = field(
        default_factory=dict
    )  # the instant at which `offset_s` counts from 0
    obstacle: str | None = None

    @property
    def header(self) -> dict[str, Any]:
        return {
            **({"time_gaps": [list(gap) for gap in self.gaps]} if self.gaps else {}),
            **self.zero,
        }


@dataclass(frozen=True)
class Stamps:
    """A channel of time stamps (n,), the clock of channels of the same group and length."""

    name: str
    values: NDArray[np.datetime64]

    @property
    def start(self) -> np.datetime64 | None:
        return absolute_start(self.values[0])

    @property
    def times_s(self) -> Floats:
        """After the first."""
        ticks = (self.values - self.values[0]).astype("m8[ns]")
        return np.asarray(ticks.astype(np.int64) * 1e-9)


@dataclass(frozen=True)
class WrittenStart:
    """What a segment says of the start: so many samples are `before` it."""

    before: int
    properties: dict[str, Any] = field(default_factory=dict)


def waveform_axis(
    properties: Mapping[str, Any], writes: Sequence[WrittenStart] = ()
) -> WaveformAxis:
    """From the properties of a channel, its group and file. `writes` are the changes of the start
    within the file."""
    unit_s, obstacle = _unit_of_x(properties)
    stated = next((value for key, value in properties.items() if key.lower() in RATE_NAMES), None)
    step = properties.get("wf_increment")
    if step is None or unit_s is None:
        return WaveformAxis(stated, obstacle=obstacle)
    step_s = float(step) * unit_s
    if not step_s > 0.0:
        return WaveformAxis(obstacle=f"has wf_increment = {step}; expected a step above 0")
    rate_hz = rate_from_step(step_s)
    if isinstance(stated, int | float) and abs(stated - rate_hz) > _AGREEMENT * rate_hz:
        return WaveformAxis(
            obstacle=f"has a wf_increment of {rate_hz:g} Hz "
            f"and states a sampling rate of {stated:g}"
        )
    first = {**properties, **(writes[0].properties if writes else {})}
    axis = WaveformAxis(
        rate_hz,
        absolute_start(first.get("wf_start_time")),
        _offset(first, unit_s),
        obstacle=obstacle,
    )
    return _with_gaps(axis, writes, unit_s)


def _unit_of_x(properties: Mapping[str, Any]) -> tuple[float | None, str | None]:
    """Seconds per unit of the x axis, or why it is no time."""
    name, unit = (str(properties.get(key, "")).strip() for key in ("wf_xname", "wf_xunit_string"))
    scale = seconds_per_unit_of_x(name, unit)
    if scale is None:
        return None, (
            f"has wf_xname = {name!r} and wf_xunit_string = {unit!r}, which is no time in s, ms, "
            "us, ns, min or h; export the series over time"
        )
    return scale, None


def _offset(properties: Mapping[str, Any], unit_s: float) -> float:
    return float(properties.get("wf_start_offset", 0.0)) * unit_s


def _with_gaps(axis: WaveformAxis, writes: Sequence[WrittenStart], unit_s: float) -> WaveformAxis:
    """The gaps between writes whose starts are stated; a write that begins before the last one ends
    is refused."""
    gaps: list[tuple[int, int]] = []
    for write in writes[1:]:
        start = absolute_start(write.properties.get("wf_start_time"))
        since = 0.0 if start is None or axis.start is None else seconds_between(axis.start, start)
        later_s = since + _offset(write.properties, unit_s) - axis.offset_s
        missing = later_s * axis.rate_hz - write.before - sum(count for _, count in gaps)
        if missing < -0.5:
            return replace(
                axis,
                obstacle=f"starts again {later_s:g} s after its start, at sample {write.before}, "
                "before the samples written until then end; save the parts as files of their own",
            )
        if missing >= 0.5:
            gaps.append((write.before, max(1, round(missing))))
    return replace(axis, gaps=tuple(gaps))


def with_stamps(axis: WaveformAxis, stamps: Stamps) -> WaveformAxis:
    """An axis whose channel has time stamps beside it: they give the rate, or check the one of the
    waveform."""
    times_s = stamps.times_s
    if axis.obstacle is not None:
        return axis
    if axis.rate_hz is None:
        return WaveformAxis(start=stamps.start, times_s=times_s)
    rate_hz = (times_s.size - 1) / times_s[-1] if times_s.size > 1 and times_s[-1] > 0.0 else 0.0
    if abs(rate_hz - axis.rate_hz) > _AGREEMENT * axis.rate_hz:
        return replace(
            axis,
            obstacle=f"has a wf_increment of {axis.rate_hz:g} Hz, and the time stamps "
            f"{stamps.name!r} beside it are {rate_hz:g} Hz apart in the mean; correct one of them",
        )
    if axis.start is None:
        return replace(axis, start=stamps.start)
    apart_s = abs(seconds_between(axis.start, stamps.values[0]) - axis.offset_s)
    if stamps.start is not None and apart_s > max(1.0 / axis.rate_hz, 2e-6):
        return replace(
            axis,
            obstacle=f"starts at {axis.start} by wf_start_time and at {stamps.values[0]} by the "
            f"time stamps {stamps.name!r}; correct one of them",
        )
    return axis


def on_one_clock(axes: Sequence[WaveformAxis], names: Sequence[str]) -> list[WaveformAxis]:
    """The same axes with all starts in `offset_s`, after the earliest absolute start of the
    file."""
    readable = [
        axis.obstacle is None and (axis.rate_hz is not None or axis.times_s is not None)
        for axis in axes
    ]
    stated = [axis.start if ok else None for axis, ok in zip(axes, readable, strict=True)]
    starts, zero = starts_on_one_clock(stated), clock_zero(stated)
    dated = next(
        (name for name, axis, ok in zip(names, axes, readable, strict=True) if ok and axis.start),
        None,
    )
    aligned = []
    for axis, start_s, ok in zip(axes, starts, readable, strict=True):
        if not ok:
            aligned.append(axis)
        elif start_s is None:
            obstacle = (
                f"has no wf_start_time, and {dated!r} has one: when it starts beside that is not "
                'known; harmless_fields = ["wf_start_time"] under [recordings] of campaign.toml '
                "(--harmless-field wf_start_time of a command) says that all channels start "
                "together"
            )
            aligned.append(replace(axis, obstacle=obstacle))
        else:
            times_s = None if axis.times_s is None else axis.times_s + start_s
            offset_s = axis.offset_s + start_s
            aligned.append(replace(axis, start=None, offset_s=offset_s, times_s=times_s, zero=zero))
    return aligned
