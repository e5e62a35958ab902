"""The gap of configurations, some of which lack what others show."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.diagnosis.gap_reduction import Gaps


def test_mean_over_configurations_is_that_over_all_cells() -> None:
    """A configuration with one cell of three counts for a third of the others, as in the gap of the report."""
    rng = np.random.default_rng(0)
    mean = rng.standard_normal((5, 3))
    mean[1, 1:] = np.nan
    mean[4] = np.nan
    variance = np.full(mean.shape, 0.2)
    gaps = Gaps((), np.ones(3), mean, variance, np.zeros(5), 4)
    assert gaps.rows.tolist() == [0, 1, 2, 3]
    assert gaps.squares()[gaps.rows].mean() == pytest.approx(np.nanmean(mean**2))
    assert gaps.floor[gaps.rows].mean() == pytest.approx(0.2)
    assert gaps.squares()[1] == pytest.approx(mean[1, 0] ** 2 / 2.5)
