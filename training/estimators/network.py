"""Networks of rectified linear units, the five sizes of the thesis's Table 4.5 and any other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..fit_report import FitReport, SettingValue
from .array_state import LearnedArrays, Shape
from .base import Arrays, Gaussian
from .mlp import OPTIMISER, Layer, outputs_of, train_network
from .standard import Standard


class Network(LearnedArrays):
    """Hidden layers of `layers` neurons; `penalty` is lambda for standardised rows (see `perceptron`).

    At most `iterations` of L-BFGS over all rows, as MATLAB's `fitrnet`. No spread: the errors on the rows it
    learned from flatter it, and nothing else in it tells how far it is off.
    """

    kind = "network"
    losses_: tuple[float, ...] = ()
    iterations_ = 0

    def __init__(self, layers: Sequence[int] = (10,), penalty: float = 0.0, iterations: int = 1000) -> None:
        if not layers or min(layers) < 1:
            raise ValueError(f"a network needs a neuron in each hidden layer, and one layer at least, not {layers}")
        self.layers, self.penalty, self.iterations = tuple(int(size) for size in layers), penalty, iterations

    def settings(self) -> dict[str, Any]:
        return {"layers": list(self.layers), "penalty": self.penalty, "iterations": self.iterations}

    def shapes(self) -> Mapping[str, Shape]:
        sizes: list[int | str] = ["d", *self.layers, "m"]
        shapes: dict[str, Shape] = {"x_mean": ("d",), "x_width": ("d",), "y_mean": ("m",), "y_width": ("m",)}
        for layer in range(1, len(sizes)):
            shapes[f"weights_{layer}"] = (sizes[layer - 1], sizes[layer])
            shapes[f"biases_{layer}"] = (1, sizes[layer])
        return shapes

    def fit(self, x: Floats, y: Floats, groups: NDArray[Any], rng: np.random.Generator) -> Self:  # noqa: ARG002
        sizes = (x.shape[1], *self.layers, y.shape[1])
        inputs, outputs = Standard.of(x), Standard.of(y)
        network = train_network(inputs.apply(x), outputs.apply(y), sizes, self.penalty, self.iterations, rng)
        self.losses_, self.iterations_ = network.losses, network.iterations
        return self.restore(_arrays(inputs, outputs, network.layers))

    def fit_report(self) -> FitReport:
        """The loss at the start, then after every 20 iterations and the last; of standardised rows."""
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
        inputs = Standard(learned["x_mean"], learned["x_width"])
        outputs = Standard(learned["y_mean"], learned["y_width"])
        layers = [(learned[f"weights_{i}"], learned[f"biases_{i}"]) for i in range(1, len(self.layers) + 2)]
        scaled_inputs = inputs.apply(self._asked(x, len(inputs.mean)))
        return Gaussian(outputs.undo(outputs_of(layers, scaled_inputs)), None)


def _arrays(inputs: Standard, outputs: Standard, layers: Sequence[Layer]) -> Arrays:
    arrays = {"x_mean": inputs.mean, "x_width": inputs.width, "y_mean": outputs.mean, "y_width": outputs.width}
    for number, (weights, biases) in enumerate(layers, start=1):
        arrays |= {f"weights_{number}": weights, f"biases_{number}": biases}
    return arrays
