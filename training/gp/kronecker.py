"""The coregional Gaussian process's marginal likelihood, exact, with its gradient in closed form.

Outputs y (n x m) are normal with covariance B (x) K + Sigma (x) I: K (n x n) between inputs, B (m x
m) between outputs, Sigma (m x m) the noise of one measurement, mostly diagonal. With Sigma = C C'
and C^-1 B C^-T = V S V', the outputs C^-1 y V are independent of each other with covariances s_j K
+ I. (Stegle et al. 2011, "Efficient inference in matrix-variate Gaussian models"; Rakitsch et al.
2013.) Nothing is differentiated through an eigendecomposition, which fails on repeated eigenvalues:
derivatives by K, B and Sigma need its result only.

Glossary: `l` eigenvalues of K, `t` its factor (K = T T'), `s` eigenvalues of the whitened B, `q` =
C^-T V, `a` (n x m) the columns (s_j K + I)^-1 y_j.

A kernel matrix as G G', as many columns as its numerical rank, with a bound on what is left out.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats


@dataclass(frozen=True, eq=False)
class KernelFactor:
    """K (n x n) is about T T': `t` (n x r) has orthogonal columns, `eigenvalues` (r,) are their
    squared lengths.

    `pivots` (r,) are the rows that carry the factorisation, `lower` (r x r) its Cholesky factor
    there and `basis` (r x r) turns G into T = G basis. `residual` is the trace of K - T T', which
    is positive semi-definite.
    """

    t: Floats
    eigenvalues: Floats
    pivots: NDArray[np.intp]
    lower: Floats
    basis: Floats
    residual: float


def factorise(k: Floats, tolerance: float) -> KernelFactor:
    """A factor of a kernel matrix: pivoted Cholesky (LAPACK `dpstrf`), then `eigh` of r x r
    numbers.

    Exact at full rank too; there it costs an eigendecomposition of K.

    Parameters:
        k: The kernel matrix K (n, n), which is left as it was.
        tolerance: The variance of an input that may be left over. The factorisation ends when none
            has more.
    """
    from scipy.linalg.lapack import dpstrf

    # The transpose of a symmetric matrix: LAPACK's order of the same numbers, copied in one sweep.
    lower, order, rank, _ = dpstrf(k.T, tol=tolerance, lower=1)
    pivots = order.astype(np.intp) - 1
    top = np.tril(lower[:rank, :rank])
    g = np.empty((len(k), rank))
    g[pivots[:rank]] = top
    g[pivots[rank:]] = lower[rank:, :rank]
    residual = float(np.maximum(k.diagonal() - np.einsum("ij,ij->i", g, g), 0.0).sum())
    eigenvalues, basis = _eigen(g.T @ g)
    return KernelFactor(
        g @ basis, np.maximum(eigenvalues, 0.0), pivots[:rank], top, basis, residual
    )


def _eigen(matrix: Floats) -> tuple[Floats, Floats]:
    """Divide and conquer: at 400 x 400 twice as fast as numpy's default for what scipy's asks
    (`evr`)."""
    from scipy.linalg import eigh

    eigenvalues, vectors = eigh(matrix, driver="evd", check_finite=False, overwrite_a=True)
    return eigenvalues, vectors


#: Left-over variance per row at which the kernel's factorisation stops, of 1.
TOLERANCE = 1e-12


@dataclass(frozen=True, eq=False)
class Whitened:
    """The m outputs made independent: y_j (n,) of `outputs` (n x m) has covariance s_j K + I.

    `q` (m x m) takes outputs there (y q), `log_determinant` is Sigma's.
    """

    outputs: Floats
    s: Floats
    q: Floats
    log_determinant: float


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Negative logarithm of the marginal likelihood, its derivatives by K (n x n), B and Sigma (m x
    m) and y (n x m).

    The first three are symmetric: a change dK changes `value` by the sum of `by_k` dK. `bound` is
    the most by which `value` can differ from that of the untruncated kernel matrix.
    """

    value: float
    by_k: Floats
    by_b: Floats
    by_sigma: Floats
    by_y: Floats
    bound: float


