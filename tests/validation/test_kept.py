"""Scored rows in a file: nothing is lost, nothing counts twice, and what is no such file is named."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.validation.case_results import CaseAnswer, CaseResult, WithheldTruth
from pyroshock.validation.report import SCORED, pooled, read_rows, write_rows
from pyroshock.validation.tally import tables
from support.records.blind_rows import DRAG, LAYER, LEAK, label, says, stranger, verdict

ROWS = [
    says(label(LEAK, stages=("gun",)), {LEAK: 0.7, DRAG: 0.2, "none": 0.1}),
    says(stranger(case="d"), {"unknown": 0.6, LEAK: 0.4}),
    CaseResult(label(LAYER, case="e", inside=(1, 3)), CaseAnswer("e", error="the process died")),
    CaseResult(
        label(LEAK, DRAG, case="f", tier="two"),
        CaseAnswer.of("f", verdict(([LEAK, f"{LEAK}+{DRAG}"], 0.9, [0.3, 0.6]), (["none"], 0.1, None)), [[0, 2]]),
        {"fraction": 0.9},
    ),
]


def asked(seed: int) -> dict[str, object]:
    return {"cases": 2, "seed": seed, "tiers": ["strong"], "split": "sealed"}


def test_rows_come_back_as_they_were(tmp_path: Path) -> None:
    write_rows(tmp_path / SCORED, asked(7), ROWS)
    about, rows = read_rows(tmp_path / SCORED)
    assert about == asked(7)
    for old, new in zip(ROWS, rows, strict=True):
        assert new.label == old.label and new.oracle == old.oracle
        assert replace(new.said, seconds=0.0) == replace(old.said, seconds=0.0)
        assert new.said.probabilities == old.said.probabilities


@given(
    st.text(max_size=8),
    st.lists(st.sampled_from([LEAK, DRAG, LAYER]), max_size=3, unique=True),
    st.floats(0, 50),
    st.none() | st.lists(st.integers(0, 30), max_size=4).map(tuple),
    st.dictionaries(st.sampled_from(["none", "unknown", LEAK, f"{DRAG}+{LEAK}"]), st.floats(0, 1), min_size=1),
)
def test_any_row_comes_back(
    case: str, effects: list[str], size: float, inside: tuple[int, ...] | None, said: dict[str, float]
) -> None:
    import tempfile

    truth = WithheldTruth(case, "weak", "chain", tuple(effects), "", size, size / 2, ("gun", "plate"), inside, True)
    row = CaseResult(truth, CaseAnswer.from_probabilities(case, said, 1.5))
    with tempfile.TemporaryDirectory() as folder:
        write_rows(Path(folder) / SCORED, asked(0), [row])
        assert read_rows(Path(folder) / SCORED)[1] == [row]


def test_pool_has_the_figures_of_all_rows(tmp_path: Path) -> None:
    for seed, rows in ((1, ROWS[:2]), (2, ROWS[2:])):
        write_rows(tmp_path / f"{seed}.jsonl", asked(seed), rows)
    checks, rows = pooled([tmp_path / "1.jsonl", tmp_path / "2.jsonl"])
    assert [check["seed"] for check in checks] == [1, 2]
    assert [each.as_json() for each in tables(rows)] == [each.as_json() for each in tables(ROWS)]
    assert tables(rows)[-1].n == 4


def test_no_campaign_counts_twice(tmp_path: Path) -> None:
    for name in ("a.jsonl", "b.jsonl"):
        write_rows(tmp_path / name, asked(7), ROWS[:1])
    with pytest.raises(ValueError, match=r"b\.jsonl: c of seed 7 is in .*a\.jsonl as well; pool it once"):
        pooled([tmp_path / "a.jsonl", tmp_path / "b.jsonl"])
    write_rows(tmp_path / "b.jsonl", asked(8), ROWS[:1])
    assert len(pooled([tmp_path / "a.jsonl", tmp_path / "b.jsonl"])[1]) == 2


def test_check_that_is_not_finished_is_named(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"no scored\.jsonl there; finish this check"):
        read_rows(tmp_path / SCORED)


@pytest.mark.parametrize("text", ["", "{", '{"seed": 1}\n{"label": {}}\n', '{"seed": 1}\n[1]\n'])
def test_other_files_are_refused_by_name(tmp_path: Path, text: str) -> None:
    file = tmp_path / "other.jsonl"
    file.write_text(text)
    with pytest.raises(ValueError, match=r"other\.jsonl: not the scored rows of a blind check"):
        read_rows(file)
