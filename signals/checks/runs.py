"""Runs of neighbouring samples, and which contact each belongs to."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..channel import Channel
from .base import Contact


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
        """(index, runs that touch that contact) for each contact touched, then (None, the runs that touch none)."""
        outside = np.ones(self.first.size, dtype=bool)
        for index, contact in enumerate(contacts):
            touching = (self.first <= contact.last) & (self.last >= contact.first)
            outside &= ~touching
            if touching.any():
                yield index, self.where(touching)
        if outside.any():
            yield None, self.where(outside)

    def evidence(self, channel: Channel) -> dict[str, int | float]:
        """How many samples, where the first is, how long the longest run is. Needs at least one run."""
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
