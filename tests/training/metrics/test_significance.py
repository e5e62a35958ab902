"""p-values."""

from __future__ import annotations

import numpy as np
from pyroshock.training.evaluation.summary import Clusters, clustered, holm, sign_flip_p
from scipy.stats import permutation_test


def of(sums: list[float]) -> Clusters:
    return clustered(np.array(sums)[:, None], np.arange(len(sums)))


def test_four_of_one_sign_by_hand() -> None:
    """Of 16 combinations of signs, two reach a sum as great."""
    assert sign_flip_p(of([1.0, 2.0, 3.0, 4.0]), np.random.default_rng(0))[0] == 2 / 16


def test_nothing_differs() -> None:
    assert sign_flip_p(of([0.0] * 30), np.random.default_rng(0))[0] == 1.0


def test_random_signs_agree_with_scipys() -> None:
    sums = np.random.default_rng(3).normal(0.3, 1.0, 40)
    ours = sign_flip_p(of(list(sums)), np.random.default_rng(0), 20000)[0]
    peer = permutation_test((sums,), np.sum, permutation_type="samples", n_resamples=20000, rng=1)
    assert abs(ours - peer.pvalue) < 5 * np.sqrt(2 * ours * (1 - ours) / 20000)


def test_holm_by_hand() -> None:
    assert np.allclose(holm(np.array([0.04, 0.01, 0.03, 0.5])), [0.09, 0.04, 0.09, 0.5])


def test_holm_never_exceeds_one() -> None:
    assert np.array_equal(holm(np.array([0.6, 0.9])), [1.0, 1.0])
