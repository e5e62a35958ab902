"""Networks of rectified linear units against automatic differentiation, MLPRegressor and a law they can hold."""

from __future__ import annotations

import subprocess
import sys
import warnings
from itertools import pairwise

import numpy as np
import pytest
import torch
from pyroshock.training.estimators.network import PRESETS, Network
from pyroshock.training.estimators.perceptron import _Errors, _layers, answers, one_thread, started, trained
from sklearn.neural_network import MLPRegressor
from support.checks.estimator_checks import fitted, known_law

SIZES = (4, 6, 5, 3)


def rows(n: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    x = rng.standard_normal((n, 4))
    return x, np.stack([np.sin(x[:, 0]), np.abs(x[:, 1]), x[:, 2] * x[:, 3]], axis=1)


def test_gradient_is_that_of_autograd() -> None:
    x, y = (torch.tensor(np.stack([part, part + 1])) for part in rows(30))
    weight = torch.rand(2, 30, 1, dtype=torch.float64)
    start = np.stack([started(SIZES, np.random.default_rng(seed)) for seed in (1, 2)]).astype(np.float64)
    w = torch.tensor(start).requires_grad_()
    expected = torch.zeros(2, dtype=torch.float64)
    for network in range(2):
        z, at = x[network], 0
        for i, (a, b) in enumerate(pairwise(SIZES)):
            weights = w[network, at : at + a * b].reshape(a, b)
            z = z @ weights + w[network, at + a * b : at + a * b + b]
            z = torch.relu(z) if i < 2 else z
            expected[network] = expected[network] + 0.05 * (weights**2).sum()
            at += a * b + b
        expected[network] = expected[network] + 0.5 * (weight[network] * (z - y[network]) ** 2).sum()
    (slope,) = torch.autograd.grad(expected.sum(), w)
    value, gradient = _Errors(x, y, weight, SIZES, 0.1)(w.detach())
    torch.testing.assert_close(value, expected.detach())
    torch.testing.assert_close(gradient, slope)


def test_numpy_answers_as_pytorch_does() -> None:
    vector = started(SIZES, np.random.default_rng(3)).astype(np.float64)
    (w1, b1), (w2, b2), (w3, b3) = (map(torch.tensor, layer) for layer in _layers(vector, SIZES))
    z = torch.tensor(rows(9)[0])
    expected = torch.relu(torch.relu(z @ w1 + b1) @ w2 + b2) @ w3 + b3
    np.testing.assert_allclose(answers(_layers(vector, SIZES), z.numpy()), expected.numpy(), rtol=1e-12, atol=1e-12)


def test_start_is_glorots() -> None:
    (weights, biases), _ = _layers(started((50, 70, 2), np.random.default_rng(0)).astype(float), (50, 70, 2))
    assert np.abs(weights).max() == pytest.approx(np.sqrt(6 / 120), rel=1e-2)
    assert weights.std() == pytest.approx(np.sqrt(2 / 120), rel=0.03)
    assert not biases.any()


def test_networks_side_by_side_do_not_touch() -> None:
    """Also where one has fewer rows: what fills them up weighs nothing."""
    first, second = rows(60, 1), rows(45, 2)
    starts = [started(SIZES, np.random.default_rng(seed)) for seed in (1, 2)]
    together = trained([first, second], starts, SIZES, 1e-3, 15)
    for one, (own, start) in enumerate(zip((first, second), starts, strict=True)):
        (alone,) = trained([own], [start], SIZES, 1e-3, 15)
        np.testing.assert_allclose(answers(together[one], own[0]), answers(alone, own[0]), atol=2e-3)


def test_holds_a_law_of_its_own_kind() -> None:
    """|x| is two rectified units."""
    x = np.linspace(-1, 1, 200)[:, None]
    y = np.abs(x)
    network = Network(layers=(8,)).fit(x, y, np.arange(200), np.random.default_rng(0))
    np.testing.assert_allclose(network.predict(x).mean, y, atol=0.01)


def test_penalty_shrinks_weights() -> None:
    squares = []
    for penalty in (0.0, 1e-3, 1e-1):
        arrays = fitted(Network((20,), penalty, iterations=150)).arrays()
        squares.append(sum(float(np.sum(arrays[f"weights_{i}"] ** 2)) for i in (1, 2)))
    assert squares == sorted(squares, reverse=True)
    assert squares[2] < 0.1 * squares[0]


def test_fits_as_well_as_mlp_regressor() -> None:
    """The same objective, size and number of steps; the median over five starts within a tenth."""
    x, y = rows(300)
    x, y = (x - x.mean(0)) / x.std(0), (y - y.mean(0)) / y.std(0)
    ours, theirs = [], []
    for seed in range(5):
        start = started((4, 20, 3), np.random.default_rng(seed))
        (network,) = trained([(x, y)], [start], (4, 20, 3), 0.0, 150)
        ours.append(np.mean((answers(network, x) - y) ** 2))
        peer = MLPRegressor(hidden_layer_sizes=(20,), solver="lbfgs", alpha=0.0, max_iter=150, random_state=seed)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that it could have gone on
            theirs.append(np.mean((peer.fit(x, y).predict(x) - y) ** 2))
    assert np.median(ours) < 1.1 * np.median(theirs)


def test_threads_are_given_back() -> None:
    before = torch.get_num_threads()
    with one_thread():
        assert torch.get_num_threads() == 1
    assert torch.get_num_threads() == before


def test_predicts_without_pytorch() -> None:
    """Neither importing nor asking a restored network loads it."""
    script = (
        "import sys, numpy as np; from pyroshock.training.estimators.network import Network\n"
        "arrays = dict(x_mean=np.zeros(1), x_width=np.ones(1), y_mean=np.zeros(1), y_width=np.ones(1),"
        " weights_1=np.ones((1, 1)), biases_1=np.zeros((1, 1)), weights_2=np.ones((1, 1)), biases_2=np.ones((1, 1)))\n"
        "answer = Network((1,)).restore(arrays).predict(np.array([[2.0], [-2.0]])).mean\n"
        "assert answer.tolist() == [[3.0], [1.0]], answer\n"
        "sys.exit('torch' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", script], check=True)


@pytest.mark.parametrize("layers", [(), (0,), (10, -1)])
def test_network_without_neurons_is_refused(layers: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="neuron"):
        Network(layers)


def test_weights_of_another_size_are_refused() -> None:
    with pytest.raises(ValueError, match="shape"):
        Network((11,)).restore(fitted(Network((10,), iterations=1)).arrays())


def test_presets_are_those_of_the_table() -> None:
    assert list(PRESETS) == ["narrow", "medium", "wide", "bilayered", "trilayered"]
    assert all(
        fitted(Network(layers, iterations=1)).settings()["layers"] == list(layers) for layers in PRESETS.values()
    )


def test_predictor_that_never_varied_is_ignored() -> None:
    """Whatever it is asked with later: nothing is known of its effect."""
    learned, asked = known_law()
    x = learned.x.copy()
    x[:, 3] = 1234.5
    network = Network((10,), iterations=50).fit(x, learned.y, learned.groups, np.random.default_rng(0))
    other = asked.x.copy()
    other[:, 3] = 1e9
    unseen = asked.x.copy()
    unseen[:, 3] = 1234.5
    np.testing.assert_array_equal(network.predict(other).mean, network.predict(unseen).mean)
