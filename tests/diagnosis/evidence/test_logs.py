"""Sums of what is kept as logarithms, where the numbers themselves are out of reach."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.diagnosis.evidence.logs import log_mean, log_sum


@pytest.mark.parametrize("shift", [-2000.0, 0.0, 2000.0])
def test_sum_is_the_sum_wherever_it_lies(shift):
    table = shift + np.log([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    assert float(log_sum(table)) == pytest.approx(shift + np.log(21), rel=1e-14)
    assert log_sum(table, axis=0) == pytest.approx(shift + np.log([5, 7, 9]), rel=1e-14)
    assert log_sum(table, axis=1) == pytest.approx(shift + np.log([6, 15]), rel=1e-14)
    assert log_mean(table) == pytest.approx(shift + np.log(3.5), rel=1e-14)


def test_what_is_impossible_adds_nothing():
    assert log_sum([[-np.inf, -np.inf], [-np.inf, 1.5]], axis=1).tolist() == [-np.inf, 1.5]
    assert log_mean([0.0, -np.inf]) == pytest.approx(-np.log(2))
