"""What is compared by `benchmarks.by_hand` gives the same numbers."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("gpytorch", reason="the extra [models] is not installed")

from benchmarks import by_hand


def test_folds_left_out_are_the_same_each_way():
    means = [way() for way in by_hand.left_out(60).values()]
    assert len(means) == 3 and np.ptp(means[0]) > 0.1
    np.testing.assert_allclose(means, [means[0]] * 3, atol=1e-8)


def test_likelihoods_are_the_same_with_and_without_pytorch():
    alone, model = (way() for way in by_hand.likelihoods(30).values())
    assert alone == pytest.approx(model, abs=1e-6)


def test_kernels_have_the_same_derivatives():
    ours, theirs = (way() for way in by_hand.kernels(30).values())
    assert ours.shape == (1, 13) and np.abs(ours).max() > 1e-3
    np.testing.assert_allclose(ours, theirs, atol=1e-9)


def test_another_number_ends_the_run():
    with pytest.raises(ValueError, match="a sum: theirs gives other numbers"):
        by_hand.printed("a sum", {"ours": lambda: 1.0, "theirs": lambda: 1.1}, 1, 0.01)


def test_runs_of_the_smallest_designs():
    assert "7 factors of resolution 3: 8 runs, pyDOE3 16" in by_hand.fewest_runs()
