"""Whole rules of standards: by hand, and wherever a spectrum is judged."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.twin.srs.standards import NAMED_TOLERANCES, parse_tolerance
from pyroshock.twin.srs.target import Target, compare, ramps
from pyroshock.twin.tune.goal import Goal

LINES = np.geomspace(100, 10_000, 20)


def judged(standard: str, error_db) -> tuple[bool, dict[str, tuple[int, int]], str]:
    """Of a spectrum that is off by so many dB at each of twenty lines."""
    target = Target(LINES, np.full(20, 1e3), np.zeros(20), np.zeros(20)).with_tolerance(
        parse_tolerance(standard)
    )
    lines = target.at(LINES)
    held = compare(lines.level_m_s2 * 10 ** (np.broadcast_to(error_db, 20) / 20), LINES, target)
    return (
        bool(held.met),
        {rule.name: (int(rule.lines), rule.required) for rule in held.rules},
        held.sentence(),
    )


def share(inside: float, rest: float, count: int) -> np.ndarray:
    """`count` lines off by `rest`, the others by `inside`."""
    return np.where(np.arange(20) < count, rest, inside)


def test_five_decibels_low_everywhere_is_within_the_tolerance_of_nasa_and_misses_its_rule():
    met, rules, sentence = judged("nasa-std-7003", -5.0)
    assert not met
    assert rules == {"within tolerance": (20, 20), "at the level or above": (0, 10)}
    assert sentence.startswith("target missed (NASA-STD-7003A")
    assert "at the level or above: 0 of 20 lines, 10 required, not met" in sentence
    assert judged("nasa-std-7003", 5.0)[0]


@pytest.mark.parametrize(("below", "met"), [(10, True), (11, False)])
@pytest.mark.parametrize(
    "standard", ["nasa-std-7003", "NASA-STD-7003A", "ecss-e-hb-32-25a", "ecss-e-st-10-03c"]
)
def test_half_of_the_lines_lie_at_the_level_or_above(standard, below, met):
    assert judged(standard, share(1.0, -1.0, below))[0] is met


def test_nasa_opens_above_three_kilohertz_only():
    above = np.where(LINES > 3000, 8.9, 5.9)
    assert judged("nasa-std-7003", above)[0]
    assert not judged("nasa-std-7003", above + 0.2)[0]
    assert not judged("nasa-std-7003", 8.0)[0]


@pytest.mark.parametrize(
    ("error_db", "met"),
    [
        (0.0, True),
        (-2.9, True),
        (-3.1, False),
        (5.9, True),
        (share(0.0, -5.9, 4), True),  # a fifth of the lines in the wider band
        (share(0.0, 8.9, 4), True),
        (share(0.0, -5.9, 5), False),
        (share(0.0, -6.1, 1), False),
        (share(0.0, 9.1, 1), False),
    ],
)
def test_mil_std_810h_asks_for_four_fifths_of_the_lines_and_a_wider_band_for_the_others(
    error_db, met
):
    assert judged("mil-std-810h-517", error_db)[0] is met


def test_ecss_is_narrower_below_than_above():
    assert judged("ecss-e-hb-32-25a", share(5.9, -2.9, 10))[0]
    assert not judged("ecss-e-hb-32-25a", share(5.9, -3.1, 1))[0]
    assert not judged("ecss-e-hb-32-25a", share(0.0, 6.1, 1))[0]


def test_a_plain_tolerance_asks_for_nothing_else():
    assert judged("6dB", -5.0)[0]
    met, rules, sentence = judged("6dB", share(0.0, -6.1, 1))
    assert not met and rules == {"within tolerance": (19, 20)}
    assert sentence == "target missed: within tolerance: 19 of 20 lines, all required, not met"


@pytest.mark.parametrize("standard", NAMED_TOLERANCES)
def test_every_standard_cites_its_clause_and_a_goal_of_the_tuner_has_the_same_rule(standard):
    tolerance = parse_tolerance(standard)
    assert tolerance.rule.name and tolerance.rule.clause
    at = ramps(100.0, 500.0, (1000.0, 9.0), (10_000.0, 0.0)).with_tolerance(tolerance).at(LINES)
    goal = Goal(
        LINES, 20 * np.log10(at.level_m_s2), at.upper_db, at.lower_db, at.rule.share_within, at.rule
    )
    errors = np.random.default_rng(4).normal(0, 3, (400, 20)) + np.linspace(-3, 3, 400)[:, None]
    spectra = at.level_m_s2 * 10 ** (errors / 20)
    held = compare(spectra, LINES, at)
    met = goal.met(20 * np.log10(spectra))
    np.testing.assert_array_equal(met, held.met)
    assert 5 < met.sum() < 395
    deciding = np.array([goal.deciding_line(level)[1] for level in 20 * np.log10(spectra)])
    if tolerance.rule.wider_upper_db is None:
        np.testing.assert_array_equal(deciding >= 0, met)
