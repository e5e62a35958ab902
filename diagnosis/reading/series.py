"""Force and accelerations of one hit, cut from its recording on the hit's own clock: 0 s is when contact begins."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from sqlalchemy.orm import Session

from ...ingest.impact_speed import IMPACTOR_POSITIONS
from ...ingest.stored import read_channel
from ...schema.recordings import RecordedChannel
from ..record import Floats, Series
from .impacts import Hit

#: Of the force, in contact times from the start of contact; at least so many samples before tell the noise.
FORCE_BEFORE, FORCE_AFTER, REST_SAMPLES = 0.5, 2.0, 64
#: Of an acceleration: rest before the contact, and ringing after it unless the next hit comes first.
REST_S, RINGING_S = 1e-3, 0.1
#: The next hit's window begins so long before its contact: a start found at a share of the peak is a little late.
_CLEAR_S = 1e-3
#: Ringing begins where a record first exceeds this share of its top, at most so long before it.
_RISE, _RISE_S = 0.1, 10e-3
#: In samples: nearer than this is the same instant.
_SAME_SAMPLE = 1e-4


@dataclass(frozen=True, eq=False)
class Window:
    """What is cut for one hit. `next_s`: when the recording's next contact begins, after this one's; inf for none."""

    hit: Hit
    next_s: float

    @property
    def start_s(self) -> float:
        return self.hit.start_s or 0.0

    @property
    def clear_s(self) -> float:
        """Up to when, after the start of contact, nothing else hits."""
        return self.next_s - _CLEAR_S


def windows(hits: Sequence[Hit]) -> dict[int, Window]:
    """For each hit with a pulse, by its place in `hits`, what may be cut: one recording may hold several."""
    by_recording: dict[int | None, list[int]] = {}
    for i, hit in enumerate(hits):
        if hit.has_pulse:
            by_recording.setdefault(hit.recording_id, []).append(i)
    found = {}
    for mine in by_recording.values():
        mine.sort(key=lambda i: hits[i].start_s or 0.0)
        starts = [*((hits[i].start_s or 0.0) for i in mine), math.inf]
        for place, i in enumerate(mine):
            found[i] = Window(hits[i], starts[place + 1] - starts[place])
    return found


def is_on_plate(row: RecordedChannel) -> bool:
    """Whether it is an accelerometer that does not ride on the impactor."""
    return row.quantity == "acceleration" and (row.position or "").lower() not in IMPACTOR_POSITIONS


def cut_force(session: Session, rows: Sequence[RecordedChannel], window: Window) -> tuple[Series, bool] | None:
    """The contact force, compression positive, and whether it was turned for that. Cells of an array are summed.

    None where the recording has no force.
    """
    cells = [row for row in rows if row.quantity == "force"]
    if not cells:
        return None
    duration, rest = window.hit.contact_time_s or 0.0, REST_SAMPLES / cells[0].sampling_rate_hz
    before, after = max(FORCE_BEFORE * duration, rest), min(FORCE_AFTER * duration, window.clear_s)
    cuts = [_cut(session, row, window.start_s, before, after) for row in cells]
    total = np.sum([cut.values for cut in cuts], axis=0)
    turned = _points_down(total, cuts[0])
    return Series(-total if turned else total, cuts[0].sampling_rate_hz, cuts[0].start_s), turned


def cut_accelerations(session: Session, rows: Sequence[RecordedChannel], window: Window) -> dict[str, Series]:
    """By channel, as recorded."""
    after = min(RINGING_S, window.clear_s)
    cuts = {}
    for row in rows:
        before = max(REST_S, REST_SAMPLES / row.sampling_rate_hz)
        cut = _cut(session, row, window.start_s, before, after)
        if cut.values.size:
            cuts[row.name] = cut
    return cuts


def cut_ringing(session: Session, rows: Sequence[RecordedChannel]) -> dict[str, Series]:
    """By channel the loudest ringing of a recording without a force; 0 s is where the first channel rises to it.

    Channels without a finite sample, and silent ones, are left out.
    """
    whole = {row.name: np.asarray(read_channel(session, row).si, dtype=np.float64) for row in rows}
    heard = {
        name: values
        for name, values in whole.items()
        if np.isfinite(values).any() and np.nanmax(values) > np.nanmin(values)
    }
    begins = [
        row.start_s + _begin_of_loudest(heard[row.name], row.sampling_rate_hz) / row.sampling_rate_hz
        for row in rows
        if row.name in heard
    ]
    cuts = {}
    for row in rows:
        if row.name in heard:
            rate, values = row.sampling_rate_hz, heard[row.name]
            contact = (min(begins) - row.start_s) * rate
            first = max(0, math.ceil(contact - max(REST_S * rate, REST_SAMPLES)))
            stop = min(values.size, math.floor(contact + RINGING_S * rate) + 1)
            cuts[row.name] = Series(values[first:stop], rate, (first - contact) / rate)
    return cuts


def _begin_of_loudest(values: Floats, rate_hz: float) -> int:
    """The sample from which a record (n,) stays within `_RISE_S` above a share of its largest deviation from rest."""
    away = np.abs(np.nan_to_num(values - np.nanmedian(values)))
    top = int(np.argmax(away))
    first = max(0, top - round(_RISE_S * rate_hz))
    return first + int(np.flatnonzero(away[first : top + 1] > _RISE * away[top])[0])


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


def _points_down(force: Floats, cut: Series) -> bool:
    rest = force[cut.time_s < 0]
    base = float(np.median(rest)) if rest.size else 0.0
    return bool(force.size) and float(force.max()) - base < base - float(force.min())
