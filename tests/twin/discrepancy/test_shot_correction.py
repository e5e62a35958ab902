"""What measured shots teach, against the formulas and against what was planted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.twin.discrepancy.kernels import Coordinates
from pyroshock.twin.discrepancy.likelihood import fitted
from pyroshock.twin.discrepancy.shot_correction import (
    TERMS,
    Discrepancy,
    ShotCorrection,
    covariance,
)
from scipy.stats import multivariate_normal
from support.records.tuning_toy import SPACE

LINES = 100 * 2.0 ** (np.arange(9) / 2)
NOTHING = np.empty((0, LINES.size))


def some(count, seed=0):
    rng, grid = np.random.default_rng(seed), SPACE.grid(6, 4)
    return [grid[i] for i in rng.choice(len(grid), count, replace=False)]


def planted(settings, terms=TERMS, seed=1):
    prior = Discrepancy(LINES, terms)
    joint = covariance(prior, Coordinates.of(settings))
    drawn = np.random.default_rng(seed).multivariate_normal(
        np.zeros(len(joint)), joint, method="cholesky"
    )
    return drawn.reshape(len(settings), -1)


def test_without_shots_nothing_is_added_and_all_terms_are_unsure():
    learned = Discrepancy(LINES).after((), NOTHING)
    (setting,) = some(1)
    assert np.all(learned.mean_db([setting]) == 0)
    total = sum(term.sd_db**2 for term in TERMS)
    variance = np.diag(learned.covariance_db2(setting))
    assert variance.mean() == pytest.approx(total)
    assert variance == pytest.approx(
        np.full(LINES.size, total), rel=0.05
    )  # ends of the smooth part have a little more


def test_conditioning_is_that_of_the_joint_normal():
    """Mean and covariance at a new setting, against the textbook's block formula on the joint
    covariance."""
    *shots, new = settings = some(4)
    residual = planted(shots)
    learned = Discrepancy(LINES).after(shots, residual)
    joint = covariance(Discrepancy(LINES), Coordinates.of(settings))
    n = 3 * LINES.size
    gain = np.linalg.solve(joint[:n, :n], joint[:n, n:]).T
    assert learned.mean_db([new])[0] == pytest.approx(gain @ residual.ravel(), abs=1e-6)
    assert learned.covariance_db2(new) == pytest.approx(
        joint[n:, n:] - gain @ joint[:n, n:], abs=1e-6
    )


def test_a_fired_setting_is_known_to_its_scatter_and_others_less():
    (setting,) = some(1)
    learned = Discrepancy(LINES).after([setting], np.full((1, LINES.size), 4.0))
    own = sum(term.sd_db**2 for term in TERMS if "shot" in term.name)
    assert np.all(np.abs(learned.mean_db([setting]) - 4.0) < 0.7)
    assert np.all(np.diag(learned.covariance_db2(setting)) < 2.2 * own)
    rng = np.random.default_rng(3)
    residual = (
        3.0 + 0.7 * rng.standard_normal((20, 1)) + 0.7 * rng.standard_normal((20, LINES.size))
    )
    repeated = Discrepancy(LINES).after([setting] * 20, residual)
    assert repeated.mean_db([setting])[0] == pytest.approx(residual.mean(axis=0), abs=0.15)
    near, far = SPACE.grid(1, 1)[0], SPACE.grid(6, 4)[-1]
    elsewhere = Discrepancy(LINES).after([near], np.full((1, LINES.size), 5.0))
    assert np.all(elsewhere.mean_db([near]) > elsewhere.mean_db([far]) + 0.5)
    assert np.all(np.diag(elsewhere.covariance_db2(near)) < np.diag(elsewhere.covariance_db2(far)))
    assert np.all(elsewhere.mean_db([far]) > 0.5)  # the part that all settings share


def test_spread_of_the_model_widens_the_prior_and_leaves_with_the_first_shot():
    draws = 4.0 * np.random.default_rng(0).standard_normal((2000, 1, 1)) * np.ones(LINES.size)
    plain, wide = Discrepancy(LINES), Discrepancy(LINES).with_spread(draws)
    (setting,) = some(1)

    def variance(prior, shots=(), residual=NOTHING):
        return np.diag(prior.after(shots, residual).covariance_db2(setting))

    assert variance(wide) - variance(plain) == pytest.approx(np.full(LINES.size, 16.0), rel=0.1)
    residual = np.zeros((1, LINES.size))
    assert np.all(variance(wide, [setting], residual) < variance(plain, [setting], residual) + 0.5)


def test_shots_left_out_are_predicted_as_if_they_had_not_been_fired():
    """By the closed form, and by conditioning on the others alone."""
    settings = some(5)
    residual = planted(settings)
    errors, deviations = Discrepancy(LINES).after(settings, residual).left_out()
    for row, new in enumerate(settings):
        others = [i for i in range(5) if i != row]
        learned = Discrepancy(LINES).after([settings[i] for i in others], residual[others])
        assert errors[row] == pytest.approx(residual[row] - learned.mean_db([new])[0], abs=1e-6)
        assert deviations[row] ** 2 == pytest.approx(np.diag(learned.covariance_db2(new)), rel=1e-6)


def test_the_mean_of_repeats_teaches_what_they_do_and_draws_have_the_stated_covariance():
    first, second, new = some(3)
    settings, groups = [first, second, first, first], np.array([4, 7, 4, 4])
    residual = planted(settings)
    alone = Discrepancy(LINES).after(settings, residual)
    means = np.array([residual[groups == 4].mean(axis=0), residual[1]])
    together = ShotCorrection.of(Discrepancy(LINES), Coordinates.of(settings).means(groups), means)
    assert together.mean_db([new]) == pytest.approx(alone.mean_db([new]), abs=1e-5)
    assert together.covariance_db2(new) == pytest.approx(alone.covariance_db2(new), abs=1e-5)
    shots, (new,) = some(3), some(1, seed=9)
    learned = Discrepancy(LINES).after(shots, planted(shots))
    drawn = learned.draws_db([new], np.random.default_rng(0).standard_normal((20_000, LINES.size)))[
        :, 0
    ]
    assert np.cov(drawn.T) == pytest.approx(learned.covariance_db2(new), abs=0.3)


def test_fitting_does_not_lower_the_likelihood_and_finds_what_was_planted():
    true = tuple(replace(t, sd_db=t.sd_db * (0.2 if "colour" in t.name else 1.5)) for t in TERMS)
    settings = some(24, seed=5)
    residual = planted(settings, true, seed=6)
    prior = Discrepancy(LINES)
    found = fitted(prior, settings, residual)

    def log_likelihood(process):
        joint = covariance(process, Coordinates.of(settings))
        return multivariate_normal(np.zeros(len(joint)), joint).logpdf(residual.ravel())

    assert log_likelihood(found) > log_likelihood(prior) + 5
    assert log_likelihood(found) > log_likelihood(Discrepancy(LINES, true)) - 5


def test_few_shots_leave_the_stated_deviations_and_residuals_that_do_not_fit_are_refused():
    settings = some(19)
    assert fitted(Discrepancy(LINES), settings, planted(settings)).terms == TERMS
    with pytest.raises(ValueError, match="residual_db has shape"):
        Discrepancy(LINES).after(some(2), np.zeros((1, LINES.size)))
    with pytest.raises(ValueError, match="finite"):
        Discrepancy(LINES).after(some(1), np.full((1, LINES.size), np.nan))
