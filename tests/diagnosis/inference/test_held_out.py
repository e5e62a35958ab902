"""What a fold predicts on configurations that it has not seen: ridge regression, and kriging of
what remains."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.diagnosis.inference import held_out
from pyroshock.diagnosis.inference.held_out import (
    cell_weights,
    fit_fold,
    set_predictions,
    stacking_weights,
)
from pyroshock.diagnosis.inference.left_out import corner_rows, left_out_residuals
from pyroshock.diagnosis.inference.model_search import ModelLibrary, fit_sets
from pyroshock.diagnosis.inference.problem import InferenceProblem
from pyroshock.diagnosis.inference.subset_fit import ErrorSize, SubsetFit, no_effects, residual
from support.records.linear_problems import columns_of, linear_problem

COUNT, NOISE = 10, 0.2
PLACE = np.linspace(0, 1, COUNT)


def problem_of(seed: int = 0, sizes: tuple[float, float] = (1.0, -0.8)) -> InferenceProblem:
    rng = np.random.default_rng(seed)
    responses = 4 * rng.standard_normal((2, COUNT, 1))
    gap = np.tensordot(sizes, responses, axes=1) + NOISE * rng.standard_normal((COUNT, 1))
    return linear_problem(responses, gap, NOISE**2 * np.eye(COUNT))


def library_of(problem: InferenceProblem, *sets: list[str]) -> ModelLibrary:
    library = ModelLibrary(problem, {(): no_effects(problem)})
    fit_sets(problem, library, sets)
    return library


def ridge(problem: InferenceProblem, effects: tuple[str, ...], training: np.ndarray) -> np.ndarray:
    """(N,): what A (I + A' A / s^2)^-1 A' z / s^2 of the training rows says of all."""
    responses, z = columns_of(problem, effects), problem.blocks[0].z
    inside = responses[training] / NOISE
    size = np.linalg.solve(np.eye(len(effects)) + inside.T @ inside, inside.T @ z[training] / NOISE)
    return responses @ size


def whole(library: ModelLibrary) -> SubsetFit:
    return max(library.fits.values(), key=lambda fit: len(fit.laws))


@pytest.mark.parametrize("out", [0, 4, 9])
def test_configuration_left_out_is_predicted_as_ridge_regression_does(out: int):
    problem = problem_of()
    library = library_of(problem, list(problem.effects))
    training = np.delete(np.arange(COUNT), out)
    fold = fit_fold(library, training, [whole(library)])
    expected = ridge(problem, problem.effects, training)
    assert fold.averaged[out, 0] == pytest.approx(expected[out], abs=0.02)
    np.testing.assert_array_equal(fold.training, training)


def test_prediction_has_not_seen_what_was_left_out():
    problem = problem_of()
    library = library_of(problem, list(problem.effects))
    training = np.arange(1, COUNT)
    expected = ridge(problem, problem.effects, training)
    found = set_predictions(library, training, [whole(library)])[0]
    np.testing.assert_allclose(found[:, 0], expected, atol=0.01)
    # Whatever was measured there.
    training, fit = np.arange(1, COUNT), whole(library)
    before = fit_fold(library, training, [fit]).averaged[0, 0]
    linear = set_predictions(library, training, [fit])[0, 0, 0]
    problem.blocks[0].z[0] += 20.0
    assert fit_fold(library, training, [fit]).averaged[0, 0] == pytest.approx(before, abs=1e-9)
    assert set_predictions(library, training, [fit])[0, 0, 0] == pytest.approx(linear, abs=1e-9)
    problem = problem_of()
    library = library_of(problem, list(problem.effects))
    fold = fit_fold(library, np.arange(1, COUNT), [whole(library)])
    np.testing.assert_allclose(fold.corrected, fold.averaged, atol=1e-9)
    library = library_of(problem_of())
    assert np.all(set_predictions(library, np.arange(1, COUNT), [library.best()]) == 0.0)


def correlated_problem(seed: int = 3, kappa: float = 0.4) -> InferenceProblem:
    """Three effects, two observables of each configuration, and noise that all of them share."""
    rng = np.random.default_rng(seed)
    responses = 4 * rng.standard_normal((3, COUNT, 2))
    gap = np.tensordot((1.0, -0.8, 0.1), responses, axes=1)
    size = 2 * COUNT
    noise = NOISE**2 * np.eye(size) + kappa * np.exp(
        -np.abs(np.subtract.outer(np.arange(size), np.arange(size))) / 4
    )
    return linear_problem(responses, gap + 0.5 * rng.standard_normal(gap.shape), noise)


EACH = [np.array([c]) for c in range(COUNT)]


def refitted(problem: InferenceProblem, fit: SubsetFit, groups: list[np.ndarray]) -> np.ndarray:
    """(N,): what each group of configurations leaves where a set is fitted, by generalized ridge
    regression, to all others; of configurations in no group, 0."""
    block, responses = problem.blocks[0], columns_of(problem, fit.effects)
    matrix = block.covariances[fit.errors[0].background]
    left = np.zeros(len(block.z))
    for group in groups:
        inside = np.isin(block.configuration, group)
        out, rest = np.flatnonzero(inside), np.flatnonzero(~inside)
        weighted = np.linalg.solve(matrix[np.ix_(rest, rest)], responses[rest])
        size = np.linalg.solve(
            np.eye(len(fit.u)) + responses[rest].T @ weighted, weighted.T @ block.z[rest]
        )
        left[out] = block.z[out] - responses[out] @ size
    return left


@pytest.mark.parametrize(
    "groups", [EACH, [np.array([7, 8, 9])], [np.array([0, 4]), np.array([1, 9, 5])]]
)
def test_residuals_of_configurations_left_out_are_those_of_a_fit_without_them(
    groups: list[np.ndarray],
):
    problem = correlated_problem()
    library = library_of(problem, list(problem.effects), ["gun.linear_0"])
    cells = np.isin(problem.blocks[0].configuration, np.concatenate(groups))
    for fit in library.fits.values():
        expected = refitted(problem, fit, groups) if fit.laws else problem.blocks[0].z
        (linear_residuals,) = left_out_residuals(problem, fit, [groups])
        np.testing.assert_allclose(linear_residuals[cells], expected[cells], atol=1e-5)
        unfitted_residuals = residual(problem.blocks[0], fit.change[0])
        np.testing.assert_allclose(linear_residuals[~cells], unfitted_residuals[~cells], atol=1e-12)


def test_corner_is_the_end_of_the_factor_with_the_larger_gap_among_the_configurations():
    count = 20
    problem = linear_problem(
        np.ones((1, count, 1)), np.linspace(1, 9, count)[:, None], NOISE**2 * np.eye(count)
    )
    rows, inside = corner_rows(problem), corner_rows(problem.only(np.arange(count - 5)))
    assert rows is not None
    assert inside is not None
    assert rows.tolist() == list(range(15, 20))
    assert inside.tolist() == list(range(15 - len(inside), 15))
    assert corner_rows(problem.only(np.arange(5))) is None  # too few are left


def test_stacking_weights_predict_best_what_is_left_out():
    # Of all pairs of weights that sum to one.
    problem = correlated_problem()
    library = library_of(problem, ["gun.linear_0"], ["gun.linear_1"])
    fits = [fit for fit in library.fits.values() if fit.laws]
    corner = corner_rows(problem)
    assert corner is not None
    assert 3 <= len(corner) <= COUNT // 2
    # Each configuration from all others, and the corner from what is outside of it.
    single_residuals = np.column_stack([refitted(problem, fit, EACH) for fit in fits])
    extrapolated = np.column_stack([refitted(problem, fit, [corner]) for fit in fits])
    all_residuals = np.vstack(
        [single_residuals, extrapolated[np.isin(problem.blocks[0].configuration, corner)]]
    )
    # A weight that is far from the posterior's has to predict ten configurations better.
    shares = np.linspace(0, 1, 1001)
    price = 10 * (all_residuals**2).sum(axis=0).min() / COUNT
    for prior in (0.0, 0.3, 1.0):
        squares = [
            float(((all_residuals @ [share, 1 - share]) ** 2).sum())
            + 2 * price * (share - prior) ** 2
            for share in shares
        ]
        weights = stacking_weights(problem, fits, np.array([prior, 1 - prior]))
        assert weights.sum() == pytest.approx(1.0)
        assert weights[0] == pytest.approx(shares[int(np.argmin(squares))], abs=2e-3)
        assert 0.05 < weights[0] < 0.95  # neither set alone
    fold = fit_fold(
        library, np.arange(1, COUNT), [fit for fit in library.fits.values() if fit.laws]
    )
    assert fold.weights.sum() == pytest.approx(1.0)
    assert fold.weights.max() < 0.99  # neither is enough by itself
    predicted = library.problem.simulator.changes([fit.point() for fit in fold.fits])
    expected = sum(w * p for w, p in zip(fold.weights, predicted, strict=True))
    np.testing.assert_allclose(fold.averaged, expected)
    problem = problem_of()
    assert stacking_weights(problem, [no_effects(problem)], np.ones(1)).tolist() == [1.0]


def test_sets_that_predict_the_same_keep_the_weights_of_the_posterior():
    problem = problem_of()
    fit = whole(library_of(problem, list(problem.effects)))
    weights = stacking_weights(problem, [fit, replace(fit)], np.array([0.85, 0.15]))
    np.testing.assert_allclose(weights, [0.85, 0.15], atol=1e-3)


def test_a_smooth_discrepancy_is_learned_from_its_neighbours():
    # A background that bends over the factors: the corrected prediction is closer than the effects
    # alone.
    rng = np.random.default_rng(2)
    responses = 4 * rng.standard_normal((1, COUNT, 1))
    smooth = 2 * np.sin(3 * PLACE)[:, None]
    kernel = 4 * np.exp(-0.5 * (PLACE[:, None] - PLACE[None, :]) ** 2 / 0.4**2)
    noise = 0.02 * np.eye(COUNT)
    problem = linear_problem(responses, responses[0] + smooth, noise)
    block = problem.blocks[0]
    object.__setattr__(
        block, "covariances", np.stack([noise, noise + kernel])
    )  # the bank's first has none
    library = library_of(problem, ["gun.linear_0"])
    for out in range(1, COUNT - 1):
        fold = fit_fold(library, np.delete(np.arange(COUNT), out), [whole(library)])
        alone = abs(fold.averaged[out, 0] - block.z[out])
        corrected = abs(fold.corrected[out, 0] - block.z[out])
        assert corrected < max(0.25 * alone, 0.15)
    from pyroshock.diagnosis.inference.held_out import _answered

    tables = np.array(
        [
            [[-0.2, 0.1], [-0.9, np.nan], [np.nan, -0.3]],
            [[np.nan, 0.0], [np.nan, 0.1], [np.nan, 0.2]],
        ]
    )
    filled = _answered(tables)
    assert filled[0].tolist() == [[-0.2, 0.1], [-0.9, -0.3], [-0.9, -0.3]]
    assert filled[1, :, 0].tolist() == [0.0, 0.0, 0.0]


def test_cell_is_averaged_over_the_sets_that_have_an_answer():
    """Of two sets the first has no answer in the second configuration, and none has one in the
    third."""
    changes = np.array([[[1.0], [np.nan], [np.nan]], [[2.0], [4.0], [np.nan]]])
    np.testing.assert_allclose(
        cell_weights(np.array([0.75, 0.25]), changes)[..., 0],
        [[0.75, 0.0, 0.75], [0.25, 1.0, 0.25]],
    )


def test_stacking_prefers_exact_laws_where_their_fit_predicts_better(
    monkeypatch: pytest.MonkeyPatch,
):
    """A set that leaves half of what its law does to the law's error, on data that the law makes
    exactly."""
    problem = problem_of()
    (block,) = problem.blocks
    problem = replace(
        problem, blocks=(replace(block, discrepancy=np.ones_like(block.discrepancy)),)
    )
    library = library_of(problem, list(problem.effects))
    loose = replace(whole(library), errors=(ErrorSize(discrepancy=6),))
    training = np.arange(1, COUNT)
    expected = ridge(problem, problem.effects, training)[0]
    with_exact_laws = fit_fold(library, training, [loose]).averaged[0, 0]
    monkeypatch.setattr(held_out, "_with_exact_laws", lambda fit: fit)
    without_exact_laws = fit_fold(library, training, [loose]).averaged[0, 0]
    assert abs(with_exact_laws - expected) < 0.4 * abs(without_exact_laws - expected)
