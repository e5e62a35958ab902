"""The verdicts on records whose faults are known hold what is promised of them."""

from __future__ import annotations

from collections import Counter

import pytest

from benchmarks.labelled_records import KINDS, made_records
from benchmarks.quality_scores import judge


@pytest.fixture(scope="module")
def verdicts() -> Counter[tuple[str, str]]:
    """(deserved, given) of 336 made records."""
    return Counter((record.verdict, judge(record)[0]) for record in made_records(seed=5, each=12))


def test_labelled_set_is_large_and_varied(verdicts):
    assert sum(verdicts.values()) >= 300 and sum(map(len, KINDS.values())) == 28


@pytest.mark.parametrize(("verdict", "precision", "recall"), [("reject", 0.98, 0.95), ("warning", 0.8, 0.8)])
def test_verdicts_are_right_and_complete(verdicts, verdict, precision, recall):
    right = verdicts[verdict, verdict]
    given = sum(count for (_, said), count in verdicts.items() if said == verdict)
    deserved = sum(count for (label, _), count in verdicts.items() if label == verdict)
    assert right / given >= precision
    assert right / deserved >= recall
