"""The cubic smoothing spline of a pulse (thesis, eq. 4.6 and MATLAB's `csaps`), on the sample index.

With x in seconds the problem is so badly scaled that libraries return no smoothing, or refuse (scipy and csaps
both); on the index it is well posed and p means the same at every sampling rate. `csaps` with parameter p
is scipy's `make_smoothing_spline` with lam = (1 - p) / p, which this equals to rounding. On the index its equations are
the same few numbers in every row, and need not be built from divided differences: a tenth of the time.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..array_types import Floats

#: scipy's smoothing spline needs five points; below, the interpolating cubic (or less) is all there is.
_SMALLEST_SMOOTHED = 5


def smoothing_spline(values: Floats, smoothing: float) -> Callable[[Floats], Floats]:
    """The spline through `values` (n,), n >= 2, at x = 0 … n-1. `smoothing` is csaps' p in (0, 1].

    Green and Silverman, Nonparametric Regression and Generalized Linear Models (1994), section 2.3: with R and Q of
    a natural spline, (R + lam Q'Q) c = Q'y gives its second derivatives, y - lam Q c its values.
    """
    from scipy.interpolate import PPoly, make_interp_spline
    from scipy.linalg import solveh_banded

    if smoothing >= 1.0 or values.size < _SMALLEST_SMOOTHED:
        x = np.arange(values.size, dtype=np.float64)
        return make_interp_spline(x, values, k=min(3, values.size - 1))
    lam = (1.0 - smoothing) / smoothing
    bands = np.empty((3, values.size - 2))  # upper form; what lies outside of the matrix is not looked at
    bands[0], bands[1], bands[2] = lam, 1 / 6 - 4 * lam, 2 / 3 + 6 * lam
    padded = np.zeros(values.size + 2)
    padded[2:-2] = solveh_banded(bands, np.diff(values, 2), overwrite_ab=True, check_finite=False)
    bending, fitted = padded[1:-1], values - lam * np.diff(padded, 2)
    slope = np.diff(fitted) - (2 * bending[:-1] + bending[1:]) / 6
    pieces = np.array([np.diff(bending) / 6, bending[:-1] / 2, slope, fitted[:-1]])
    return PPoly.construct_fast(pieces, np.arange(values.size, dtype=np.float64))


def nrmse(values: Floats, fitted: Floats) -> float:
    """Root mean square error over the range of `values` (eq. 4.3 and 4.4); 0 for a flat signal."""
    spread = float(values.max() - values.min())
    return float(np.sqrt(np.mean((values - fitted) ** 2))) / spread if spread > 0 else 0.0
