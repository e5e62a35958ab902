"""Samples that stand alone: far from what their neighbours on either side say, which agree with one
another.

The rule and its reasons stand in `placeholders`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats

#: A lone sample departs from the cubic through its neighbours by so many times as much as they do.
LONE_RATIO = 20.0
#: The same for a sample that is exactly one of `CODES`: chance hardly writes them.
CODE_RATIO = 3.0
#: Samples on either side that are looked at.
NEIGHBOURS = 8
#: What departs by less than this share of the record's largest deviation changes no figure: a peak
#: by 2 % at most.
LEAST_SHARE = 0.02
#: What departs by fewer steps of the converter is its noise.
LEAST_STEPS = 16.0
#: So many equal samples can stand for one lone value; more are a top, which the clipping check
#: judges.
LONGEST_RUN = 2
#: Where one is mended, a smaller one may show.
_MOST_ROUNDS = 16
_LEAST_SAMPLES = 5
#: Values that several samples near one another have: the farthest from the rest are looked at.
_MOST_VALUES = 8
_SCANNED = 16384
#: What loggers and exports write for "no value" (-999.25: Log ASCII Standard), and the ends of 16,
#: 24 and 32 bits.
CODES = np.array(
    [
        *(
            sign * value
            for value in (999.0, 999.25, 9999.0, 9999.9, 99999.0, 999999.0)
            for sign in (-1.0, 1.0)
        ),
        *(
            -32768.0,
            -32767.0,
            32767.0,
            65535.0,
            -8388608.0,
            8388607.0,
            -2147483648.0,
            2147483647.0,
            4294967295.0,
        ),
    ]
)
_LEAST_CODE = float(np.abs(CODES).min())


def lone_samples(x: Floats, recorded: NDArray[Any]) -> NDArray[np.int64]:
    """Indices (k,) of the lone samples of a finite record `x` (n,), which the file holds as
    `recorded` (n,)."""
    rounds: list[NDArray[np.int64]] = []
    for _ in range(_MOST_ROUNDS if x.size >= _LEAST_SAMPLES else 0):
        at = _round(x, recorded)
        if not at.size:
            break
        x = x if rounds else x.copy()
        mend(x, at)
        rounds.append(at)
    return np.unique(np.concatenate(rounds)) if rounds else np.empty(0, np.int64)


def mend(x: Floats, at: NDArray[np.int64]) -> None:
    """Put the cubic through the two neighbours on either side in the place of the samples `at` (k,)
    of `x` (n,).

    Neighbours that are mended themselves are passed over; at an end the last neighbour counts on.
    """
    usable = np.delete(np.arange(x.size), at)
    if not at.size or not usable.size:
        return
    after = np.searchsorted(usable, at)
    near = [usable[np.clip(after + offset, 0, usable.size - 1)] for offset in (-2, -1, 0, 1)]
    x[at] = (4.0 * (x[near[1]] + x[near[2]]) - x[near[0]] - x[near[3]]) / 6.0


@dataclass(frozen=True)
class _Collapsed:
    """A record in which equal neighbours that may stand for one value are one: its samples, and
    each one's first index and number of samples in the record; None where none are equal."""

    x: Floats
    first: NDArray[np.int64] | None
    samples: NDArray[np.int64] | None

    def firsts(self, at: NDArray[np.int64]) -> NDArray[np.int64]:
        """Indices in the record of the samples `at` (k,)."""
        return at if self.first is None else self.first[at]

    def lengths(self, at: NDArray[np.int64]) -> NDArray[np.int64]:
        """Samples of the record that stand behind the samples `at` (k,)."""
        return np.ones(at.size, np.int64) if self.samples is None else self.samples[at]


