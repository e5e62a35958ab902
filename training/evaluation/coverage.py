"""Whether intervals hold what they promise."""

from __future__ import annotations

import numpy as np

from ...array_types import Floats
from ...dataset.table import PulseTable
from ..models.base import ContactPrediction

#: Nominal shares that are looked at.
LEVELS = np.concatenate([np.arange(0.1, 0.9, 0.1), [0.9, 0.95, 0.99]])


def coverage(scores: Floats, levels: Floats = LEVELS) -> Floats:
    """Share of standardised errors within the central normal interval of each of `levels`."""
    from scipy.special import ndtri

    return np.asarray(np.mean(np.abs(scores.ravel()) <= ndtri((1 + levels) / 2)[:, None], axis=1))


def standardised(pulses: PulseTable, prediction: ContactPrediction, name: str) -> Floats | None:
    """Errors of "force" (n, 20) or "contact time" (n,) in spreads; None for a model without."""
    spread = prediction.force_spread_n if name == "force" else prediction.contact_time_spread_s
    if spread is None:
        return None
    force = name == "force"
    off = (
        prediction.force_n - pulses.force_n
        if force
        else prediction.contact_time_s - pulses.contact_time_s
    )
    # Where a law is certain (the ends of a hybrid's pulse) any error is beyond all of its
    # intervals.
    return np.divide(off, spread, out=np.where(off == 0, 0.0, np.inf), where=spread > 0)
