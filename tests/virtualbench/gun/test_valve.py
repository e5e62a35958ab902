"""The ball valve's port as the ball turns."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.virtualbench.gun.gas import DEAD_SHARE, RANGEABILITY, ValveWay, open_share


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


def test_kinks_are_where_the_port_begins_to_open_and_where_the_ball_turns_otherwise() -> None:
    way = ValveWay((0.1, 0.5, 0.6, 0.8), (0.0, 1.0, 1.0, 0.1))
    begin, end = 0.1 + 0.4 * DEAD_SHARE, 0.6 + 0.2 * (1 - DEAD_SHARE) / 0.9
    assert way.kinks_s == pytest.approx((0.1, begin, 0.5, 0.6, end, 0.8))
    assert open_share(way.position(begin - 1e-9)) == 0.0
    assert open_share(way.position(begin + 1e-3)) > 0.0
    assert open_share(way.position(end - 1e-3)) > 0.0
    assert open_share(way.position(end + 1e-9)) == 0.0
    assert [way.position(t) for t in (0.0, 0.3, 0.55, 0.7, 5.0)] == pytest.approx([0.0, 0.5, 1.0, 0.55, 0.1])


@pytest.mark.parametrize(
    ("moments", "positions"),
    [((), ()), ((0.0, 0.0), (0.0, 1.0)), ((0.0,), (1.2,)), ((-1.0,), (0.0,)), ((0.0, 1.0), (0.0,))],
)
def test_a_way_that_no_ball_has_is_refused(moments: tuple[float, ...], positions: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="expected rising moments"):
        ValveWay(moments, positions)
