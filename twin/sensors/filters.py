"""Recursive filters along the last axis, with parameters that may differ from row to row."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...array_types import Floats
from ..effects import Value
from .effect import along_first

#: One row's parameters to (b, a) of its filter.
Design = Callable[..., tuple[Floats, Floats]]


def filtered(series: Floats, design: Design, *parameters: Value) -> Floats:
    """(..., n) filtered from rest by `design(*parameters)`; parameters that are arrays (k,) go with the first axis.

    A filter is designed once for all rows that share its parameters. `ValueError` for arrays of another k.
    """
    from scipy.signal import lfilter

    if all(np.ndim(parameter) == 0 for parameter in parameters):
        return np.asarray(lfilter(*design(*map(float, parameters)), series, axis=-1))
    columns = [np.broadcast_to(np.ravel(along_first(parameter, series)), series.shape[:1]) for parameter in parameters]
    output, (different, which) = np.empty(series.shape), np.unique(columns, axis=1, return_inverse=True)
    for number, row in enumerate(different.T):
        alike = which.ravel() == number
        output[alike] = lfilter(*design(*map(float, row)), series[alike], axis=-1)
    return output
