"""The law of force in an impact's own units."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.twin.contact.numbers import Numbers, Spring, pace, rates
from scipy.integrate import quad


def _numbers(n: int = 1, **values: float) -> Numbers:
    columns = {"exponent": 1.5, "damping": 0.0, "inelasticity": 0.0, "compliance": 0.0, "stiffening": 0.0}
    columns |= {"yield_depth": np.inf, **values}
    return Numbers(**{name: np.full(n, value) for name, value in columns.items()})


@pytest.mark.parametrize("stiffening", [0.0, 1e-9, 1e-8, 2e-8, 1e-4, 0.3, 100.0])
def test_a_layer_gives_way_by_the_integral_of_its_compliance(stiffening: float) -> None:
    """By beta / (1 + h f) for each f; quad's own error is 1e-14."""
    numbers = _numbers(2, compliance=3.0, stiffening=stiffening)
    forces = np.array([0.5, 2.0])
    expected = [quad(lambda f: 3.0 / (1 + stiffening * f), 0, force, epsabs=0, epsrel=1e-13)[0] for force in forces]
    assert numbers.layer(forces) == pytest.approx(expected, rel=1e-12)


def test_a_layer_without_force_gives_way_by_nothing() -> None:
    assert _numbers(2, compliance=3.0, stiffening=0.5).layer(np.zeros(2)).tolist() == [0.0, 0.0]


def test_the_layers_rate_is_that_of_what_it_gives_way() -> None:
    """x' / xi' = 1 + d layer / d xi, by a central difference."""
    numbers = _numbers(3, compliance=2.0, stiffening=0.7)
    spring = Spring.loading(numbers)
    depth, small = np.array([0.2, 0.8, 1.5]), 1e-5
    around = [numbers.layer(spring(depth + side * small)[0]) for side in (-1, 1)]
    now = pace(numbers, spring, depth, np.ones(3))
    assert now.approach / now.indentation == pytest.approx(1 + (around[1] - around[0]) / (2 * small), rel=1e-9)


def test_no_force_where_the_bodies_are_apart() -> None:
    spring = Spring(np.array([1.5, 2.0]), np.array([2.0, 3.0]), np.array([0.3, 0.0]), np.full(2, np.inf))
    force, slope = spring(np.array([0.1, -0.2]))
    assert force.tolist() == slope.tolist() == [0.0, 0.0]


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.2])
def test_force_follows_its_tangent_from_the_depth_of_yield_on(exponent: float) -> None:
    spring = Spring.loading(_numbers(4, exponent=exponent, yield_depth=0.5))
    force, slope = spring(np.array([0.25, 0.5, 0.7, 2.0]))
    tangent = exponent * 0.5 ** (exponent - 1)
    assert force == pytest.approx([0.25**exponent, *(0.5**exponent + tangent * np.array([0.0, 0.2, 1.5]))], rel=1e-14)
    assert slope == pytest.approx([exponent * 0.25 ** (exponent - 1), *[tangent] * 3], rel=1e-14)


def test_rates_of_change_are_those_of_the_motion() -> None:
    """Of approach and force, by a central difference along the motion."""
    numbers = _numbers(3, damping=0.4, inelasticity=0.3, compliance=0.6, stiffening=0.9, yield_depth=0.6)
    spring = Spring.loading(numbers)
    depth, velocity, small = np.array([0.2, 0.4, 0.9]), np.array([0.9, 0.3, -0.4]), 1e-6
    now = rates(numbers, spring, depth, velocity)
    before, after = (
        rates(numbers, spring, depth + by * now.indentation, velocity - by * now.force) for by in (-small, small)
    )
    assert now.force_rate == pytest.approx((after.force - before.force) / (2 * small), rel=1e-8)
    assert now.approach_rate == pytest.approx((after.approach - before.approach) / (2 * small), rel=1e-8)
