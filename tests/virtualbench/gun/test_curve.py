"""The cubic between a shot's points."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.virtualbench.gun.fire import crossings, position_at, velocity_at

TIME = np.array([0.0, 0.3, 0.45, 1.0, 1.4])
WAY = TIME, TIME**3 - TIME, 3 * TIME**2 - 1


def test_cubic_motion_is_exact() -> None:
    moment = np.linspace(0, 1.4, 57)
    assert position_at(*WAY, moment) == pytest.approx(moment**3 - moment, abs=1e-14)
    assert velocity_at(*WAY, moment) == pytest.approx(3 * moment**2 - 1, abs=1e-13)


def test_order_of_convergence_is_four() -> None:
    def error(points: int) -> float:
        time = np.linspace(0, 1, points)
        moment = np.linspace(0, 1, 997)
        return float(
            np.abs(position_at(time, np.sin(6 * time), 6 * np.cos(6 * time), moment) - np.sin(6 * moment)).max()
        )

    assert np.log2(error(21) / error(41)) == pytest.approx(4, abs=0.1)


def test_crossings_are_the_roots() -> None:
    roots = np.roots([1, 0, -1, 0.2])
    assert crossings(*WAY, -0.2) == pytest.approx(np.sort(roots[roots > 0]), abs=1e-12)
    assert position_at(*WAY, crossings(*WAY, 0.7)) == pytest.approx([0.7], abs=1e-12)
    assert crossings(*WAY, 5.0).size == 0


def test_outside_the_points_it_rests() -> None:
    assert position_at(*WAY, np.array([-1.0, 9.0])) == pytest.approx([0.0, 1.4**3 - 1.4])
