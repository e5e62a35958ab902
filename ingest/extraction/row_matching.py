"""Which hit of a recording is which row of `runs.csv`.

One row for a recording that holds several hits: they are its repetitions, counted on from the
row's. As many rows as hits: in time order. More hits than rows: the largest ones are the rows' (the
thesis's "ten main peaks"), unless the one row may count on; the others are told, each with its time
and its peak. Fewer hits than rows: nobody can say which row lacks its hit, so the recording is set
aside.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from ..folder.runs_table import RunRow
from ..readers import RecordingError


@dataclass(frozen=True)
class MatchedImpact:
    """A row's impact: its repetition number, and the index of its pulse (None: no contact was
    found)."""

    row: RunRow
    repetition: int
    pulse: int | None


def expected_hits(rows: list[RunRow], all_rows: Collection[RunRow]) -> int | None:
    """How many main peaks to keep; None where the one row takes whatever was hit."""
    return None if _counts_on(rows, all_rows) else len(rows)


def match(
    path: str, rows: list[RunRow], hits: int, all_rows: Collection[RunRow]
) -> list[MatchedImpact]:
    """Assign `hits` contacts in time order to a recording's rows. Raises `RecordingError` when it
    cannot be done."""
    if hits == 0:
        return [MatchedImpact(row, row.repetition, None) for row in rows]
    if hits == len(rows):
        return [MatchedImpact(row, row.repetition, i) for i, row in enumerate(rows)]
    if _counts_on(rows, all_rows):
        return [MatchedImpact(rows[0], rows[0].repetition + i, i) for i in range(hits)]
    raise RecordingError(
        f"{path}: {hits} impacts found for {len(rows)} rows of runs.csv; expected one for each"
    )


def _counts_on(rows: list[RunRow], all_rows: Collection[RunRow]) -> bool:
    """Whether a recording's only row may stand for several repetitions: it is the run's only row,
    and reports no velocity (which would be that of one hit)."""
    if (
        len(rows) != 1
        or rows[0].impact_velocity_m_s is not None
        or rows[0].measured_velocity_m_s is not None
    ):
        return False
    return sum(row.run == rows[0].run for row in all_rows) == 1
