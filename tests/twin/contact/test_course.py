"""Force between the nodes: against scipy's cubics, and their summits against the roots of their
slopes."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.twin.contact.impact import ForceHistory, peak_force
from pyroshock.twin.contact.integrate_contact import March, Nodes
from scipy.interpolate import CubicHermiteSpline

#: Three contacts with as many nodes as they took: time, force and rate of each node.
NODES = (
    (
        np.array([0.0, 0.3, 0.5, 1.2, 2.0]),
        np.array([0.0, 2.0, 2.5, 1.5, 0.0]),
        np.array([5.0, 4.0, -1.0, -2.0, -0.5]),
    ),
    (np.array([0.0, 0.5]), np.array([0.0, 0.0]), np.array([3.0, -1.0])),
    (np.array([0.0, 1.0, 4.0]), np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.8, 0.0])),
)
PHASES = np.array([0.0, 1e-9, 0.1, 0.15, 0.25, 0.5, 0.777, 1.0])


def _nodes(nodes=NODES) -> Nodes:
    first = np.cumsum([0, *(len(time) for time, _, _ in nodes)])
    return Nodes(first, *(np.concatenate([one[what] for one in nodes]) for what in range(3)))


def _march(nodes=NODES, ends: list[float] | None = None) -> March:
    end = np.array([time[-1] for time, _, _ in nodes] if ends is None else ends)
    nothing = np.zeros(len(nodes))
    return March(
        end, nothing, nothing, nothing, nothing, np.ones(len(nodes), dtype=bool), _nodes(nodes)
    )


def _by_scipy(nodes=NODES) -> np.ndarray:
    rows = [CubicHermiteSpline(*one)(PHASES * one[0][-1]) for one in nodes]
    return np.maximum(rows, 0.0)


def test_between_nodes_lie_scipys_cubics() -> None:
    """Each contact at phases of its own in any order of them, too."""
    assert ForceHistory.of(_march()).at(PHASES) == pytest.approx(_by_scipy(), rel=1e-13, abs=1e-15)
    own = np.stack([PHASES, PHASES[::-1], PHASES**2])
    expected = [
        CubicHermiteSpline(*one)(phases * one[0][-1])
        for one, phases in zip(NODES, own, strict=True)
    ]
    assert ForceHistory.of(_march()).at(own) == pytest.approx(
        np.maximum(expected, 0.0), rel=1e-13, abs=1e-15
    )


def test_no_force_pulls_and_nodes_at_and_a_digit_beyond_the_end_are_the_end() -> None:
    falls = ((np.array([0.0, 1.0]), np.array([1.0, 0.0]), np.array([0.0, 2.0])),)
    forces = ForceHistory.of(_march(falls)).at(np.linspace(0, 1, 50))
    assert CubicHermiteSpline(*falls[0])(0.8) < 0
    assert forces.min() == 0
    # The way left may be nothing: then the end is the last node.
    twice = ((np.array([0.0, 1.0, 1.0]), np.array([0.0, 1.0, 0.25]), np.array([2.0, -1.0, -1.0])),)
    assert ForceHistory.of(_march(twice)).at(np.array([0.0, 1.0])).tolist() == [[0.0, 0.25]]
    after = (
        (np.array([0.0, 0.5, 1.0 + 1e-15]), np.array([0.0, 1.0, 0.0]), np.array([2.0, 0.0, -2.0])),
    )
    assert ForceHistory.of(_march(after, ends=[1.0])).phase.tolist() == [0.0, 0.5, 1.0]


def test_peak_is_the_greatest_of_nodes_and_cubics() -> None:
    """Also of a cubic that is level at its end, whose slope touches nothing there and only there: a
    root that rounding can take away; and at a node without a rate."""
    fine = np.linspace(0, 1, 20_001)
    expected = [CubicHermiteSpline(*one)(fine * one[0][-1]).max() for one in NODES]
    assert peak_force(_nodes()) == pytest.approx(expected, rel=1e-7)
    for rise in (0.1, 0.3, 0.7, 1.1, 3.3):
        touching = ((np.array([0.0, 1.0]), np.array([0.0, rise / 3]), np.array([rise, 0.0])),)
        assert peak_force(_nodes(touching)) == pytest.approx([rise / 3], rel=1e-12)
    flat = ((np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, -1.0])),)
    assert peak_force(_nodes(flat)).tolist() == [1.0]
    # Every cubic that rises at first and falls at last, against the roots of its slope.
    rng = np.random.default_rng(5)
    n = 200
    begin, end = rng.uniform(0, 1, n), rng.uniform(0, 1, n)
    rises, falls = 10 ** rng.uniform(-3, 2, n), -(10 ** rng.uniform(-3, 2, n))
    width = 10 ** rng.uniform(-2, 1, n)
    nodes = [
        (np.array([0.0, w]), np.array([b, e]), np.array([r, f]))
        for w, b, e, r, f in zip(width, begin, end, rises, falls, strict=True)
    ]
    cubics = [CubicHermiteSpline(*one) for one in nodes]
    tops = [cubic.derivative().roots(extrapolate=False) for cubic in cubics]
    expected = [cubic([*cubic.x, *at]).max() for cubic, at in zip(cubics, tops, strict=True)]
    assert peak_force(_nodes(nodes)) == pytest.approx(expected, rel=1e-10)
