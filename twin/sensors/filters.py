"""Recursive filters along the last axis, with parameters that may differ from row to row."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..effects import Floats, Value

#: One row's parameters to (b, a) of its filter.
Design = Callable[..., tuple[Floats, Floats]]


def filtered(series: Floats, design: Design, *parameters: Value) -> Floats:
    """(..., n) filtered from rest by `design(*parameters)`; parameters that are arrays (k,) go with the first axis."""
    from scipy.signal import lfilter

    if all(np.ndim(each) == 0 for each in parameters):
        return np.asarray(lfilter(*design(*map(float, parameters)), series, axis=-1))
    columns = [np.broadcast_to(np.asarray(each, dtype=np.float64), series.shape[:1]) for each in parameters]
    rows = zip(series, *columns, strict=True)
    return np.stack([np.asarray(lfilter(*design(*map(float, row)), each, axis=-1)) for each, *row in rows])