def _round(x: Floats, recorded: NDArray[Any]) -> NDArray[np.int64]:
    low, high = float(x.min()), float(x.max())
    rest = float(np.median(x[:: max(1, x.size // 4096)]))
    floor = LEAST_SHARE * max(high - rest, rest - low)
    if floor == 0.0:
        return np.empty(0, np.int64)
    steep, repeats = _steps(x, floor)
    code_at = _code_samples(x, recorded)
    short = _collapsed(x, steep, repeats, code_at)
    if short.first is not None:
        steep, _ = _steps(short.x, floor)
    at = _peaks(short.x, steep)
    code_at = _lone_codes(short, code_at)
    if code_at.size:
        at = np.union1d(at, code_at)
    runs = [_lone_ends(x, recorded, low, high)]
    for members, others in _by_value(short.x, at):
        lone = _lone(short, members, others, code_at)
        if lone.size:
            departs = np.abs(short.x[lone] - _expected(_window(others, lone, 2)))
            lone = lone[departs >= LEAST_STEPS * _step(x, short.firsts(lone))]
        runs += [
            np.arange(a, a + n)
            for a, n in zip(short.firsts(lone), short.lengths(lone), strict=True)
        ]
    return np.unique(np.concatenate(runs))


def _by_value(x: Floats, at: NDArray[np.int64]) -> Iterator[tuple[NDArray[np.int64], Floats]]:
    """Candidates with the record that they are held against. Those of one value that stand near one
    another would hide each other: they are held against the record in which all of that value are
    mended."""
    yield at, x
    near = at[:-1][np.diff(at) <= NEIGHBOURS + 2]
    if not near.size:
        return
    values, counts = np.unique(x[at], return_counts=True)
    values = np.intersect1d(values[counts > 1], x[near])
    rest = float(np.median(x[:: max(1, x.size // 4096)]))
    for value in values[np.argsort(-np.abs(values - rest))][:_MOST_VALUES]:
        members, mended = at[x[at] == value], x.copy()
        mend(mended, members)
        yield members, mended


def _lone(
    short: _Collapsed, at: NDArray[np.int64], others: Floats, code_at: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Those of the candidates `at` that depart far enough from the `others`."""

    def window(reach: int) -> Floats:
        near = _window(others, at, reach)
        near[:, reach] = short.x[at]
        return near

    near = window(3)
    at = at[
        _departure(near) >= CODE_RATIO * _of_the_next(near)
    ]  # the cheap part of the rule, on all
    near = window(NEIGHBOURS + 2)
    around = np.maximum(_of_the_next(near), _of_the_others(near))
    is_code = np.isin(at, code_at) if code_at.size else np.zeros(at.size, bool)
    far = _departure(near) >= np.where(is_code, CODE_RATIO, LONE_RATIO) * around
    return at[far & (is_code | (short.lengths(at) <= LONGEST_RUN))]


def _steps(x: Floats, least: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Samples of `x` (n,) after which it moves by more than `least`, and samples that equal the one
    before them.

    In pieces that stay in the processor's cache: most of a record is at rest.
    """
    steep, repeats = [], []
    rise = np.empty(min(_SCANNED, x.size))
    for begin in range(0, x.size - 1, _SCANNED):
        piece = x[begin : begin + _SCANNED + 1]
        moved = np.subtract(piece[1:], piece[:-1], out=rise[: piece.size - 1])
        repeats.append(np.flatnonzero(moved == 0.0) + (begin + 1))
        np.abs(moved, out=moved)
        steep.append(np.flatnonzero(moved > least) + begin)
    return np.concatenate(steep), np.concatenate(repeats)


def _collapsed(
    x: Floats, steep: NDArray[np.int64], repeats: NDArray[np.int64], code_at: NDArray[np.int64]
) -> _Collapsed:
    """The record with runs of equal samples as one sample, where these may be one value: between
    two steep steps, or of a code."""
    if repeats.size and (steep.size or code_at.size):
        heads = np.flatnonzero(np.diff(repeats, prepend=-2) > 1)
        first, last = repeats[heads] - 1, np.append(repeats[heads[1:] - 1], repeats[-1])
        short = last - first < LONGEST_RUN
        alone = (short & _among(first - 1, steep) & _among(last, steep)) | _among(first, code_at)
        repeats = repeats[np.repeat(alone, np.diff(heads, append=repeats.size))]
        if repeats.size:
            kept = np.delete(np.arange(x.size), repeats)
            return _Collapsed(x[kept], kept, np.diff(kept, append=x.size))
    return _Collapsed(x, None, None)


def _among(values: NDArray[np.int64], ascending: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Which of `values` (k,) are among those of an ascending array; numpy's own test would hash all
    of them."""
    if not ascending.size:
        return np.zeros(values.size, dtype=bool)
    at = np.minimum(np.searchsorted(ascending, values), ascending.size - 1)
    return np.asarray(ascending[at] == values)


def _code_samples(x: Floats, recorded: NDArray[Any]) -> NDArray[np.int64]:
    """Samples of exactly one of `CODES`, but the first and the last one."""
    if max(float(recorded.max()), -float(recorded.min())) < _LEAST_CODE:
        return np.empty(0, np.int64)
    at = np.flatnonzero((recorded >= _LEAST_CODE) | (recorded <= -_LEAST_CODE))
    at = at[(at > 0) & (at < x.size - 1)]
    return np.asarray(at[np.isin(recorded[at], CODES)])


def _lone_codes(short: _Collapsed, code_at: NDArray[np.int64]) -> NDArray[np.int64]:
    """Those of the samples of codes that lie above both of their neighbours, or below both, in the
    collapsed record."""
    if not code_at.size:
        return code_at
    at = code_at
    if short.first is not None:
        at = np.unique(np.searchsorted(short.first, code_at, side="right") - 1)
        at = at[(at > 0) & (at < short.x.size - 1)]
    before, after = short.x[at] - short.x[at - 1], short.x[at] - short.x[at + 1]
    return np.asarray(at[before * after > 0])


def _peaks(x: Floats, steep: NDArray[np.int64]) -> NDArray[np.int64]:
    """Samples between two `steep` steps of opposite signs."""
    at = steep[1:][np.diff(steep) == 1]
    return np.asarray(at[(x[at] > x[at - 1]) != (x[at + 1] > x[at])])


def _window(x: Floats, at: NDArray[np.int64], reach: int) -> Floats:
    """The samples `at` (k,) of `x` (n,) with `reach` on either side, (k, 2 reach + 1); the ends of
    `x` count on."""
    near = at[:, None] + np.arange(-reach, reach + 1)
    if at.size and (near[0, 0] < 0 or near[-1, -1] >= x.size):
        near = np.clip(near, 0, x.size - 1)
    return np.asarray(x[near])


def _cubic(before: Floats, after: Floats) -> Floats:
    """Half way between samples at -2 and -1 (k, 2) and at 1 and 2 (k, 2)."""
    return np.asarray((4.0 * (before[:, 1] + after[:, 0]) - before[:, 0] - after[:, 1]) / 6.0)


def _expected(window: Floats) -> Floats:
    middle = window.shape[1] // 2
    return _cubic(window[:, middle - 2 : middle], window[:, middle + 1 : middle + 3])


def _departure(window: Floats) -> Floats:
    """By how much each sample in the middle of a window (k, m) departs from the cubic through its
    neighbours."""
    return np.abs(window[:, window.shape[1] // 2] - _expected(window))


def _of_the_next(window: Floats) -> Floats:
    """The larger departure of the two samples beside the middle one, by the cubic through those at
    -2, -1, 2 and 3 from it, which passes over the middle one."""
    middle = window.shape[1] // 2
    sides = []
    for side in (-1, 1):
        passing = (-0.2, -2), (0.5, -1), (1.0, 2), (-0.3, 3)
        expected = sum(weight * window[:, middle + side * offset] for weight, offset in passing)
        sides.append(np.abs(window[:, middle + side] - expected))
    return np.maximum(*sides)


def _of_the_others(window: Floats) -> Floats:
    """The largest departure of the samples from the second beside the middle one on, as if that
    were mended."""
    middle = window.shape[1] // 2
    mended = window.copy()
    mended[:, middle] = _expected(window)
    inner = mended[:, 2:-2]
    departures = np.abs(
        inner - (4.0 * (mended[:, 1:-3] + mended[:, 3:-1]) - mended[:, :-4] - mended[:, 4:]) / 6.0
    )
    departures[:, middle - 3 : middle] = (
        0.0  # of the middle one and the next, which `_of_the_next` tells
    )
    return np.asarray(departures.max(axis=1, initial=0.0))


def _step(x: Floats, at: NDArray[np.int64]) -> float:
    """The smallest difference of two values near the samples `at`: the converter's step, or an
    upper bound of it."""
    near = np.unique(np.clip(at[:, None] + np.arange(-256, 257), 0, x.size - 1))
    gaps = np.diff(
        np.unique(np.delete(x, at) if near.size > x.size // 2 else x[np.setdiff1d(near, at)])
    )
    return float(gaps.min()) if gaps.size else 0.0


def _lone_ends(x: Floats, recorded: NDArray[Any], low: float, high: float) -> NDArray[np.int64]:
    """The first and the last sample, where one is farther from all others than these are from one
    another."""
    ends = []
    for i, near, others in (
        (0, x[1 : 1 + NEIGHBOURS], x[1:]),
        (x.size - 1, x[-1 - NEIGHBOURS : -1], x[:-1]),
    ):
        code = bool(np.isin(recorded[i], CODES))
        if not code and x[i] not in (low, high):
            continue
        spread = near if code else others
        distance, width = float(np.abs(spread - x[i]).min()), float(np.ptp(spread))
        if distance >= max(width, LEAST_SHARE * (high - low)) and float(np.ptp(others)) > 0.0:
            ends.append(i)
    return np.array(ends, dtype=np.int64)
