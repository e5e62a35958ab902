"""When a spectrum is met."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.twin.tune.goal import Goal

LINES = np.array([100.0, 200.0, 400.0, 800.0])


def test_margin_is_the_way_to_the_nearer_edge_which_passes():
    goal = Goal(LINES, np.full(4, 60.0), np.array([3.0, 6.0, 6.0, np.inf]), np.array([6.0, 6.0, 3.0, 6.0]))
    assert goal.margin_db(np.array([62.0, 67.0, 58.0, 90.0])) == pytest.approx([1.0, -1.0, 1.0, 36.0])
    even = Goal.even(LINES, np.ones(4), 6.0)
    assert even.met(np.full(4, 6.0)) and not even.met(np.full(4, 6.0 + 1e-9))


def test_ninety_five_percent_of_41_lines_are_39():
    lines = 100 * 2.0 ** (np.arange(41) / 6)
    goal = Goal.even(lines, np.ones(41), 6.0, share=0.95)
    for out, met in ((2, True), (3, False)):
        levels = np.zeros(41)
        levels[:out] = 7.0
        assert bool(goal.met(levels)) is met


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"level_db": np.zeros(3)}, "level_db has shape"),
        ({"level_db": np.full(4, np.inf)}, "finite levels"),
        ({"upper_db": np.full(4, -1.0)}, "0 dB or more"),
        ({"share": 0.0}, "share = 0"),
    ],
)
def test_what_is_no_goal_is_refused(fields, said):
    good = {"frequency_hz": LINES, "level_db": np.zeros(4), "upper_db": np.full(4, 6.0), "lower_db": np.full(4, 6.0)}
    with pytest.raises(ValueError, match=said):
        Goal(**(good | fields))


@pytest.mark.parametrize(("share", "required", "line"), [(1.0, 4, 2), (0.75, 3, 0), (0.5, 2, 3)])
def test_deciding_line_is_the_worst_of_the_required_best(share, required, line):
    """Errors of 5, 1, 9 and 2 dB at a tolerance of 6 dB leave 1, 5, -3 and 4 dB."""
    goal = Goal.even(np.array([100.0, 200.0, 400.0, 800.0]), np.ones(4), 6.0, share)
    level_db = np.array([5.0, -1.0, 9.0, 2.0])
    assert goal.required == required
    assert goal.deciding_line(level_db) == line
    assert bool(goal.met(level_db)) == bool(goal.margin_db(level_db)[line] >= 0)
