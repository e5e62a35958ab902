"""Hits that a recording shows and that are not stored as impacts: each is told, with its time and its peak."""

from __future__ import annotations

from ..signals.checks.base import Finding
from .pulses import ExtractedPulse, Hits, Touch

#: From this share of the smallest hit that has a row, a hit without a row may be the row's own: the largest hits are
#: taken to be the rows', and between peaks that differ by less than a factor of two their size says nothing.
DOUBTFUL_SHARE = 0.5
#: Hits that a message names; all of them are in the evidence.
_NAMED = 5


def hits_without_row(hits: Hits, channel: str) -> list[Finding]:
    """One finding for all hits that no row of `runs.csv` stands for: a `warning` where one of them is as large as those
    that have a row, else a `note`. The rows' hits are the largest (the thesis's "ten main peaks")."""
    if not hits.left_out:
        return []
    rows, smallest = len(hits.pulses), min(pulse.peak_force_n for pulse in hits.pulses)
    doubtful = max(touch.peak_force_n for touch in hits.left_out) >= DOUBTFUL_SHARE * smallest
    message = (
        f"{rows + len(hits.left_out)} hits found for {_rows(rows)} of runs.csv; "
        f"{'the largest is' if rows == 1 else 'the largest are'} stored, not stored: {_named(hits.left_out)}"
    )
    evidence = {
        "hits": rows + len(hits.left_out),
        "rows": rows,
        "smallest_stored_peak_n": smallest,
        "left_out": _evidence(hits.left_out),
    }
    return [Finding("hit-without-row", "warning" if doubtful else "note", message, channel, evidence)]


def touches_before(pulse: ExtractedPulse, contact: int, channel: str) -> list[Finding]:
    """A contact before the hit that belongs to the same swing; `signals.checks.double_hit` looks for those after it."""
    if not pulse.earlier_touches:
        return []
    message = f"before this hit of {pulse.peak_force_n:.4g} N the force shows {_named(pulse.earlier_touches)}"
    evidence = {"peak_force_n": pulse.peak_force_n, "earlier": _evidence(pulse.earlier_touches)}
    return [Finding("double-hit", "warning", message, channel, evidence, contact)]


def _rows(number: int) -> str:
    return "1 row" if number == 1 else f"{number} rows"


def _named(touches: tuple[Touch, ...]) -> str:
    named = ", ".join(f"{touch.peak_force_n:.3g} N at {touch.time_s:.4g} s" for touch in touches[:_NAMED])
    return named + (f" and {len(touches) - _NAMED} more" if len(touches) > _NAMED else "")


def _evidence(touches: tuple[Touch, ...]) -> list[dict[str, float]]:
    return [{"time_s": touch.time_s, "peak_force_n": touch.peak_force_n} for touch in touches]
