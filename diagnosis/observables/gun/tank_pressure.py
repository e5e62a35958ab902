"""What the record of the tank's pressure says of a shot beside its velocity.

A tank does not lose air through a bore that brakes, a leak loses air before the projectile has
moved, a dead volume shows itself in the first drop, an offset of the transducer in what it reads of
an empty tank, and a valve in how the tank empties after the exit. Four numbers need no moment at
which the valve opened: the pressure just before the exit, that half a nominal transit before it,
that of the empty tank, and that some time after the exit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ....array_types import Flags, Floats, Rows
from ...record import Series
from ..base import Observable

#: The channel, as campaigns call it.
CHANNEL = "tank_pressure"
#: Of a reading of a transducer of 16 bar whose samples scatter by a quarter of a percent of that.
ASSUMED_NOISE_PA = 1e3
#: Names of the observables in their order.
AT_EXIT, ON_THE_WAY, EMPTY, AFTER = (
    "pressure_at_exit", "pressure_on_the_way", "pressure_when_empty", "pressure_after_exit",
)  # fmt: skip
#: Their columns, behind that of the velocity.
EXIT_COLUMN, AFTER_COLUMN = 1, 4
#: One percent of the pressure before the shot counts as agreement, and so much of an empty tank's,
#: in Pa.
TOLERANCE, EMPTY_TOLERANCE_PA = 0.01, 500.0
#: Agreement after the exit, where nobody states how vent holes and muzzle open as the projectile
#: goes on.
AFTER_TOLERANCE = 0.03
#: The reading after the exit lies so many times later as sound needs for a bore as large as the
#: tank, in these limits.
_AFTER_SHARE, _SOUND_M_S, _SOONEST_S, _LATEST_S = 0.7, 343.0, 4e-3, 20e-3
#: Readings are means over this share of the nominal transit, within these limits.
_WINDOW_SHARE, _SHORTEST_S, _LONGEST_S = 0.05, 2e-3, 20e-3
#: The last share of a record tells of the empty tank; emptied: less than this share of the pressure
#: before is left, and the pressure no longer moves by this share of it.
_END_SHARE, _EMPTIED, _RESTING = 0.05, 0.10, 0.003
#: A valve that shuts before the tank is empty leaves what goes with the pressure, or differs from
#: shot to shot by this share of the tolerance; an offset does neither. One shot is not emptied that
#: lies so many deviations from the others.
_LARGEST_SLOPE, _LARGEST_SPREAD, _OUTLYING = 0.01, 0.5, 4.0
#: Standard uncertainty of the moment (lag of the transducer), and of where the laser stands beside
#: the vent holes.
LAG_S, LASER_M = 1e-3, 0.03


@dataclass(frozen=True, eq=False)
class PressureWindows:
    """For each of C configurations: `length_s` over which a reading is averaged, `half_transit_s`
    before the exit, and `scale_pa` by which readings are divided: the pressure before the shot, and
    where that is small, what the noise allows to be told. NaN for a configuration whose nominal
    shot stays in the barrel. `after_s`: how long after the exit the last reading lies."""

    length_s: Floats
    half_transit_s: Floats
    scale_pa: Floats
    after_s: float

    @classmethod
    def of(
        cls, transit_s: Floats, pressure_pa: Floats, noise_pa: float, tank_over_bore_m: float
    ) -> PressureWindows:
        """`transit_s` (C,) of nominal shots, `pressure_pa` (C,) before them, `noise_pa` of a
        reading, and the tank's volume over the bore's area."""
        length = np.clip(_WINDOW_SHARE * transit_s, _SHORTEST_S, _LONGEST_S)
        after_s = float(
            np.clip(_AFTER_SHARE * tank_over_bore_m / _SOUND_M_S, _SOONEST_S, _LATEST_S)
        )
        return cls(length, transit_s / 2, np.hypot(pressure_pa, noise_pa / TOLERANCE), after_s)

    @property
    def before_exit_s(self) -> Floats:
        """(C, 3): how long before the exit the middles of two readings lie, and that of one after
        it (negative)."""
        return np.stack(
            [self.length_s / 2, self.half_transit_s, np.full(len(self.length_s), -self.after_s)],
            axis=1,
        )


def reading_noise_pa(traces: Sequence[Series | None]) -> float:
    """Standard deviation of a mean over the shortest window, the median over the records; by second
    differences, which a smooth fall leaves alone."""
    noise = []
    for trace in traces:
        if trace is not None and trace.values.size > 2:
            single = float(np.median(np.abs(np.diff(trace.values, 2)))) * 1.4826 / np.sqrt(6)
            noise.append(single / np.sqrt(max(_SHORTEST_S * trace.sampling_rate_hz, 1.0)))
    return float(np.median(noise)) if noise else 0.0


def measured_pressures(
    traces: Sequence[Series | None],
    pressure_pa: Floats,
    configuration_of: Rows,
    windows: PressureWindows,
) -> Floats:
    """(R, 4) of records whose 0 s is the exit: two pressures over the scale of their configuration,
    that of the empty tank in Pa over 1 bar, and one after the exit over the scale. `pressure_pa`
    (R,) is that before the shot. NaN where a record does not reach so far, and where the tank was
    not emptied."""
    table = np.full((len(traces), 4), np.nan)
    for row, (trace, before, c) in enumerate(
        zip(traces, pressure_pa, configuration_of, strict=True)
    ):
        if trace is None:
            continue
        length, half, scale = windows.length_s[c], windows.half_transit_s[c], windows.scale_pa[c]
        if np.isfinite(length):
            table[row, 0] = _mean(trace, -length, 0.0) / scale
            if half > length:
                table[row, 1] = _mean(trace, -half - length / 2, -half + length / 2) / scale
        table[row, 2] = _empty_pa(trace, before) / 1e5
        table[row, 3] = (
            _mean(trace, windows.after_s - _SHORTEST_S / 2, windows.after_s + _SHORTEST_S / 2)
            / scale
        )
    table[~_emptied(pressure_pa, 1e5 * table[:, 2]), 2] = np.nan
    table[~np.isfinite(table[:, 2]), 3] = np.nan  # a valve that shuts early keeps what nobody knows
    return table


def _mean(trace: Series, start_s: float, stop_s: float) -> float:
    """Of the samples between two moments, which a record may hold only in part: then NaN."""
    time = trace.time_s
    inside = (time >= start_s) & (time <= stop_s)
    whole = time[0] <= start_s and time[-1] >= stop_s
    return float(trace.values[inside].mean()) if whole and inside.any() else float("nan")


def _empty_pa(trace: Series, before_pa: float) -> float:
    """Of the tank once it is empty; NaN where it is not."""
    count = int(_END_SHARE * trace.values.size)
    if count < 4 or not before_pa > 0:
        return float("nan")
    last, previous = trace.values[-count:], trace.values[-2 * count : -count]
    level = float(last.mean())
    noise = float(np.std(np.diff(last))) / np.sqrt(count)
    resting = abs(level - float(previous.mean())) <= max(4 * noise, _RESTING * before_pa)
    return level if resting and abs(level) <= _EMPTIED * before_pa else float("nan")


def _emptied(pressure_pa: Floats, level_pa: Floats) -> Flags:
    """(R,): of which shots the level that is left is that of an empty tank, which is the same in
    all of them."""
    finite = np.isfinite(level_pa)
    if not finite.any() or _grows(pressure_pa, level_pa):
        return np.zeros(level_pa.size, dtype=bool)
    deviation_pa = np.abs(level_pa - np.median(level_pa[finite]))
    spread_pa = 1.4826 * float(np.median(deviation_pa[finite]))
    largest_pa = _LARGEST_SPREAD * EMPTY_TOLERANCE_PA
    return np.asarray(finite & (spread_pa <= largest_pa) & (deviation_pa <= _OUTLYING * largest_pa))


def _grows(pressure_pa: Floats, level_pa: Floats) -> bool:
    """Whether what is left goes with the pressure before the shot, as that of a valve that has
    shut."""
    finite = np.isfinite(pressure_pa) & np.isfinite(level_pa)
    if finite.sum() < 3 or np.ptp(pressure_pa[finite]) == 0:
        return False
    line = np.polyfit(pressure_pa[finite], level_pa[finite], 1)
    slope, scatter_pa = line[0], level_pa[finite] - np.polyval(line, pressure_pa[finite])
    error = np.std(scatter_pa) / (np.std(pressure_pa[finite]) * np.sqrt(finite.sum()))
    return bool(slope > _LARGEST_SLOPE and slope > 3 * error)


def pressure_observables(windows: PressureWindows, noise_pa: float) -> tuple[Observable, ...]:
    """The four columns of `measured_pressures`."""
    floor = noise_pa / float(np.nanmedian(windows.scale_pa))
    return (
        Observable(AT_EXIT, "gun", CHANNEL, "1", TOLERANCE, floor),
        Observable(ON_THE_WAY, "gun", CHANNEL, "1", TOLERANCE, floor),
        Observable(EMPTY, "gun", CHANNEL, "bar", EMPTY_TOLERANCE_PA / 1e5, noise_pa / 1e5),
        Observable(AFTER, "gun", CHANNEL, "1", AFTER_TOLERANCE, floor),
    )
