"""The gate of a promotion: bands that hold, better beyond chance, enough configurations, and usable
at all."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.training.evaluation.gate import (
    LEAST_CONFIGURATIONS,
    band_checks,
    coverage_figures,
    find_unusable,
    judge,
    too_few,
)
from pyroshock.training.evaluation.summary import Clusters, corrected_p, least_p_value, sign_flip_p
from pyroshock.training.evaluation.unseen_scores import UnseenScores
from pyroshock.training.models.calibrated import grouped_quantile
from scipy import stats

RNG = np.random.default_rng


def scores(
    configurations: int = 40,
    *,
    candidate: float = 0.05,
    covered: tuple[float, float, float] = (0.9, 0.9, 0.9),
) -> UnseenScores:
    """Two pulses of each configuration; the reference errs by 0.1, scattered by a fifth; shares
    inside as given."""
    rng = RNG(3)
    n = 2 * configurations
    names = np.repeat([f"c{number:03d}" for number in range(configurations)], 2)
    crps = tuple(mean * (1 + 0.2 * rng.standard_normal((n, 3))) for mean in (candidate, 0.1))
    ranks = np.column_stack([rng.permutation(n) / n for _ in covered])
    inside = (ranks < np.array(covered), ranks < 0.9)
    return UnseenScores(("new@1", "old@1"), crps, inside, names, 5)


def test_better_model_whose_bands_hold_passes() -> None:
    good = scores()
    verdict = judge(good, good.p_value(RNG(0)))
    assert verdict.promoted
    assert "new@1 predicts unseen configurations better than old@1" in verdict.reason


def test_bands_that_hold_half_are_refused_although_the_scores_are_better() -> None:
    """The case of the issue: CRPS better, coverage .49 for peak and impulse."""
    narrow = scores(covered=(0.49, 0.9, 0.49))
    verdict = judge(narrow, narrow.p_value(RNG(0)))
    assert verdict.verdict == "bands do not hold"
    assert "do not hold for peak force and impulse" in verdict.reason


def test_lead_that_may_be_chance_is_refused() -> None:
    even = scores(candidate=0.0998)
    p_value = even.p_value(RNG(0))
    assert p_value > 0.05
    assert judge(even, p_value).verdict in ("may be chance", "worse")
    assert judge(scores(candidate=0.2), 0.0).verdict == "worse"
    assert judge(scores(), 0.75).verdict == "may be chance"


def test_few_configurations_are_not_enough_to_judge() -> None:
    few = scores(LEAST_CONFIGURATIONS - 1)
    verdict = judge(few, few.p_value(RNG(0)))
    assert verdict.verdict == "not enough to judge"
    assert "9 configurations are not enough" in verdict.reason
    assert not too_few(LEAST_CONFIGURATIONS)


def test_share_below_the_range_by_no_more_than_its_count_is_not_enough() -> None:
    unsure = scores(14, covered=(0.8, 0.9, 0.9))
    (peak, *_) = band_checks(unsure)
    assert peak.share < 0.85 < peak.high
    assert judge(unsure, 0.001).verdict == "not enough to judge"


def test_interval_is_that_of_configurations_and_not_of_pulses() -> None:
    """Wilson's interval of as many trials as configurations, where pulses of a configuration agree
    entirely."""
    inside = np.repeat(np.arange(20) < 18, 10)[:, None] & np.ones((200, 3), dtype=bool)
    names = np.repeat([f"c{number:02d}" for number in range(20)], 10)
    check = band_checks(
        UnseenScores(("a", "b"), (np.zeros((200, 3)),) * 2, (inside, inside), names, 5)
    )[0]
    assert check.share == pytest.approx(0.9)
    assert 0.70 < check.low < 0.80
    assert check.high > 0.95
    figures = coverage_figures(
        UnseenScores(("a", "b"), (np.zeros((200, 3)),) * 2, (inside, inside), names, 5)
    )
    assert figures["coverage90.candidate.peak_force"] == pytest.approx(0.9)


@pytest.mark.parametrize(("error", "repeatability", "of_mean", "limit"), [
    (0.36, 0.035, None, "above 35 %, ten times what repeated impacts differ by"),
    (0.6, None, 0.5, "above 50 %, the error of the mean of the pulses that it learned from"),
    (2.02, 0.035, 0.55, "above 100 %, the force itself"),
])  # fmt: skip
def test_an_error_above_a_limit_is_no_prediction(
    error: float, repeatability: float | None, of_mean: float | None, limit: str
) -> None:
    reason = find_unusable("tree@1", "configurations", error, 0.9 * error, repeatability, of_mean)
    assert str(reason) == (
        "tree@1 is not usable: its force error on the split configurations is "
        f"{100 * error:g} %, {limit}"
    )


def test_an_error_below_the_limits_is_a_prediction() -> None:
    assert find_unusable("svr@1", "configurations", 0.34, 0.3, 0.035, 0.5) is None
    assert find_unusable("svr@1", "configurations", 0.9, None, None, 0.5) is None
    assert find_unusable("svr@1", "configurations", 0.6, 0.45, None, 0.5) is None


@pytest.mark.parametrize("count", [1, 2, 6, 10])
def test_least_p_value_is_that_of_equal_signs(count: int) -> None:
    clusters = Clusters(np.arange(1.0, count + 1)[:, None], np.ones(count))
    assert sign_flip_p(clusters, RNG(0))[0] == least_p_value(count)


def test_corrected_p_value_is_that_of_the_published_test() -> None:
    """t = d / (s sqrt(1 / k + share)): Nadeau and Bengio 2003, eq. 9."""
    values = RNG(5).normal(0.4, 1.0, 25)
    (p_value,) = corrected_p(Clusters(values[:, None], np.ones(25)))
    t = values.mean() / (values.std(ddof=1) * np.sqrt(1 / 25 + 0.1))
    assert p_value == pytest.approx(2 * stats.t.sf(abs(t), 24))
    assert corrected_p(Clusters(np.ones((1, 1)), np.ones(1)))[0] == 1.0
    assert corrected_p(Clusters(np.ones((5, 1)), np.ones(5)))[0] == 0.0


def test_quantile_over_groups_weighs_each_group_the_same() -> None:
    scores_, groups = np.arange(1.0, 101.0), np.array([f"{i:03d}" for i in range(100)])
    assert grouped_quantile(scores_, groups, 0.9) == 90.0
    many = np.concatenate([np.full(1000, 5.0), [1.0, 2.0, 3.0]])
    labels = np.array(["a"] * 1000 + ["b", "c", "d"])
    assert grouped_quantile(many, labels, 0.7) == 3.0
    assert grouped_quantile(many, labels, 0.9) == 5.0
