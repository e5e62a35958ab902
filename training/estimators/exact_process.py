"""One output's Gaussian process with a basis in its mean: covariance, training by GPyTorch,
leave-fold-out means.

The mean is a basis h(x) times coefficients with a wide normal prior, so it is part of the
covariance (Rasmussen and Williams 2006, section 2.7): K = signal^2 k(z, z') + PRIOR h h' + noise^2
I.

Glossary: `z` (n x d) centred predictors, `h` (n x p) basis terms, `y` (n,) the standardised output.

One output seen by an exact process under given settings: fitted, judged on rows left out, solved.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...array_types import Floats
from ..gp.kernels import kernel_matrix
from .base import USUAL_CHANGE, Gaussian, Standard

#: Prior variance of a coefficient of the basis; the output's own is 1.
PRIOR = 10.0


@dataclass(frozen=True, eq=False)
class Process:
    """`lengthscales` (d,) in the units of z; `signal` and `noise` are standard deviations, the
    output's being 1."""

    kernel: str
    lengthscales: Floats
    signal: float
    noise: float

    def between(self, z: Floats, h: Floats, other_z: Floats, other_h: Floats) -> Floats:
        """Covariance n x p of the noise-free output at two sets of inputs."""
        k = kernel_matrix(self.kernel, z / self.lengthscales, other_z / self.lengthscales)
        return np.asarray(self.signal**2 * k + PRIOR * h @ other_h.T)

    def factor(self, z: Floats, h: Floats) -> Floats:
        """Lower Cholesky factor (n x n) of the measurements' covariance. Raises `ValueError` where
        there is none."""
        k = self.between(z, h, z, h)
        k.flat[:: len(k) + 1] += self.noise**2
        try:
            return np.asarray(np.linalg.cholesky(k), dtype=np.float64)
        except np.linalg.LinAlgError:
            name = self.kernel
            raise ValueError(
                f"the covariance of kernel {name!r} is not positive definite: raise the noise"
            ) from None


def inverse(lower: Floats) -> Floats:
    """K^-1 from its lower Cholesky factor, both triangles."""
    from scipy.linalg.lapack import dpotri

    k, _ = dpotri(lower, lower=1)
    half = np.tril(k)
    return np.asarray(half + np.tril(half, -1).T)


def leave_folds_out(inverted: Floats, y: Floats, folds: Sequence[NDArray[np.bool_]]) -> Floats:
    """Means (n,) of each fold's rows as the other rows alone predict them: y_F - (K^-1_FF)^-1 (K^-1
    y)_F."""
    weights = inverted @ y
    means = np.empty_like(y)
    for rows in folds:
        means[rows] = y[rows] - np.linalg.solve(inverted[np.ix_(rows, rows)], weights[rows])
    return means


def most_likely(
    start: Process,
    z: Floats,
    h: Floats,
    y: Floats,
    ard: bool,
    noise_floor: float,
    iterations: int,
    change: float = USUAL_CHANGE,
) -> tuple[Process, Floats]:
    """The process of greatest marginal likelihood near `start`, and the losses of the search per
    row.

    The search stops where the loss changes by less than the share `change` of it. Without `ard`,
    lengthscales stay equal; the noise's standard deviation keeps above `noise_floor`. Raises
    `ValueError` where the covariance is not positive definite.
    """
    from ..gp.basis_process import BasisProcess
    from ..gp.marginal_likelihood import CholeskyMarginalLogLikelihood
    from ..gp.maximise import maximise

    model = BasisProcess(
        z, h, y, start.kernel, start.lengthscales if ard else start.lengthscales[:1], start.signal,
        max(start.noise, noise_floor), noise_floor, PRIOR,
    )  # fmt: skip
    search = maximise(
        CholeskyMarginalLogLikelihood(model.likelihood, model),
        iterations,
        change=change,
        gradient=1e-5,
    )
    lengthscales = np.broadcast_to(model.lengthscales, z.shape[1]).copy()
    return Process(start.kernel, lengthscales, model.signal, model.noise), search.losses


#: The settings of `contact_time.SPACE`.
Settings = Mapping[str, Any]


