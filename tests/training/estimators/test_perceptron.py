"""Networks of rectified linear units against formulas by hand, MLPRegressor and a law they can
hold."""

from __future__ import annotations

import subprocess
import sys
import warnings

import numpy as np
import pytest
import torch
from pyroshock.training.estimators.network import (
    Network,
    Objective,
    as_vector,
    glorot_layers,
    layers_in,
    outputs_of,
    train_network,
)
from pyroshock.training.models.catalogue import BuildOptions, entry_of
from pyroshock.training.models.serialization import describe
from sklearn.neural_network import MLPRegressor
from support.checks.estimator_checks import fitted, known_law

SIZES = (4, 6, 5, 3)


def rows(n: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    x = rng.standard_normal((n, 4))
    return x, np.stack([np.sin(x[:, 0]), np.abs(x[:, 1]), x[:, 2] * x[:, 3]], axis=1)


def standard_rows(n: int) -> tuple[np.ndarray, np.ndarray]:
    x, y = rows(n)
    return (x - x.mean(0)) / x.std(0), (y - y.mean(0)) / y.std(0)


@pytest.mark.parametrize("penalty", [0.0, 0.1])
def test_value_and_gradient_are_those_of_pytorch(penalty: float) -> None:
    layers = glorot_layers(SIZES, np.random.default_rng(1))
    x, y = rows(30)
    leaves = [torch.tensor(array, requires_grad=True) for layer in layers for array in layer]
    error = torch.tensor(x)
    for number in range(0, len(leaves), 2):
        error = error @ leaves[number] + leaves[number + 1]
        error = torch.relu(error) if number < len(leaves) - 2 else error - torch.tensor(y)
    expected = 0.5 * (error**2).mean() + 0.5 * penalty * sum((w**2).sum() for w in leaves[::2])
    expected.backward()
    value, gradient = Objective(x, y, SIZES, penalty)(as_vector(layers))
    assert value == pytest.approx(expected.item(), rel=1e-6)
    slopes = np.concatenate([leaf.grad.numpy().ravel() for leaf in leaves])
    np.testing.assert_allclose(gradient, slopes, rtol=1e-5, atol=1e-7)


def test_objective_is_half_the_mean_square_and_the_weights() -> None:
    layers = glorot_layers((4, 2, 3), np.random.default_rng(1))
    x, y = rows(30)
    (w1, b1), (w2, b2) = layers
    error = np.maximum(x @ w1 + b1, 0) @ w2 + b2 - y
    expected = 0.5 * (error**2).mean() + 0.05 * ((w1**2).sum() + (w2**2).sum())
    value, _ = Objective(x, y, (4, 2, 3), 0.1)(as_vector(layers))
    assert value == pytest.approx(expected, rel=1e-6)
    np.testing.assert_allclose(outputs_of(layers, x), error + y, rtol=1e-12, atol=1e-12)


def test_start_is_glorots() -> None:
    (weights, biases), _ = glorot_layers((50, 70, 2), np.random.default_rng(0))
    assert np.abs(weights).max() == pytest.approx(np.sqrt(6 / 120), rel=1e-2)
    assert weights.std() == pytest.approx(np.sqrt(2 / 120), rel=0.03)
    assert 0.9 * np.sqrt(6 / 120) < np.abs(biases).max() < np.sqrt(6 / 120)
    layers = layers_in(as_vector(glorot_layers(SIZES, np.random.default_rng(3))), SIZES)
    for layer, expected in zip(layers, glorot_layers(SIZES, np.random.default_rng(3)), strict=True):
        np.testing.assert_array_equal(layer[0], expected[0])
        np.testing.assert_array_equal(layer[1], expected[1])


def test_loss_is_recorded_and_falls_until_nothing_is_gained() -> None:
    network = train_network(*standard_rows(80), (4, 6, 3), 1e-3, 70, np.random.default_rng(0))
    assert network.iterations == 70
    assert len(network.losses) == 5  # at the start, after 20, 40, 60 and 70
    assert list(network.losses) == sorted(network.losses, reverse=True)
    assert network.losses[-1] < 0.5 * network.losses[0]
    x = np.zeros((20, 4))  # only the last biases matter
    network = train_network(x, x[:, :3], (4, 6, 3), 0.0, 1000, np.random.default_rng(0))
    assert network.iterations < 30
    network = train_network(*standard_rows(20), SIZES, 0.0, 0, np.random.default_rng(5))
    np.testing.assert_array_equal(
        network.layers[0][0], glorot_layers(SIZES, np.random.default_rng(5))[0][0]
    )


def test_report_tells_sizes_and_losses() -> None:
    network = fitted(Network((7, 5), 1e-3, iterations=30))
    report = network.fit_report()
    assert report.settings["layers"] == 2
    assert report.settings["neurons"] == "7-5"
    assert report.settings["activation"] == "relu"
    assert report.settings["regularisation"] == 1e-3
    assert report.settings["iterations"] == 30
    assert len(report.histories["loss"]) == 3
    restored = Network((7, 5), 1e-3, iterations=30).restore(network.arrays()).fit_report()
    assert restored.settings["neurons"] == "7-5"
    assert not restored.histories


def test_holds_a_law_of_its_own_kind() -> None:
    # |x| is two rectified units.
    x = np.linspace(-1, 1, 200)[:, None]
    y = np.abs(x)
    network = Network(layers=(8,)).fit(x, y, np.arange(200), np.random.default_rng(0))
    np.testing.assert_allclose(network.predict(x).mean, y, atol=0.01)
    # Whatever it is asked with later: nothing is known of its effect.
    learned, new_inputs = known_law()
    x = learned.x.copy()
    x[:, 3] = 1234.5
    network = Network((10,), iterations=50).fit(
        x, learned.y, learned.groups, np.random.default_rng(0)
    )
    other = new_inputs.x.copy()
    other[:, 3] = 1e9
    unseen = new_inputs.x.copy()
    unseen[:, 3] = 1234.5
    np.testing.assert_array_equal(network.predict(other).mean, network.predict(unseen).mean)


def test_penalty_shrinks_weights() -> None:
    squares = []
    for penalty in (0.0, 1e-3, 1e-1):
        arrays = fitted(Network((20,), penalty, iterations=150)).arrays()
        squares.append(sum(float(np.sum(arrays[f"weights_{i}"] ** 2)) for i in (1, 2)))
    assert squares == sorted(squares, reverse=True)
    assert squares[2] < 0.1 * squares[0]


def test_fits_as_well_as_mlp_regressor() -> None:
    """The same objective, size and number of steps; the median over five starts within a tenth."""
    x, y = standard_rows(300)
    ours, theirs = [], []
    for seed in range(5):
        network = train_network(x, y, (4, 20, 3), 0.0, 150, np.random.default_rng(seed))
        ours.append(np.mean((outputs_of(network.layers, x) - y) ** 2))
        peer = MLPRegressor(
            hidden_layer_sizes=(20,), solver="lbfgs", alpha=0.0, max_iter=150, random_state=seed
        )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that it could have gone on
            theirs.append(np.mean((peer.fit(x, y).predict(x) - y) ** 2))
    assert np.median(ours) < 1.1 * np.median(theirs)


def test_learns_and_predicts_without_pytorch() -> None:
    """Neither importing nor training nor asking a restored network loads it."""
    script = (
        "import sys, numpy as np; from pyroshock.training.estimators.network import Network\n"
        "arrays = dict(x_mean=np.zeros(1), x_width=np.ones(1), y_mean=np.zeros(1), "
        "y_width=np.ones(1), weights_1=np.ones((1, 1)), biases_1=np.zeros((1, 1)), "
        "weights_2=np.ones((1, 1)), biases_2=np.ones((1, 1)))\n"
        "answer = Network((1,)).restore(arrays).predict(np.array([[2.0], [-2.0]])).mean\n"
        "assert answer.tolist() == [[3.0], [1.0]], answer\n"
        "x = np.linspace(0, 1, 9)[:, None]\n"
        "Network((2,), iterations=3).fit(x, x, np.arange(9), np.random.default_rng(0))\n"
        "sys.exit('torch' in sys.modules)"
    )
    subprocess.run([sys.executable, "-c", script], check=True)


@pytest.mark.parametrize("layers", [(), (0,), (10, -1)])
def test_network_without_neurons_is_refused(layers: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="neuron"):
        Network(layers)


def test_presets_are_those_of_the_table() -> None:
    layers = {
        name: describe(entry_of(name).make(BuildOptions()))["settings"]["model"]["settings"][
            "force"
        ]["settings"]["layers"]
        for name in ("nn-narrow", "nn-medium", "nn-wide", "nn-bilayer", "nn-trilayer")
    }
    assert list(layers.values()) == [[10], [25], [100], [10, 10], [10, 10, 10]]
    with pytest.raises(ValueError, match="shape"):
        Network((11,)).restore(fitted(Network((10,), iterations=1)).arrays())
