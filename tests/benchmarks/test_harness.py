"""Turns, figures with their promises, and programs that answer line by line."""

from __future__ import annotations

import sys
from dataclasses import replace
from functools import partial

import pytest

from benchmarks.harness import (
    Figure,
    Program,
    ProgramError,
    Spread,
    beside,
    compared,
    interpreter_with,
    missing,
    processor_seconds,
    promised,
    ratio,
    run_python,
    table,
    table_row,
    take_turns,
)

FASTER = Figure("series", "reading", "1 ms", "4 ms", Spread(0.25, 0.2, 0.5), 1 / 3)
SLOWER = Figure("plans", "time", "3 s", "2 s", Spread(1.5, 1.25, 1.75))
ANSWERS = (
    "from benchmarks.harness import answer_requests;"
    "answer_requests(lambda asked: print('noise') or {'seconds': asked['x'] / 2})"
)


def test_ratio_is_turn_by_turn():
    assert ratio([1.0, 4.0, 9.0], [2.0, 2.0, 3.0]) == Spread(2.0, 0.5, 3.0)
    assert [ratio([a], [b]).median for a, b in ((0, 0), (0, 3), (3, 2), (1, 0))] == [
        1.0,
        0.0,
        1.5,
        float("inf"),
    ]


def test_functions_take_turns_after_a_round_that_does_not_count():
    calls: list[str] = []
    seconds = take_turns({name: partial(calls.append, name) for name in "ab"}, 2)
    assert calls == ["a", "b"] * 3
    assert {name: len(times) for name, times in seconds.items()} == {"a": 2, "b": 2}


def test_a_function_may_report_its_own_seconds():
    functions = {"own": lambda: 7.0, "busy": lambda: sum(range(1000))}
    seconds = take_turns(functions, 2, processor_seconds, reported=["own"], warm=False)
    assert seconds["own"] == [7.0, 7.0] and len(seconds["busy"]) == 2


def test_values_are_shown_in_their_unit_beside_the_peer_and_the_bound():
    figure = compared(
        "t", "n", [0.002, 0.003], [0.001, 0.003], bound="copying", bound_values=[0.001, 0.001]
    )
    assert (figure.ours, figure.peer) == ("2.5 ms (2 to 3)", "2 ms (1 to 3)")
    assert figure.value == Spread(1.5, 1.0, 2.0) and figure.over_bound == Spread(2.5, 2.0, 3.0)
    assert figure.bound == "copying: 1 ms (1 to 1)"


@pytest.mark.parametrize(("value", "holds"), [(0.04, True), (0.06, False)])
def test_a_promise_has_no_peer(value, holds):
    figure = promised("t", "n", [value], 0.05)
    assert figure.peer == "50 ms, promised" and figure.behind == "" and figure.holds is holds


@pytest.mark.parametrize(("limit", "holds"), [(None, True), (1.5, True), (1.4, False)])
def test_promise_is_of_the_median(limit, holds):
    assert replace(SLOWER, limit=limit).holds is holds


def test_promises_and_aims_have_words():
    assert FASTER.promise == "at most 0.333: holds"
    assert replace(FASTER, limit=0.2).promise == "at most 0.2: **lost**"
    assert replace(FASTER, limit=0.2, binding=False).promise == "aim at most 0.2: **missed**"


def test_slower_is_said_in_bold():
    assert SLOWER.ratio == "1.5 (1.25 to 1.75) **slower**"
    assert (
        replace(SLOWER, value=Spread(1.1, 0.9, 1.2)).ratio
        == "1.1 (0.9 to 1.2) **slower**, within the spread"
    )
    assert [replace(SLOWER, kind=kind).behind for kind in ("quality", "growth", "bound")] == [
        "worse",
        "",
        "",
    ]
    assert FASTER.behind == ""


def test_missing_peer_has_a_row_and_breaks_no_promise():
    row = missing("spectra", "endaq", "not installed")
    assert row.row() == "| endaq | — | not installed | — | — | — | — |" and row.holds
    assert not replace(row, limit=1.0).holds


def test_a_peer_stands_beside_ours_or_its_absence_does():
    seconds = {"ours": [0.002], "endaq": [0.004], "bound": [0.001]}
    row = beside("spectra", "lines", seconds, "endaq", bound="copying", limit=1.0)
    assert (row.peer_name, row.value, row.over_bound) == (
        "endaq",
        Spread(0.5, 0.5, 0.5),
        Spread(2.0, 2.0, 2.0),
    )
    absent = beside(
        "spectra", "lines", seconds, "pyyeti", "out of memory", limit=1.0, question="a spectrum"
    )
    assert (absent.ours, absent.peer, absent.question) == (
        "2 ms",
        "out of memory",
        "a spectrum",
    ) and absent.holds


def test_a_table_has_a_rule_below_its_head():
    assert table(("a", "b"), [table_row("1", "2")]) == "| a | b |\n| --- | --- |\n| 1 | 2 |"


@pytest.mark.skipif(
    not sys.platform.startswith("linux"), reason="shares of memory are read where Linux shows them"
)
def test_a_watched_program_tells_its_memory_with_its_children():
    child = "import sys, time; x = bytearray(5 * 10**7); x[::1000] = b'1' * 50_000; time.sleep(3)"
    script = f"import subprocess, sys; subprocess.run([sys.executable, '-c', {child!r}])"
    assert run_python("-c", script, watch_memory=True) > 4e7
    assert run_python("-c", "pass") == 0


def test_a_program_answers_each_request():
    with Program("-c", ANSWERS) as program:
        assert [program.ask(x=x)["seconds"] for x in (1, 2)] == [0.5, 1.0]
        assert program.seconds(x=3) == 1.5


@pytest.mark.parametrize(
    ("script", "reason"),
    [
        ("import nothing_of_that_name", "not installed"),
        ("import time; time.sleep(60)", "killed after"),
    ],
)
def test_a_program_that_does_not_answer_says_why(script, reason):
    with Program("-c", script) as program, pytest.raises(ProgramError, match=reason):
        program.ask(limit_s=0.2 if "sleep" in script else 60, x=1)


def test_a_missing_module_has_no_interpreter():
    assert interpreter_with("nothing_of_that_name") is None
    assert interpreter_with("numpy") is not None
