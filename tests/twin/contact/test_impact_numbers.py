"""The law of force in an impact's own units."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.twin.contact.kernel import Law, layer, rates, spring
from scipy.integrate import quad


def _law(**values: float) -> Law:
    nothing = dict.fromkeys(("rest", "damping", "inelasticity", "compliance", "stiffening"), 0.0)
    return Law(**{"exponent": 1.5, "factor": 1.0, **nothing, "yield_depth": np.inf, **values})


@pytest.mark.parametrize("stiffening", [0.0, 1e-9, 1e-8, 2e-8, 1e-4, 0.3, 0.5, 100.0])
def test_a_layer_gives_way_by_the_integral_of_its_compliance(stiffening: float) -> None:
    """By beta / (1 + h f) for each f; quad's own error is 1e-14."""
    law = _law(compliance=3.0, stiffening=stiffening)
    for force in (0.5, 2.0):
        expected = quad(lambda f: 3.0 / (1 + stiffening * f), 0, force, epsabs=0, epsrel=1e-13)[0]
        assert layer(law, force) == pytest.approx(expected, rel=1e-12)
    assert layer(law, 0.0) == 0.0


@pytest.mark.parametrize("depth", [0.2, 0.8, 1.5])
def test_the_layers_rate_is_that_of_what_it_gives_way(depth: float) -> None:
    """x' / xi' = 1 + d layer / d xi, by a central difference."""
    law, small = _law(compliance=2.0, stiffening=0.7), 1e-5
    before, after = (layer(law, spring(law, depth + side * small)[0]) for side in (-1, 1))
    now = rates(law, depth, 1.0)
    assert now.approach / now.indentation == pytest.approx(1 + (after - before) / (2 * small), rel=1e-9)


@pytest.mark.parametrize(("exponent", "factor", "rest", "depth"), [(1.5, 2.0, 0.3, 0.1), (2.0, 3.0, 0.0, -0.2)])
def test_no_force_where_the_bodies_are_apart(exponent: float, factor: float, rest: float, depth: float) -> None:
    assert spring(_law(exponent=exponent, factor=factor, rest=rest), depth) == (0.0, 0.0)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.2])
def test_force_follows_its_tangent_from_the_depth_of_yield_on(exponent: float) -> None:
    law = _law(exponent=exponent, yield_depth=0.5)
    force, slope = zip(*(spring(law, depth) for depth in (0.25, 0.5, 0.7, 2.0)), strict=True)
    tangent = exponent * 0.5 ** (exponent - 1)
    assert force == pytest.approx([0.25**exponent, *(0.5**exponent + tangent * np.array([0.0, 0.2, 1.5]))], rel=1e-14)
    assert slope == pytest.approx([exponent * 0.25 ** (exponent - 1), *[tangent] * 3], rel=1e-14)


@pytest.mark.parametrize(("depth", "velocity"), [(0.2, 0.9), (0.4, 0.3), (0.9, -0.4)])
def test_rates_of_change_are_those_of_the_motion(depth: float, velocity: float) -> None:
    """Of approach and force, by a central difference along the motion."""
    law, small = _law(damping=0.4, inelasticity=0.3, compliance=0.6, stiffening=0.9, yield_depth=0.6), 1e-6
    now = rates(law, depth, velocity)
    before, after = (rates(law, depth + by * now.indentation, velocity - by * now.force) for by in (-small, small))
    assert now.force_rate == pytest.approx((after.force - before.force) / (2 * small), rel=1e-8)
    assert now.approach_rate == pytest.approx((after.approach - before.approach) / (2 * small), rel=1e-8)
