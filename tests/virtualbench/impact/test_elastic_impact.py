"""The virtual impact against Hertz, Newton and its own step."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.impact.build import (
    MATERIALS,
    Impactor,
    contact_material,
    hammer,
    projectile,
    target,
)
from pyroshock.virtualbench.impact.strike import ImpactTruth, strike, strike_many

STEEL = contact_material("steel")
BALL = Impactor(STEEL, tip_radius_m=0.01, mass_kg=0.0327)
WALL = target("steel", 0.05)
MODULUS = 1 / (2 * STEEL.compliance_1_pa)
STIFFNESS = 4 / 3 * MODULUS * math.sqrt(BALL.tip_radius_m)


def _strikes(
    speeds: list[float], effects: Effects, *, impactor: Impactor = BALL, steps: int = 250
) -> list[ImpactTruth]:
    count = len(speeds)
    rng = np.random.default_rng(0)
    return strike_many(
        [impactor] * count,
        [WALL] * count,
        effects,
        speeds,
        rng,
        steps_per_contact=steps,
        tail_s=1e-4,
    )


def _impulse(impact: ImpactTruth) -> float:
    return float(np.trapezoid(impact.force_n, impact.time_s))


@pytest.mark.parametrize("speed", [0.01, 1.0, 30.0])
def test_contact_time_and_peak_force_of_hertz(speed: float) -> None:
    """Contact time 2 (d / v) times the integral of (1 - x^2.5)^-1/2, with d the deepest
    indentation."""
    deepest = (5 * BALL.mass_kg * speed**2 / (4 * STIFFNESS)) ** 0.4
    integral = 0.4 * math.sqrt(math.pi) * math.gamma(0.4) / math.gamma(0.9)
    (impact,) = _strikes([speed], Effects.none())
    assert impact.contact_time_s == pytest.approx(2 * integral * deepest / speed, rel=1e-5)
    printed = 2.87 * (BALL.mass_kg**2 / (BALL.tip_radius_m * MODULUS**2 * speed)) ** 0.2
    assert impact.contact_time_s == pytest.approx(printed, rel=2e-3)
    assert impact.peak_force_n == pytest.approx(STIFFNESS * deepest**1.5, rel=1e-4)
    assert impact.force_n.max() == pytest.approx(impact.peak_force_n, rel=1e-3)


def test_elastic_impact_loses_nothing_and_lasts_by_the_fifth_root_of_speed() -> None:
    """Nor does a worn tip lose, nor one of finite height: their forces depend on the indentation
    alone."""
    soft = Impactor(contact_material("delrin"), 0.03, 0.3, tip_height_m=0.015)
    worn = Effects.only("contact.tip_geometry", 3.0)
    slow, middle, fast = _strikes([0.1, 1.0, 10.0], Effects.none())
    for impact in (slow, middle, fast, *_strikes([0.1, 1.0], worn, impactor=soft)):
        assert impact.restitution**2 == pytest.approx(1.0, abs=1e-4)
    assert math.log(fast.contact_time_s / slow.contact_time_s) / math.log(100) == pytest.approx(
        -0.2, abs=1e-4
    )


def test_impulse_is_the_change_of_momentum() -> None:
    speeds = [0.3, 1.0, 2.0]
    effects = Effects.default()
    rng = np.random.default_rng(4)
    for tip, radius in (("aluminum", 0.03), ("delrin", 0.03), ("polyurethane", 0.015)):
        struck = target("aluminum", 0.02, anvil_material="steel")
        for impact in strike_many([hammer(tip, radius)] * 3, [struck] * 3, effects, speeds, rng):
            change = impact.mass_kg * impact.velocity_m_s * (1 + impact.restitution)
            assert _impulse(impact) == pytest.approx(change, rel=2e-4)


def test_error_falls_with_the_square_of_the_step_and_the_default_one_resolves_a_blow() -> None:
    """Between second and fourth order: Hertz's force has no second derivative at the ends of
    contact."""
    effects = Effects.only("contact.plate_compliance")
    exact = _strikes([1.0], effects, steps=2000)[0].contact_time_s
    coarse, middle, fine = (
        abs(_strikes([1.0], effects, steps=steps)[0].contact_time_s / exact - 1)
        for steps in (25, 50, 100)
    )
    assert coarse < 1e-4
    assert middle < coarse / 4
    assert fine < middle / 4
    effects = Effects.default().without("bench.hand_scatter")
    usual, precise = (
        _strikes([1.0], effects, impactor=hammer("aluminum", 0.03), steps=n)[0] for n in (250, 2500)
    )
    assert usual.restitution == pytest.approx(precise.restitution, abs=1e-4)
    assert usual.contact_time_s == pytest.approx(precise.contact_time_s, rel=5e-4)
    assert usual.peak_force_n == pytest.approx(precise.peak_force_n, rel=1e-4)


def test_many_are_as_one() -> None:
    """Impacts of very different length, solved abreast, do not know of each other."""
    effects = Effects.default().without("bench.hand_scatter")
    rng = np.random.default_rng(0)
    impactors, speeds = (
        [hammer("aluminum", 0.03), hammer("polyurethane", 0.015), projectile(0.5, "steel", 0.045)],
        [1, 1, 20],
    )
    targets = [
        target("steel", 0.01),
        target("aluminum", 0.01, anvil_material="steel", insulator="polymeric"),
        WALL,
    ]
    for together, impactor, struck, speed in zip(
        strike_many(impactors, targets, effects, speeds, rng),
        impactors,
        targets,
        speeds,
        strict=True,
    ):
        alone = strike(impactor, struck, effects, speed, rng)
        np.testing.assert_array_equal(together.plate_force_n, alone.plate_force_n)
        assert (together.restitution, together.contact_time_s) == (
            alone.restitution,
            alone.contact_time_s,
        )


@settings(max_examples=12)
@given(
    tip=st.sampled_from(sorted(MATERIALS)),
    mass=st.floats(0.05, 1.0),
    speed=st.floats(0.05, 80.0),
    thickness=st.floats(0.008, 0.05),
    anvil=st.sampled_from([("none", "none"), ("aluminum", "none"), ("steel", "polymeric")]),
    strength=st.floats(0.0, 3.0),
)
def test_no_impact_gains_energy(
    tip: str, mass: float, speed: float, thickness: float, anvil: tuple[str, str], strength: float
) -> None:
    effects = Effects.default().with_strength("contact.plate_compliance", strength)
    struck = target("aluminum", thickness, anvil_material=anvil[0], insulator=anvil[1])
    impact = strike(projectile(mass, tip, 0.03), struck, effects, speed, np.random.default_rng(1))
    assert abs(impact.restitution) <= 1
    assert np.all(impact.force_n >= 0)
    assert np.all(np.isfinite(impact.plate_force_n))
    assert impact.contact_time_s <= impact.time_s[-1]
