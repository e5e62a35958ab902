"""Networks of rectified linear units: weights as arrays, trained many at a time by PyTorch, evaluated by numpy.

A network of k hidden layers is k + 1 pairs of weights (inputs x outputs) and biases (1 x outputs). Training minimises
half the mean squared error over rows and outputs plus `penalty` / 2 times the sum of the squared weights, as MATLAB's
`fitrnet` does up to its factors; biases are free. Single precision: a network's own error is a thousand times its
rounding, and half the bytes are half the seconds.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..tuning.quasi_newton import minimise
from .base import Floats

if TYPE_CHECKING:
    from torch import Tensor

Layer = tuple[Floats, Floats]
#: Predictors, neurons of each hidden layer, outputs.
Sizes = tuple[int, ...]


def answers(layers: Sequence[Layer], z: Floats) -> Floats:
    """Outputs (n x m) of a network at standardised inputs (n x d)."""
    for weights, biases in layers[:-1]:
        z = np.maximum(z @ weights + biases, 0.0)
    weights, biases = layers[-1]
    return z @ weights + biases


def started(sizes: Sizes, rng: np.random.Generator) -> NDArray[np.float32]:
    """Weights of Glorot and Bengio (AISTATS 2010), biases 0, as one vector (p,): layer by layer, weights first."""
    parts = []
    for inputs, outputs in pairwise(sizes):
        limit = np.sqrt(6 / (inputs + outputs))
        parts += [rng.uniform(-limit, limit, inputs * outputs), np.zeros(outputs)]
    return np.concatenate(parts).astype(np.float32)


def trained(
    rows: Sequence[tuple[Floats, Floats]],
    starts: Sequence[NDArray[np.float32]],
    sizes: Sizes,
    penalty: float,
    steps: int,
) -> list[list[Layer]]:
    """Networks of one size, each on its own standardised rows (n x d, n x m), from its own start, side by side.

    Arithmetic on one thread: the same numbers on any number of cores.
    """
    import torch

    with one_thread():
        most = max(len(x) for x, _ in rows)
        x, y = (torch.tensor(np.stack([_padded(pair[side], most) for pair in rows])) for side in (0, 1))
        counts = np.array([[len(x)] for x, _ in rows])
        weight = (np.arange(most) < counts) / (counts * sizes[-1])
        problem = _Errors(x, y, torch.tensor(weight[:, :, None], dtype=torch.float32), sizes, penalty)
        found = minimise(problem, torch.tensor(np.stack(starts)), steps)
        return [_layers(vector, sizes) for vector in found.numpy().astype(np.float64)]


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


def _padded(columns: Floats, most: int) -> NDArray[np.float32]:
    """With rows of zeros, which weigh nothing, to `most` rows."""
    return np.concatenate([columns, np.zeros((most - len(columns), columns.shape[1]))]).astype(np.float32)


def _layers(vector: Floats, sizes: Sizes) -> list[Layer]:
    layers, at = [], 0
    for inputs, outputs in pairwise(sizes):
        weights, at = vector[at : at + inputs * outputs].reshape(inputs, outputs), at + inputs * outputs
        biases, at = vector[at : at + outputs].reshape(1, outputs), at + outputs
        layers.append((weights, biases))
    return layers


@dataclass(frozen=True)
class _Errors:
    """The objective of b networks: rows x (b x n x d), y (b x n x m), and what each row weighs (b x n x 1)."""

    x: Tensor
    y: Tensor
    weight: Tensor
    sizes: Sizes
    penalty: float

    def take(self, rows: Tensor) -> _Errors:
        return _Errors(self.x[rows], self.y[rows], self.weight[rows], self.sizes, self.penalty)

    def __call__(self, w: Tensor) -> tuple[Tensor, Tensor]:
        """By hand: forwards and backwards are ten lines, and autograd's bookkeeping costs small networks double."""
        import torch

        gradient = torch.empty_like(w)
        layers, slopes = self._views(w), self._views(gradient)
        inputs = [self.x]
        for weights, biases in layers[:-1]:
            inputs.append(torch.baddbmm(biases, inputs[-1], weights).relu_())
        weights, biases = layers[-1]
        wrong = torch.baddbmm(biases, inputs[-1], weights).sub_(self.y)
        back = wrong * self.weight
        value = 0.5 * (wrong * back).sum(dim=(1, 2))
        for (weights, _), (to_weights, to_biases), before in zip(layers[::-1], slopes[::-1], inputs[::-1], strict=True):
            value = value + 0.5 * self.penalty * (weights * weights).sum(dim=(1, 2))
            to_weights.copy_(torch.baddbmm(weights, before.mT, back, beta=self.penalty))
            to_biases.copy_(back.sum(dim=1, keepdim=True))
            if before is not self.x:
                back = torch.bmm(back, weights.mT).mul_(before > 0)
        return value, gradient

    def _views(self, w: Tensor) -> list[tuple[Tensor, Tensor]]:
        """Weights (b x inputs x outputs) and biases (b x 1 x outputs) inside w (b x p)."""
        views, at = [], 0
        for inputs, outputs in pairwise(self.sizes):
            end = at + inputs * outputs
            views.append((w[:, at:end].view(-1, inputs, outputs), w[:, end : end + outputs].view(-1, 1, outputs)))
            at = end + outputs
        return views
