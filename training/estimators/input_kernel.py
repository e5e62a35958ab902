"""The kernel over predictors that a Gaussian process was given: a name, or a kernel of GPyTorch."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...array_types import Floats
from ..gp.kernels import Covariance, NamedCovariance, TorchCovariance, kernel_named
from .base import Arrays, Shape

#: Before the names of a handed-in kernel's parameters.
_PREFIX = "kernel."


class InputKernel:
    """`given` is a name of `gp.kernels.KERNELS`, a description of `gp.kernel_description`, or a
    kernel of GPyTorch.

    Each fit trains a copy: what was given stays as it was. Raises `LookupError` for an unknown
    name, `ValueError` for a kernel that cannot be described.
    """

    def __init__(self, given: Any) -> None:
        self._given = given
        if isinstance(given, str):
            kernel_named(given)
            self.description: Any = given
        elif isinstance(given, Mapping):
            self.description = dict(given)
        else:
            from ..gp.kernel_description import described

            self.description = described(given)

    @property
    def is_named(self) -> bool:
        """Whether the kernel has a name, and is evaluated without PyTorch."""
        return isinstance(self.description, str)

    def made(self, predictors: int, start: Arrays | None = None) -> Any:
        """A kernel of GPyTorch to be trained over so many predictors, in float64; from the
        parameters of another (`numbers`) where `start` has them."""
        kernel = self._unstarted(predictors)
        if start is None:
            return kernel
        if not self.is_named:
            from ..gp.kernel_description import set_numbers

            return set_numbers(kernel, self._own_numbers(start))
        from ..gp.basis_process import lengthscale_interval, within

        kernel.lengthscale = within(lengthscale_interval(), np.exp(start["log_lengthscales"]))
        return kernel

    def _unstarted(self, predictors: int) -> Any:
        from copy import deepcopy

        if isinstance(self._given, str):
            from ..gp.multitask import named_kernel

            return named_kernel(self._given, predictors)
        if isinstance(self._given, Mapping):
            from ..gp.kernel_description import kernel_of

            return kernel_of(self._given)
        return deepcopy(self._given).double()

    def shapes(self) -> dict[str, Shape]:
        """Of the arrays of `numbers`."""
        if self.is_named:
            return {"log_lengthscales": ("d",)}
        return {name: array.shape for name, array in self.numbers(self.made(1)).items()}

    def numbers(self, kernel: Any) -> Arrays:
        """The parameters of a trained kernel, by name."""
        if self.is_named:
            return {"log_lengthscales": np.log(kernel.lengthscale.detach().numpy().ravel())}
        from ..gp.kernel_description import kernel_numbers

        return {f"{_PREFIX}{name}": array for name, array in kernel_numbers(kernel).items()}

    def scaled(self, arrays: Arrays, z: Floats) -> Floats:
        """Inputs of `scaled_covariance`: those of a named kernel are divided by their
        lengthscales."""
        return z / np.exp(arrays["log_lengthscales"]) if self.is_named else z

    def scaled_covariance(self, arrays: Arrays) -> Covariance:
        """The trained kernel over `scaled` inputs."""
        if self.is_named:
            return NamedCovariance(self.description, np.ones(len(arrays["log_lengthscales"])))
        from ..gp.kernel_description import kernel_of, set_numbers

        return TorchCovariance(set_numbers(kernel_of(self.description), self._own_numbers(arrays)))

    @staticmethod
    def _own_numbers(arrays: Arrays) -> Arrays:
        """Of a kernel that was handed in."""
        return {
            name.removeprefix(_PREFIX): array
            for name, array in arrays.items()
            if name.startswith(_PREFIX)
        }

    def report(self, arrays: Arrays) -> tuple[dict[str, Any], dict[str, list[float]]]:
        """Settings and, for a named kernel, the lengthscale of each standardised predictor."""
        if self.is_named:
            return {"kernel": self.description}, {
                "lengthscale": np.exp(arrays["log_lengthscales"]).tolist()
            }
        from ..gp.kernel_description import kernel_words

        numbers = {
            f"{name}.{place}" if array.size > 1 else name: float(value)
            for name, array in arrays.items()
            if name.startswith(_PREFIX)
            for place, value in enumerate(array.ravel())
        }
        return {"kernel": kernel_words(self.description), **numbers}, {}
