"""The tuner on a toy bench: finds, learns, refuses, tells what to avoid."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.twin.tune.goal import Goal, level_db
from pyroshock.twin.tune.search import Effort
from pyroshock.twin.tune.space import mount_of
from pyroshock.twin.tune.tuner import SAME_SPECTRUM_DB, FiredShots, tune
from support.records.tuning_toy import LINES, SPACE, Toy, spectrum

HIDDEN = SPACE.setting(list(SPACE.mounts())[7], 3.3e5, 0.41)
EFFORT = Effort(pressures=6, masses=3, finalists=12)


def goal(offset_db=0.0, **more):
    return Goal.even(LINES, spectrum(HIDDEN) * 10 ** (offset_db / 20), 6.0, **more)


def tuned(wanted, **more):
    given = {
        "forward": Toy(1.0),
        "space": SPACE,
        "rng": np.random.default_rng(0),
        "effort": EFFORT,
    } | more
    return tune(given.pop("forward"), given.pop("space"), wanted, given.pop("rng"), **given)


@pytest.fixture(scope="module")
def first():
    return tuned(goal())


def test_proposals_are_ranked_and_distinct_and_the_first_is_the_one_asked_for(first):
    """The same with the same seed; progress counts up to the whole grid."""
    best = first.proposals[0]
    assert np.abs(level_db(spectrum(best.setting)) - goal().level_db).max() < 1.0
    assert best.worst_margin_db > 5.0
    ranks = [p.rank for p in first.proposals]
    assert ranks == sorted(ranks, reverse=True)
    mounts = [mount_of(s) for p in first.proposals for s in (p.setting, *p.alternatives)]
    assert len(set(mounts)) == len(mounts) > 5
    levels = [p.level_db for p in first.proposals]
    assert (
        min(np.abs(a - b).max() for i, a in enumerate(levels) for b in levels[:i])
        >= SAME_SPECTRUM_DB
    )
    calls = []
    again = tuned(goal(), progress=lambda done, total, what: calls.append((done, total, what)))
    for name in ("setting", "probability_within"):
        assert [getattr(p, name) for p in again.proposals] == [
            getattr(p, name) for p in first.proposals
        ]
    assert (648, 648, "grid") in calls
    assert all(done <= total for done, total, _ in calls)


def test_fired_shots_update_the_next_proposal_and_make_surer(first):
    """A bench 8 dB louder than its model: the first shot misses, the second does not."""
    fired = tuned(goal(8.0)).proposals[0].setting
    shown = FiredShots((fired,), level_db(spectrum(fired))[None] + 8.0)
    first_miss = np.abs(shown.level_db[0] - goal(8.0).level_db).max()
    after = tuned(goal(8.0), measured=shown)
    second_miss = np.abs(
        level_db(spectrum(after.proposals[0].setting)) + 8.0 - goal(8.0).level_db
    ).max()
    assert first_miss > 6.0 > second_miss
    rng, mounts = np.random.default_rng(2), list(SPACE.mounts())
    shots = tuple(SPACE.setting(m, 3e5, 0.5) for m in mounts[::4])
    exact = FiredShots(
        shots, level_db(Toy().spectra(shots)) + 0.5 * rng.standard_normal((len(shots), LINES.size))
    )
    after = tuned(goal(), measured=exact)
    assert after.proposals[0].probability_95 > first.proposals[0].probability_95 + 0.1


def test_nothing_refused_or_outside_of_the_model_is_proposed():
    def no_steel(settings):
        return [("no steel today",) if s.tip.name == "steel" else () for s in settings]

    found = tuned(goal(), refusals=no_steel)
    assert all(p.setting.tip.name != "steel" for p in found.proposals)
    assert any("beyond the bench: no steel today" in each.reason for each in found.avoid)

    def outside(settings):
        return [("tip unknown",) if s.tip.name == "PLA" else () for s in settings]

    cautious, bold = (
        tuned(goal(), outside=outside),
        tuned(goal(), outside=outside, extrapolate=True),
    )
    assert not any(p.outside for p in cautious.proposals)
    assert any("outside of the model: tip unknown" in each.reason for each in cautious.avoid)
    assert any(p.outside for p in bold.proposals)


def test_likely_overtests_are_told_and_lines_of_another_grid_are_refused():
    every_mount = Effort(pressures=6, masses=3, finalists=36)
    said = [
        each.reason
        for each in tuned(goal(), effort=every_mount).avoid
        if each.reason.startswith("overtests")
    ]
    assert said
    assert all("dB above the upper edge at" in reason for reason in said)
    with pytest.raises(ValueError, match="expected the same frequencies"):
        tuned(Goal.even(LINES[:-1], np.ones(40)))
    one = FiredShots((HIDDEN,), np.zeros((1, LINES.size)))
    assert len(FiredShots() + one + one) == 2
    assert (one + FiredShots()).level_db.shape == (1, LINES.size)
    assert len(FiredShots() + FiredShots()) == 0
