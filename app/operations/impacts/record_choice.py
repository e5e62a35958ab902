"""What of a record a spectrum is made of: one hit or a part of it, and its zero."""

from __future__ import annotations

import math

from ....array_types import Floats
from ....ingest.extraction.channel_figures import parts_between
from ....signals.record_hits import hits_of
from ....signals.record_rest import AS_RECORDED, BEFORE_SHOCK, RestChoice

#: Word for a record that is taken whole, however many hits it holds.
WHOLE = "whole"
#: Hits that a refusal names.
_NAMED = 8


def parse_rest(text: str | None, name: str) -> RestChoice:
    """None or empty: the rest before the shock; `none`: nothing; `0ms:5ms`: the mean from there to
    there.

    Raises `ValueError` that says `name`, the option or argument.
    """
    if not text:
        return BEFORE_SHOCK
    if text.strip().lower() == "none":
        return AS_RECORDED
    return RestChoice("stretch", *parse_times(text, name, "none or two times"))


def parse_times(text: str, name: str, expected: str = "two times") -> tuple[float, float]:
    """`0ms:5ms` in seconds, rising. Raises `ValueError` that says `name`."""
    from ...common.frames import parse_quantity

    ends = text.split(":")
    if len(ends) != 2:
        raise ValueError(f"{name} is {text!r}; expected {expected}, such as 0ms:5ms")
    begin_s, end_s = (parse_quantity(end.strip(), "s", name) for end in ends)
    if not begin_s < end_s:
        raise ValueError(
            f"{name} is {text!r}; expected {expected} in rising order, such as 0ms:5ms"
        )
    return begin_s, end_s


def chosen_part(
    record: Floats, sampling_rate_hz: float, start_s: float, hit: str | int | None, hit_name: str
) -> tuple[slice, str]:
    """The samples of the hit with a number (from 1), or all for one hit and for `whole`; and what
    was taken.

    A hit begins with the rest before it and ends where the next one's part begins, as an ingest
    divides a recording. Raises `ValueError` for a record of several hits without a choice, and for
    a hit that there is not.
    """
    everything = slice(0, record.size)
    if hit == WHOLE:
        return everything, "the whole record"
    hits = hits_of(record, sampling_rate_hz)
    if hit is None and len(hits) <= 1:
        return everything, "the whole record"
    onsets_s = [start_s + record_hit.first / sampling_rate_hz for record_hit in hits]
    if hit is None:
        times = ", ".join(f"{onset:.4g}" for onset in onsets_s[:_NAMED])
        more = f" and {len(hits) - _NAMED} more" if len(hits) > _NAMED else ""
        raise ValueError(
            f"the record holds {len(hits)} hits, at {times}{more} s; choose one with {hit_name} 1 "
            f"to {len(hits)}, or take the record as one shock with {hit_name} {WHOLE}"
        )
    try:
        number = int(hit)
    except ValueError:
        number = 0
    if not 1 <= number <= len(hits):
        raise ValueError(f"{hit_name} is {hit!r}; expected 1 to {max(1, len(hits))}, or {WHOLE}")
    ((begin_s, end_s),) = parts_between(onsets_s, [number - 1], sampling_rate_hz)
    first = 0 if begin_s == -math.inf else math.ceil((begin_s - start_s) * sampling_rate_hz)
    stop = record.size if end_s == math.inf else math.ceil((end_s - start_s) * sampling_rate_hz)
    return slice(
        max(0, first), stop
    ), f"hit {number} of {len(hits)}, at {onsets_s[number - 1]:.4g} s"
