"""When a spectrum is met; what a probability says, against closed forms and how often it comes
true."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.twin.discrepancy.kernels import Coordinates, Everywhere, level, white
from pyroshock.twin.discrepancy.shot_correction import Discrepancy, Term, covariance
from pyroshock.twin.tune.goal import Goal, level_db
from pyroshock.twin.tune.probability import proposals, root
from pyroshock.twin.tune.search import Candidate, line_scores
from scipy.stats import norm
from support.records.tuning_toy import LINES, SPACE, Toy, spectrum

SETTING = SPACE.setting(next(SPACE.mounts()), 3e5, 0.5)
NOTHING = np.empty((0, LINES.size))


def judged(terms, error_db=0.0, draws=40_000, tolerance_db=6.0):
    learned = Discrepancy(LINES, terms).after((), NOTHING)
    goal = Goal.even(LINES, spectrum(SETTING), tolerance_db)
    candidate = Candidate(SETTING, goal.level_db + error_db, 0.0)
    (proposal,) = proposals([candidate], learned, goal, np.random.default_rng(0), draws=draws)
    return proposal


def test_one_level_for_all_lines_is_one_normal():
    proposal = judged((Term("level", 3.0, Everywhere(), level),), error_db=2.0)
    expected = norm.cdf(4 / 3) - norm.cdf(-8 / 3)
    assert proposal.probability_within == pytest.approx(expected, abs=0.01)
    assert proposal.probability_95 == proposal.probability_within
    assert proposal.share_within == pytest.approx(expected, abs=0.01)
    assert proposal.probability_overtest == pytest.approx(norm.sf(4 / 3), abs=0.01)
    assert proposal.upper_db - proposal.level_db == pytest.approx(
        norm.ppf(0.95, scale=3.0), rel=1e-3
    )
    assert proposal.lower_db - proposal.level_db == pytest.approx(
        norm.ppf(0.05, scale=3.0), rel=1e-3
    )


def test_lines_for_themselves_multiply_and_scores_are_log_probabilities():
    proposal = judged((Term("line", 2.5, Everywhere(), white),))
    line = norm.cdf(6 / 2.5) - norm.cdf(-6 / 2.5)
    assert proposal.probability_within == pytest.approx(line**LINES.size, abs=0.01)
    assert proposal.share_within == pytest.approx(line, abs=0.002)
    assert proposal.probability_95 > proposal.probability_within
    # The root squares to the covariance even where that is singular.
    goal = Goal.even(LINES[:3], np.ones(3), 6.0)
    scores = line_scores(np.array([[0.0, -8.0, 300.0]]), np.array([2.0, 3.0, 1.0]), goal)[0]
    expected = [
        np.log(norm.cdf(3) - norm.cdf(-3)),
        np.log(norm.cdf(14 / 3) - norm.cdf(2 / 3)),
        norm.logcdf(-294.0),
    ]
    assert scores == pytest.approx(expected)
    ones = np.ones((4, 4))
    assert root(ones) @ root(ones).T == pytest.approx(ones)


def test_worst_line_is_named_and_better_ones_come_first():
    error = np.zeros(LINES.size)
    error[7] = -5.0
    proposal = judged((Term("level", 1.0, Everywhere(), level),), error_db=error)
    assert proposal.worst_margin_db == pytest.approx(1.0)
    assert proposal.worst_frequency_hz == LINES[7]
    learned = Discrepancy(LINES).after((), NOTHING)
    goal = Goal.even(LINES, spectrum(SETTING), 6.0)
    candidates = [Candidate(SETTING, goal.level_db + error, 0.0) for error in (5.0, 0.0, -3.0)]
    ranked = proposals(candidates, learned, goal, np.random.default_rng(0))
    assert [p.level_db[0] - goal.level_db[0] for p in ranked] == pytest.approx([0.0, -3.0, 5.0])


def test_stated_probability_is_how_often_it_comes_true():
    """A bench that is off by a draw from the prior, at a setting after three shots elsewhere: 200
    such benches.

    The mean of the stated probabilities against the frequency, and among the surer half of the
    benches again.
    """
    rng, few, toy = np.random.default_rng(11), LINES[::4], Toy()
    prior = Discrepancy(few)
    mounts = list(SPACE.mounts())
    shots = [SPACE.setting(mounts[i], 3e5, 0.5) for i in (3, 8, 20)]
    joint = covariance(prior, Coordinates.of([*shots, SETTING]))
    factor = np.linalg.cholesky(joint)
    goal = Goal.even(few, spectrum(SETTING)[::4], 6.0, share=0.8)
    nominal = level_db(toy.spectra([SETTING]))[0, ::4]
    stated, came_true = [], []
    for _ in range(200):
        bias = (factor @ rng.standard_normal(len(joint))).reshape(4, -1)
        learned = prior.after(shots, bias[:3])
        candidate = Candidate(SETTING, nominal + learned.mean_db([SETTING])[0], 0.0)
        (proposal,) = proposals([candidate], learned, goal, rng, draws=60)
        stated.append(proposal.probability_met)
        came_true.append(bool(goal.met(nominal + bias[3])))
    likely = np.array(stated) > np.median(stated)
    for group in (np.ones(200, dtype=bool), likely, ~likely):
        p, hits, n = np.array(stated)[group], np.array(came_true)[group], np.count_nonzero(group)
        # three standard deviations of the number of hits
        assert abs(hits.sum() - p.sum()) < 3 * np.sqrt(np.sum(p * (1 - p)) + 0.01 * n)
    assert 0.2 < np.mean(came_true) < 0.95


FOUR_LINES = np.array([100.0, 200.0, 400.0, 800.0])


def test_margin_is_the_way_to_the_nearer_edge_and_95_percent_of_41_lines_are_39():
    goal = Goal(
        FOUR_LINES,
        np.full(4, 60.0),
        np.array([3.0, 6.0, 6.0, np.inf]),
        np.array([6.0, 6.0, 3.0, 6.0]),
    )
    assert goal.margin_db(np.array([62.0, 67.0, 58.0, 90.0])) == pytest.approx(
        [1.0, -1.0, 1.0, 36.0]
    )
    even = Goal.even(FOUR_LINES, np.ones(4), 6.0)
    assert even.met(np.full(4, 6.0)) and not even.met(np.full(4, 6.0 + 1e-9))
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
    good = {
        "frequency_hz": FOUR_LINES,
        "level_db": np.zeros(4),
        "upper_db": np.full(4, 6.0),
        "lower_db": np.full(4, 6.0),
    }
    with pytest.raises(ValueError, match=said):
        Goal(**(good | fields))


@pytest.mark.parametrize(("share", "required", "line"), [(1.0, 4, 2), (0.75, 3, 0), (0.5, 2, 3)])
def test_deciding_line_is_the_worst_of_the_required_best(share, required, line):
    """Errors of 5, 1, 9 and 2 dB at a tolerance of 6 dB leave 1, 5, -3 and 4 dB."""
    goal = Goal.even(np.array([100.0, 200.0, 400.0, 800.0]), np.ones(4), 6.0, share)
    level_db = np.array([5.0, -1.0, 9.0, 2.0])
    assert goal.required == required
    assert goal.deciding_line(level_db)[0] == line
    assert bool(goal.met(level_db)) == bool(goal.margin_db(level_db)[line] >= 0)
