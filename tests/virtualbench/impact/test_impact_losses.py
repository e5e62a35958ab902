"""What each effect of the contact does: vanishes at 0, acts in its direction, and as its closed
form says."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.impact.build import (
    Impactor,
    ImpactTarget,
    contact_material,
    hammer,
    target,
)
from pyroshock.virtualbench.impact.strike import ImpactTruth, strike, strike_many

STEEL = contact_material("steel")
BALL = Impactor(STEEL, tip_radius_m=0.01, mass_kg=0.0327)
BARE = target("aluminum", 0.02)
INSULATED = target("aluminum", 0.02, anvil_material="steel", insulator="polymeric")
#: For each effect, a figure of the impact that it can only raise.
RAISED: dict[str, Callable[[ImpactTruth], float]] = {
    "contact.viscous_loss": lambda impact: -impact.restitution,
    "contact.plastic_yield": lambda impact: -impact.restitution,
    "contact.layer_compliance": lambda impact: impact.contact_time_s,
    "contact.plate_compliance": lambda impact: -impact.restitution,
    "contact.effective_mass": lambda impact: impact.contact_time_s,
    "contact.tip_geometry": lambda impact: -impact.contact_time_s,
}


@cache
def _strike(
    effects: Effects,
    struck: ImpactTarget = BARE,
    speed: float = 1.0,
    impactor: Impactor | None = None,
) -> ImpactTruth:
    return strike(
        impactor or hammer("aluminum", 0.03), struck, effects, speed, np.random.default_rng(3)
    )


def _hertz(impactor: Impactor) -> tuple[float, float]:
    """Stiffness K, and the time scale (m / (K sqrt v))^0.4 at 1 m/s, on steel."""
    modulus = 1 / (impactor.tip.compliance_1_pa + STEEL.compliance_1_pa)
    stiffness = 4 / 3 * modulus * math.sqrt(impactor.tip_radius_m)
    return stiffness, (impactor.mass_kg / stiffness) ** 0.4


@pytest.mark.parametrize("name", sorted(RAISED))
def test_effect_vanishes_at_strength_zero_and_grows_with_it(name: str) -> None:
    """Signed effects act both ways."""
    base = Effects.default()
    absent, zero = (
        _strike(e, INSULATED, 4.0) for e in (base.without(name), base.with_strength(name, 0.0))
    )
    np.testing.assert_array_equal(absent.force_n, zero.force_n)
    assert absent.restitution != _strike(base, INSULATED, 4.0).restitution
    struck = INSULATED if name == "contact.layer_compliance" else BARE
    figures = [
        RAISED[name](_strike(Effects.only(name, strength), struck, 3.0))
        for strength in (0.0, 0.5, 1.5)
    ]
    assert np.all(np.diff(figures) > 0)
    if name in ("contact.effective_mass", "contact.tip_geometry"):
        less, none, more = (
            RAISED[name](_strike(Effects.only(name, strength))) for strength in (-1.0, 0.0, 1.0)
        )
        assert less < none < more


def test_layer_acts_only_where_there_is_one_and_with_its_strength() -> None:
    """With its compliance at 0, the insulated anvil is struck as the bare one."""
    bare = target("aluminum", 0.02, anvil_material="steel")
    effects = Effects.default().with_strength("contact.layer_compliance", 0.0)
    np.testing.assert_array_equal(
        _strike(effects, bare).force_n, _strike(effects, INSULATED).force_n
    )
    with_it, without = (
        _strike(e) for e in (Effects.only("contact.layer_compliance"), Effects.none())
    )
    np.testing.assert_array_equal(with_it.force_n, without.force_n)


@pytest.mark.parametrize("thickness", [0.05, 0.02, 0.01])
def test_plate_takes_what_zener_says_by_the_work_on_it(thickness: float) -> None:
    """Zener 1941: e = exp(-1.719 lambda) for an inelasticity m / (Z T), here up to 0.16."""
    struck = target("steel", thickness)
    _, scale = _hertz(BALL)
    inelasticity = BALL.mass_kg / (struck.plate_impedance_n_s_m * scale)
    impact = _strike(Effects.only("contact.plate_compliance"), struck, impactor=BALL)
    assert impact.restitution == pytest.approx(math.exp(-1.719 * inelasticity), rel=5e-3)
    work = np.trapezoid(impact.plate_force_n**2, impact.time_s) / struck.plate_impedance_n_s_m
    assert work == pytest.approx(0.5 * BALL.mass_kg * (1 - impact.restitution**2), rel=1e-3)


@pytest.mark.parametrize(
    ("name", "struck"),
    [("contact.plate_compliance", BARE), ("contact.layer_compliance", INSULATED)],
)
def test_loss_of_plate_and_layer_grows_with_bandwidth(name: str, struck: ImpactTarget) -> None:
    """Faster impacts are shorter, and the plate's dashpot and the layer's retardation take more of
    them."""
    rigid = replace(hammer("aluminum", 0.03), rear_fraction=0.0, rear_resonance_hz=0.0)
    impacts = strike_many(
        [rigid] * 4,
        [struck] * 4,
        Effects.only(name),
        [0.1, 0.4, 1.6, 6.4],
        np.random.default_rng(0),
    )
    assert np.all(np.diff([impact.contact_time_s for impact in impacts]) < 0)
    assert np.all(np.diff([impact.restitution for impact in impacts]) < 0)


def test_loss_is_largest_where_relaxation_and_contact_are_as_long() -> None:
    """Much slower or faster it is elastic, with the instantaneous modulus or the relaxed one."""

    def relaxing(time_s: float) -> ImpactTruth:
        half = replace(STEEL, relaxing_fraction=0.5, relaxation_time_s=time_s)
        struck = replace(target("steel", 0.05), face=half)
        return _strike(Effects.only("contact.viscous_loss"), struck, 1.0, replace(BALL, tip=half))

    duration = 3.218 * _hertz(BALL)[1]
    for time_s, stiffer in ((10.0, 1.5), (0.5e-6, 1.0)):
        assert relaxing(time_s).restitution > 0.95
        assert relaxing(time_s).contact_time_s == pytest.approx(duration * stiffer**-0.4, rel=0.02)
    losses = [1 - relaxing(share * duration).restitution for share in (1 / 3, 1 / 30, 10)]
    assert losses[0] > 2 * max(losses[1:])


@pytest.mark.slow
def test_historical_soft_layer_kept_its_momentum() -> None:
    """A light blow on a very soft layer once took steps too long for it: force rattled, and 99 % of
    it was missed."""
    strong = {
        "viscous_loss": 10.0,
        "plastic_yield": 2.0,
        "layer_compliance": 10.0,
        "tip_geometry": 5.0,
    }
    effects = Effects.only("contact.plate_compliance", 0.3)
    for name, strength in strong.items():
        effects = effects.with_strength(f"contact.{name}", strength)
    impact = _strike(effects, INSULATED, 0.11, hammer("delrin", 0.03))
    change = impact.mass_kg * impact.velocity_m_s * (1 + impact.restitution)
    assert np.trapezoid(impact.force_n, impact.time_s) == pytest.approx(change, rel=1e-4)
