"""How large the parts of a discrepancy are, from many measured shots."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...array_types import Floats
from ..setting import Setting
from .kernels import Coordinates
from .shot_correction import Discrepancy, inverted, with_jitter

#: Fewer shots say too little about nine standard deviations.
ENOUGH_SHOTS = 20
#: Shots looked at: the cost grows with the cube.
_SHOTS = 60
#: How far (natural logarithm, standard deviation) a fitted deviation may stray from its stated one
#: before it costs.
_STRAY = 1.0


def fitted(prior: Discrepancy, settings: Sequence[Setting], residual_db: Floats) -> Discrepancy:
    """The terms with the standard deviations that make residuals (n, f) likeliest, each held to its
    stated value.

    Fewer than `ENOUGH_SHOTS` leave the prior as it is. Of many shots, evenly picked ones are looked
    at. It is the marginal likelihood (Rasmussen and Williams, 2006, eq. 5.8-5.9) times a log-normal
    prior of each deviation.
    """
    if len(settings) < ENOUGH_SHOTS:
        return prior
    from scipy.optimize import minimize

    shots = np.unique(
        np.linspace(0, len(settings) - 1, min(len(settings), _SHOTS)).round().astype(np.int64)
    )
    at = Coordinates.of([settings[i] for i in shots])
    alike = np.array([term.of_settings(at, at) for term in prior.terms])
    bounds = [(-3.0, 2.5)] * len(prior.terms)
    result = minimize(
        _loss,
        np.zeros(len(prior.terms)),
        (prior.variances, alike, prior.in_patterns(residual_db[shots])),
        "L-BFGS-B",
        jac=True,
        bounds=bounds,
        options={"maxiter": 40},
    )
    scaled = zip(prior.terms, np.exp(result.x).tolist(), strict=True)
    return replace(
        prior, terms=tuple(replace(term, sd_db=term.sd_db * factor) for term, factor in scaled)
    )


def _loss(logs: Floats, stated: Floats, alike: Floats, values: Floats) -> tuple[float, Floats]:
    """Minus the logarithm of likelihood and prior, and its slope in the logarithms of the
    deviations.

    `stated` (t, f) are variances of terms in patterns, `alike` (t, n, n) correlations of settings,
    `values` (n, f) residuals of patterns.
    """
    variances = stated * np.exp(2 * logs)[:, None]
    precision, logarithms = inverted(
        with_jitter(np.tensordot(variances.T, alike, axes=1), variances)
    )
    weights = np.einsum("fnm,mf->nf", precision, values)
    explained = np.sum(variances * np.sum(weights * (alike @ weights), axis=1), axis=1)
    slopes = np.einsum("tnm,tnm->t", np.tensordot(variances, precision, axes=1), alike) - explained
    halves = 0.5 * (logarithms + float(np.sum(values * weights)))
    return halves + 0.5 * float(np.sum((logs / _STRAY) ** 2)), slopes + logs / _STRAY**2
