"""The promise of speed: `make bench-full`."""

from __future__ import annotations

import pytest

from benchmarks import gun

pytestmark = pytest.mark.bench


def test_ten_thousand_shots_are_a_hundred_times_faster_than_a_loop():
    result = gun.race(gun.three_effects)
    assert result.difference <= gun.ACCURACY
    assert result.factor >= 100, f"{result.factor:.0f} times"
