"""The ball valve's port as the ball turns."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pyroshock.virtualbench.gun.valve import DEAD_SHARE, open_share, valve_moments


def test_port_opens_from_nothing_to_all() -> None:
    shares = [open_share(turned) for turned in np.linspace(-0.1, 1.2, 131)]
    assert np.diff(shares).min() >= 0
    assert (shares[0], open_share(DEAD_SHARE), open_share(1.0), shares[-1]) == (0.0, 0.0, 1.0, 1.0)


def test_half_way_is_the_lens_of_two_circles() -> None:
    """Circles of diameter 1, half a diameter apart: 2 r^2 acos(d / 2r) - d sqrt(r^2 - d^2 / 4), over pi r^2."""
    lens = 2 * 0.25 * math.acos(0.5) - 0.5 * math.sqrt(0.25 - 0.0625)
    assert open_share((1 + DEAD_SHARE) / 2) == pytest.approx(lens / (math.pi * 0.25))


def test_valve_is_open_after_its_opening_time() -> None:
    begin, end = valve_moments(0.4)
    assert open_share(begin / 0.4) == 0.0
    assert open_share(end / 0.4) == 1.0
    assert open_share((begin + 1e-3) / 0.4) > 0
