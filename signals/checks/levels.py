"""Cheap robust figures of a record that several checks need: baseline, spread, quantisation step,
extent of the shock.

The robust ones look at a few thousand samples: a sort of half a million would cost more than all
checks together.

Runs of neighbouring samples, and which contact each belongs to.

What of a record rests before and after its shock, and at which level.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..channel import Channel
from .base import Contact

#: Median and MAD of this many samples have a standard error of about 2 % of sigma: finer than any
#: limit here.
DECIMATED_SAMPLES = 4096
#: Below this share of the peak a record counts as at rest, where no contact says otherwise ...
EVENT_SHARE = 0.05
#: ... unless noise passes it: so many sigmas of the first samples are passed once in two million.
NOISE_SIGMAS, NOISE_SAMPLES = 5.0, 32
#: What is louder than this share of the peak is shock, however noisy the record.
MAX_EVENT_SHARE = 0.5
#: A record is scanned in pieces that stay in the processor's cache, and not beyond what is sought.
_SCANNED = 16384
#: MAD of a normal distribution times this is its standard deviation.
MAD_TO_SIGMA = 1.4826


@dataclass(frozen=True)
class ShockSpan:
    """The shock in a record, in samples: first and last index, both included, and the peak
    deviation between."""

    first: int
    last: int
    peak: float


@dataclass(frozen=True)
class Scale:
    """What a record's levels are measured against: level at rest, quantisation step and spread
    about the rest."""

    rest: float
    step: float
    noise: float


def scale_of(x: NDArray[np.float64]) -> Scale:
    """The scale of a record (n,), n >= 1. `noise` takes in what rings: an upper bound of it."""
    return Scale(baseline(x), quantisation_step(x), robust_sigma(x))


def channel_scale(channel: Channel) -> Scale:
    """The scale of a channel's samples (`finite_samples`), at least one."""
    lone = channel.placeholders.lone  # mended, they have no step of the converter
    return channel.once("scale", lambda: scale_of(np.delete(finite_samples(channel), lone)))


def finite_samples(channel: Channel) -> NDArray[np.float64]:
    """The channel's readings in SI (n,); where they hold NaN or infinity, a copy with the median of
    the others there.

    The dropout check reports those samples, as the placeholder check does those that are mended in
    the readings; the other checks need a record that they can compare.
    """
    return channel.once("finite samples", lambda: _with_filler(channel.readings))


def _with_filler(si: NDArray[np.float64]) -> NDArray[np.float64]:
    if all_finite(si):
        return si
    good = np.isfinite(si)
    filler = baseline(si[good]) if good.any() else 0.0
    return np.where(good, si, filler)


def all_finite(x: NDArray[Any]) -> bool:
    """Whether no sample of `x` (n,) is NaN or infinite, in one pass: the sum is as soon as one
    sample is."""
    with np.errstate(invalid="ignore", over="ignore"):
        return math.isfinite(float(x.sum(dtype=np.float64))) or bool(np.isfinite(x).all())


