"""The contact's law: energies of its own curve beyond yield, Johnson's limit, continuity, the shape
of the tip."""

from __future__ import annotations

import math

import numpy as np
import pytest
from pyroshock.array_types import Floats
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.impact.build import contact_material, projectile, target
from pyroshock.virtualbench.impact.chain import ContactLaw
from pyroshock.virtualbench.impact.kernel import elastic_force
from pyroshock.virtualbench.impact.strike import strike_many
from scipy.integrate import quad

YIELD = Effects.only("contact.plastic_yield")
WALL = target("steel", 0.05)
SHOT = projectile(0.5, "steel", 0.03)


def _law(hardness_pa: float = 1e9) -> ContactLaw:
    one = np.ones(1)
    return ContactLaw(1e11 * one, 0.03 * one, hardness_pa * one, math.inf * one, 0 * one)


def _force(law: ContactLaw, indentation_m: Floats, deepest_m: Floats) -> Floats:
    rows = zip(indentation_m, deepest_m, law.figures, strict=True)
    return np.array([elastic_force(*row) for row in rows])


def _restitution(speeds: list[float], effects: Effects = YIELD) -> list[float]:
    count = len(speeds)
    rng = np.random.default_rng(0)
    return [
        impact.restitution
        for impact in strike_many(
            [SHOT] * count, [WALL] * count, effects, speeds, rng, steps_per_contact=500
        )
    ]


MODULUS = 1 / (2 * contact_material("steel").compliance_1_pa)
HARDNESS = 2.8 * 1.5 * contact_material("steel").yield_strength_pa
#: Mean pressure 0.4 H of a Hertzian contact: a^2 = R d, F = 4/3 E* sqrt(R) d^1.5.
ONSET_M = SHOT.tip_radius_m * (3 * math.pi * 0.4 * HARDNESS / (4 * MODULUS)) ** 2


def _loading(depth_m: float) -> tuple[float, float]:
    """Force (N) and contact radius (m) of Zhao, Maietta and Chang, as their paper has them."""
    first, last, radius = ONSET_M, 54 * ONSET_M, SHOT.tip_radius_m
    if depth_m <= first:
        return 4 / 3 * MODULUS * math.sqrt(radius) * depth_m**1.5, math.sqrt(radius * depth_m)
    if depth_m >= last:
        return 2 * math.pi * radius * depth_m * HARDNESS, math.sqrt(2 * radius * depth_m)
    transition = (depth_m - first) / (last - first)
    area = math.pi * radius * depth_m * (1 - 2 * transition**3 + 3 * transition**2)
    falling = (math.log(last) - math.log(depth_m)) / (math.log(last) - math.log(first))
    return area * (HARDNESS - HARDNESS * (1 - 0.4) * falling), math.sqrt(area / math.pi)


def _energies(depth_m: float) -> tuple[float, float]:
    """Work (J) of the loading up to a depth, and what the way back returns of it: 2/5 F times 3 F /
    (4 E* a)."""
    breaks = [x for x in (ONSET_M, 54 * ONSET_M) if x < depth_m]
    work = quad(lambda depth: _loading(depth)[0], 0, depth_m, points=breaks, limit=200)[0]
    force, contact = _loading(depth_m)
    return work, 0.4 * force * 3 * force / (4 * MODULUS * contact)


def _yield_speed() -> float:
    return math.sqrt(2 * _energies(ONSET_M)[0] / SHOT.mass_kg)


@pytest.mark.parametrize("depth", [1.5, 10.0, 53.0, 300.0])
def test_restitution_of_zhao_maietta_and_chang(depth: float) -> None:
    """Its square is the energy of the way back over that of the way in."""
    work, returned = _energies(depth * ONSET_M)
    restitution = _restitution([math.sqrt(2 * work / SHOT.mass_kg)])[0]
    assert restitution == pytest.approx(math.sqrt(returned / work), rel=2e-3)


@pytest.mark.parametrize("depth", [0.5, 1.5, 10.0, 53.0, 300.0])
def test_first_loading_is_the_published_curve(depth: float) -> None:
    law = ContactLaw(
        *(np.array([x]) for x in (MODULUS, SHOT.tip_radius_m, HARDNESS, math.inf, 0.0))
    )
    at = np.array([depth * ONSET_M])
    assert _force(law, at, np.zeros(1))[0] == pytest.approx(_loading(depth * ONSET_M)[0], rel=1e-12)


