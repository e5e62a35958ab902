"""The ball valve's port as the ball turns."""

from __future__ import annotations

import numpy as np
from pyroshock.virtualbench.gun.valve import DEAD_SHARE, RANGEABILITY, open_share, valve_moments


def test_port_opens_from_nothing_to_all() -> None:
    shares = [open_share(turned) for turned in np.linspace(-0.1, 1.2, 131)]
    assert np.diff(shares).min() >= 0
    assert (shares[0], open_share(DEAD_SHARE), open_share(1.0), shares[-1]) == (0.0, 0.0, 1.0, 1.0)


def test_equal_steps_of_travel_multiply_the_flow_equally() -> None:
    """IEC 60534-2-4: R^(h - 1) of the flow, here less what it leaves at h = 0, over the span of the rest."""
    travel = np.linspace(0, 1, 11)
    shares = np.array([open_share(DEAD_SHARE + h * (1 - DEAD_SHARE)) for h in travel])
    law = RANGEABILITY ** (travel - 1)
    np.testing.assert_allclose(shares, (law - law[0]) / (1 - law[0]), atol=1e-12)
    steps = np.diff(shares)
    np.testing.assert_allclose(steps[1:] / steps[:-1], RANGEABILITY**0.1, rtol=1e-9)


def test_valve_is_open_after_its_opening_time() -> None:
    begin, end = valve_moments(0.4)
    assert open_share(begin / 0.4) == 0.0
    assert open_share(end / 0.4) == 1.0
    assert open_share((begin + 1e-3) / 0.4) > 0