class ProcessInputs:
    """Data as the process sees them: z and h of x, the output standardised, its logarithm where
    asked."""

    def __init__(self, x: Floats, y: Floats, settings: Settings) -> None:
        self._columns = Standard.of(x)
        self._settings = settings
        self._output = Standard.of(self._transformed(y))
        self.output = self._output.apply(self._transformed(y))[:, 0]

    def _transformed(self, y: Floats) -> Floats:
        return np.log(y) if self._settings["log_time"] else y

    def inputs(self, x: Floats) -> tuple[Floats, Floats]:
        """z (n x d) and h (n x p). The basis takes standardised columns whatever `standardise`
        says."""
        columns = self._columns.apply(x)
        ones = np.ones((len(x), 1))
        h = {"zero": ones[:, :0], "constant": ones, "linear": np.hstack([ones, columns])}[
            self._settings["basis"]
        ]
        return (columns if self._settings["standardise"] else columns * self._columns.width), h

    def start(self) -> Process:
        """Each column's deviation as its lengthscale, times the root of their number; or their mean
        for all."""
        width = np.where(self._columns.width > 0, self._columns.width, 1.0)
        scales = np.ones_like(width) if self._settings["standardise"] else width
        scales = scales * np.sqrt(len(scales))
        if not self._settings["ard"]:
            scales = np.full_like(scales, scales.mean())
        return Process(self._settings["kernel"], scales, 1.0, self._settings["noise"])

    def undo(self, mean: Floats, deviation: Floats) -> Gaussian:
        """Both (n,), of the standardised output."""
        value = self._output.undo(mean[:, None])
        spread = deviation[:, None] * self._output.width
        if not self._settings["log_time"]:
            return Gaussian(value, spread)
        time = np.exp(value)
        return Gaussian(time, time * spread)


def _most_likely(
    view: ProcessInputs,
    x: Floats,
    settings: Settings,
    iterations: int,
    start: Process,
    change: float = USUAL_CHANGE,
) -> tuple[Process, Floats]:
    z, h = view.inputs(x)
    floor = settings["noise"] / 10
    return most_likely(start, z, h, view.output, settings["ard"], floor, iterations, change)


def left_out_error(
    x: Floats, y: Floats, settings: Settings, folds: Sequence[NDArray[np.bool_]]
) -> float:
    """Eq. 4.7 over folds left out, with kernel parameters from all rows: one inverse serves all
    folds."""
    view = ProcessInputs(x, y, settings)
    process, _ = _most_likely(view, x, settings, 25, view.start())
    inverted = inverse(process.factor(*view.inputs(x)))
    left_out = leave_folds_out(inverted, view.output, folds)
    predicted = view.undo(left_out, np.zeros_like(left_out)).mean
    return float(np.mean(np.abs(predicted - y) / np.abs(y)))


def fitted(
    x: Floats,
    y: Floats,
    settings: Settings,
    iterations: int,
    start: Mapping[str, Any] | None = None,
    change: float = USUAL_CHANGE,
) -> tuple[dict[str, Any], list[float]]:
    """Kernel parameters of greatest likelihood, and the losses of the search per row. The search
    begins at the parameters of `start`, which has the same settings, where it is given, and stops
    where the loss changes by less than the share `change` of it."""
    view = ProcessInputs(x, y, settings)
    first_process = view.start() if start is None else _process_of(start)
    process, losses = _most_likely(view, x, settings, iterations, first_process, change)
    tuned = {
        "lengthscales": process.lengthscales.tolist(),
        "signal": process.signal,
        "noise_level": process.noise,
    }
    return tuned, losses.tolist()


def _process_of(tuned: Mapping[str, Any]) -> Process:
    """With the parameters that `fitted` gave."""
    return Process(
        tuned["kernel"], np.array(tuned["lengthscales"]), tuned["signal"], tuned["noise_level"]
    )


class ProcessSolution:
    """Kernel parameters given, what prediction needs: the factor of the covariance and the weights
    of the rows."""

    def __init__(self, x: Floats, y: Floats, tuned: Mapping[str, Any]) -> None:
        from scipy.linalg import cho_solve

        self._view = ProcessInputs(x, y, tuned)
        self._process = _process_of(tuned)
        self._rows = self._view.inputs(x)
        self._lower = self._process.factor(*self._rows)
        self._weights = cho_solve((self._lower, True), self._view.output)

    def at(self, x: Floats) -> Gaussian:
        from scipy.linalg import solve_triangular

        z, h = self._view.inputs(x)
        between = self._process.between(z, h, *self._rows)
        explained = solve_triangular(self._lower, between.T, lower=True)
        own = self._process.signal**2 + PRIOR * (h * h).sum(axis=1) + self._process.noise**2
        variance = np.maximum(own - (explained * explained).sum(axis=0), self._process.noise**2)
        return self._view.undo(between @ self._weights, np.sqrt(variance))
