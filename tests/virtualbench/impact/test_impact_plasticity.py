"""The elastic-plastic contact against Thornton's closed form, and the law's own continuity."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.impact.build import target
from pyroshock.virtualbench.impact.contact import ContactLaw
from pyroshock.virtualbench.impact.impactors import projectile
from pyroshock.virtualbench.impact.materials import contact_material
from pyroshock.virtualbench.impact.strike import strike_many

YIELD = Effects.only("contact.plastic_yield")
WALL = target("steel", 0.05)
SHOT = projectile(0.5, "steel", 0.03)


def _law(yield_pressure_pa: float = 1e9) -> ContactLaw:
    one = np.ones(1)
    return ContactLaw(1e11 * one, 0.03 * one, yield_pressure_pa * one, math.inf * one, 0 * one)


def _restitution(speeds: list[float], effects: Effects = YIELD) -> list[float]:
    count = len(speeds)
    rng = np.random.default_rng(0)
    return [
        impact.restitution
        for impact in strike_many([SHOT] * count, [WALL] * count, effects, speeds, rng, steps_per_contact=500)
    ]


def _yield_speed() -> float:
    steel = contact_material("steel")
    modulus = 1 / (2 * steel.compliance_1_pa)
    onset = SHOT.tip_radius_m * (math.pi * 3 * steel.yield_strength_pa / (2 * modulus)) ** 2
    energy = 8 / 15 * modulus * math.sqrt(SHOT.tip_radius_m) * onset**2.5
    return math.sqrt(2 * energy / SHOT.mass_kg)


@pytest.mark.parametrize("times", [1.5, 4.0, 30.0])
def test_restitution_of_thornton(times: float) -> None:
    """Thornton 1997, eq. 37: restitution over the speed at which yield begins."""
    ratio = 1 / times
    plastic = ratio / (ratio + 2 * math.sqrt(1.2 - 0.2 * ratio**2))
    expected = math.sqrt(6 * math.sqrt(3) / 5 * (1 - ratio**2 / 6)) * plastic**0.25
    assert _restitution([times * _yield_speed()])[0] == pytest.approx(expected, rel=2e-3)


def test_slower_than_yield_is_elastic() -> None:
    assert _restitution([0.9 * _yield_speed()])[0] == pytest.approx(1.0, abs=1e-4)


def test_restitution_falls_with_the_fourth_root_of_speed() -> None:
    """Johnson, Contact Mechanics, 1985, section 11.5."""
    slow, fast = _restitution([20.0, 80.0])
    assert math.log(fast / slow) / math.log(4) == pytest.approx(-0.25, abs=0.005)


def test_half_the_strength_yields_at_twice_the_pressure() -> None:
    assert _restitution([5.0], Effects.only("contact.plastic_yield", 0.5))[0] > 1.1 * _restitution([5.0])[0]


def test_force_and_slope_are_continuous_at_yield() -> None:
    law = _law()
    onset, step = law.yield_m, 1e-4 * law.yield_m
    below, at, above = (law.force(depth, depth) for depth in (onset - step, onset, onset + step))
    assert (above - at) / (at - below) == pytest.approx(1.0, abs=2e-4)


def test_path_back_starts_where_the_way_in_ended_and_leaves_a_dent() -> None:
    law = _law()
    deepest = 20 * law.yield_m
    assert law.force(deepest * (1 - 1e-12), deepest) == pytest.approx(law.force(deepest, deepest))
    assert law.force(0.5 * deepest, deepest) == 0
    assert law.force(0.95 * deepest, deepest) > 0


def test_no_dent_below_yield() -> None:
    law = _law()
    depth = 0.3 * law.yield_m
    assert law.force(depth, 0.9 * law.yield_m) == pytest.approx(law.stiffness * depth**1.5)


def test_no_force_without_contact() -> None:
    law = _law(math.inf)
    assert law.force(np.array([-1e-6]), np.zeros(1)) == 0
    assert law.force(np.zeros(1), np.zeros(1)) == 0


def test_tip_of_finite_height_is_stiffer() -> None:
    """Dimitriadis et al. 2002: at chi = 0.5, 1 + 0.5665 + 0.32075 + 0.096125 + 0.00609375 of Hertz."""
    one = np.ones(1)
    tip = ContactLaw(1e9 * one, 0.01 * one, math.inf * one, 0.02 * one, 0 * one)
    depth = np.array([0.01])
    assert tip.force(depth, depth) == pytest.approx(tip.stiffness * depth**1.5 * 1.98946875)
