"""The exact process against dense textbook formulas, and its training by GPyTorch against the
normal density."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.training.estimators import exact_process
from pyroshock.training.estimators.exact_process import PRIOR, Process, inverse, leave_folds_out
from scipy.stats import multivariate_normal

RNG = np.random.default_rng(11)
Z = RNG.standard_normal((40, 3))
H = np.hstack([np.ones((40, 1)), Z])
Y = np.sin(Z[:, 0]) + 0.3 * Z[:, 1] + 0.1 * RNG.standard_normal(40)


def process(kernel: str, noise: float = 0.2) -> Process:
    return Process(kernel, np.array([0.7, 1.5, 3.0]), 1.3, noise)


def dense(of: Process) -> np.ndarray:
    return of.between(Z, H, Z, H) + of.noise**2 * np.eye(len(Z))


def test_rbf_is_the_textbook_one() -> None:
    of = process("rbf")
    distance = np.sum(((Z[0] - Z[1]) / of.lengthscales) ** 2)
    assert dense(of)[0, 1] == pytest.approx(1.69 * np.exp(-distance / 2) + PRIOR * H[0] @ H[1])
    twice = np.vstack([Z, Z])
    with pytest.raises(ValueError, match="'rbf' is not positive definite: raise the noise"):
        process("rbf", noise=0.0).factor(twice, twice[:, :0])


def density(of: Process) -> float:
    """The negative logarithm of the normal density of Y, per row."""
    return -float(multivariate_normal.logpdf(Y, cov=dense(of))) / len(Y)


@pytest.mark.parametrize("kernel", ["rbf", "matern32", "matern52", "rational-quadratic"])
@pytest.mark.parametrize("ard", [True, False])
def test_the_first_loss_is_the_normal_density(kernel: str, ard: bool) -> None:
    of = process(kernel) if ard else Process(kernel, np.full(3, 1.5), 1.3, 0.2)
    _, losses = exact_process.most_likely(of, Z, H, Y, ard, 0.01, 1)
    assert losses[0] == pytest.approx(density(of), rel=1e-9)


@pytest.mark.parametrize("columns", [0, 1, 4], ids=["zero", "constant", "linear"])
def test_leave_folds_out_is_brute_force(columns: int) -> None:
    h = H[:, :columns]
    of = process("matern52")
    folds = [np.arange(40) % 5 == fold for fold in range(5)]
    brute = np.empty(40)
    for fold in folds:
        lower = of.factor(Z[~fold], h[~fold])
        weights = np.linalg.solve(lower @ lower.T, Y[~fold])
        brute[fold] = of.between(Z[fold], h[fold], Z[~fold], h[~fold]) @ weights
    fast = leave_folds_out(inverse(of.factor(Z, h)), Y, folds)
    np.testing.assert_allclose(fast, brute, rtol=1e-8, atol=1e-9)


def test_likelihood_does_not_fall() -> None:
    start = process("rbf")
    for ard in (True, False):
        same = Process("rbf", np.full(3, 1.0), 1.0, 0.3) if not ard else start
        found, losses = exact_process.most_likely(same, Z, H, Y, ard, 0.01, 40)
        assert density(found) < density(same) - 0.05
        assert density(found) == pytest.approx(losses.min(), abs=1e-6)
        assert len(set(found.lengthscales)) == (3 if ard else 1)
    found, _ = exact_process.most_likely(process("rbf"), Z, H, 2 * Z[:, 0], True, 0.05, 40)
    assert found.noise == pytest.approx(0.05)
