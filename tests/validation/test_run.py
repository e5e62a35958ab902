"""A whole check, with a diagnosis put in the place of the real one, and which cases it draws."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from pyroshock.parallel.executor import ExecutorConfig
from pyroshock.validation import blind_check, case_plan, run_case
from pyroshock.validation.case_plan import BENCHES, SEEDS, SPLITS, case_of_task, tasks
from pyroshock.validation.cases import record
from pyroshock.virtualbench.recorder import SealError
from support.records.blind_rows import LEAK, verdict

CASES = 3


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Guns only, one process, and a diagnosis that says the same of every folder; what happened, in
    order."""
    events: list[str] = []

    def here(
        _: ExecutorConfig, function: Callable[[Any], Any], items: Sequence[Any], **__: object
    ) -> Iterator[tuple[Any, Any]]:
        return ((item, function(item)) for item in items)

    def diagnosed(folder: Path, options: object) -> dict[str, Any]:
        events.append(f"diagnosed {sorted(path.name for path in folder.iterdir())}")
        assert [path.name for path in folder.parent.iterdir()] == ["campaign"]
        return {
            "verdict": verdict(([LEAK], 0.6, None), (["none"], 0.4, None)),
            "fitted": [],
            "seconds": 1.0,
        }

    opened = record.open_labels

    def open_labels(*given: Any) -> Any:
        events.append("labels opened")
        return opened(*given)

    monkeypatch.setattr(blind_check, "run_all_tasks", here)
    monkeypatch.setattr(blind_check, "open_labels", open_labels)
    monkeypatch.setattr(run_case, "diagnosed", diagnosed)
    monkeypatch.setattr(case_plan, "KINDS", ("gun",))
    case_plan.case_of_task.cache_clear()
    return events


def check(**other: Any) -> Any:
    given: dict[str, Any] = {
        "tiers": ["middle"],
        "baselines": False,
        "oracle": False,
        "seed": 3,
        "cases": CASES,
    }
    return blind_check.run(**{**given, **other})


def test_labels_are_opened_after_the_last_answer(told: list[str]) -> None:
    report = check()
    assert told == ["diagnosed ['campaign.toml', 'runs.csv']"] * CASES + ["labels opened"]
    assert len(set(report.published)) == CASES
    assert report.tiers[-1].n == CASES
    first = [case_plan.case_of_task(task) for task in case_plan.tasks(2, 5, ["middle"])]
    case_plan.case_of_task.cache_clear()
    assert [
        case_plan.case_of_task(task) for task in case_plan.tasks(2, 5, ["middle"])[::-1]
    ] == first[::-1]
    assert first[0] != first[1]


