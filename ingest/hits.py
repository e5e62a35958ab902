"""Which hit of a recording is which row of `runs.csv`.

One row for a recording that holds several hits: they are its repetitions, counted on from the row's. As many rows as
hits: in time order. More hits than rows: the largest ones are the rows' (the thesis's "ten main peaks"), unless the
one row may count on. Fewer hits than rows: nobody can say which row lacks its hit, so the recording is set aside.

Hits that a recording shows and that are not stored as impacts: each is told, with its time and its peak.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from ..signals.checks.base import Finding
from .pulses import ExtractedPulse, Hits, Touch
from .readers import RecordingError
from .runs import RunRow


@dataclass(frozen=True)
class MatchedImpact:
    """A row's impact: its repetition number, and the index of its pulse (None: no contact was found)."""

    row: RunRow
    repetition: int
    pulse: int | None


def expected_hits(rows: list[RunRow], all_rows: Collection[RunRow]) -> int | None:
    """How many main peaks to keep; None where the one row takes whatever was hit."""
    return None if _counts_on(rows, all_rows) else len(rows)


def match(path: str, rows: list[RunRow], hits: int, all_rows: Collection[RunRow]) -> list[MatchedImpact]:
    """Assign `hits` contacts in time order to a recording's rows. Raises `RecordingError` when it cannot be done."""
    if hits == 0:
        return [MatchedImpact(row, row.repetition, None) for row in rows]
    if hits == len(rows):
        return [MatchedImpact(row, row.repetition, i) for i, row in enumerate(rows)]
    if _counts_on(rows, all_rows):
        return [MatchedImpact(rows[0], rows[0].repetition + i, i) for i in range(hits)]
    raise RecordingError(f"{path}: {hits} impacts found for {len(rows)} rows of runs.csv; expected one for each")


def _counts_on(rows: list[RunRow], all_rows: Collection[RunRow]) -> bool:
    """Whether a recording's only row may stand for several repetitions: it is the run's only row, and reports no
    velocity (which would be that of one hit)."""
    if len(rows) != 1 or rows[0].impact_velocity_m_s is not None or rows[0].measured_velocity_m_s is not None:
        return False
    return sum(row.run == rows[0].run for row in all_rows) == 1


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
