"""Counts of a converter: a series of whole multiples of one step, kept as 16-bit integers and the
step.

What a 16-bit recorder writes as floats fills four or eight bytes with at most two bytes of
information, and packs and unpacks several times slower than the counts it came from. The step is
found, not declared, and counts are used only where they give back every bit.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Counts = NDArray[np.int16]

LARGEST_COUNT = 32_767
#: Samples that are looked at first: most series that are no multiples show it there.
_PROBE_SAMPLES = 16_384
#: A step that fails somewhere is narrowed by the samples where it failed, this many times.
_ATTEMPTS = 4
#: Counts up to this one tell the step well enough to know all others.
_NEAR = 64


def as_counts(samples: NDArray[Any]) -> tuple[Counts, float] | None:
    """Counts (n,) and their step, from which `from_counts` makes the same bits as `samples` (n,);
    None if none do."""
    if samples.dtype not in (np.dtype("<f4"), np.dtype("<f8")) or samples.size < 2:
        return None
    with np.errstate(
        all="ignore"
    ):  # what overflows gives counts that are refused, or bits that differ
        return _as_counts(samples)


def _as_counts(samples: NDArray[Any]) -> tuple[Counts, float] | None:
    probe = np.unique(samples[:: max(1, samples.size // _PROBE_SAMPLES)]).astype(np.float64)
    if probe.size < 2 or not np.isfinite(probe[[0, -1]]).all():
        return None
    rough = float(np.diff(probe).min())
    probed = np.concatenate([probe, samples[[samples.argmin(), samples.argmax()]]])
    for _ in range(_ATTEMPTS):
        step = _step(probed, rough, samples.dtype)
        if step is None:
            return None
        if _counts_of(probed.astype(samples.dtype), step)[1].size:
            return None  # no step gives even these
        counts, wrong = _counts_of(samples, step)
        if not wrong.size:
            return counts, step
        probed = np.concatenate([probed, samples[wrong[:_PROBE_SAMPLES]]])
    return None


def from_counts(counts: Counts, step: float, out: NDArray[Any]) -> None:
    """Counts times step into `out` (n,), rounded once to its dtype."""
    # A step that float32 holds gives the same product in single precision, ten times faster: 15 and
    # 24 bits fit in the 53 of a double, so that either way the exact product is rounded once.
    narrow = out.dtype == np.float32 and float(np.float32(step)) == step
    np.multiply(
        counts, np.float32(step) if narrow else np.float64(step), out=out, casting="same_kind"
    )


def _step(values: NDArray[np.float64], rough: float, dtype: np.dtype[Any]) -> float | None:
    """A step whose multiples round to all of `values` in `dtype`, if there is one near `rough`."""
    size = np.abs(values[values != 0])
    # A difference of rounded values is off by their rounding: too much for the larger counts, not
    # for small ones.
    near = size[size <= _NEAR * rough]
    if near.size:
        rough = float(near.max() / np.rint(near.max() / rough))
    counts = np.rint(size / rough)
    if not counts.size or not 1 <= counts.min() <= counts.max() <= LARGEST_COUNT:
        return None
    half = np.spacing(size.astype(dtype)).astype(np.float64) / 2
    low, high = float(((size - half) / counts).max()), float(((size + half) / counts).min())
    if low > high * (1 + 4 * np.finfo(np.float64).eps):
        return None
    middle = (low + high) / 2
    narrow = float(np.float32(middle))
    return narrow if dtype == np.float32 and low <= narrow <= high else middle


def _counts_of(samples: NDArray[Any], step: float) -> tuple[Counts, NDArray[np.intp]]:
    """Counts of `samples` (n,), and the indices of those that they do not give back."""
    # Beyond the counts, and where there is no number, the conversion gives anything: the comparison
    # notices.
    counts = (
        np.rint(samples / samples.dtype.type(step))
        .clip(-LARGEST_COUNT, LARGEST_COUNT)
        .astype(np.int16)
    )
    again = np.empty_like(samples)
    from_counts(counts, step, again)
    bits = f"u{samples.itemsize}"
    return counts, np.flatnonzero(again.view(bits) != samples.view(bits))
