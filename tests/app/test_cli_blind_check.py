"""`blind-check`: what it asks for and what it prints. The check itself is made up here."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from pyroshock.validation import blind_check as blind
from pyroshock.validation.case_plan import SEEDS
from pyroshock.validation.report import SCORED, write_rows
from support.records.blind_rows import LEAK, label, says
from support.stores.stores import pyroshock


class MadeUp:
    """A report whose figures cannot all be told."""

    def as_json(self) -> dict[str, Any]:
        return {"tiers": [{"tier": "strong", "first": 1.0, "ece": float("nan")}], "baselines": []}

    def text(self) -> str:
        return "| tier | first |"


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []

    def run(cases: int, seed: int, tiers: tuple[str, ...], **options: Any) -> MadeUp:
        found.append({"cases": cases, "seed": seed, "tiers": tiers, **options})
        return MadeUp()

    monkeypatch.setattr(blind, "run", run)
    return found


def test_tables_for_people_and_json_without_nan(asked: list[dict[str, Any]]) -> None:
    result = pyroshock("blind-check", "--cases", "2", "--seed", "1")
    assert (result.exit_code, result.stdout) == (0, "| tier | first |\n")
    found = json.loads(pyroshock("blind-check", "--cases", "2", "--seed", "1", "--json").stdout)
    assert found == {"tiers": [{"tier": "strong", "first": 1.0, "ece": None}], "baselines": []}


def test_options_reach_the_check(asked: list[dict[str, Any]], tmp_path: Path) -> None:
    pyroshock("blind-check", "--cases", "2", "--seed", "1", "--tier", "weak", "--tier", "strong",
    "--jobs", "3",
              "--folder", tmp_path, "--no-baselines")  # fmt: skip
    (one,) = asked
    assert one["tiers"] == ("weak", "strong")
    assert (one["executor"].jobs, one["folder"], one["baselines"]) == (3, tmp_path, False)
    pyroshock(
        "blind-check", "--cases", "2", "--tier", "foreign", "--kind", "gun", "--time-limit", "60"
    )
    assert asked[1]["tiers"] == ("foreign one", "foreign two", "foreign full scale")
    assert (asked[1]["kinds"], asked[1]["patience_s"]) == (("gun",), 60.0)


def test_shrinkage_may_be_left_out(asked: list[dict[str, Any]]) -> None:
    """With the oracle that it is held against, which takes as long."""
    for more in ([], ["--no-shrinkage"]):
        pyroshock("blind-check", "--cases", "2", "--seed", "1", *more)
    assert [(one["options"].shrink, one["oracle"]) for one in asked] == [
        (True, True),
        (False, False),
    ]


def test_what_cannot_be_checked_is_one_line(asked: list[dict[str, Any]], tmp_path: Path) -> None:
    for words, message in (
        (
            ("--cases", "2", "--seed", "1", "--tier", "easy"),
            "--tier is 'easy'; expected one of weak, middle, strong",
        ),
        ((), "cases is missing"),
        (("--pool", tmp_path), "finish this check with blind-check --folder first"),
    ):
        result = pyroshock("blind-check", *words)
        assert result.exit_code == 2 and message in result.stderr
    assert not asked


def test_seed_is_the_splits_own_unless_given(asked: list[dict[str, Any]]) -> None:
    for split in ("development", "sealed"):
        pyroshock("blind-check", "--cases", "2", "--split", split)
    assert [(one["seed"], one["split"]) for one in asked] == [
        (SEEDS[s], s) for s in ("development", "sealed")
    ]


def test_finished_checks_make_one_table(asked: list[dict[str, Any]], tmp_path: Path) -> None:
    for seed in (3, 4):
        (tmp_path / str(seed)).mkdir()
        about = {"cases": 2, "seed": seed, "tiers": ["strong"], "split": "sealed"}
        rows = [says(label(LEAK, case=f"strong-{i}"), {LEAK: 0.9, "none": 0.1}) for i in range(2)]
        write_rows(tmp_path / str(seed) / SCORED, about, rows)
    folders = ["--pool", tmp_path / "3", "--pool", tmp_path / "4" / SCORED]
    text = pyroshock("blind-check", *folders).stdout
    assert text.startswith("2 checks: seeds 3, 4\n") and "| strong | 4 " in text
    found = json.loads(pyroshock("blind-check", *folders, "--json").stdout)
    assert [each["seed"] for each in found["pooled"]] == [3, 4]
    assert (found["tiers"][0]["tier"], found["tiers"][0]["first"]["value"]) == (
        "strong",
        1.0,
    ) and not asked
