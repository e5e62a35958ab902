"""The law of force in an impact's own units, and eq. 1.17: unloading with a permanent
indentation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pyroshock.array_types import Floats
from pyroshock.twin.contact.hertz import hertz
from pyroshock.twin.contact.impact import solve
from pyroshock.twin.contact.impacts import Impacts
from pyroshock.twin.contact.kernel import Law, layer, rates, spring, unloading
from scipy.integrate import quad
from support.records.contact_bodies import impacts


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
    assert now.approach / now.indentation == pytest.approx(
        1 + (after - before) / (2 * small), rel=1e-9
    )


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.2])
def test_force_follows_its_tangent_from_the_depth_of_yield_on(exponent: float) -> None:
    """No force where the bodies are apart."""
    law = _law(exponent=exponent, yield_depth=0.5)
    force, slope = zip(*(spring(law, depth) for depth in (0.25, 0.5, 0.7, 2.0)), strict=True)
    tangent = exponent * 0.5 ** (exponent - 1)
    assert force == pytest.approx(
        [0.25**exponent, *(0.5**exponent + tangent * np.array([0.0, 0.2, 1.5]))], rel=1e-14
    )
    assert slope == pytest.approx([exponent * 0.25 ** (exponent - 1), *[tangent] * 3], rel=1e-14)
    assert spring(_law(exponent=1.5, factor=2.0, rest=0.3), 0.1) == (0.0, 0.0)
    assert spring(_law(exponent=2.0, factor=3.0), -0.2) == (0.0, 0.0)


@pytest.mark.parametrize("hardening", [0.2, 0.7, 1.0, 1.0 + 1e-9, 1.25, 1.5])
def test_hardening_force_is_the_integral_of_a_slope_that_goes_as_a_power_of_the_depth(
    hardening: float,
) -> None:
    """Beyond yield the slope is p c d_y^(p-1) (d / d_y)^(r-1), by quad; r = p is c d^p, as though
    nothing yielded."""
    for exponent in (1.0, 1.5, 2.2):
        law = _law(exponent=exponent, factor=3.0, yield_depth=0.5, hardening=hardening)
        at_yield, steepness = 3.0 * 0.5**exponent, 3.0 * exponent * 0.5 ** (exponent - 1)
        assert spring(law, 0.5) == pytest.approx((at_yield, steepness), rel=1e-14)
        for depth in (0.5 + 1e-9, 0.7, 40.0):
            slope = steepness * (depth / 0.5) ** (hardening - 1)
            more = quad(
                lambda d, s=steepness: s * (d / 0.5) ** (hardening - 1), 0.5, depth, epsrel=1e-13
            )[0]
            assert spring(law, depth) == pytest.approx((at_yield + more, slope), rel=1e-12)
        elastic = spring(_law(exponent=exponent, factor=3.0), 0.9)
        assert spring(law._replace(hardening=exponent), 0.9) == pytest.approx(elastic, rel=1e-14)


@pytest.mark.parametrize("hardening", [0.5, 1.0, 1.3])
@pytest.mark.parametrize(("depth", "velocity"), [(0.2, 0.9), (0.4, 0.3), (0.9, -0.4)])
def test_rates_of_change_are_those_of_the_motion(
    depth: float, velocity: float, hardening: float
) -> None:
    """Of approach and force, by a central difference along the motion."""
    beside = {"damping": 0.4, "inelasticity": 0.3, "compliance": 0.6, "stiffening": 0.9}
    law, small = _law(**beside, yield_depth=0.6, hardening=hardening), 1e-6
    now = rates(law, depth, velocity)
    before, after = (
        rates(law, depth + by * now.indentation, velocity - by * now.force)
        for by in (-small, small)
    )
    assert now.force_rate == pytest.approx((after.force - before.force) / (2 * small), rel=1e-8)
    assert now.approach_rate == pytest.approx(
        (after.approach - before.approach) / (2 * small), rel=1e-8
    )


PEAK, DEEPEST, PERMANENT = np.array([800.0]), np.array([3e-4]), np.array([1e-4])


def unloading_force(
    indentation_m: Floats,
    peak_force_n: Floats,
    deepest_m: Floats,
    permanent_m: Floats,
    exponent: Floats | float = 1.5,
) -> Floats:
    """F = F_max ((delta - delta_p) / (delta_max - delta_p))^n, 0 below delta_p; arguments
    broadcast.

    Raises `ValueError` unless 0 <= delta_p < delta_max.
    """
    if np.any((permanent_m < 0) | (permanent_m >= deepest_m)):
        raise ValueError("permanent_m: expected 0 or more, and less than deepest_m")
    share = np.clip((indentation_m - permanent_m) / (deepest_m - permanent_m), 0.0, None)
    return np.asarray(peak_force_n * share**exponent)


def returned_work(
    peak_force_n: Floats, deepest_m: Floats, permanent_m: Floats, exponent: Floats | float = 1.5
) -> Floats:
    """Area below eq. 1.17 (J): F_max (delta_max - delta_p) / (n + 1)."""
    return np.asarray(peak_force_n * (deepest_m - permanent_m) / (exponent + 1))


def restitution_of_loop(
    loading_work_j: Floats,
    peak_force_n: Floats,
    deepest_m: Floats,
    permanent_m: Floats,
    exponent: Floats | float = 1.5,
) -> Floats:
    """e = sqrt(W_r / W_c) of a loading of known work and its unloading after eq. 1.17 (eq.
    1.11)."""
    return np.sqrt(returned_work(peak_force_n, deepest_m, permanent_m, exponent) / loading_work_j)


def test_curve_runs_from_the_peak_to_what_stays_if_anything_yielded() -> None:
    depth = np.array([0.5e-4, 1e-4, 2e-4, 3e-4])
    assert unloading_force(depth, PEAK, DEEPEST, PERMANENT) == pytest.approx(
        [0, 0, 800 / 2**1.5, 800]
    )
    # Hertz' loading and eq. 1.17 without a mark are one curve: the loop has no area, e = 1.
    law = Law(1.5, 1.0, 0.0, 0.9, 0.0, 0.0, 0.0, 0.0)
    assert unloading(law, 0.8) == law._replace(yield_depth=np.inf)
    # Beyond yield the two forces meet at the turn, and what is left is delta_max (1 - F_max / F_e).
    for hardening in (0.3, 0.8, 1.0, 1.2):
        law = _law(yield_depth=0.5, hardening=hardening)
        back, (force, _) = unloading(law, 2.0), spring(law, 2.0)
        assert spring(back, 2.0)[0] == pytest.approx(force, rel=1e-14)
        assert (back.rest, back.hardening) == (
            pytest.approx(2.0 * (1 - force / 2.0**1.5), rel=1e-14),
            1.0,
        )
    assert restitution_of_loop(0.4 * PEAK * DEEPEST, PEAK, DEEPEST, 0 * DEEPEST) == pytest.approx(
        [1.0]
    )


@pytest.mark.parametrize("exponent", [1.0, 1.5, 2.0])
def test_returned_work_is_the_area_below(exponent: float) -> None:
    """Impossible marks are refused."""
    depth = np.linspace(1e-4, 3e-4, 4001)
    area = np.trapezoid(unloading_force(depth, PEAK, DEEPEST, PERMANENT, exponent), depth)
    assert returned_work(PEAK, DEEPEST, PERMANENT, exponent) == pytest.approx([area], rel=1e-6)
    for permanent in (-1e-6, 3e-4):
        with pytest.raises(ValueError, match="permanent_m: expected"):
            unloading_force(DEEPEST, PEAK, DEEPEST, np.array([permanent]))


@pytest.mark.parametrize("hardening", [0.3, 1.0, 1.3])
def test_loop_area_is_the_energy_lost(hardening: float) -> None:
    """Of a solved impact: loading work minus returned work against the kinetic energy, and e =
    sqrt(W_r / W_c)."""
    bodies = impacts()
    nominal = Impacts.of(bodies)
    load = 0.2 * hertz(bodies).peak_force_n
    pulse = solve(replace(nominal, yield_load_n=load, hardening_exponent=np.array([hardening])))
    depth = np.linspace(0, pulse.deepest_indentation_m[0], 20_001)
    stiffness = nominal.stiffness_n_mp
    reach = (load / stiffness) ** (2 / 3)
    beyond = load * (1 + 1.5 * ((np.maximum(depth, reach) / reach) ** hardening - 1) / hardening)
    loading = np.where(depth < reach, stiffness * depth**1.5, beyond)
    work = np.trapezoid(loading, depth)
    loop = (pulse.peak_force_n, pulse.deepest_indentation_m, pulse.permanent_indentation_m)
    assert work == pytest.approx(0.32 / 2 * 1.2**2, rel=1e-6)
    kinetic = 0.32 / 2 * (1.2**2 - pulse.separation_velocity_m_s**2)
    assert work - returned_work(*loop) == pytest.approx(kinetic, rel=1e-6)
    assert restitution_of_loop(work, *loop) == pytest.approx(pulse.restitution.value, rel=1e-6)
