"""What a fold predicts on configurations that it has not seen: ridge regression, and kriging of what remains."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.diagnosis.inference.held_out import FoldFit, fit_fold, set_predictions
from pyroshock.diagnosis.inference.model_search import ModelLibrary, fit_sets, set_prior
from pyroshock.diagnosis.inference.problem import InferenceProblem
from pyroshock.diagnosis.inference.subset_fit import SubsetFit, no_effects
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


def test_prediction_of_a_set_is_ridge_regression():
    problem = problem_of()
    library = library_of(problem, list(problem.effects))
    training = np.arange(1, COUNT)
    expected = ridge(problem, problem.effects, training)
    found = set_predictions(library, training, [whole(library)])[0]
    np.testing.assert_allclose(found[:, 0], expected, atol=0.01)


def test_prediction_has_not_seen_what_was_left_out():
    """Whatever was measured there."""
    problem = problem_of()
    library = library_of(problem, list(problem.effects))
    training, fit = np.arange(1, COUNT), whole(library)
    before = fit_fold(library, training, [fit]).averaged[0, 0]
    linear = set_predictions(library, training, [fit])[0, 0, 0]
    problem.blocks[0].z[0] += 20.0
    assert fit_fold(library, training, [fit]).averaged[0, 0] == pytest.approx(before, abs=1e-9)
    assert set_predictions(library, training, [fit])[0, 0, 0] == pytest.approx(linear, abs=1e-9)


def test_sets_are_weighed_by_what_the_training_configurations_say():
    """An effect that acts in the configuration left out alone is as likely without it as before any measurement."""
    rng = np.random.default_rng(1)
    responses = np.zeros((2, COUNT, 1))
    responses[0, :, 0] = 4 * rng.standard_normal(COUNT)
    responses[1, 0, 0] = 6 * NOISE
    gap = responses.sum(axis=0) + NOISE * rng.standard_normal((COUNT, 1))
    problem = linear_problem(responses, gap, NOISE**2 * np.eye(COUNT))
    library = library_of(problem, ["gun.linear_0"], ["gun.linear_0", "gun.linear_1"])
    on, off = set_prior(problem.laws)["gun.linear_1"]
    assert _probability_of_both(fit_fold(library, np.arange(COUNT))) > 0.99
    unseen = _probability_of_both(fit_fold(library, np.arange(1, COUNT)))
    assert unseen == pytest.approx(np.exp(on) / (np.exp(on) + np.exp(off)), abs=0.01)


def _probability_of_both(fold: FoldFit) -> float:
    """Of the set of two effects."""
    return sum(weight for fit, weight in zip(fold.fits, fold.weights, strict=True) if len(fit.laws) == 2)


def test_weights_average_the_predictions():
    problem = problem_of(sizes=(1.0, 0.06))
    library = library_of(problem, ["gun.linear_0"], list(problem.effects))
    fold = fit_fold(library, np.arange(1, COUNT))
    assert fold.weights.sum() == pytest.approx(1.0)
    assert fold.weights.max() < 0.99  # the data do not decide
    predicted = library.problem.simulator.changes([fit.point() for fit in fold.fits])
    expected = sum(w * p for w, p in zip(fold.weights, predicted, strict=True))
    np.testing.assert_allclose(fold.averaged, expected)


def test_a_smooth_discrepancy_is_learned_from_its_neighbours():
    """A background that bends over the factors: the corrected prediction is closer than the effects alone."""
    rng = np.random.default_rng(2)
    responses = 4 * rng.standard_normal((1, COUNT, 1))
    smooth = 2 * np.sin(3 * PLACE)[:, None]
    kernel = 4 * np.exp(-0.5 * (PLACE[:, None] - PLACE[None, :]) ** 2 / 0.4**2)
    noise = 0.02 * np.eye(COUNT)
    problem = linear_problem(responses, responses[0] + smooth, noise)
    block = problem.blocks[0]
    object.__setattr__(block, "covariances", np.stack([noise, noise + kernel]))  # the bank's first has none
    library = library_of(problem, ["gun.linear_0"])
    for out in range(1, COUNT - 1):
        fold = fit_fold(library, np.delete(np.arange(COUNT), out), [whole(library)])
        alone = abs(fold.averaged[out, 0] - block.z[out])
        corrected = abs(fold.corrected[out, 0] - block.z[out])
        assert corrected < max(0.25 * alone, 0.15)


def test_without_a_discrepancy_there_is_nothing_to_correct():
    problem = problem_of()
    library = library_of(problem, list(problem.effects))
    fold = fit_fold(library, np.arange(1, COUNT), [whole(library)])
    np.testing.assert_allclose(fold.corrected, fold.averaged, atol=1e-9)


def test_set_without_effects_predicts_no_change():
    library = library_of(problem_of())
    assert np.all(set_predictions(library, np.arange(1, COUNT), [library.best()]) == 0.0)


def test_shot_without_an_answer_is_as_far_off_as_the_farthest_with_one():
    from pyroshock.diagnosis.inference.held_out import _answered

    tables = np.array([[[-0.2, 0.1], [-0.9, np.nan], [np.nan, -0.3]], [[np.nan, 0.0], [np.nan, 0.1], [np.nan, 0.2]]])
    filled = _answered(tables)
    assert filled[0].tolist() == [[-0.2, 0.1], [-0.9, -0.3], [-0.9, -0.3]]
    assert filled[1, :, 0].tolist() == [0.0, 0.0, 0.0]
