"""Shares of the gap: Shapley values of the squared gap, which sum to the whole."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.diagnosis.inference import shares
from pyroshock.diagnosis.inference.model_search import ModelLibrary, fit_sets
from pyroshock.diagnosis.inference.problem import InferenceProblem
from pyroshock.diagnosis.inference.shares import GapShares, gap_shares
from pyroshock.diagnosis.inference.subset_fit import (
    ErrorSize,
    Start,
    SubsetFit,
    fit_subsets,
    leave_one_out,
    linearised,
    no_effects,
)
from support.records.linear_problems import linear_problem

COUNT = 12
NOISE = 1e-3
WEIGHTS = np.array([1.0])


def problem_of(responses: np.ndarray, gap: np.ndarray) -> InferenceProblem:
    return linear_problem(responses[:, :, None], gap[:, None], NOISE**2 * np.eye(COUNT))


def fit_at(problem: InferenceProblem, sizes: np.ndarray) -> SubsetFit:
    """All laws of the problem, fitted; `sizes` are the true ones, where the fit begins."""
    laws = problem.laws
    change, jacobian = linearised(problem, [laws], [sizes])
    contributions = leave_one_out(problem, [laws], [sizes], change)
    start = Start(laws, sizes, contributions[0], (ErrorSize(),), change[0], jacobian[0])
    return fit_subsets(problem, [start])[0]


def orthogonal(count: int) -> np.ndarray:
    """(count, COUNT) with lengths 4, 5, ..."""
    rows = np.linalg.qr(np.random.default_rng(0).standard_normal((COUNT, COUNT)))[0][:count]
    return rows * (4 + np.arange(count))[:, None]


def library_of(problem: InferenceProblem, *fits: SubsetFit) -> ModelLibrary:
    library = ModelLibrary(problem)
    library.add([no_effects(problem), *fits])
    return library


def of_all(responses: np.ndarray, sizes: np.ndarray, rest: np.ndarray | float = 0.0) -> GapShares:
    problem = problem_of(responses, sizes @ responses + rest)
    library = library_of(problem, fit_at(problem, sizes))
    return gap_shares(library, WEIGHTS, COUNT * NOISE**2, np.random.default_rng(0))


def test_values_sum_to_the_whole_reduction():
    rng = np.random.default_rng(1)
    responses, sizes = 3 * rng.standard_normal((4, COUNT)), np.array([1.0, -0.6, 0.4, 0.8])
    problem = problem_of(responses, sizes @ responses + rng.standard_normal(COUNT))
    fit = fit_at(problem, sizes)
    before = float((problem.blocks[0].z ** 2).sum())
    after = float(((problem.blocks[0].z - fit.u @ responses) ** 2).sum())
    assert shares._shapley(problem, fit, WEIGHTS, before).sum() == pytest.approx(before - after)
    # Two effects: half of what it takes alone, half of what it takes after the other.
    rng = np.random.default_rng(2)
    responses, sizes = 3 * rng.standard_normal((2, COUNT)), np.array([0.9, 0.5])
    problem = problem_of(responses, sizes @ responses)
    fit = fit_at(problem, sizes)
    z, own = problem.blocks[0].z, fit.u[:, None] * responses
    alone = (z**2).sum() - ((z - own[0]) ** 2).sum()
    second = ((z - own[1]) ** 2).sum() - ((z - own.sum(axis=0)) ** 2).sum()
    assert shares._shapley(problem, fit, WEIGHTS, float((z**2).sum()))[0] == pytest.approx(
        (alone + second) / 2
    )


def test_two_identical_effects_share_equally():
    # Over draws from their posterior, in which one is the larger the smaller the other is.
    response = orthogonal(2)
    responses, sizes = np.array([response[0], response[0], response[1]]), np.array([0.7, 0.7, 0.7])
    problem = problem_of(responses, sizes @ responses)
    library = library_of(problem, fit_at(problem, sizes))
    drawn = [
        gap_shares(library, WEIGHTS, COUNT * NOISE**2, np.random.default_rng(seed)).share
        for seed in range(8)
    ]
    first, second, other = (
        np.mean([share[f"gun.linear_{i}"] for share in drawn]) for i in range(3)
    )
    assert first == pytest.approx(second, abs=0.03)
    assert first > other
    rng = np.random.default_rng(3)
    responses, sizes = 3 * rng.standard_normal((4, COUNT)), np.array([1.0, -0.6, 0.05, 0.8])
    effect_shares = of_all(responses, sizes, 0.3 * rng.standard_normal(COUNT))
    rows = [
        (effect_shares.share[name], effect_shares.interval[name]) for name in effect_shares.share
    ]
    for mean, (low, high) in [
        *rows,
        (effect_shares.unexplained, effect_shares.unexplained_interval),
    ]:
        assert low <= mean <= high


@pytest.mark.parametrize("count", [3, 7])
def test_large_sets_share_orthogonal_contributions_as_small_ones(count: int):
    """Of more than six effects the first and the last place stand for all orders: nothing changes
    where no order matters."""
    sizes = np.linspace(0.4, 1.0, count)
    responses = orthogonal(count)
    problem = problem_of(responses, sizes @ responses)
    fit = fit_at(problem, sizes)
    squares = fit.u**2 * (responses**2).sum(axis=1)
    before = float((problem.blocks[0].z ** 2).sum())
    found = shares._shapley(problem, fit, WEIGHTS, before)
    np.testing.assert_allclose(found / found.sum(), squares / squares.sum(), atol=0.01)


def test_shares_and_unexplained_sum_to_one():
    rest = 6 * np.linalg.qr(np.random.default_rng(0).standard_normal((COUNT, COUNT)))[0][5]
    effect_shares = of_all(orthogonal(3), np.array([1.0, -0.8, 0.5]), rest)
    assert sum(effect_shares.share.values()) + effect_shares.unexplained == pytest.approx(1.0)
    responses, sizes = orthogonal(2), np.array([1.0, 1.0])
    rest = 6 * np.linalg.qr(np.random.default_rng(0).standard_normal((COUNT, COUNT)))[0][5]
    effect_shares = of_all(responses, sizes, rest)
    assert effect_shares.unexplained == pytest.approx(36 / (16 + 25 + 36), abs=0.04)
    sizes = np.array([1.0, -0.8, 0.5])
    responses = orthogonal(3)
    squares = (sizes**2) * (responses**2).sum(axis=1)
    effect_shares = of_all(responses, sizes)
    for i, square in enumerate(squares):
        assert effect_shares.share[f"gun.linear_{i}"] == pytest.approx(
            square / squares.sum(), abs=0.02
        )


def test_effects_without_a_part_share_nothing():
    problem = problem_of(orthogonal(2), 5 * np.ones(COUNT))
    found = gap_shares(library_of(problem), WEIGHTS, COUNT * NOISE**2, np.random.default_rng(0))
    assert found.unexplained == pytest.approx(1.0)
    assert set(found.share.values()) == {0.0}
    responses = orthogonal(3)
    problem = problem_of(responses, responses[0])
    library = library_of(problem)
    fit_sets(problem, library, [["gun.linear_0"]])
    found = gap_shares(library, WEIGHTS, COUNT * NOISE**2, np.random.default_rng(0))
    assert found.share["gun.linear_0"] == pytest.approx(1.0, abs=0.02)
    assert found.share["gun.linear_1"] == found.share["gun.linear_2"] == 0.0
    # The second effect acts on the second observable alone, which is not of the metric.
    rows = orthogonal(2)
    responses = np.zeros((2, COUNT, 2))
    responses[0, :, 0], responses[1, :, 1] = rows
    problem = linear_problem(responses, responses.sum(axis=0), NOISE**2 * np.eye(2 * COUNT))
    library = library_of(problem, fit_at(problem, np.array([1.0, 1.0])))
    found = gap_shares(library, np.array([1.0, 0.0]), COUNT * NOISE**2, np.random.default_rng(0))
    assert found.share["gun.linear_0"] == pytest.approx(1.0, abs=0.02)


def test_shares_are_of_the_likeliest_sets_where_very_many_are_alike(
    monkeypatch: pytest.MonkeyPatch,
):
    problem = problem_of(orthogonal(3), orthogonal(3)[0])
    library = library_of(problem)
    fits = [(fit, 1e-3) for fit in library.fits.values()]
    monkeypatch.setattr(type(library), "weights", lambda _: fits)
    gap_share = gap_shares(library, WEIGHTS, COUNT * NOISE**2, np.random.default_rng(0))
    assert sum(gap_share.share.values()) + gap_share.unexplained == pytest.approx(1.0)


def test_shares_of_a_gap_within_the_noise_are_those_of_a_quarter_of_it():
    """An error in other observables may be large where that of the metric is noise: then nothing is
    left to share."""
    rows = orthogonal(2)
    problem = problem_of(rows, 0.1 * rows[0] + 0.05 * rows[1])
    library = library_of(problem, fit_at(problem, np.array([0.1, 0.0])))
    before = float((problem.blocks[0].z ** 2).sum())
    for floor in (0.9 * before, 1.001 * before, 5 * before):
        assert shares.reducible_square(before, floor) == pytest.approx(before / 4)
        gap_share = gap_shares(library, WEIGHTS, floor, np.random.default_rng(0))
        assert max(abs(share) for share in gap_share.share.values()) <= 1.0
        assert sum(gap_share.share.values()) + gap_share.unexplained == pytest.approx(1.0)
    assert shares.reducible_square(before, before / 2) == pytest.approx(before / 2)


def test_effect_that_works_against_a_larger_one_has_a_negative_share():
    rows = orthogonal(1)
    responses, sizes = np.array([rows[0], rows[0] + orthogonal(2)[1]]), np.array([2.0, -0.5])
    shares = of_all(responses, sizes)
    assert shares.share["gun.linear_1"] < 0 < shares.share["gun.linear_0"]
    assert (
        shares.share["gun.linear_0"] > 1
        and shares.interval["gun.linear_1"][0] < shares.share["gun.linear_1"]
    )
    assert sum(shares.share.values()) + shares.unexplained == pytest.approx(1.0)
