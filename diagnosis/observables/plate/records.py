"""A campaign's accelerations from the end of each contact on, as one block."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from ...record import CampaignRecord, Floats, Run, Series
from .force import contact, end_of

#: Where no force says when a contact ends: soft tips stay on a plate for some milliseconds (thesis, Fig. 4.6).
_CONTACT_S = 5e-3
#: Longer records are cut: by then a plate is silent. A run below this share of the usual length is left out.
_MOST_SAMPLES, _SHORT = 16384, 0.5
#: Samples between the end of a contact and the ringing that modes are read from.
_CLEAR = 4


@dataclass(frozen=True, eq=False)
class RingdownRecords:
    """Of R runs and S channels: `acceleration` (R, S, n), NaN for what was not measured.

    `window_s` is the usual stretch of time, from the begin of contact.
    """

    acceleration: Floats
    channels: tuple[str, ...]
    rate_hz: float
    window_s: tuple[float, float]

    @property
    def good(self) -> NDArray[np.bool_]:
        """(R, S): what was measured."""
        return np.asarray(np.isfinite(self.acceleration).all(axis=2))

    @classmethod
    def of(cls, record: CampaignRecord, used: NDArray[np.bool_]) -> Self:
        """Of the runs that are `used` (R,). Raises `ValueError` where none of them has an acceleration."""
        channels = tuple(dict.fromkeys(name for run in record.runs for name in run.accelerations))
        cuts = [_cuts(run) if use else {} for run, use in zip(record.runs, used, strict=True)]
        rates = [series.sampling_rate_hz for cut in cuts for series in cut.values()]
        if not rates:
            raise ValueError("no run has an acceleration of the plate that goes on after the contact")
        values, counts = np.unique(rates, return_counts=True)
        rate = float(values[np.argmax(counts)])
        cuts = [{name: s for name, s in cut.items() if math.isclose(s.sampling_rate_hz, rate)} for cut in cuts]
        lengths = [min(s.values.size for s in cut.values()) if cut else 0 for cut in cuts]
        least = _SHORT * float(np.median([length for length in lengths if length]))
        kept = [length >= max(least, 1) for length in lengths]
        samples = min(_MOST_SAMPLES, *(length for length, keep in zip(lengths, kept, strict=True) if keep))
        block = np.full((len(cuts), len(channels), samples), np.nan)
        for row, (cut, keep) in enumerate(zip(cuts, kept, strict=True)):
            for name, series in cut.items() if keep else ():
                block[row, channels.index(name)] = series.values[:samples]
        starts = [s.start_s for cut, keep in zip(cuts, kept, strict=True) if keep for s in cut.values()]
        begin = float(np.median(starts))
        return cls(block, channels, rate, (begin, begin + samples / rate))


def _cuts(run: Run) -> dict[str, Series]:
    """By channel what follows the contact, where it is numbers and not silent."""
    over = _CONTACT_S if run.force is None or not np.any(run.force.values) else end_of(contact(run.force))
    found = {}
    for name, series in run.accelerations.items():
        first = max(0, math.ceil((over - series.start_s) * series.sampling_rate_hz)) + _CLEAR
        values = series.values[first:]
        if values.size and np.isfinite(values).all() and np.ptp(values) > 0:
            found[name] = Series(values, series.sampling_rate_hz, series.start_s + first / series.sampling_rate_hz)
    return found
