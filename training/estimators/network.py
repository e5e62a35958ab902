"""Networks of rectified linear units, the five sizes of the thesis's Table 4.5 and any other.

Networks of rectified linear units: modules of PyTorch while they are trained, arrays once they
predict.

Training minimises half the mean squared error over rows and outputs plus `penalty` / 2 times the
sum of the squared weights, as MATLAB's `fitrnet` does up to its factors; biases are free. Single
precision: a network's own error is a thousand times its rounding, and half the bytes are half the
seconds. Each network has an L-BFGS of its own: one problem of all folds, stacked by `torch.func`
under one L-BFGS or under Adam, is less accurate in the same time (docs/decisions/0022).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
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

if TYPE_CHECKING:
    from torch import Tensor
    from torch.nn import Sequential


#: Weights (inputs x outputs) and biases (1 x outputs).
Layer = tuple[Floats, Floats]
#: Predictors, neurons of each hidden layer, outputs.
Sizes = tuple[int, ...]

OPTIMISER = "torch.optim.LBFGS, strong Wolfe line search"
#: Between two entries of the loss history. The optimiser evaluates the loss once more at the
#: beginning of each.
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
    """Outputs (n x m) of a network at standardised inputs (n x d), by numpy: PyTorch takes 2 s to
    import."""
    for weights, biases in layers[:-1]:
        z = np.maximum(z @ weights + biases, 0.0)
    weights, biases = layers[-1]
    return z @ weights + biases


def glorot_module(sizes: Sizes, rng: np.random.Generator) -> Sequential:
    """Weights of Glorot and Bengio (AISTATS 2010), biases within the same limits; from `rng` alone.

    With biases of 0 one network of ten with three layers of ten neurons came to three times the
    error of the others.
    """
    import torch

    modules: list[torch.nn.Module] = []
    for inputs, outputs in pairwise(sizes):
        limit = np.sqrt(6 / (inputs + outputs))
        linear = torch.nn.utils.skip_init(torch.nn.Linear, inputs, outputs)
        with torch.no_grad():
            linear.weight.copy_(torch.tensor(rng.uniform(-limit, limit, (inputs, outputs)).T))
            linear.bias.copy_(torch.tensor(rng.uniform(-limit, limit, outputs)))
        modules += [linear, torch.nn.ReLU()]
    return torch.nn.Sequential(*modules[:-1])


def objective(module: Sequential, x: Tensor, y: Tensor, penalty: float) -> Tensor:
    """Half the mean squared error, and the penalty of the weights."""
    import torch

    loss = 0.5 * torch.nn.functional.mse_loss(module(x), y)
    if penalty:
        loss = loss + 0.5 * penalty * sum(
            w.square().sum() for w in module.parameters() if w.ndim == 2
        )
    return loss


def train_network(
    x: Floats, y: Floats, sizes: Sizes, penalty: float, iterations: int, rng: np.random.Generator
) -> TrainedNetwork:
    """A network that has learned standardised rows (n x d, n x m). One thread: the same numbers on
    any machine load."""
    import torch

    with one_thread():
        module = glorot_module(sizes, rng)
        inputs, targets = (torch.tensor(rows, dtype=torch.float32) for rows in (x, y))
        parameters = list(module.parameters())
        optimiser = torch.optim.LBFGS(parameters, history_size=10, line_search_fn="strong_wolfe")

        def closure() -> Tensor:
            loss = objective(module, inputs, targets, penalty)
            for parameter, slope in zip(
                parameters, torch.autograd.grad(loss, parameters), strict=True
            ):
                parameter.grad = slope
            return loss.detach()

        losses, before = list[float](), 0
        group = optimiser.param_groups[0]
        while before < iterations:
            group["max_iter"] = min(ITERATIONS_PER_ENTRY, iterations - before)
            group["max_eval"] = 2 * group["max_iter"]
            losses.append(float(optimiser.step(closure)))
            after = int(optimiser.state[parameters[0]]["n_iter"])
            stopped = len(losses) > 1 and losses[-2] - losses[-1] < LEAST_GAIN * losses[-1]
            before, unchanged = after, after == before
            if stopped or unchanged:
                break
        with torch.no_grad():
            losses.append(float(objective(module, inputs, targets, penalty)))
        return TrainedNetwork(_layers(module), tuple(losses), before)


def _layers(module: Sequential) -> list[Layer]:
    arrays = [parameter.detach().double().numpy() for parameter in module.parameters()]
    return [
        (weights.T.copy(), biases[None, :])
        for weights, biases in zip(arrays[::2], arrays[1::2], strict=True)
    ]


@contextmanager
def one_thread() -> Iterator[None]:
    """PyTorch on one thread, and then as before."""
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


class Network(LearnedArrays):
    """Hidden layers of `layers` neurons; `penalty` is lambda for standardised rows (see
    `perceptron`).

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