def test_restitution_of_a_plastic_contact_falls_with_the_fourth_root_of_speed() -> None:
    """Johnson, Contact Mechanics, 1985, section 11.5; nearly so, since the first part of the way
    was elastic, as all of a contact slower than yield. Half the strength is twice the hardness."""
    elastic, slow, fast = _restitution([0.9 * _yield_speed(), 40.0, 160.0])
    assert elastic == pytest.approx(1.0, abs=1e-4)
    assert math.log(fast / slow) / math.log(4) == pytest.approx(-0.25, abs=0.01)
    assert _restitution([40.0], Effects.only("contact.plastic_yield", 0.5))[0] > 1.1 * slow


@pytest.mark.parametrize(
    ("times", "before", "after"),
    [(1.0, 1.5, 1 + 0.6 / 0.4 / math.log(54)), (54.0, 1 + 0.6 / math.log(54), 1.0)],
)
def test_force_is_continuous_where_the_law_changes(
    times: float, before: float, after: float
) -> None:
    """The exponent d ln F / d ln d falls there, from 1.5 to 1.376 and from 1.15 to 1."""
    law = _law()
    depth, step = times * law.yield_m, 1e-5
    below, at, above = (_force(law, depth * (1 + e), depth * (1 + e)) for e in (-step, 0.0, step))
    assert np.log(at / below) / step == pytest.approx(before, rel=1e-3)
    assert np.log(above / at) / step == pytest.approx(after, rel=1e-3)


def test_force_grows_with_depth_below_the_elastic_one_and_leaves_a_dent_from_yield_on() -> None:
    law = _law()
    depth = law.yield_m * np.geomspace(0.1, 1e3, 4000)
    force = np.array([_force(law, at, at)[0] for at in depth[:, None]])
    assert np.all(np.diff(force) > 0)
    assert np.all(force <= law.stiffness * depth**1.5 * (1 + 1e-12))
    deepest = 200 * law.yield_m
    assert _force(law, deepest * (1 - 1e-12), deepest) == pytest.approx(
        _force(law, deepest, deepest)
    )
    assert _force(law, 0.5 * deepest, deepest) == 0
    assert _force(law, 0.95 * deepest, deepest) > 0
    depth = 0.3 * law.yield_m
    assert _force(law, depth, 0.9 * law.yield_m) == pytest.approx(law.stiffness * depth**1.5)
    for apart in (np.array([-1e-6]), np.zeros(1)):
        assert _force(_law(math.inf), apart, np.zeros(1)) == 0


def test_tip_of_finite_height_is_stiffer_and_one_of_no_wear_a_ball() -> None:
    """Dimitriadis et al. 2002: at chi = 0.5, 1 + 0.5665 + 0.32075 + 0.096125 + 0.00609375 of
    Hertz."""
    one = np.ones(1)
    tip = ContactLaw(1e9 * one, 0.01 * one, math.inf * one, 0.02 * one, 0 * one)
    depth = np.array([0.01])
    assert _force(tip, depth, depth) == pytest.approx(tip.stiffness * depth**1.5 * 1.98946875)
    unit, depth = np.ones(1), np.array([1e-4])
    near = [
        _force(
            ContactLaw(1e9 * unit, 0.03 * unit, math.inf * unit, 0.02 * unit, w * unit),
            depth,
            depth,
        )
        for w in (1e-9, -1e-9)
    ]
    ball = ContactLaw(1e9 * unit, 0.03 * unit, math.inf * unit, 0.02 * unit, 0 * unit)
    assert near == pytest.approx(np.array([_force(ball, depth, depth)] * 2), rel=1e-6)


@pytest.mark.parametrize("share", [0.6, 0.18, -0.03, -0.3])
@pytest.mark.parametrize("radius_m", [0.5e-3, 2e-3, 8e-3])
def test_worn_and_pointed_tips_are_popovs_integrals(share: float, radius_m: float) -> None:
    """Popov, Hess and Willert 2019, eq. 2.5 and 2.8: g(x) = x times the integral of f' / sqrt(x^2 -
    r^2), d = g(a).

    F = 2 E* times the integral of d - g(x) from 0 to a.
    """
    ball, modulus = 0.03, 1e9
    reach = math.sqrt(0.1) * ball

    def slope(r: float) -> float:
        if share > 0:
            return (1 - share) * r / ball + share * 2 * r**3 / (ball * reach**2)
        return (1 + share) * r / ball - share * reach / (2 * ball)

    def profile(x: float) -> float:
        return x * quad(lambda angle: slope(x * math.sin(angle)), 0, math.pi / 2)[0]

    depth = profile(radius_m)
    expected = 2 * modulus * quad(lambda x: depth - profile(x), 0, radius_m)[0]
    law = ContactLaw(*(np.array([x]) for x in (modulus, ball, math.inf, math.inf, share)))
    assert _force(law, np.array([depth]), np.zeros(1))[0] == pytest.approx(expected, rel=1e-8)