def test_hashes_are_kept_before_any_answer(
    told: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[int] = []

    def looked(folder: Path, options: object) -> dict[str, Any]:
        seen.append(len((tmp_path / "published.txt").read_text(encoding="utf-8").split()))
        raise RuntimeError("no answer today")

    monkeypatch.setattr(run_case, "diagnosed", looked)
    check(folder=tmp_path)
    assert seen == [CASES] * CASES


def test_folder_of_another_check_or_with_changed_labels_is_refused(
    told: list[str], tmp_path: Path
) -> None:
    check(folder=tmp_path)
    text = (tmp_path / "labels.sealed").read_text(encoding="utf-8")
    assert not any(word in text for word in ("gun", "none", "cause", "strengths"))
    with pytest.raises(ValueError, match="other settings"):
        check(folder=tmp_path, seed=4)
    sealed = json.loads(text)
    sealed["sealed"] = ("00" if sealed["sealed"][:2] != "00" else "01") + sealed["sealed"][2:]
    (tmp_path / "labels.sealed").write_text(json.dumps(sealed), encoding="utf-8")
    with pytest.raises(SealError, match="changed"):
        check(folder=tmp_path)


def test_crash_is_counted_as_wrong_and_listed(
    told: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(folder: Path, options: object) -> dict[str, Any]:
        raise ZeroDivisionError("it broke")

    monkeypatch.setattr(run_case, "diagnosed", broken)
    found = check().tiers[-1]
    assert found.errors == tuple(
        f"middle-{i:04d}: ZeroDivisionError: it broke" for i in range(CASES)
    )
    assert found.covered.hits == found.first.hits == 0


def test_stopped_check_goes_on(told: list[str], tmp_path: Path) -> None:
    whole = check(folder=tmp_path).as_json()
    answers = (tmp_path / "answers.jsonl").read_text(encoding="utf-8").splitlines(keepends=True)
    (tmp_path / "answers.jsonl").write_text(answers[0], encoding="utf-8")
    told.clear()
    assert check(folder=tmp_path).as_json() == whole
    assert len(told) == CASES  # two answers and the opening


def test_effect_left_out_is_not_in_the_catalogue(
    told: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[tuple[str, ...] | None] = []

    def diagnosed(folder: Path, options: Any) -> dict[str, Any]:
        asked.append(options.catalogue)
        causes = verdict((["unknown"] if options.catalogue else [effect], 1.0, None))
        return {"verdict": causes, "fitted": [], "seconds": 1.0}

    monkeypatch.setattr(run_case, "diagnosed", diagnosed)
    (task,) = case_plan.tasks(1, 3, [case_plan.LEFT_OUT])
    (effect,) = case_plan.case_of_task(task)[0].strengths
    report = check(tiers=[case_plan.LEFT_OUT], cases=1)
    assert effect not in asked[0]
    assert asked[1] is None
    assert (report.left_out.unknown.hits, report.left_out.found.hits, report.tiers) == (1, 1, ())


@pytest.mark.parametrize(
    ("wrong", "said"),
    [({"tiers": ["huge"]}, "tier 'huge': expected one of"), ({"cases": 0}, "at least 1")],
)
def test_wrong_words_are_refused(wrong: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        check(**wrong)


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_quick_tier() -> None:
    """The real diagnosis on a few campaigns of all kinds: every case answered, and better than by
    the first stage."""
    report = blind_check.run(4, 11, ["very strong", case_plan.LEFT_OUT], learn_from=8)
    found = report.tiers[-1]
    assert (found.n, found.errors) == (4, ())
    assert report.left_out.n == 4
    assert set(report.baselines) == {
        "noise-only evidence",
        "BIC",
        "largest residual",
        "random forest",
    }
    assert found.reliability.nll < report.baselines["largest residual"][-1].reliability.nll
    json.dumps(report.as_json(), allow_nan=False)


def test_cases_of_a_plan_keep_their_kinds_seeds_and_draws() -> None:
    assert [task.kind for task in tasks(6, 1, ["realistic"])] == [
        "gun",
        "hammer",
        "plate",
        "chain",
        "gun",
        "hammer",
    ]
    alone = tasks(2, 1, ["realistic"], kinds=["hammer"])
    among = [task for task in tasks(8, 1, ["realistic"]) if task.kind == "hammer"]
    assert alone == among
    assert set(SEEDS) == set(SPLITS)
    assert len(set(SEEDS.values())) == len(SPLITS)
    seeds = {task.seed for split in SPLITS for task in tasks(4, 1, list(BENCHES), split)}
    assert len(seeds) == 4 * len(SPLITS) * sum(not tier.seeds_of for tier in BENCHES.values())
    task = tasks(1, 1, ["realistic"], kinds=["hammer"])[0]
    case, seed = case_of_task(task)
    case_of_task.cache_clear()
    assert case_of_task(task) == (case, seed)
    assert len(case.strengths) > 1


@pytest.mark.parametrize(
    ("tiers", "kinds", "named"), [(["loud"], [], "tier"), (["realistic"], ["rifle"], "kind")]
)
def test_unknown_words_are_refused_by_name(tiers: list[str], kinds: list[str], named: str) -> None:
    with pytest.raises(ValueError, match=named):
        tasks(1, 1, tiers, kinds=kinds)
