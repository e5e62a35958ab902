"""One set of effects fitted to the gap: against closed forms of linear problems and a peer for bent
ones."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.diagnosis.inference import subset_fit
from pyroshock.diagnosis.inference.effect_laws import LawRanges, laws_of
from pyroshock.diagnosis.inference.problem import NO_ANSWER, InferenceProblem
from pyroshock.diagnosis.inference.subset_fit import (
    DISCREPANCIES,
    ErrorSize,
    Start,
    SubsetFit,
    covariance,
    covariance_factor,
    fit_subsets,
    least_squares_place,
    leave_one_out,
    linearised,
    no_effects,
    polished,
    residual,
    with_evidence,
)
from scipy.optimize import minimize
from scipy.stats import multivariate_normal
from support.records.linear_problems import columns_of, linear_kind, linear_law, linear_problem

SHAPE = (6, 2)


@pytest.fixture(autouse=True)
def _plain_errors(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every size of the errors as likely as any other, so that the evidence is that of the Gaussian
    problem alone."""
    monkeypatch.setattr(subset_fit, "_LOG_PRIOR", np.zeros(len(DISCREPANCIES)))
    monkeypatch.setattr(subset_fit, "_BEYOND_TOLERANCE", np.inf)


def problem_of(bend: float = 0.0, seed: int = 1) -> InferenceProblem:
    """Three effects of which two act."""
    rng = np.random.default_rng(seed)
    responses = rng.standard_normal((3, *SHAPE))
    size = responses[0].size
    root = 0.3 * rng.standard_normal((size, size))
    noise = root @ root.T + 0.2 * np.eye(size)
    true = 0.8 * (1 + 0.8 * bend) * responses[0] - 0.5 * (1 - 0.5 * bend) * responses[2]
    gap = true + (np.linalg.cholesky(noise) @ rng.standard_normal(size)).reshape(SHAPE)
    return linear_problem(responses, gap, noise, bend=bend)


def fit(problem: InferenceProblem, laws, begin: float = 0.3, iterations: int = 20) -> SubsetFit:
    u = np.full(sum(law.size for law in laws), begin)
    change, jacobian = linearised(problem, [tuple(laws)], [u])
    contributions = leave_one_out(problem, [tuple(laws)], [u], change)
    start = Start(tuple(laws), u, contributions[0], (ErrorSize(),), change[0], jacobian[0])
    return fit_subsets(problem, [start], iterations=iterations)[0]


@pytest.mark.parametrize("chosen", [(0,), (0, 2), (0, 1, 2)])
def test_evidence_is_that_of_the_gaussian_problem(chosen):
    """log N(z; 0, S + A A')."""
    problem = problem_of()
    own = fit(problem, [linear_law(i) for i in chosen])
    responses = columns_of(problem, own.effects)
    block = problem.blocks[0]
    total = block.covariances[0] + responses @ responses.T
    assert own.log_evidence == pytest.approx(
        multivariate_normal(cov=total).logpdf(block.z), abs=1e-2
    )