def whiten(y: Floats, b: Floats, sigma: Floats) -> Whitened:
    """The outputs made independent of each other.

    Parameters:
        y: The outputs (n, m), less their prior mean.
        b: The covariance B (m, m) between outputs.
        sigma: The covariance Sigma (m, m) of the noise of one measurement.

    Raises:
        ValueError: Where sigma is not positive definite.
    """
    from scipy.linalg import solve_triangular

    try:
        c = np.linalg.cholesky(sigma)
    except np.linalg.LinAlgError:
        raise ValueError(
            "the noise between outputs is not positive definite: raise its diagonal"
        ) from None
    inner = solve_triangular(c, solve_triangular(c, b, lower=True).T, lower=True)
    s, v = np.linalg.eigh(0.5 * (inner + inner.T))
    q = solve_triangular(c, v, lower=True, trans="T")
    return Whitened(y @ q, np.maximum(s, 0.0), q, 2.0 * float(np.log(c.diagonal()).sum()))


def solve(factor: KernelFactor, white: Whitened) -> tuple[Floats, Floats, Floats]:
    """The solution of the whitened system by Woodbury: no division by small eigenvalues.

    Parameters:
        factor: The kernel matrix T T' as `factorise` gives it, with its eigenvalues l.
        white: The independent outputs (n, m), with their eigenvalues s.

    Returns:
        `a` (n, m), T'a (r, m) and 1 / (s_j l_i + 1) (r, m).
    """
    shrink = 1.0 / (factor.eigenvalues[:, None] * white.s + 1.0)
    projected = factor.t.T @ white.outputs
    a = white.outputs - factor.t @ (white.s * shrink * projected)
    return a, shrink * projected, shrink


def likelihood(factor: KernelFactor, y: Floats, b: Floats, sigma: Floats) -> Likelihood:
    """The marginal likelihood of outputs under a factorised kernel matrix; O(n^2 r) and one n x n
    array.

    Parameters:
        factor: The kernel matrix K as `factorise` gives it.
        y: The outputs (n, m), less their prior mean.
        b: The covariance B (m, m) between outputs.
        sigma: The covariance Sigma (m, m) of the noise of one measurement.

    Raises:
        ValueError: Where sigma is not positive definite.
    """
    white = whiten(y, b, sigma)
    a, projected, shrink = solve(factor, white)
    n, m = y.shape
    quadratic = np.einsum("ij,ij->j", white.outputs, a)
    value = (
        n * white.log_determinant
        - float(np.log(shrink).sum())
        + float(quadratic.sum())
        + n * m * np.log(2 * np.pi)
    )
    return Likelihood(
        value=0.5 * value,
        by_k=_by_k(factor, white.s, shrink, a),
        by_b=_rotated(white.q, factor.eigenvalues @ shrink, projected),
        by_sigma=_rotated(white.q, shrink.sum(axis=0) + (n - len(shrink)), a),
        by_y=a @ white.q.T,
        bound=_bound(factor.residual, white.s, a),
    )


def _by_k(factor: KernelFactor, s: Floats, shrink: Floats, a: Floats) -> Floats:
    """1/2 (sum_j s_j (s_j K + I)^-1 - A S A') as c I - H H': a symmetric product, half the work of
    a general one."""
    h = np.hstack([factor.t * np.sqrt(shrink @ (s * s)), a * np.sqrt(s)])
    h *= np.sqrt(0.5)
    by_k = h @ h.T
    np.negative(by_k, out=by_k)
    by_k.flat[:: len(by_k) + 1] += 0.5 * s.sum()
    return by_k


def _rotated(q: Floats, traces: Floats, vectors: Floats) -> Floats:
    """1/2 Q (diag(traces) - vectors' vectors) Q', the form both derivatives between outputs
    have."""
    inner = -(vectors.T @ vectors)
    inner.flat[:: len(inner) + 1] += traces
    return np.asarray(0.5 * q @ inner @ q.T)


def _bound(residual: float, s: Floats, a: Floats) -> float:
    """With E = K - T T' >= 0 of trace e, log|I + s K| is larger by at most s e, and y'(I + s K)^-1
    y smaller by at most s a'Ea <= s e |a|^2, as the inverse is convex. The two pull the value
    apart, so the larger counts.
    """
    return float(0.5 * residual * max(s.sum(), np.einsum("ij,ij,j->", a, a, s)))
