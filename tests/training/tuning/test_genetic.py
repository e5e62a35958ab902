"""The genetic search: it finds known minima, repeats nothing, survives being killed; and its
folds."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from pyroshock.training.tuning.folds import grouped_folds
from pyroshock.training.tuning.genetic import (
    Genes,
    GeneticResult,
    Search,
    SearchJournal,
    run_search,
)

LEVELS = (3, 24, 21)
SEARCH = Search(LEVELS, population=10, generations=6)
BOTTOM = (1, 17, 5)


def bowl(genes: Genes) -> float:
    """Least at `BOTTOM`, with ripples beside it."""
    away = np.array([(g - b) / n for g, b, n in zip(genes, BOTTOM, LEVELS, strict=True)])
    return float(away @ away + 0.01 * np.sin(40 * away).sum() ** 2)


def without_file() -> SearchJournal:
    return SearchJournal(None, {})


def test_finds_the_bottom_and_never_worsens() -> None:
    result = run_search(Search(LEVELS, 50, 30), bowl, 4, without_file())
    assert result.value < bowl((1, 16, 5))  # a neighbour's
    assert bowl(result.genes) == result.value
    best = run_search(SEARCH, bowl, 2, without_file()).best
    assert len(best) == SEARCH.generations + 1
    assert list(best) == sorted(best, reverse=True)
    assert (
        run_search(SEARCH, bowl, 1, without_file()).best
        != run_search(SEARCH, bowl, 2, without_file()).best
    )
    seen: list[Genes] = []
    run_search(SEARCH, lambda genes: seen.append(genes) or 0.0, 3, without_file())
    assert np.all((np.array(seen) >= 0) & (np.array(seen) < LEVELS))
    steps: list[tuple[int, int, str]] = []
    run_search(
        *(SEARCH, bowl, 1, without_file()),
        progress=lambda *step: steps.append(step),
        show=lambda genes: f"<{genes[0]}>",
    )
    assert [step[:2] for step in steps] == [(done, 7) for done in range(1, 8)]
    assert steps[-1][2].startswith("generation 6 of 6: ")
    assert "<1>" in steps[-1][2]


def test_beats_chance() -> None:
    """With as many evaluations as it used itself, over ten seeds."""
    ours, theirs = [], []
    for seed in range(10):
        result = run_search(SEARCH, bowl, seed, without_file())
        rng = np.random.default_rng(seed)
        drawn = [tuple(map(int, rng.integers(LEVELS))) for _ in range(result.evaluated)]
        ours.append(result.value)
        theirs.append(min(map(bowl, drawn)))
    assert np.median(ours) < 0.5 * np.median(theirs)


def test_evaluates_nothing_twice() -> None:
    asked: list[Genes] = []

    def counted(genes: Genes) -> float:
        asked.append(genes)
        return bowl(genes)

    result = run_search(Search((2, 3, 2), population=8, generations=10), counted, 1, without_file())
    assert len(asked) == len(set(asked)) == result.evaluated <= 12
    assert result.asked > result.evaluated


def test_workers_work_at_once_and_find_the_same() -> None:
    # Also where the first to be asked is the last to answer.

    def slow(genes: Genes) -> float:
        time.sleep(0.002 * (hash(genes) % 3))
        return bowl(genes)

    assert run_search(Search(LEVELS, 10, 6, workers=3), slow, 5, without_file()) == run_search(
        SEARCH, bowl, 5, without_file()
    )
    meet = threading.Barrier(2, timeout=10)

    def together(genes: Genes) -> float:
        meet.wait()
        return float(sum(genes))

    run_search(
        Search((4,), population=4, generations=0, elite=1, workers=2), together, 0, without_file()
    )
    assert not meet.broken


def test_failing_evaluation_reaches_the_caller(tmp_path: Path) -> None:
    """What was found before it stays in the journal."""

    def fails(genes: Genes) -> float:
        if genes[0] == 2:
            raise ArithmeticError("diverged")
        return bowl(genes)

    with pytest.raises(ArithmeticError, match="diverged"):
        run_search(SEARCH, fails, 1, SearchJournal(tmp_path / "journal", {}))
    assert all(genes[0] != 2 for genes in SearchJournal(tmp_path / "journal", {}).values)


@pytest.mark.parametrize(
    "wrong", [{"population": 1}, {"elite": 0}, {"generations": -1}, {"workers": 0}]
)
def test_impossible_search_is_refused(wrong: dict[str, int]) -> None:
    with pytest.raises(ValueError, match="not a search"):
        Search(LEVELS, **{"elite": 1, **wrong})


# Under a shell that started it in the background SIGINT would be ignored.
SCRIPT = """
import signal, sys, time
from pathlib import Path
from test_genetic import SEARCH, bowl
from pyroshock.training.tuning.genetic import SearchJournal, run_search

signal.signal(signal.SIGINT, signal.default_int_handler)

def slow(genes):
    time.sleep(0.03)
    return bowl(genes)

