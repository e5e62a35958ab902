"""Kernels of GPyTorch as JSON and numbers, and back: no pickle, and no class but those listed here.

GPyTorch's squared exponential with its derivative in closed form.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import gpytorch
import numpy as np
import torch
from gpytorch.kernels import Kernel, RBFKernel


class SquaredExponential(RBFKernel):  # type: ignore[misc]  # GPyTorch publishes no types
    """An `RBFKernel`: the same numbers.

    GPyTorch differentiates its distances one operation after another when there is a lengthscale
    for each predictor: eight more passes over n x n numbers than the two products here.
    """

    def forward(
        self,
        x1: torch.Tensor,
        x2: torch.Tensor,
        diag: bool = False,
        last_dim_is_batch: bool = False,
        **params: Any,
    ) -> Any:
        """Covariances of x1 and x2."""
        special = diag or last_dim_is_batch or x1.dim() != 2 or x1.requires_grad or x2.requires_grad
        if special or not torch.equal(x1, x2):
            return super().forward(x1, x2, diag=diag, last_dim_is_batch=last_dim_is_batch, **params)
        return _Covariances.apply((x1 - x1.mean(dim=0)) / self.lengthscale)


class _Covariances(torch.autograd.Function):  # type: ignore[misc]  # of PyTorch's untyped part
    """exp(-|a_i - a_j|^2 / 2) of a (n x d), with its diagonal of ones."""

    @staticmethod
    def forward(ctx: Any, a: torch.Tensor) -> torch.Tensor:
        """n x n."""
        halves = 0.5 * (a * a).sum(dim=1)
        k = (a @ a.T).sub_(halves).sub_(halves[:, None]).clamp_max_(0.0)
        k.fill_diagonal_(0.0)
        k.exp_()
        ctx.save_for_backward(a, k)
        return k

    @staticmethod
    def backward(ctx: Any, *gradients: torch.Tensor) -> torch.Tensor:
        """By a (n x d): the sum over j of (w_ij + w_ji) (a_j - a_i), w being gradient times k."""
        a, k = ctx.saved_tensors
        w = gradients[0] * k
        rows = torch.vstack([a.T, torch.ones_like(a[:, 0])])
        products = rows @ w + rows @ w.T
        return (products[:-1] - products[-1] * a.T).T


#: Class -> the arguments of its constructor that a description keeps, beside `ard_num_dims` and
#: `active_dims`.
_ARGUMENTS: dict[str, tuple[str, ...]] = {
    "RBFKernel": (),
    "SquaredExponential": (),
    "MaternKernel": ("nu",),
    "RQKernel": (),
    "PeriodicKernel": (),
    "CosineKernel": (),
    "LinearKernel": (),
    "ConstantKernel": (),
    "PolynomialKernel": ("power",),
    "PiecewisePolynomialKernel": ("q",),
}
#: Kernels of kernels.
_WRAPPERS = ("ScaleKernel", "AdditiveKernel", "ProductKernel")


def described(kernel: Kernel) -> dict[str, Any]:
    """What `kernel_of` makes a kernel of the same structure of; its numbers are `kernel_numbers`.

    Raises `ValueError` for a class that is not listed, for batches of kernels and for parameters of
    a module's own.
    """
    name = type(kernel).__name__
    if tuple(kernel.batch_shape):
        raise ValueError(
            f"{name} is a batch of kernels ({tuple(kernel.batch_shape)}); expected a single one"
        )
    if name == "ScaleKernel":
        return {"class": name, "kernels": [described(kernel.base_kernel)], **_dimensions(kernel)}
    if name in _WRAPPERS:
        return {
            "class": name,
            "kernels": [described(part) for part in kernel.kernels],
            **_dimensions(kernel),
        }
    if name not in _ARGUMENTS or type(kernel) is not _class_named(name):
        class_names = ", ".join((*_ARGUMENTS, *_WRAPPERS))
        raise ValueError(
            f"a model with {type(kernel).__name__} cannot be stored; kernels "
            f"that can: {class_names}"
        )
    arguments = {argument: _plain(getattr(kernel, argument)) for argument in _ARGUMENTS[name]}
    return {"class": name, **arguments, **_dimensions(kernel)}


def kernel_of(description: Mapping[str, Any]) -> Kernel:
    """A kernel of this structure with GPyTorch's own constraints, in float64. Raises `ValueError`
    as `described`."""
    arguments = {
        name: value for name, value in description.items() if name not in ("class", "kernels")
    }
    if arguments.get("active_dims") is not None:
        arguments["active_dims"] = tuple(arguments["active_dims"])
    name = description.get("class")
    if name not in (*_ARGUMENTS, *_WRAPPERS):
        raise ValueError(f"no kernel {name!r}; there are: {', '.join((*_ARGUMENTS, *_WRAPPERS))}")
    parts = [kernel_of(part) for part in description.get("kernels", ())]
    try:
        return _class_named(name)(*parts, **arguments).double()
    except (TypeError, RuntimeError) as error:
        raise ValueError(f"{name} cannot be made with {arguments}: {error}") from error


def _class_named(name: str) -> Any:
    """Of this package or of GPyTorch."""
    return (
        SquaredExponential
        if name == SquaredExponential.__name__
        else getattr(gpytorch.kernels, name)
    )


def kernel_numbers(kernel: Kernel) -> dict[str, np.ndarray[Any, np.dtype[np.float64]]]:
    """The parameters by name ("kernels.0.lengthscale"), as they act: constraints do not matter."""
    numbers = {}
    for name, module in _modules(kernel):
        for parameter in _parameters(module):
            value = getattr(module, parameter).detach().numpy().astype(np.float64)
            numbers[f"{name}{parameter}"] = value.copy()
    return numbers


def set_numbers(kernel: Kernel, numbers: Mapping[str, np.ndarray[Any, Any]]) -> Kernel:
    """The kernel with these parameters. Raises `ValueError` for names that are not its own."""
    own = set(kernel_numbers(kernel))
    if own != set(numbers):
        raise ValueError(f"the kernel has the parameters {sorted(own)}, not {sorted(numbers)}")
    for name, module in _modules(kernel):
        for parameter in _parameters(module):
            setattr(
                module,
                parameter,
                torch.as_tensor(numbers[f"{name}{parameter}"], dtype=torch.float64),
            )
    return kernel


def _modules(kernel: Kernel) -> list[tuple[str, Kernel]]:
    named = kernel.named_modules()
    return [
        (f"{name}." if name else "", module) for name, module in named if isinstance(module, Kernel)
    ]


def _parameters(module: Kernel) -> list[str]:
    """Names of the module's own parameters, without those of kernels below it."""
    return [name.removeprefix("raw_") for name, _ in module.named_parameters(recurse=False)]


def _dimensions(kernel: Kernel) -> dict[str, Any]:
    dimensions: dict[str, Any] = {}
    if kernel.ard_num_dims is not None:
        dimensions["ard_num_dims"] = int(kernel.ard_num_dims)
    if kernel.active_dims is not None:
        dimensions["active_dims"] = [int(dimension) for dimension in kernel.active_dims]
    return dimensions


def _plain(value: Any) -> Any:
    number = float(value)
    return int(number) if math.isfinite(number) and number.is_integer() else number


def kernel_words(description: Mapping[str, Any]) -> str:
    """A description in one line: "AdditiveKernel(RBFKernel, LinearKernel)"."""
    parts = ", ".join(kernel_words(part) for part in description.get("kernels", ()))
    return f"{description['class']}({parts})" if parts else str(description["class"])
