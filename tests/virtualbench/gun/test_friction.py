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


def test_nominal_friction_is_coulomb() -> None:
    assert sliding_friction(setting(Effects.none()), 1.0, 1e5) == pytest.approx(0.30 * 0.1428 * 9.80665)


def test_friction_is_odd_and_passes_zero() -> None:
    figures = setting(Effects.default())
    assert sliding_friction(figures, 0.0, 1e5) == 0.0
    assert sliding_friction(figures, -0.3, 1e5) == -sliding_friction(figures, 0.3, 1e5)


def test_stribeck_hump_falls_with_speed() -> None:
    figures = setting(Effects.only("gun.sliding_friction"))
    slow, fast = (sliding_friction(figures, velocity, 0.0) for velocity in (0.01, 1.0))
    assert slow - fast == pytest.approx(GunBuild().breakaway_force_n, rel=0.02)


def test_seal_is_pressed_by_the_gas_from_behind_only() -> None:
    figures = setting(Effects.only("gun.sliding_friction"))
    free, pressed, pulled = (sliding_friction(figures, 1.0, dp) for dp in (0.0, 1e5, -1e5))
    assert pressed - free == pytest.approx(0.02 * 1e5 * Projectile().area_m2)
    assert pulled == free


def test_column_loss_is_blasius_in_turbulent_flow() -> None:
    figures = setting(Effects.only("gun.barrel_loss"))
    reynolds = 1.204 * 15.0 * 0.049 / 1.82e-5
    drop = 0.3164 / reynolds**0.25 * 0.8 / 0.049 * 1.204 * 15.0**2 / 2
    assert column_loss(figures, 15.0, AIR, 0.8, 0.0) == pytest.approx(drop * Projectile().area_m2)


def test_column_loss_is_poiseuille_when_slow() -> None:
    figures = setting(Effects.only("gun.barrel_loss"))
    drop = 32 * 1.82e-5 * 0.8 * 0.1 / 0.049**2
    assert column_loss(figures, 0.1, AIR, 0.8, 0.0) == pytest.approx(drop * Projectile().area_m2)


def test_column_loss_opposes_and_vanishes() -> None:
    figures = setting(Effects.only("gun.barrel_loss", 2.0))
    assert column_loss(figures, -15.0, AIR, 0.8, 0.5) == -column_loss(figures, 15.0, AIR, 0.8, 0.5)
    assert column_loss(setting(Effects.none()), 15.0, AIR, 0.8, 0.5) == 0.0