def test_mode_and_precision_are_those_of_ridge_regression(monkeypatch: pytest.MonkeyPatch):
    block = (problem := problem_of()).blocks[0]
    assert no_effects(problem).log_evidence == pytest.approx(
        multivariate_normal(cov=block.covariances[0]).logpdf(block.z)
    )
    problem = problem_of()
    own = fit(problem, [linear_law(0), linear_law(2)])
    responses, block = columns_of(problem, own.effects), problem.blocks[0]
    whitened = np.linalg.solve(block.covariances[0], responses)
    precision = np.eye(2) + responses.T @ whitened
    np.testing.assert_allclose(own.precision, precision, rtol=1e-6)
    np.testing.assert_allclose(own.u, np.linalg.solve(precision, whitened.T @ block.z), atol=0.03)
    again = polished(problem, [own])[0]
    assert again.polished
    np.testing.assert_allclose(again.u, own.u, atol=0.03)
    np.testing.assert_allclose(
        again.contributions[0].T, columns_of(problem, own.effects) * again.u, atol=0.1
    )
    monkeypatch.setattr(subset_fit, "_SETTLED", 1e-9)
    expected = np.linalg.solve(np.eye(2) + responses.T @ whitened, whitened.T @ block.z)
    np.testing.assert_allclose(own.u, expected, atol=1e-6)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_mode_of_a_bent_problem_is_that_of_a_general_minimiser(
    seed, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(subset_fit, "_SETTLED", 1e-6)
    problem = problem_of(bend=0.15, seed=seed)
    laws = [linear_law(0), linear_law(2)]
    own = fit(problem, laws, iterations=40)
    block, precision = problem.blocks[0], np.linalg.inv(problem.blocks[0].covariances[0])

    def cost(u: np.ndarray) -> float:
        away = (
            block.z
            - problem.changes([tuple((law, u[i : i + 1]) for i, law in enumerate(laws))])[0][0]
        )
        return float(away @ precision @ away + u @ u)

    expected = minimize(cost, np.full(2, 0.3), tol=1e-10)
    assert cost(own.u) == pytest.approx(expected.fun, abs=1e-3)
    np.testing.assert_allclose(own.u, expected.x, atol=0.02)


@pytest.mark.parametrize("seed", [1, 2])
def test_exact_laws_together_fit_best_where_a_general_minimiser_ends(seed: int):
    problem, laws = problem_of(bend=0.4, seed=seed), tuple(linear_law(i) for i in range(3))
    block = problem.blocks[0]
    precision = np.linalg.inv(block.covariances[0])

    def cost(u: np.ndarray) -> float:
        change = linearised(problem, [laws], [u])[0][0][0]
        return float(u @ u + (block.z - change) @ precision @ (block.z - change))

    place = least_squares_place(problem, laws, np.full(3, 0.3))
    peer = minimize(
        cost, np.zeros(3), method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-10}
    )
    np.testing.assert_allclose(place, peer.x, atol=5e-3)  # derivatives are differences


def test_several_starts_are_fitted_as_if_they_were_alone():
    problem = problem_of(bend=0.1)
    sets = [(linear_law(0),), (linear_law(0), linear_law(2)), (linear_law(1),)]
    places = [np.full(len(laws), 0.3) for laws in sets]
    change, jacobian = linearised(problem, sets, places)
    contributions = leave_one_out(problem, sets, places, change)
    starts = [
        Start(laws, places[k], contributions[k], (ErrorSize(),), change[k], jacobian[k])
        for k, laws in enumerate(sets)
    ]
    for together, laws in zip(fit_subsets(problem, starts, iterations=20), sets, strict=True):
        alone = fit(problem, laws)
        np.testing.assert_allclose(together.u, alone.u, atol=1e-9)
        assert together.log_evidence == pytest.approx(alone.log_evidence)
    # Two levels with opposite sizes: a law with one value for both can only take the mean.
    rng = np.random.default_rng(4)
    kind = linear_kind(0)
    responses = (2 + rng.random(SHAPE))[None]
    common, split = laws_of(kind, LawRanges(), {"bench": ((0, 0, 0, 1, 1, 1), ("a", "b"))})
    sizes = np.array([1.0, 1.0, 1.0, -1.0, -1.0, -1.0])[:, None]
    noise = 0.01 * np.eye(responses[0].size)
    problem = linear_problem(responses, sizes * responses[0], noise, laws=(common, split))
    own = fit(problem, [split])
    np.testing.assert_allclose(own.point()[0][0].values(own.u)["size"], sizes[:, 0], atol=0.1)
    assert own.log_evidence > fit(problem, [common]).log_evidence + 50


