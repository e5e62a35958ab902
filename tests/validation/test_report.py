"""Tables, their JSON, the journal and the picture."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from pyroshock.validation.blind_check import CaseJournal
from pyroshock.validation.case_results import CaseAnswer, CaseResult
from pyroshock.validation.metrics import CaseMetrics, figures
from pyroshock.validation.report import Report, table
from support.records.blind_rows import DRAG, LEAK, label, says

ROWS = [says(label(LEAK), {LEAK: 0.9, DRAG: 0.1}), says(label(), {"none": 0.8, LEAK: 0.2})]


@pytest.fixture
def tables() -> tuple[CaseMetrics, ...]:
    return figures("strong", ROWS), figures(
        "all", [*ROWS, CaseResult(label(LEAK), CaseAnswer("x-3", error="it broke"))]
    )


def test_json_has_tiers_and_baselines(tables: tuple[CaseMetrics, ...]) -> None:
    data = json.loads(json.dumps(Report(3, 1, tables, {"bic": tables}).as_json(), allow_nan=False))
    assert [row["tier"] for row in data["tiers"]] == ["strong", "all"]
    assert data["tiers"][0]["first"] == {"value": 1.0, "low": pytest.approx(0.2065, abs=1e-4), "high": 1.0, "n": 1}
    assert [(each["name"], len(each["tiers"])) for each in data["baselines"]] == [("bic", 2)]


def test_table_leaves_empty_columns_out(tables: tuple[CaseMetrics, ...]) -> None:
    lines = table(tables, "tier").splitlines()
    assert len(lines) == 4
    assert "first group" in lines[0]
    assert "one of two" not in lines[0]
    assert len({len(line) for line in lines}) == 1


def test_crash_is_listed(tables: tuple[CaseMetrics, ...]) -> None:
    text = Report(3, 1, tables, {}).text()
    assert "no answer: x-3: it broke" in text
    assert f"1 times no answer for {LEAK}" in text


def test_journal_goes_on_after_a_kill(tmp_path: Path) -> None:
    journal = CaseJournal(tmp_path / "answers.jsonl")
    for name in ("a", "b"):
        journal.add({"case": name})
    with (tmp_path / "answers.jsonl").open("ab") as file:
        file.write(b'{"case": "c", "verd')
    assert list(journal.read()) == ["a", "b"]
    journal.add({"case": "c"})
    assert list(journal.read()) == ["a", "b", "c"]


def test_journal_without_a_place_keeps_nothing() -> None:
    CaseJournal(None).add({"case": "a"})
    assert CaseJournal(None).read() == {}
