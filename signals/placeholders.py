"""Samples that are no readings: placeholders that an instrument or an export writes where it has
none (9.99e37, -9999, -32768), told from the shock by their neighbours.

What has passed an anti-alias filter is never one sample wide: one at 0.45 of the sampling rate or
below (recorders have 0.39 to 0.45) spreads the shortest impulse, so that the next samples have 11 %
of its peak or more (sinc 0.9). A sample is therefore lone where it departs from the cubic through
its four neighbours by twenty times as much as any of the samples around it departs from the cubic
through its own, which does not look at the lone one: twice what a filter can leave. That is the
identifier of Hampel (J. Amer. Statist. Assoc. 69 (1974) 383; Davies and Gather, ibid. 88 (1993)
782) on the residuals of an interpolation, with the largest residual near the sample in the place of
their median deviation, which the first crest of any shock exceeds. Of 406 measured records an
unfiltered 500 Hz logger comes nearest, which saw a shock in samples of 9, 100 and 0 %: 9 times. An
unfiltered recorder that sees a contact in one sample alone cannot be told from a placeholder, and
has no peak or impulse to lose.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..array_types import Floats
from .lone_samples import NEIGHBOURS, lone_samples, mend

#: No instrument measures such a number. Oscilloscopes write 9.9E37 where they have none (SCPI-1999,
#: volume 1, 7.2.1.4).
BEYOND_RANGE = 1e30


@dataclass(frozen=True)
class Placeholders:
    """Samples of a record, ascending: those that are `lone`, and those of numbers beyond every
    range that stand together, where the instrument was overdriven."""

    lone: NDArray[np.int64]
    beyond_range: NDArray[np.int64]


NO_PLACEHOLDERS = Placeholders(np.empty(0, np.int64), np.empty(0, np.int64))


def without_placeholders(
    values: Floats, recorded: NDArray[Any], *, pulsed: bool = False
) -> tuple[Placeholders, Floats]:
    """The placeholders among `values` (n,) in SI, which the file holds as `recorded` (n,), and the
    values without them. In a `pulsed` record a sample may stand alone, and only numbers beyond
    every range are none.

    A lone sample becomes the cubic through its neighbours. Numbers beyond every range that stand
    together become the extreme of the others on their side, which is a bound. NaN stays, and
    infinity becomes NaN. Where there is no placeholder, the values are handed back as they came,
    not copied.
    """
    if not values.size:
        return NO_PLACEHOLDERS, values
    beyond = not_numbers = NO_PLACEHOLDERS.lone
    low, high = float(values.min()), float(values.max())  # NaN where one sample is none
    extreme = _extreme(recorded)
    if not (np.isfinite(low) and np.isfinite(high) and extreme < BEYOND_RANGE):
        beyond, not_numbers = _beyond_range(recorded), np.flatnonzero(~np.isfinite(values))
    elif pulsed or values.size <= NEIGHBOURS:
        return NO_PLACEHOLDERS, values
    usable = values
    alone = np.diff(beyond, prepend=-2) > 1
    alone &= np.append(alone[1:], True)
    if beyond.size or not_numbers.size:
        rest = np.delete(values, np.union1d(beyond, not_numbers))
        if not rest.size:  # nothing to mend them by
            return Placeholders(beyond[:0], beyond), values
        usable = values.copy()
        usable[beyond] = np.where(values[beyond] > 0, rest.max(), rest.min())
        mend(usable, not_numbers)
        mend(usable, beyond[alone])
    lone = beyond[:0] if pulsed else np.setdiff1d(lone_samples(usable, recorded), not_numbers)
    placeholders = Placeholders(np.union1d(beyond[alone], lone), np.setdiff1d(beyond[~alone], lone))
    if not placeholders.lone.size and not beyond.size and not np.isinf(values[not_numbers]).any():
        return NO_PLACEHOLDERS, values
    usable = usable.copy() if usable is values else usable
    mend(usable, lone)
    usable[not_numbers] = np.nan
    return placeholders, usable


def _extreme(recorded: NDArray[Any]) -> float:
    """The largest magnitude of the file's numbers; NaN where one is none."""
    return max(float(recorded.max()), -float(recorded.min()))


def _beyond_range(recorded: NDArray[Any]) -> NDArray[np.int64]:
    """Samples of finite numbers that no instrument measures."""
    if recorded.dtype.kind != "f" or recorded.dtype.itemsize < 4:
        return NO_PLACEHOLDERS.lone
    with np.errstate(invalid="ignore", over="ignore"):
        return np.flatnonzero((np.abs(recorded) >= BEYOND_RANGE) & np.isfinite(recorded))
