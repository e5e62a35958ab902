"""Programs that are asked line by line, and ways that are timed in turn."""

from __future__ import annotations

import pytest

from benchmarks.apart import Apart, ApartError, in_turn, interpreter_with

ANSWERS = (
    "from benchmarks.apart import answering; answering(lambda asked: print('noise') or {'seconds': asked['x'] / 2})"
)


def test_a_program_answers_each_request():
    with Apart("-c", ANSWERS) as program:
        assert [program.ask(x=x)["seconds"] for x in (1, 2)] == [0.5, 1.0]
        assert program.seconds(x=3) == 1.5


def test_a_program_that_ends_says_why():
    with Apart("-c", "import nothing_of_that_name") as program, pytest.raises(ApartError, match="not installed"):
        program.ask(x=1)


def test_a_program_that_does_not_answer_is_killed():
    with Apart("-c", "import time; time.sleep(60)") as program, pytest.raises(ApartError, match="killed after"):
        program.ask(limit_s=0.2, x=1)


def test_ways_take_turns():
    order = []
    ways = {name: lambda name=name: order.append(name) or len(order) for name in "ab"}
    assert in_turn(ways, 2) == {"a": [1, 3], "b": [2, 4]}
    assert order == ["a", "b", "a", "b"]


def test_a_missing_module_has_no_interpreter():
    assert interpreter_with("nothing_of_that_name") is None
    assert interpreter_with("numpy") is not None
