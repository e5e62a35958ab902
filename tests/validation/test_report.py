"""Tables, their JSON and the journal; scored rows in a file; the table of
docs/measurements/blind-check.md."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pyroshock.validation.blind_check import CaseJournal
from pyroshock.validation.case_plan import BENCHES, GROUPS
from pyroshock.validation.case_results import CaseAnswer, CaseResult, WithheldTruth
from pyroshock.validation.metrics import figures
from pyroshock.validation.report import SCORED, Report, pooled, read_rows, table, write_rows
from pyroshock.validation.tally import tables
from support.records.blind_check_table import FOLDER, cause_lines, lines, sealed_lines
from support.records.blind_rows import DRAG, LAYER, LEAK, label, says, stranger, verdict

TWO_ROWS = [says(label(LEAK), {LEAK: 0.9, DRAG: 0.1}), says(label(), {"none": 0.8, LEAK: 0.2})]


def test_report_has_tiers_baselines_and_errors() -> None:
    crash = CaseResult(label(LEAK), CaseAnswer("x-3", error="it broke"))
    tiers = figures("strong", TWO_ROWS), figures("all", [*TWO_ROWS, crash])
    data = json.loads(json.dumps(Report(3, 1, tiers, {"bic": tiers}).as_json(), allow_nan=False))
    assert [row["tier"] for row in data["tiers"]] == ["strong", "all"]
    assert data["tiers"][0]["first"] == {
        "value": 1.0,
        "low": pytest.approx(0.2065, abs=1e-4),
        "high": 1.0,
        "n": 1,
    }
    assert [(row["name"], len(row["tiers"])) for row in data["baselines"]] == [("bic", 2)]
    text = Report(3, 1, tiers, {}).text()
    assert "no answer: x-3: it broke" in text
    assert f"1 times no answer for {LEAK}" in text
    printed = table(tiers, "tier").splitlines()
    assert len(printed) == 4
    assert "first group" in printed[0]
    assert "one of two" not in printed[0]
    assert len({len(line) for line in printed}) == 1


def test_journal_goes_on_after_a_kill(tmp_path: Path) -> None:
    journal = CaseJournal(tmp_path / "answers.jsonl")
    for name in ("a", "b"):
        journal.add({"case": name})
    with (tmp_path / "answers.jsonl").open("ab") as file:
        file.write(b'{"case": "c", "verd')
    assert list(journal.read()) == ["a", "b"]
    journal.add({"case": "c"})
    assert list(journal.read()) == ["a", "b", "c"]
    CaseJournal(None).add({"case": "a"})
    assert CaseJournal(None).read() == {}


ROWS = [
    says(label(LEAK, stages=("gun",)), {LEAK: 0.7, DRAG: 0.2, "none": 0.1}),
    says(stranger(case="d"), {"unknown": 0.6, LEAK: 0.4}),
    CaseResult(label(LAYER, case="e", inside=(1, 3)), CaseAnswer("e", error="the process died")),
    CaseResult(
        label(LEAK, DRAG, case="f", tier="two"),
        CaseAnswer.of(
            "f",
            verdict(([LEAK, f"{LEAK}+{DRAG}"], 0.9, [0.3, 0.6]), (["none"], 0.1, None)),
            [[0, 2]],
        ),
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
    st.dictionaries(
        st.sampled_from(["none", "unknown", LEAK, f"{DRAG}+{LEAK}"]), st.floats(0, 1), min_size=1
    ),
)
def test_any_row_comes_back(
    tmp_path_factory, case: str, effects: list[str], size: float, inside, said
) -> None:
    truth = WithheldTruth(
        case, "weak", "chain", tuple(effects), "", size, size / 2, ("gun", "plate"), inside, True
    )
    row = CaseResult(truth, CaseAnswer.from_probabilities(case, said, 1.5))
    write_rows(tmp_path_factory.getbasetemp() / SCORED, asked(0), [row])
    assert read_rows(tmp_path_factory.getbasetemp() / SCORED)[1] == [row]


def test_pool_has_the_figures_of_all_rows_once(tmp_path: Path) -> None:
    for seed, rows in ((1, ROWS[:2]), (2, ROWS[2:])):
        write_rows(tmp_path / f"{seed}.jsonl", asked(seed), rows)
    checks, rows = pooled([tmp_path / "1.jsonl", tmp_path / "2.jsonl"])
    assert [check["seed"] for check in checks] == [1, 2]
    assert [tier_table.as_json() for tier_table in tables(rows)] == [
        tier_table.as_json() for tier_table in tables(ROWS)
    ]
    assert tables(rows)[-1].n == 4
    for name in ("a.jsonl", "b.jsonl"):
        write_rows(tmp_path / name, asked(7), ROWS[:1])
    with pytest.raises(
        ValueError, match=r"b\.jsonl: c of seed 7 is in .*a\.jsonl as well; pool it once"
    ):
        pooled([tmp_path / "a.jsonl", tmp_path / "b.jsonl"])
    write_rows(tmp_path / "b.jsonl", asked(8), ROWS[:1])
    assert len(pooled([tmp_path / "a.jsonl", tmp_path / "b.jsonl"])[1]) == 2
    with pytest.raises(ValueError, match=r"no scored\.jsonl there; finish this check"):
        read_rows(tmp_path / SCORED)


@pytest.mark.parametrize("text", ["", "{", '{"seed": 1}\n{"label": {}}\n', '{"seed": 1}\n[1]\n'])
def test_other_files_are_refused_by_name(tmp_path: Path, text: str) -> None:
    file = tmp_path / "other.jsonl"
    file.write_text(text)
    with pytest.raises(ValueError, match=r"other\.jsonl: not the scored rows of a blind check"):
        read_rows(file)


PAGE = FOLDER.parents[1] / "measurements" / "blind-check.md"


def shown_rows(head: str = "| tier, kind | cases |") -> list[str]:
    """Rows below the head that begins so."""
    table = PAGE.read_text(encoding="utf-8").split(head)[1].split("\n\n")[0]
    return table.splitlines()[2:]


def test_shown_rows_are_those_of_the_kept_answers() -> None:
    computed = list(lines())
    assert [row for row in shown_rows() if row not in computed] == []
    names = {row.split("|")[1].strip() for row in shown_rows()}
    assert names >= set(BENCHES) - set(GROUPS["causes"])


def test_shown_rows_of_what_a_reader_acts_on_are_those_of_the_kept_answers() -> None:
    heads = "| tier, kind | campaigns |", "| tier, kind | of |"
    assert tuple(shown_rows(head) for head in heads) == cause_lines()
    heads = "| sealed tier, kind | campaigns |", "| sealed tier, kind | of |"
    assert tuple(shown_rows(head) for head in heads) == sealed_lines()
