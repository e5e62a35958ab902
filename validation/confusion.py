"""What was said of what."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from .case_results import CaseResult

#: An answer that never came.
NO_ANSWER = "no answer"


def confusion(rows: Sequence[CaseResult]) -> dict[str, dict[str, int]]:
    """By truth, how often each label was the first one; both in falling number, then by name."""
    counts: dict[str, Counter[str]] = {}
    for row in rows:
        first = row.said.labels[0] if row.said.labels else NO_ANSWER
        counts.setdefault(row.label.key, Counter())[first] += 1
    return {truth: _falling(counts[truth]) for truth in sorted(counts, key=lambda t: (-sum(counts[t].values()), t))}


def mistaken(rows: Sequence[CaseResult], most: int = 12) -> list[tuple[str, str, int]]:
    """The most frequent errors: truth, what was said for it, how often."""
    wrong = Counter(
        (row.label.key, row.said.labels[0] if row.said.labels else NO_ANSWER)
        for row in rows
        if not row.said.labels or row.said.labels[0] not in row.label.accepted
    )
    falling = sorted(wrong.items(), key=lambda item: (-item[1], item[0]))
    return [(truth, answer, n) for (truth, answer), n in falling[:most]]


def _falling(counts: Counter[str]) -> dict[str, int]:
    return dict(sorted(counts.items(), key=lambda item: (-item[1], item[0])))
