"""How well a score tells two kinds of cases apart."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np


def auroc(of_these: Sequence[float], of_others: Sequence[float]) -> float:
    """The chance that one of these has a larger score than one of the others; ties count half. NaN without both."""
    if not of_these or not of_others:
        return math.nan
    from scipy.stats import rankdata

    ranks = rankdata(np.concatenate([of_these, of_others]))
    n = len(of_these)
    return float((ranks[:n].sum() - n * (n + 1) / 2) / (n * len(of_others)))


def threshold_at(false_share: float, of_others: Sequence[float]) -> float:
    """The least score above which at most `false_share` of the others lie."""
    falling = np.sort(np.asarray(of_others, dtype=np.float64))[::-1]
    allowed = int(false_share * len(falling) + 1e-9)
    return float(falling[allowed]) if allowed < len(falling) else -math.inf


def found_above(of_these: Sequence[float], threshold: float) -> list[bool]:
    """Which of these have a larger score."""
    return [score > threshold for score in of_these]
