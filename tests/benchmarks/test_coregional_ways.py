"""Ways of computing a coregional process: the same numbers as a plain dense Gaussian process."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.training.gp.kernels import kernel_matrix

from benchmarks import coregional, coregional_peers
from benchmarks.coregional_ways import Way, new_pulses, ours_predicts, parameters, plain, pulses, written

# Importing it warns; a test that imports it first would fail by that.
pytest.importorskip("gpytorch", reason="the extra [models] is not installed")

N, ASKED = 12, 3


def dense() -> tuple[float, np.ndarray, np.ndarray]:
    """Loss, means and standard deviations by one factorisation of everything."""
    (x, y), at = pulses(N), parameters()
    a, new = x / at.lengthscales, new_pulses(ASKED) / at.lengthscales
    full = np.kron(kernel_matrix("rbf", a, a), at.b) + np.kron(np.eye(N), np.diag(at.noise))
    values = y.ravel()
    loss = 0.5 * (values @ np.linalg.solve(full, values) + np.linalg.slogdet(full)[1] + values.size * np.log(2 * np.pi))
    across = np.kron(kernel_matrix("rbf", new, a), at.b)
    mean = across @ np.linalg.solve(full, values)
    own = np.kron(np.ones(ASKED), np.diag(at.b) + at.noise)
    variance = own - np.einsum("ij,ji->i", across, np.linalg.solve(full, across.T))
    return float(loss), mean.reshape(ASKED, -1), np.sqrt(variance).reshape(ASKED, -1)


@pytest.mark.parametrize("way", [coregional_peers.ours, plain, coregional_peers.gpytorch])
def test_likelihoods_are_the_dense_ones(way):
    assert way(N)() == pytest.approx(dense()[0], abs=1e-4)


@pytest.mark.parametrize("way", [ours_predicts, coregional_peers.gpytorch_predicts])
def test_predictions_are_the_dense_ones(way):
    mean, spread = way(N, ASKED)()
    np.testing.assert_allclose(mean, dense()[1], atol=1e-5)
    np.testing.assert_allclose(spread, dense()[2], atol=1e-5)


def test_a_way_answers_with_its_value_and_seconds():
    told = Way("pyroshock").answer({"what": "likelihood", "n": N})
    assert told["value"] == pytest.approx(dense()[0], abs=1e-4)
    assert told["seconds"] > 0 and told["peak_bytes"] > 1e6


def test_pulses_for_others_are_the_same(tmp_path):
    kept = np.load(written(tmp_path / "pulses.npz", N, ASKED))
    np.testing.assert_array_equal(kept["x"], pulses(N)[0])
    np.testing.assert_array_equal(kept["loadings"], parameters().loadings)


def test_another_likelihood_is_no_race():
    with pytest.raises(ValueError, match="somebody"):
        coregional._agree({coregional.OURS: [1.0], "somebody": [1.1]}, 0.01)
