"""How large the parts of a discrepancy are, from many measured shots."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..setting import Setting
from .discrepancy import Discrepancy, Term, covariance
from .kernels import Coordinates

Floats = NDArray[np.float64]

#: Fewer shots say too little about nine standard deviations.
ENOUGH_SHOTS = 20
#: Residuals looked at: the cost grows with the cube.
_SHOTS, _LINES = 30, 20
#: How far (natural logarithm, standard deviation) a fitted deviation may stray from its stated one before it costs.
_STRAY = 1.0


def fitted(prior: Discrepancy, settings: Sequence[Setting], residual_db: Floats) -> Discrepancy:
    """The terms with the standard deviations that make residuals (n, f) likeliest, each held to its stated value.

    Fewer than `ENOUGH_SHOTS` leave the prior as it is. Of many shots and lines, evenly picked ones are looked at. It is
    the marginal likelihood (Rasmussen and Williams, 2006, eq. 5.8-5.9) times a log-normal prior of each deviation.
    """
    if len(settings) < ENOUGH_SHOTS:
        return prior
    from scipy.optimize import minimize

    shots, lines = _even(len(settings), _SHOTS), _even(prior.frequency_hz.size, _LINES)
    thin = Discrepancy(prior.frequency_hz[lines], prior.terms)
    at = Coordinates.of([settings[i] for i in shots])
    values = residual_db[np.ix_(shots, lines)].ravel()
    bounds = [(-3.0, 2.5)] * len(prior.terms)
    found = minimize(
        _loss,
        np.zeros(len(prior.terms)),
        (thin, at, values),
        "L-BFGS-B",
        jac=True,
        bounds=bounds,
        options={"maxiter": 40},
    )
    return replace(prior, terms=_scaled(prior, found.x))


def _even(count: int, most: int) -> NDArray[np.int64]:
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))


def _scaled(prior: Discrepancy, logs: Floats) -> tuple[Term, ...]:
    return tuple(replace(t, sd_db=float(t.sd_db * np.exp(log))) for t, log in zip(prior.terms, logs, strict=True))


def _loss(logs: Floats, prior: Discrepancy, at: Coordinates, values: Floats) -> tuple[float, Floats]:
    """Minus the logarithm of likelihood and prior, and its slope in the logarithms of the deviations."""
    from scipy.linalg import cho_factor, cho_solve

    now = replace(prior, terms=_scaled(prior, logs))
    factor = cho_factor(covariance(now, at), lower=True, check_finite=False)
    weights = cho_solve(factor, values, check_finite=False)
    inverse = cho_solve(factor, np.eye(values.size), check_finite=False)
    slopes = [
        float(np.sum(inverse * (part := t.covariance(at, at, prior.octaves))) - weights @ part @ weights)
        for t in now.terms
    ]
    halves = float(np.sum(np.log(np.diag(factor[0])))) + 0.5 * float(values @ weights)
    return halves + 0.5 * float(np.sum((logs / _STRAY) ** 2)), np.array(slopes) + logs / _STRAY**2