def test_discrepancy_is_a_share_of_what_an_effect_does():
    # The variance of each cell grows by the square of the share times the contribution.
    rng = np.random.default_rng(2)
    responses = rng.standard_normal((1, *SHAPE))
    size = responses[0].size
    problem = linear_problem(responses, responses[0], 0.1 * np.eye(size), discrepancy=np.eye(size))
    matrix = covariance(problem.blocks[0], 2 * responses.reshape(1, -1), ErrorSize(0, 4, 0))
    expected = 0.1 + (DISCREPANCIES[4] * 2 * responses.ravel()) ** 2
    np.testing.assert_allclose(matrix, np.diag(expected))
    block = problem_of().blocks[0]
    change = np.zeros(len(block.z))
    change[3] = np.nan
    away = residual(block, change)
    assert away[3] == NO_ANSWER
    np.testing.assert_array_equal(np.delete(away, 3), np.delete(block.z, 3))


def test_law_that_is_wrong_by_half_has_a_discrepancy():
    """A true law that is itself has none; one whose response is off by half in each cell has a
    large one."""
    rng = np.random.default_rng(5)
    shape = (20, 1)
    responses = 10 + rng.random((1, *shape))
    noise, kernel = 0.05 * np.eye(20), np.eye(20)
    off = 1 + 0.5 * rng.standard_normal(shape)
    right = fit(linear_problem(responses, responses[0], noise, discrepancy=kernel), [linear_law(0)])
    wrong = fit(
        linear_problem(responses, responses[0] * off, noise, discrepancy=kernel), [linear_law(0)]
    )
    assert DISCREPANCIES[right.errors[0].discrepancy] <= 0.03
    assert 0.25 <= DISCREPANCIES[wrong.errors[0].discrepancy] <= 1.0


@pytest.mark.parametrize(("size", "cost"), [(0.5, 0.0), (3.0, 0.5 * (2.0 / 0.4) ** 2)])
def test_background_beyond_tolerance_is_unlikely(
    size: float, cost: float, monkeypatch: pytest.MonkeyPatch
):
    """Two tolerances above the first one are five standard deviations of what a background may be
    beyond it."""
    noise = 0.01
    gap = np.full(SHAPE, np.sqrt(size**2 + noise))
    problem = linear_problem(np.ones((1, *SHAPE)), gap, noise * np.eye(gap.size))
    free = no_effects(problem).log_evidence
    monkeypatch.setattr(subset_fit, "_BEYOND_TOLERANCE", 0.4)
    assert free - no_effects(problem).log_evidence == pytest.approx(cost)


def test_factor_of_a_covariance_is_reckoned_once_for_what_acts_alike(
    monkeypatch: pytest.MonkeyPatch,
):
    block = problem_of().blocks[0]
    contributions = np.random.default_rng(3).standard_normal((2, len(block.z)))
    idle = np.vstack([contributions[:1], np.zeros((1, len(block.z))), contributions[1:]])
    error = ErrorSize(discrepancy=3)
    first = covariance_factor(block, contributions, error)
    np.testing.assert_allclose(first @ first.T, covariance(block, contributions, error), rtol=1e-12)
    assert (
        covariance_factor(block, idle, error) is first
    )  # an effect of another stage changes nothing here
    for other, size in ((2 * contributions, error), (contributions, ErrorSize(discrepancy=4))):
        lower = covariance_factor(block, other, size)
        np.testing.assert_allclose(lower @ lower.T, covariance(block, other, size), rtol=1e-12)
    monkeypatch.setattr(subset_fit, "_FACTOR_BYTES", first.nbytes)
    covariance_factor(block, contributions[:1], error)
    assert len(block.factors) == 1


def test_evidence_of_a_search_for_errors_is_that_of_the_errors_it_found():
    problem = problem_of(bend=0.3)
    fitted_set = fit(problem, [linear_law(0), linear_law(2)])
    assert with_evidence(problem, fitted_set).log_evidence == pytest.approx(
        fitted_set.log_evidence, abs=1e-9
    )
