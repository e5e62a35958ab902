"""Networks of rectified linear units, the five sizes of the thesis's Table 4.5 and any other.

Training minimises half the mean squared error over rows and outputs plus `penalty` / 2 times the
sum of the squared weights, as MATLAB's `fitrnet` does up to its factors; biases are free. The
gradient is computed in single precision: a network's own error is a thousand times its rounding,
and half the bytes are half the seconds. Each network has an L-BFGS of its own: one problem of all
folds under one L-BFGS is less accurate in the same time (docs/decisions/0022). SciPy's steps and a
gradient in NumPy take a fifth to a half of the time of PyTorch's (docs/decisions/0028).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ...parallel.task import one_thread
from .base import (
    STANDARDS,
    FitReport,
    Gaussian,
    LearnedArrays,
    SettingValue,
    Shape,
    Standard,
    standard_arrays,
    standard_of,
)

#: Weights (inputs x outputs) and biases (1 x outputs).
Layer = tuple[Floats, Floats]
#: Predictors, neurons of each hidden layer, outputs.
Sizes = tuple[int, ...]

OPTIMISER = "scipy.optimize.minimize, L-BFGS-B"
#: Between two entries of the loss history.
ITERATIONS_PER_ENTRY = 20
#: Training ends once an entry gains less than this share of the loss.
LEAST_GAIN = 1e-4


@dataclass(frozen=True, eq=False)
class TrainedNetwork:
    """`layers` from the first hidden one on; `losses` at the start, then after every 20 iterations
    and the last."""

    layers: list[Layer]
    losses: tuple[float, ...]
    iterations: int


def outputs_of(layers: Sequence[Layer], z: Floats) -> Floats:
    """Outputs (n x m) of a network at standardised inputs (n x d)."""
    for weights, biases in layers[:-1]:
        z = np.maximum(z @ weights + biases, 0.0)
    weights, biases = layers[-1]
    return z @ weights + biases


def glorot_layers(sizes: Sizes, rng: np.random.Generator) -> list[Layer]:
    """Weights of Glorot and Bengio (AISTATS 2010), biases within the same limits.

    With biases of 0 one network of ten with three layers of ten neurons came to three times the
    error of the others.
    """
    layers = list[Layer]()
    for inputs, outputs in pairwise(sizes):
        limit = np.sqrt(6 / (inputs + outputs))
        weights = rng.uniform(-limit, limit, (inputs, outputs))
        layers.append((weights, rng.uniform(-limit, limit, (1, outputs))))
    return layers


def as_vector(layers: Sequence[Layer]) -> Floats:
    """All weights and biases in one array, layer by layer."""
    return np.concatenate([array.ravel() for layer in layers for array in layer])


def layers_in(vector: NDArray[Any], sizes: Sizes) -> list[tuple[NDArray[Any], NDArray[Any]]]:
    """Views of the weights and biases of `as_vector`."""
    layers, begin = [], 0
    for inputs, outputs in pairwise(sizes):
        end = begin + inputs * outputs
        weights = vector[begin:end].reshape(inputs, outputs)
        layers.append((weights, vector[end : end + outputs].reshape(1, outputs)))
        begin = end + outputs
    return layers


class Objective:
    """Half the mean squared error of standardised rows (n x d, n x m), and the penalty of the
    weights, with the gradient by backpropagation.

    The arrays of all layers are allocated once: an evaluation of a small network takes as long as
    its calls of NumPy.
    """

    def __init__(self, x: Floats, y: Floats, sizes: Sizes, penalty: float) -> None:
        self._y = np.ascontiguousarray(y, dtype=np.float32)
        self._penalty = penalty
        length = sum((inputs + 1) * outputs for inputs, outputs in pairwise(sizes))
        self._vector = np.empty(length, dtype=np.float32)
        self._slopes = np.empty(length, dtype=np.float32)
        self._layers = layers_in(self._vector, sizes)
        self._layer_slopes = layers_in(self._slopes, sizes)
        self._ones = np.ones((1, len(x)), dtype=np.float32)
        # What each layer receives, and at last the outputs.
        self._received = [np.ascontiguousarray(x, dtype=np.float32)] + [
            np.empty((len(x), size), dtype=np.float32) for size in sizes[1:]
        ]
        self._errors = [np.empty_like(values) for values in self._received[:-1]]
        self._active = [np.empty(values.shape, dtype=bool) for values in self._received[:-1]]

    def __call__(self, vector: Floats) -> tuple[float, Floats]:
        """The value at weights and biases as of `as_vector`, and its gradient."""
        self._vector[:] = vector
        self._forward()
        error = self._received[-1]
        error -= self._y
        value = 0.5 * float(np.vdot(error, error)) / error.size
        error /= np.float32(error.size)
        self._backward(error)
        if self._penalty:
            value += self._add_penalty()
        return value, self._slopes.astype(np.float64)

    def _forward(self) -> None:
        for number, (weights, biases) in enumerate(self._layers, start=1):
            values = np.matmul(self._received[number - 1], weights, out=self._received[number])
            values += biases
            if number < len(self._layers):
                np.maximum(values, 0.0, out=values)

    def _backward(self, error: NDArray[np.float32]) -> None:
        """From the slope of the value by the outputs to those by all weights and biases."""
        for number in reversed(range(len(self._layers))):
            received = self._received[number]
            by_weights, by_biases = self._layer_slopes[number]
            np.matmul(received.T, error, out=by_weights)
            np.matmul(self._ones, error, out=by_biases)
            if number:
                error = np.matmul(error, self._layers[number][0].T, out=self._errors[number])
                error *= np.greater(received, 0.0, out=self._active[number])

    def _add_penalty(self) -> float:
        """Its value; its gradient is added to that of the error."""
        value = 0.0
        for (weights, _), (by_weights, _) in zip(self._layers, self._layer_slopes, strict=True):
            by_weights += np.float32(self._penalty) * weights
            value += 0.5 * self._penalty * float(np.vdot(weights, weights))
        return value


def train_network(
    x: Floats, y: Floats, sizes: Sizes, penalty: float, iterations: int, rng: np.random.Generator
) -> TrainedNetwork:
    """A network that has learned standardised rows (n x d, n x m).

    The sums are the same on any machine load where the caller keeps NumPy to one thread, as
    `parallel.task.one_thread` does.
    """
    from scipy.optimize import OptimizeResult, minimize

    objective, start = Objective(x, y, sizes, penalty), as_vector(glorot_layers(sizes, rng))
    losses, count = [objective(start)[0]], 0

    def record(intermediate_result: OptimizeResult) -> None:
        nonlocal count
        count += 1
        if count % ITERATIONS_PER_ENTRY == 0:
            losses.append(float(intermediate_result.fun))
            if losses[-2] - losses[-1] < LEAST_GAIN * losses[-1]:
                raise StopIteration

    if not iterations:
        return TrainedNetwork(layers_in(start, sizes), (losses[0], losses[0]), 0)
    options: dict[str, Any] = {
        "maxiter": iterations, "maxfun": 2 * iterations, "maxcor": 10, "ftol": 0.0, "gtol": 1e-7,
    }  # fmt: skip
    result = minimize(  # type: ignore[call-overload]
        objective, start, jac=True, method="L-BFGS-B", callback=record, options=options
    )
    if count % ITERATIONS_PER_ENTRY:
        losses.append(float(result.fun))
    return TrainedNetwork(layers_in(result.x, sizes), tuple(losses), count)


class Network(LearnedArrays):
    """Hidden layers of `layers` neurons; `penalty` is lambda for standardised rows.

    At most `iterations` of L-BFGS over all rows, as MATLAB's `fitrnet`. No spread: the errors on
    the rows it learned from flatter it, and nothing else in it tells how far it is off.
    """

    kind = "network"
    losses_: tuple[float, ...] = ()
    iterations_ = 0

    def __init__(
        self, layers: Sequence[int] = (10,), penalty: float = 0.0, iterations: int = 1000
    ) -> None:
        if not layers or min(layers) < 1:
            raise ValueError(
                f"a network needs a neuron in each hidden "
                f"layer, and one layer at least, not {layers}"
            )
        self.layers, self.penalty, self.iterations = (
            tuple(int(size) for size in layers),
            penalty,
            iterations,
        )

    def settings(self) -> dict[str, Any]:
        return {"layers": list(self.layers), "penalty": self.penalty, "iterations": self.iterations}

    def shapes(self) -> Mapping[str, Shape]:
        sizes: list[int | str] = ["d", *self.layers, "m"]
        shapes = dict(STANDARDS)
        for layer in range(1, len(sizes)):
            shapes[f"weights_{layer}"] = (sizes[layer - 1], sizes[layer])
            shapes[f"biases_{layer}"] = (1, sizes[layer])
        return shapes

    def fit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:  # noqa: ARG002
        sizes = (x.shape[1], *self.layers, y.shape[1])
        inputs, outputs = Standard.of(x), Standard.of(y)
        with one_thread():
            network = train_network(
                inputs.apply(x), outputs.apply(y), sizes, self.penalty, self.iterations, rng
            )
        self.losses_, self.iterations_ = network.losses, network.iterations
        arrays = standard_arrays(inputs, outputs)
        for number, (weights, biases) in enumerate(network.layers, start=1):
            arrays |= {f"weights_{number}": weights, f"biases_{number}": biases}
        return self.restore(arrays)

    def fit_report(self) -> FitReport:
        """The loss at the start, then after every 20 iterations and the last; of standardised
        rows."""
        settings: dict[str, SettingValue] = {
            "layers": len(self.layers),
            "neurons": "-".join(map(str, self.layers)),
            "activation": "relu",
            "regularisation": self.penalty,
            "optimiser": OPTIMISER,
            "iterations": self.iterations_ or self.iterations,
        }
        return FitReport(settings, histories={"loss": self.losses_} if self.losses_ else {})

    def predict(self, x: Floats) -> Gaussian:
        learned = self._learned()
        inputs, outputs = standard_of(learned, "x"), standard_of(learned, "y")
        layers = [
            (learned[f"weights_{i}"], learned[f"biases_{i}"])
            for i in range(1, len(self.layers) + 2)
        ]
        scaled_inputs = inputs.apply(self._asked(x, len(inputs.mean)))
        return Gaussian(outputs.undo(outputs_of(layers, scaled_inputs)), None)