run_search(SEARCH, slow, 7, SearchJournal(Path(sys.argv[1]), {"of": "a test"}))
"""


@pytest.mark.parametrize("kill", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_killed_search_resumes_to_the_same_result(tmp_path: Path, kill: signal.Signals) -> None:
    path = tmp_path / "journal"
    run = subprocess.Popen(
        [sys.executable, "-c", SCRIPT, str(path)],
        env={**os.environ, "PYTHONPATH": str(Path(__file__).parent)},
        stderr=subprocess.DEVNULL,
    )
    until = time.monotonic() + 30
    while time.monotonic() < until and run.poll() is None:
        if path.exists() and path.read_bytes().count(b"\n") > 12:
            break
        time.sleep(0.002)
    run.send_signal(kill)
    assert run.wait(timeout=30) != 0
    before = SearchJournal(path, {"of": "a test"}).values
    assert 0 < len(before) < run_search(SEARCH, bowl, 7, without_file()).evaluated

    fresh: list[Genes] = []
    result = run_search(
        SEARCH,
        lambda genes: fresh.append(genes) or bowl(genes),
        7,
        SearchJournal(path, {"of": "a test"}),
    )
    assert result == run_search(SEARCH, bowl, 7, without_file())
    assert not set(fresh) & set(before)


def cut(path: Path, length: int) -> GeneticResult:
    """The search after its journal was cut to some bytes, as by a power failure."""
    path.write_bytes(path.read_bytes()[:length])
    return run_search(SEARCH, bowl, 7, SearchJournal(path, {}))


def test_torn_at_any_byte_resumes_to_the_same_result(tmp_path: Path) -> None:
    path = tmp_path / "journal"
    whole = run_search(SEARCH, bowl, 7, SearchJournal(path, {}))
    content = path.read_bytes()
    for length in range(0, len(content), 211):
        path.write_bytes(content)
        assert cut(path, length) == whole
        assert path.read_bytes().splitlines()[0] == content.splitlines()[0]


def test_journal_keeps_values_exactly(tmp_path: Path) -> None:
    values = {(1, 2): 0.1 + 0.2, (3, 4): 1e-300, (5, 6): 1 / 3}
    journal = SearchJournal(tmp_path / "deep" / "journal", {"seed": 2**62})
    for key, value in values.items():
        journal.add(key, value, 0.25)
    assert SearchJournal(tmp_path / "deep" / "journal", {"seed": 2**62}).values == values
    SearchJournal(tmp_path / "journal", {"seed": 1})
    with pytest.raises(ValueError, match="another search"):
        SearchJournal(tmp_path / "journal", {"seed": 2})
    SearchJournal(tmp_path / "journal", {"seed": 1}).add((1, 2, 3), 0.5, 0.125)
    assert [json.loads(line) for line in (tmp_path / "journal").read_text().splitlines()] == [
        {"search": {"seed": 1}},
        {"key": [1, 2, 3], "value": 0.5, "duration_s": 0.125},
    ]
    with (tmp_path / "journal").open("a") as file:
        file.write('{"key": [4, 5, 6], "value": 0.7}\n')
    resumed = SearchJournal(tmp_path / "journal", {"seed": 1})
    assert resumed.values == {(1, 2, 3): 0.5, (4, 5, 6): 0.7}
    assert resumed.durations_s == {(1, 2, 3): 0.125}  # a line of older software has no duration


def test_journal_times_each_candidate() -> None:
    journal = without_file()
    run_search(
        Search((4,), population=4, generations=0, elite=1),
        lambda _: time.sleep(0.01) or 0.0,
        0,
        journal,
    )
    assert all(0.01 <= seconds < 5 for seconds in journal.durations_s.values())
    assert journal.durations_s.keys() == journal.values.keys()


@pytest.mark.parametrize("content", ["no json\n", "[1, 2]\n", '{"search": {}}\n{"key": [1]}\n'])
def test_stranger_is_no_journal(tmp_path: Path, content: str) -> None:
    (tmp_path / "journal").write_text(content)
    with pytest.raises(ValueError, match="no journal"):
        SearchJournal(tmp_path / "journal", {})


GROUPS = np.repeat([f"c{i}" for i in range(23)], 4)


def test_folds_part_no_configuration_and_are_alike() -> None:
    folds = grouped_folds(GROUPS, 5, np.random.default_rng(0))
    assert np.array_equal(np.sum(folds, axis=0), np.ones(len(GROUPS)))
    for fold in grouped_folds(GROUPS, 5, np.random.default_rng(0)):
        assert not set(GROUPS[fold]) & set(GROUPS[~fold])
    sizes = [int(fold.sum()) // 4 for fold in grouped_folds(GROUPS, 5, np.random.default_rng(0))]
    assert sorted(sizes) == [4, 4, 5, 5, 5]
    assert len(grouped_folds(GROUPS[:12], 5, np.random.default_rng(0))) == 3


@pytest.mark.parametrize(("groups", "folds"), [(GROUPS[:4], 5), (GROUPS, 1)])
def test_nothing_to_leave_out_is_refused(groups: np.ndarray, folds: int) -> None:
    with pytest.raises(ValueError, match="folds"):
        grouped_folds(groups, folds, np.random.default_rng(0))
