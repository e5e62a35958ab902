"""Force and accelerations of the chosen hits, cut from their recordings on each hit's own clock: 0 s is when contact
begins."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from ...ingest.impact_speed import IMPACTOR_POSITIONS
from ...ingest.stored import read_channel
from ...schema.recordings import RecordedChannel
from ..record import Floats, Series
from .impacts import Hit
from .quality_exclusions import QualityExclusions

#: Of the force, in contact times from the start of contact; at least so many samples before tell the noise.
_FORCE_BEFORE, _FORCE_AFTER, _REST_SAMPLES = 0.5, 2.0, 64
#: Of an acceleration: rest before the contact, and ringing after it unless the next hit comes first.
_REST_S, _RINGING_S = 1e-3, 0.1
#: The next hit's window begins so long before its contact: a start found at a share of the peak is a little late.
_CLEAR_S = 1e-3
#: Ringing begins where a record first exceeds this share of its top, at most so long before it.
_RISE, _RISE_S = 0.1, 10e-3
#: In samples: nearer than this is the same instant.
_SAME_SAMPLE = 1e-4


@dataclass(eq=False)
class HitSeries:
    """Series by a hit's place in the order of runs, and what happened on the way.

    `chosen` hits with a pulse; of them `turned` show compression as negative and `double_hits` are followed by a second
    touch. `rejected` counts hits by channel that a quality check said not to use; `force_cells` are channels whose sum
    is the force; `of_impactor` names accelerometers that ride on it; `without_force` are hits whose accelerations were
    recorded and their force was not.
    """

    chosen: int
    force: dict[int, Series] = field(default_factory=dict)
    accelerations: dict[int, dict[str, Series]] = field(default_factory=dict)
    rejected: Counter[str] = field(default_factory=Counter)
    of_impactor: set[str] = field(default_factory=set)
    double_hits: int = 0
    turned: int = 0
    force_cells: int = 0
    without_force: int = 0


def read_series(
    session: Session, hits: Sequence[Hit], chosen: Sequence[int], ringing: Sequence[int], exclusions: QualityExclusions
) -> HitSeries:
    """Force and accelerations of the hits at the places `chosen`; accelerations alone of those at `ringing`, which have
    no pulse, where no force was recorded that could have shown one."""
    result, clear_s = HitSeries(len(chosen)), clear_times(hits)
    channels = _channels(session, sorted({hits[i].recording_id or 0 for i in (*chosen, *ringing)}))
    for i in chosen:
        hit, rows = hits[i], channels.get(hits[i].recording_id or 0, [])
        result.double_hits += hit.impact_id in exclusions.double_hits
        after = min(_RINGING_S, clear_s[i])
        cuts = {}
        for row in _on_plate(rows, result):
            rest = max(_REST_S, _REST_SAMPLES / row.sampling_rate_hz)
            cuts[row.name] = _cut(session, row, hit.start_s or 0.0, rest, after)
        result.rejected.update(_add_accelerations(result, i, hit, cuts, exclusions))
        cells = [row for row in rows if row.quantity == "force"]
        result.force_cells = max(result.force_cells, len(cells))
        rejected = [row.name for row in cells if exclusions.rejects(hit, row.name)]
        result.rejected.update(rejected)
        if cells and not rejected:  # a sum lacks what one cell of its array lacks
            force = _contact_force(session, cells, hit, clear_s[i])
            result.turned += _pulls(force)
            result.force[i] = replace(force, values=-force.values) if _pulls(force) else force
    for i in ringing:
        hit, rows = hits[i], channels.get(hits[i].recording_id or 0, [])
        if not any(row.quantity == "force" for row in rows):
            good = [row for row in _on_plate(rows, result) if not exclusions.rejects(hit, row.name)]
            _add_accelerations(result, i, hit, _cut_ringing(session, good), exclusions)
            result.without_force += i in result.accelerations
    return result


def _on_plate(rows: Sequence[RecordedChannel], result: HitSeries) -> list[RecordedChannel]:
    """Accelerometers that do not ride on the impactor; those that do are noted in `result`."""
    accelerations = [row for row in rows if row.quantity == "acceleration"]
    riding = {row.name for row in accelerations if (row.position or "").lower() in IMPACTOR_POSITIONS}
    result.of_impactor |= riding
    return [row for row in accelerations if row.name not in riding]


def _add_accelerations(
    result: HitSeries, place: int, hit: Hit, cuts: Mapping[str, Series], exclusions: QualityExclusions
) -> list[str]:
    """Adds those that no quality check rejects; gives the names of the others."""
    recorded = {name: cut for name, cut in cuts.items() if cut.values.size}
    rejected = [
        n for n, cut in recorded.items() if exclusions.rejects(hit, n) or exclusions.cut_top(hit, n, cut.values)
    ]
    if len(rejected) < len(recorded):
        result.accelerations[place] = {name: cut for name, cut in recorded.items() if name not in rejected}
    return rejected


def clear_times(hits: Sequence[Hit]) -> dict[int, float]:
    """For each hit with a pulse, by its place in `hits`, for how long after its contact begins nothing else hits, s.

    One recording may hold several hits; infinite after the last one.
    """
    by_recording: dict[int | None, list[int]] = {}
    for i, hit in enumerate(hits):
        if hit.has_pulse:
            by_recording.setdefault(hit.recording_id, []).append(i)
    clear_s = {}
    for places in by_recording.values():
        starts = sorted((hits[i].start_s or 0.0, i) for i in places)
        for (start, i), (following, _) in zip(starts, [*starts[1:], (math.inf, -1)], strict=True):
            clear_s[i] = following - start - _CLEAR_S
    return clear_s


def _channels(session: Session, recordings: Sequence[int]) -> dict[int, list[RecordedChannel]]:
    """Rows of channels by recording, by name within it."""
    channels: dict[int, list[RecordedChannel]] = {}
    query = select(RecordedChannel).order_by(RecordedChannel.recording_id, RecordedChannel.name)
    for i in range(0, len(recordings), 500):  # SQLite allows a limited number of variables
        for row in session.scalars(query.where(RecordedChannel.recording_id.in_(recordings[i : i + 500]))):
            channels.setdefault(row.recording_id, []).append(row)
    return channels


def _contact_force(session: Session, cells: Sequence[RecordedChannel], hit: Hit, clear_s: float) -> Series:
    """As recorded; the cells of an array are summed."""
    duration, rest = hit.contact_time_s or 0.0, _REST_SAMPLES / cells[0].sampling_rate_hz
    before, after = max(_FORCE_BEFORE * duration, rest), min(_FORCE_AFTER * duration, clear_s)
    cuts = [_cut(session, row, hit.start_s or 0.0, before, after) for row in cells]
    return replace(cuts[0], values=np.sum([cut.values for cut in cuts], axis=0))


def _pulls(force: Series) -> bool:
    """Whether it shows compression as negative."""
    x = force.values
    return bool(x.size) and float(x.max()) - force.rest < force.rest - float(x.min())


def _cut_ringing(session: Session, rows: Iterable[RecordedChannel]) -> dict[str, Series]:
    """By channel the loudest ringing of a recording without a force; 0 s is where the first channel rises to it.

    Channels without a finite sample, and silent ones, are left out.
    """
    records = [(row, np.asarray(read_channel(session, row).si, dtype=np.float64)) for row in rows]
    audible = [(row, x) for row, x in records if np.isfinite(x).any() and np.nanmax(x) > np.nanmin(x)]
    begins = [row.start_s + _begin_of_loudest(x, row.sampling_rate_hz) / row.sampling_rate_hz for row, x in audible]
    cuts = {}
    for row, values in audible:
        rate = row.sampling_rate_hz
        contact = (min(begins) - row.start_s) * rate
        first = max(0, math.ceil(contact - max(_REST_S * rate, _REST_SAMPLES)))
        stop = min(values.size, math.floor(contact + _RINGING_S * rate) + 1)
        cuts[row.name] = Series(values[first:stop], rate, (first - contact) / rate)
    return cuts


def _begin_of_loudest(values: Floats, rate_hz: float) -> int:
    """The sample from which a record (n,) stays within `_RISE_S` above a share of its largest deviation from rest."""
    away = np.abs(np.nan_to_num(values - np.nanmedian(values)))
    top = int(np.argmax(away))
    first = max(0, top - round(_RISE_S * rate_hz))
    return first + int(np.argmax(away[first : top + 1] > _RISE * away[top]))


def _cut(session: Session, row: RecordedChannel, start_s: float, before_s: float, after_s: float) -> Series:
    """Samples from `before_s` before to `after_s` after `start_s`, which is on the recording's clock."""
    rate = row.sampling_rate_hz
    contact = (start_s - row.start_s) * rate
    first = max(0, math.ceil(contact - before_s * rate - _SAME_SAMPLE))
    stop = min(row.samples, max(first, math.floor(contact + after_s * rate + _SAME_SAMPLE) + 1))
    values = np.asarray(read_channel(session, row, first, stop).si, dtype=np.float64)
    # Where both clocks share their samples, rounding alone must not shift the series.
    exact = round(contact) if abs(contact - round(contact)) < _SAME_SAMPLE else contact
    return Series(values, rate, (first - exact) / rate)
