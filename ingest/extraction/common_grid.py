"""Channels of one recording on one time grid: each may start at an instant of its own (`start_s`),
and samples of the same number are then not of the same moment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...array_types import Floats
from ...signals.channel import Channel

#: Samples on either side that a value between samples is made of, and the shape of their Kaiser
#: window.
HALF_WIDTH, _KAISER = 32, 8.6
#: What is between samples by less is not interpolated: it moves a wave at half of the Nyquist
#: frequency by 0.02 %.
_ON_SAMPLE = 1e-4


class GridError(ValueError):
    """Channels cannot be put on one grid; the message says why and what to do."""


@dataclass(frozen=True)
class CommonGrid:
    """SI readings of several channels (k, n) on the grid of the first, whose sample `first` is
    theirs of number 0."""

    values: Floats
    sampling_rate_hz: float
    start_s: float
    first: int


def on_one_grid(channels: Sequence[Channel]) -> CommonGrid:
    """The span that all `channels` cover, on the samples of the first.

    Where another channel's samples lie between these, it is interpolated band-limited: up to 0.9 of
    the Nyquist frequency the error is below 1e-4 of the peak. Raises `GridError` for different
    rates, and for channels that have no moment in common.
    """
    first = channels[0]
    rate = first.sampling_rate_hz
    for other in channels[1:]:
        if not np.isclose(other.sampling_rate_hz, rate, rtol=1e-6, atol=0.0):
            raise GridError(
                f"{first.name!r} is recorded at {rate:g} Hz and {other.name!r} at "
                f"{other.sampling_rate_hz:g} Hz; record them at one rate"
            )
    offsets = [(channel.start_s - first.start_s) * rate for channel in channels]
    shifted = [
        _on_samples(channel.readings, offset)
        for channel, offset in zip(channels, offsets, strict=True)
    ]
    begin = max(number for number, _ in shifted)
    end = min(number + samples.size for number, samples in shifted)
    if end - begin < 1:
        spans = ", ".join(
            f"{c.name!r} from {c.start_s:g} to {c.start_s + c.recorded.size / rate:g} s"
            for c in channels
        )
        raise GridError(f"the channels have no moment in common: {spans}; check their start times")
    values = np.stack([samples[begin - number : end - number] for number, samples in shifted])
    return CommonGrid(values, rate, first.start_s + begin / rate, begin)


def _on_samples(samples: Floats, offset: float) -> tuple[int, Floats]:
    """Number on the grid of the first of `samples` (n,), which begin `offset` samples after it, and
    samples there."""
    number = round(offset)
    between = offset - number
    return number, samples if abs(between) < _ON_SAMPLE else delayed(samples, between)


def delayed(samples: Floats, delay: float) -> Floats:
    """The signal of `samples` (n,) later by `delay` samples, within ±0.5, at the same instants.

    By a sinc under a Kaiser window (A. V. Oppenheim and R. W. Schafer, Discrete-Time Signal
    Processing, section 7.5); beyond its ends the record is held at its last value.
    """
    taps = np.arange(-HALF_WIDTH, HALF_WIDTH + 1)
    place = taps - delay
    window = np.i0(_KAISER * np.sqrt(np.maximum(0.0, 1.0 - (place / (HALF_WIDTH + 1)) ** 2)))
    weights = np.sinc(place) * window
    padded = np.pad(samples, HALF_WIDTH, mode="edge")
    return np.asarray(np.convolve(padded, weights / weights.sum(), mode="valid"), dtype=np.float64)
