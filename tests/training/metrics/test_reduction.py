"""How much of an error disappears, and how sure it is."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.training.evaluation.summary import fraction, fraction_interval


def test_fraction_agrees_with_what_is_printed() -> None:
    """The numbers of the report's example: (0.041 - 0.011) / (0.041 - 0.009)."""
    squares = [np.array(each**2) for each in (0.041, 0.011, 0.009)]
    assert float(fraction(*squares)) == pytest.approx(0.9375)


def test_interval_widens_with_what_is_unsure() -> None:
    rng = np.random.default_rng(0)
    squares = 9 + rng.random(12), 1 + rng.random(12), np.ones(12)
    plain = fraction_interval(*squares, np.random.default_rng(1))
    wider = fraction_interval(*squares, np.random.default_rng(1), training_error=0.1)
    assert plain is not None and wider is not None
    assert wider[0] < plain[0] < plain[1] < wider[1] <= 1.0


def test_interval_needs_three_configurations() -> None:
    assert fraction_interval(np.ones(2), np.zeros(2), np.zeros(2), np.random.default_rng(0)) is None
