"""Hits in an acceleration record that are apart: the structure is at rest between them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..array_types import Floats

#: Below this share of the record's largest excursion, or below so many deviations of its noise, it
#: is at rest; a hit has at least `_HIT_SHARE` of it. What is louder than half of the largest is no
#: rest, however noisy the record.
_REST_SHARE, _NOISE_SIGMAS, _MOST_REST, _HIT_SHARE = 0.05, 5.0, 0.5, 0.2
#: Two hits are apart where the record rests this long, this many samples, and for this share of the
#: time that the one before was loud: at each zero a slow oscillation is below 5 % for a thirtieth
#: of the time that it was above. A hammer that bounces hits again within some milliseconds, which
#: is one event.
_APART_S, _APART_SAMPLES, _APART_SHARE = 20e-3, 16, 0.25
#: A record is cut into so many pieces for its noise, which is that of a quiet one among them.
_PIECES, _QUIET_QUANTILE = 32, 0.1


@dataclass(frozen=True)
class RecordHit:
    """First and last loud sample of a hit, both included, and its largest excursion from the
    rest."""

    first: int
    last: int
    peak: float


def hits_of(record: Floats, sampling_rate_hz: float) -> list[RecordHit]:
    """Hits in a record, in the order of time: one for a shock, however it rings.

    Parameters:
        record: Acceleration (n,) in m/s2. There are no hits in a constant record, nor in one with
            samples that are no numbers.
        sampling_rate_hz: Its sampling rate.
    """
    if not record.size or not np.isfinite(record.sum()):
        return []
    size = np.abs(record - np.median(record))
    largest = float(size.max())
    if not largest > 0:
        return []
    length = record.size // _PIECES
    noise = 0.0
    if length >= 2:
        noise = float(
            np.quantile(
                record[: length * _PIECES].reshape(_PIECES, -1).std(axis=1), _QUIET_QUANTILE
            )
        )
    rest = min(max(_REST_SHARE * largest, _NOISE_SIGMAS * noise), _MOST_REST * largest)
    loud = np.flatnonzero(size > rest)
    apart = max(_APART_S * sampling_rate_hz, _APART_SAMPLES)
    groups: list[tuple[int, int]] = []
    begin = int(loud[0])
    pauses = np.flatnonzero(np.diff(loud) > apart)
    for pause in pauses.tolist():
        end, later = int(loud[pause]), int(loud[pause + 1])
        if later - end > _APART_SHARE * (end - begin):
            groups.append((begin, end))
            begin = later
    groups.append((begin, int(loud[-1])))
    hits = [RecordHit(first, last, float(size[first : last + 1].max())) for first, last in groups]
    return [
        hit
        for hit in hits
        if hit.peak >= max(_HIT_SHARE * largest, 2 * rest if len(hits) > 1 else 0.0)
    ]
