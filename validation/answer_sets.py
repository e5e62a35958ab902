"""Which of the answers are right: pure functions of rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from ..diagnosis.verdict import NONE, UNKNOWN
from .case_results import CaseResult, Said
from .reliability import label_set
from .wilson import Rate

Rows = Sequence[CaseResult]


def singles(rows: Rows) -> list[CaseResult]:
    """One effect of the catalogue, with a gap beyond tolerance."""
    return [row for row in rows if len(row.label.effects) == 1 and not row.label.within_tolerance]


def pairs(rows: Rows) -> list[CaseResult]:
    return [row for row in rows if len(row.label.effects) == 2]


def nulls(rows: Rows) -> list[CaseResult]:
    """No effect at all: background, and nominal figures that are a little wrong."""
    return [row for row in rows if row.label.key == NONE]


def strangers(rows: Rows) -> list[CaseResult]:
    """An effect outside the catalogue, with a gap beyond tolerance."""
    return [row for row in rows if row.label.family and not row.label.within_tolerance]


def first_label(row: CaseResult) -> bool:
    """Whether the likeliest member of the first entry is right."""
    return row.said.labels[:1] != () and row.said.labels[0] in row.label.accepted


def first_entry(row: CaseResult) -> bool:
    """Whether the first entry, be it a group, holds what is right."""
    return bool(row.said.entries) and bool(row.label.accepted & set(row.said.entries[0].labels))


def first_two(row: CaseResult) -> bool:
    """Whether one of the first two labels as they are read is right."""
    return bool(row.label.accepted & set(row.said.labels[:2]))


def first_two_entries(row: CaseResult) -> bool:
    """Whether one of the first two entries holds what is right."""
    return any(row.label.accepted & set(entry.labels) for entry in row.said.entries[:2])


def in_set(row: CaseResult) -> bool:
    """Whether the smallest set of labels with 90 % of the probability holds what is right."""
    return bool(row.label.accepted & set(label_set(row.said.probabilities)))


def at_least_one(row: CaseResult) -> bool:
    """Of two effects, whether the first label names one."""
    return bool(set(row.label.effects) & set(_named(row.said)))


def accused(row: CaseResult) -> bool:
    """Whether the first answer is another than "none"; no answer is as bad."""
    return _first(row.said) != NONE


def called_unknown(row: CaseResult) -> bool:
    return _first(row.said) == UNKNOWN


def rate(rows: Rows, right: Callable[[CaseResult], bool]) -> Rate:
    return Rate.of(right(row) for row in rows)


def _first(said: Said) -> str:
    return said.labels[0] if said.labels else ""


def _named(said: Said) -> list[str]:
    return _first(said).split("+")
