"""A regression whose learned state is a handful of plain arrays of declared shapes.

What they learned is small enough to evaluate here, so nothing on disk can carry code. Regressions of scikit-learn are
kept as its own objects (`scikit_pipeline`).
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, Self

import numpy as np

from ...array_types import Floats
from .base import Arrays, Estimator, NotFittedError

#: Lengths of an array's axes: a number, or a letter that stands for the same number in all arrays of a regression.
Shape = tuple[int | str, ...]


class LearnedArrays(Estimator):
    """Keeps what it learned in `learned_`, checked against `shapes` whether it comes from `fit` or from a file."""

    learned_: Arrays | None = None

    @abstractmethod
    def shapes(self) -> Mapping[str, Shape]:
        """Names and shapes of all learned arrays. The letter d is the number of predictors."""

    def settings(self) -> dict[str, Any]:
        return {}

    def arrays(self) -> Arrays:
        return dict(self._learned())

    def restore(self, arrays: Arrays) -> Self:
        self._check(arrays)
        self.learned_ = dict(arrays)
        return self

    def _check(self, arrays: Arrays) -> dict[str, int]:
        """Lengths by letter. Raises `ValueError` for arrays that are not of this kind; a leaf may ask for more."""
        shapes = self.shapes()
        if set(arrays) != set(shapes):
            raise ValueError(f"{self.kind!r} is restored from {_listed(shapes)}, not from {_listed(arrays)}")
        lengths: dict[str, int] = {}
        for name, shape in shapes.items():
            array = arrays[name]
            if array.dtype.kind not in "if" or not np.all(np.isfinite(array)):
                raise ValueError(f"{self.kind!r}: {name!r} must hold finite numbers, not {array.dtype}")
            if not _fits(array.shape, shape, lengths):
                raise ValueError(f"{self.kind!r}: {name!r} has the shape {array.shape}, not {shape} with {lengths}")
        return lengths

    def _learned(self) -> Arrays:
        if self.learned_ is None:
            raise NotFittedError(f"{self.kind!r} has learned nothing yet: call fit, or restore")
        return self.learned_

    def _asked(self, x: Floats, predictors: int) -> Floats:
        """x as n x d float64. Raises `ValueError` for another number of predictors than learned."""
        inputs = np.asarray(x, dtype=np.float64)
        if inputs.ndim != 2 or inputs.shape[1] != predictors:
            raise ValueError(f"{self.kind!r} learned from {predictors} predictors; asked with the shape {inputs.shape}")
        return inputs


def _fits(found: tuple[int, ...], shape: Shape, lengths: dict[str, int]) -> bool:
    if len(found) != len(shape):
        return False
    return all(
        length == (expected if isinstance(expected, int) else lengths.setdefault(expected, length))
        for length, expected in zip(found, shape, strict=True)
    )


def _listed(names: Mapping[str, object]) -> str:
    return ", ".join(sorted(names)) or "nothing"
