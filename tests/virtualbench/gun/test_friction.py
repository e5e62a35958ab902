"""Friction of the projectile and of the air column."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.gun.build import GunBuild, GunSetting, Projectile, setting_of
from pyroshock.virtualbench.gun.gas import Gas
from pyroshock.virtualbench.gun.motion import column_loss, sliding_friction

AIR = Gas(101_325.0, 293.15, 1.204)


def setting(effects: Effects) -> GunSetting:
    return setting_of(GunBuild(), effects, 1e5, Projectile(), np.random.default_rng(0))


def test_sliding_friction_is_coulombs_with_stribecks_hump_and_a_seal() -> None:
    """Odd, and through zero; the gas presses the seal from behind only."""
    assert sliding_friction(setting(Effects.none()), 1.0, 1e5) == pytest.approx(0.30 * 0.1428 * 9.80665)
    default = setting(Effects.default())
    assert sliding_friction(default, 0.0, 1e5) == 0.0
    assert sliding_friction(default, -0.3, 1e5) == -sliding_friction(default, 0.3, 1e5)
    figures = setting(Effects.only("gun.sliding_friction"))
    slow, fast = (sliding_friction(figures, velocity, 0.0) for velocity in (0.01, 1.0))
    assert slow - fast == pytest.approx(GunBuild().breakaway_force_n, rel=0.02)
    free, pressed, pulled = (sliding_friction(figures, 1.0, dp) for dp in (0.0, 1e5, -1e5))
    assert pressed - free == pytest.approx(0.02 * 1e5 * Projectile().area_m2)
    assert pulled == free


def test_column_loss_is_blasius_in_turbulent_flow_and_poiseuille_when_slow() -> None:
    figures = setting(Effects.only("gun.barrel_loss"))
    reynolds = 1.204 * 15.0 * 0.049 / 1.82e-5
    turbulent_pa = 0.3164 / reynolds**0.25 * 0.8 / 0.049 * 1.204 * 15.0**2 / 2
    laminar_pa = 32 * 1.82e-5 * 0.8 * 0.1 / 0.049**2
    for velocity, drop_pa in ((15.0, turbulent_pa), (0.1, laminar_pa)):
        assert column_loss(figures, velocity, AIR, 0.8, 0.0) == pytest.approx(drop_pa * Projectile().area_m2)
    twice = setting(Effects.only("gun.barrel_loss", 2.0))
    assert column_loss(twice, -15.0, AIR, 0.8, 0.5) == -column_loss(twice, 15.0, AIR, 0.8, 0.5)
    assert column_loss(setting(Effects.none()), 15.0, AIR, 0.8, 0.5) == 0.0
