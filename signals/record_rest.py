"""The zero of an acceleration record: the rest before its shock, found, chosen or left alone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..array_types import Floats
from .checks.levels import (
    EVENT_SHARE,
    MAD_TO_SIGMA,
    MAX_EVENT_SHARE,
    MIN_REST_SAMPLES,
    NOISE_SAMPLES,
    NOISE_SIGMAS,
    climbs,
)

#: A long record is searched in blocks of so many samples.
_BLOCK = 4096


@dataclass(frozen=True)
class RestChoice:
    """What to take for the zero of a record: the rest before its shock where there is one, nothing,
    or the mean of a stretch of it, on the record's own clock."""

    kind: Literal["before the shock", "none", "stretch"] = "before the shock"
    from_s: float = 0.0
    to_s: float = 0.0


BEFORE_SHOCK, AS_RECORDED = RestChoice(), RestChoice("none")


@dataclass(frozen=True)
class RemovedRest:
    """What was subtracted from a record, m/s2 (0 for nothing), and in a sentence why."""

    level_m_s2: float
    sentence: str


def rest_before_shock(x: Floats) -> tuple[float | None, float]:
    """The rest of a record before its shock, None where it has none; and the deviation of the noise
    at its begin.

    The shock begins at the first sample that is farther from the median of the first sixteen than 5
    % of the peak or five deviations of the noise, whichever is more. The rest is the mean of the
    first half of what lies before: the second half may hold the foot of a slow pulse. Fewer than
    sixteen samples, or a first half that climbs, are no rest.

    Parameters:
        x: Acceleration (n,) in m/s2, at least one sample, all of them finite.

    Returns:
        Both in m/s2.
    """
    begin = x[:NOISE_SAMPLES]
    level = float(np.median(begin[:MIN_REST_SAMPLES]))
    peak = max(float(x.max()) - level, level - float(x.min()))
    steps = np.diff(begin)
    sigma = (
        MAD_TO_SIGMA * float(np.median(np.abs(steps - np.median(steps)))) / 2**0.5
        if steps.size
        else 0.0
    )
    loud = min(max(EVENT_SHARE * peak, NOISE_SIGMAS * sigma), MAX_EVENT_SHARE * peak)
    quiet = x[: _first_beyond(x, level, loud) // 2]
    if quiet.size < MIN_REST_SAMPLES or climbs(quiet):
        return None, sigma
    return float(quiet.mean()), sigma


def _first_beyond(x: Floats, level: float, distance: float) -> int:
    """The first sample that is further than so much from a level; 0 where none is."""
    for begin in range(0, x.size, _BLOCK):
        beyond = np.abs(x[begin : begin + _BLOCK] - level) > distance
        if beyond.any():
            return begin + int(beyond.argmax())
    return 0


def without_rest(
    record: Floats, sampling_rate_hz: float, start_s: float = 0.0, choice: RestChoice = BEFORE_SHOCK
) -> tuple[Floats, RemovedRest]:
    """A record less its rest, and what was removed.

    Parameters:
        record: Acceleration (n,) in m/s2.
        sampling_rate_hz: Its sampling rate.
        start_s: The time of its first sample on the clock that `choice` counts on; by default 0.
        choice: What is taken for the rest; by default the rest before the shock, and nothing is
            removed where the record holds none.

    Raises:
        ValueError: For a stretch that holds no sample.
    """
    if choice.kind == "none":
        return record, RemovedRest(0.0, "nothing is removed: zero is as recorded")
    if choice.kind == "stretch":
        first, stop = (
            round((at - start_s) * sampling_rate_hz) for at in (choice.from_s, choice.to_s)
        )
        stretch = record[max(first, 0) : max(stop, 0)]
        if not stretch.size:
            end_s = start_s + record.size / sampling_rate_hz
            raise ValueError(
                f"the rest from {choice.from_s:g} to {choice.to_s:g} s holds no sample: the record "
                f"reaches from {start_s:g} to {end_s:g} s"
            )
        level, what = float(stretch.mean()), f"the mean from {choice.from_s:g} to {choice.to_s:g} s"
    else:
        rest = (
            rest_before_shock(record)[0] if record.size > 1 and np.isfinite(record.sum()) else None
        )
        if rest is None:
            return record, RemovedRest(
                0.0, "nothing is removed: no rest was recorded before the shock"
            )
        level, what = rest, "the rest before the shock"
    return record - level, RemovedRest(level, f"{what} is removed: {level:.4g} m/s2")
