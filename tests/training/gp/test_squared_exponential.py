"""The squared exponential against GPyTorch's own: values and derivatives."""

from __future__ import annotations

import gpytorch
import pytest
import torch
from pyroshock.training.gp.kernel_description import SquaredExponential

GENERATOR = torch.Generator().manual_seed(1)
#: Far from 0, with two equal rows.
X = torch.randn(30, 3, dtype=torch.float64, generator=GENERATOR) + 100.0
X[7] = X[3]
#: Not symmetric: the derivative must not rely on it.
WEIGHTS = torch.randn(30, 30, dtype=torch.float64, generator=GENERATOR)


def kernels(ard_num_dims):
    made = [
        kind(ard_num_dims=ard_num_dims).double()
        for kind in (SquaredExponential, gpytorch.kernels.RBFKernel)
    ]
    for kernel in made:
        kernel.lengthscale = torch.tensor([0.7, 1.3, 2.0]) if ard_num_dims else 0.9
    return made


@pytest.mark.parametrize("ard_num_dims", [3, None])
def test_values_and_derivatives_are_gpytorchs(ard_num_dims):
    ours, theirs = kernels(ard_num_dims)
    values = [kernel(X).to_dense() for kernel in (ours, theirs)]
    for value in values:
        (value * WEIGHTS).sum().backward()
    torch.testing.assert_close(*values, rtol=0, atol=1e-13)
    torch.testing.assert_close(
        ours.raw_lengthscale.grad, theirs.raw_lengthscale.grad, rtol=1e-10, atol=0
    )
    assert bool((values[0].diagonal() == 1).all())


def test_other_inputs_and_diagonals_are_gpytorchs():
    ours, theirs = kernels(3)
    torch.testing.assert_close(ours(X, X[:4]).to_dense(), theirs(X, X[:4]).to_dense())
    torch.testing.assert_close(ours(X, diag=True), theirs(X, diag=True))
    batch = X.reshape(2, 15, 3)
    torch.testing.assert_close(ours(batch).to_dense(), theirs(batch).to_dense())
    grads = []
    for kernel in kernels(3):
        x = X.clone().requires_grad_()
        (kernel(x).to_dense() * WEIGHTS).sum().backward()
        grads.append(x.grad)
    torch.testing.assert_close(*grads)