def decimated(x: NDArray[np.float64], samples: int = DECIMATED_SAMPLES) -> NDArray[np.float64]:
    """Every k-th sample of `x` (n,), at most `samples` of them (a view)."""
    return x[:: -(-x.size // samples) or 1]


def baseline(x: NDArray[np.float64]) -> float:
    """Median of the decimated record: the level at rest, as long as the shocks fill less than half
    of it."""
    return float(np.median(decimated(x))) if x.size else 0.0


def robust_sigma(x: NDArray[np.float64]) -> float:
    """Standard deviation by the median absolute deviation of the decimated record; 0 for an empty
    one."""
    some = decimated(x)
    return MAD_TO_SIGMA * float(np.median(np.abs(some - np.median(some)))) if some.size else 0.0


def quantisation_step(x: NDArray[np.float64]) -> float:
    """The smallest difference between two values of `x` (n,): its LSB, or an upper bound of it. 0
    for a constant.

    Looks at a decimated record and at what surrounds the largest sample; an overestimate only makes
    checks lenient.
    """
    top = int(x.argmax())
    near = x[max(top - DECIMATED_SAMPLES // 2, 0) : top + DECIMATED_SAMPLES // 2]
    gaps = np.diff(np.sort(np.concatenate([decimated(x), near])))
    gaps = gaps[gaps > 0]
    return float(gaps.min()) if gaps.size else 0.0


def shock_span(channel: Channel, contacts: tuple[Contact, ...]) -> ShockSpan | None:
    """`event_span` of a channel: all but a force ring after a contact."""
    ringing = channel.quantity != "force"
    return channel.once(
        ("span", contacts), lambda: event_span(finite_samples(channel), contacts, ringing)
    )


def event_span(
    x: NDArray[np.float64], contacts: tuple[Contact, ...], ringing: bool
) -> ShockSpan | None:
    """Where the shock is: from the contacts, stretched over what rings above 5 % of the peak, and
    above the noise, if `ringing`.

    Without contacts the record itself says. None for a constant record.
    """
    if x.size == 0:
        return None
    rest, top, bottom = baseline(x), int(x.argmax()), int(x.argmin())
    at = top if x[top] - rest > rest - x[bottom] else bottom
    peak = abs(float(x[at]) - rest)
    if peak == 0.0:
        return None
    if contacts and not ringing:
        return ShockSpan(contacts[0].first, contacts[-1].last, peak)
    limit = _loudness(x, peak)
    # Each side against its own rest: an offset after the shock is no ringing.
    before, after = _first_loud(x[:at], limit), _first_loud(x[at:][::-1], limit)
    first = at if before is None else before
    last = at if after is None else x.size - 1 - after
    if contacts:
        first, last = contacts[0].first, max(last, contacts[-1].last)
    return ShockSpan(first, last, peak)


def _loudness(x: NDArray[np.float64], peak: float) -> float:
    """What no longer counts as rest. The noise is that of differences of neighbours at the begin of
    `x` (n,), in which the smooth rise of a pulse leaves nothing."""
    steps = np.diff(x[:NOISE_SAMPLES] / peak)
    sigma = (
        MAD_TO_SIGMA * float(np.median(np.abs(steps - np.median(steps)))) / math.sqrt(2.0)
        if steps.size
        else 0.0
    )
    return min(max(EVENT_SHARE, NOISE_SIGMAS * sigma), MAX_EVENT_SHARE) * peak


def _first_loud(x: NDArray[np.float64], limit: float) -> int | None:
    """Index of the first sample of `x` (n,) farther from its median than `limit`; None where there
    is none."""
    rest = baseline(x)
    for start in range(0, x.size, _SCANNED):
        piece = x[start : start + _SCANNED]
        loud = (piece > rest + limit) | (piece < rest - limit)
        if loud.any():
            return start + int(loud.argmax())
    return None


@dataclass(frozen=True)
class SampleRuns:
    """First sample and length of each run, (k,) both, ascending and apart."""

    first: NDArray[np.int64]
    samples: NDArray[np.int64]

    @property
    def last(self) -> NDArray[np.int64]:
        return self.first + np.maximum(self.samples - 1, 0)

    def where(self, chosen: NDArray[np.bool_]) -> SampleRuns:
        return SampleRuns(self.first[chosen], self.samples[chosen])

    def by_contact(self, contacts: tuple[Contact, ...]) -> Iterator[tuple[int | None, SampleRuns]]:
        """(index, runs that touch that contact) for each contact touched, then (None, the runs that
        touch none)."""
        outside = np.ones(self.first.size, dtype=bool)
        for index, contact in enumerate(contacts):
            touching = (self.first <= contact.last) & (self.last >= contact.first)
            outside &= ~touching
            if touching.any():
                yield index, self.where(touching)
        if outside.any():
            yield None, self.where(outside)

    def evidence(self, channel: Channel) -> dict[str, int | float]:
        """How many samples, where the first is, how long the longest run is. Needs at least one
        run."""
        period_s = float(channel.period_s)
        total, longest = int(self.samples.sum()), int(self.samples.max())
        return {
            "samples": total,
            "runs": int(self.first.size),
            "first_sample": int(self.first[0]),
            "first_time_s": float(channel.start_s) + float(self.first[0]) * period_s,
            "longest_samples": longest,
            "longest_s": longest * period_s,
            "share": total / channel.recorded.size,
        }


def runs_of(at: NDArray[np.int64]) -> SampleRuns:
    """Ascending sample indices (n,), grouped where they are neighbours."""
    return SampleRuns(at[head := run_heads(at)], np.diff(head, append=at.size))


def run_heads(at: NDArray[np.int64]) -> NDArray[np.int64]:
    """Positions in `at` (n,) at which a run begins."""
    return np.flatnonzero(np.diff(at, prepend=-2) > 1)


#: Fewer samples than this before or after the shock give no level.
MIN_REST_SAMPLES = 16
#: The standard error of a level comes from the means of ten blocks, which ringing and slow wander
#: spread as they should; with nine degrees of freedom five of them are exceeded by chance once in
#: 1350 (Student's t).
BLOCKS = 10
#: A slope beyond so many of its own standard errors is a flank (Student's t, eight degrees: once in
#: 950).
MIN_SLOPE_ERRORS = 5.0


def rest_before(x: NDArray[np.float64], span: ShockSpan) -> NDArray[np.float64]:
    """What rests before the shock in `x` (n,): the first half of what lies before it; empty where
    that is too little, and where it climbs or falls.

    The second half may hold the foot of a slow pulse, which is no level: a drop table's makes one
    of 1 % of the peak. Where a record begins inside of that foot, the first half climbs as well.
    """
    quiet = x[: span.first // 2]
    return quiet[:0] if quiet.size < MIN_REST_SAMPLES or climbs(quiet) else quiet


def climbs(x: NDArray[np.float64]) -> bool:
    """Whether a line through the block means of `x` (n,), n >= 10, has a slope that is no
    chance."""
    means = block_means(x)
    at = np.arange(BLOCKS) - (BLOCKS - 1) / 2
    slope = float(at @ means) / float(at @ at)
    residuals = means - means.mean() - slope * at
    return abs(slope) > MIN_SLOPE_ERRORS * float(
        np.sqrt(residuals @ residuals / (BLOCKS - 2) / (at @ at))
    )


def rest_after(x: NDArray[np.float64], span: ShockSpan) -> NDArray[np.float64]:
    """What rests after the shock in `x` (n,), without the falling foot of a pulse: half as much as
    the shock lasted, but half of what is left at most. Where it rings to the end, the last quarter
    of what follows its begin."""
    quarter = x.size - (x.size - span.first) // 4
    foot = min((span.last - span.first + 1) // 2, (x.size - span.last - 1) // 2)
    quiet = x[min(span.last + 1 + foot, quarter) :]
    return quiet if quiet.size >= MIN_REST_SAMPLES else quiet[:0]


def block_mean(x: NDArray[np.float64]) -> tuple[float, float]:
    """Mean and its standard error by batch means, of as much of `x` (n,), n >= 10, as ten equal
    blocks hold."""
    means = block_means(x)
    return float(means.mean()), float(means.std(ddof=1)) / BLOCKS**0.5


def block_means(x: NDArray[np.float64]) -> NDArray[np.float64]:
    """Means of the last ten equal blocks of `x` (n,), n >= 10: (10,)."""
    length = x.size // BLOCKS
    return np.asarray(x[x.size - BLOCKS * length :].reshape(BLOCKS, length).mean(axis=1))
