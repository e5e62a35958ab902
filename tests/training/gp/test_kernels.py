"""Covariances against scikit-learn's, and against GPyTorch's kernels of the same names."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.training.gp.kernels import KERNELS, kernel_matrix

RNG = np.random.default_rng(3)
A, B = RNG.normal(size=(9, 4)), RNG.normal(size=(6, 4))


@pytest.mark.parametrize("kind", KERNELS)
def test_kernels_are_sklearns_and_those_that_were_trained(kind: str) -> None:
    from sklearn.gaussian_process import kernels as peers

    peer = {
        "rbf": peers.RBF(1.0),
        "matern32": peers.Matern(1.0, nu=1.5),
        "matern52": peers.Matern(1.0, nu=2.5),
        "rational-quadratic": peers.RationalQuadratic(1.0, 1.0),
    }[kind]
    np.testing.assert_allclose(kernel_matrix(kind, A, B), peer(A, B), atol=1e-14)
    k = kernel_matrix(kind, A, A)
    np.testing.assert_array_equal(k.diagonal(), 1.0)
    np.testing.assert_allclose(k, k.T, rtol=1e-13)
    import torch
    from pyroshock.training.gp.multitask import named_kernel

    kernel = named_kernel(kind, 4)
    kernel.lengthscale = torch.tensor([0.5, 1.0, 2.0, 4.0])
    scales = kernel.lengthscale.detach().numpy()[0]
    with torch.no_grad():
        trained = kernel(torch.tensor(A), torch.tensor(B)).to_dense().numpy()
    np.testing.assert_allclose(kernel_matrix(kind, A / scales, B / scales), trained, atol=1e-12)


def test_unknown_kernel_and_untouched_inputs() -> None:
    before = A.copy()
    kernel_matrix("matern52", A, A)
    np.testing.assert_array_equal(A, before)
    with pytest.raises(LookupError, match=r"periodic.*rbf, matern32"):
        kernel_matrix("periodic", A, B)
