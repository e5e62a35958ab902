"""The two impactors: pulses as published, the hammer's own ringing and lag, the hand's scatter,
refusals."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from pyroshock.virtualbench.effects import Effects
from pyroshock.virtualbench.impact.build import (
    HAND_SPEEDS_M_S,
    HAND_SPREAD,
    Anvil,
    Impactor,
    ImpactTarget,
    contact_material,
    hammer,
    hand_speed,
    projectile,
    target,
)
from pyroshock.virtualbench.impact.strike import ImpactTruth, strike, strike_many

TIPS = [("aluminum", 0.03), ("delrin", 0.03), ("polyurethane", 0.015)]
ON_STEEL = target("aluminum", 0.02, anvil_material="steel")
STEADY = Effects.default().without("bench.hand_scatter")
RNG = np.random.default_rng(0)


def _strikes(
    impactor: Impactor,
    speeds: list[float],
    effects: Effects = STEADY,
    struck: ImpactTarget = ON_STEEL,
    tail_s: float = 4e-3,
) -> list[ImpactTruth]:
    count, rng = len(speeds), np.random.default_rng(11)
    return strike_many([impactor] * count, [struck] * count, effects, speeds, rng, tail_s=tail_s)


def _width(impact: ImpactTruth) -> float:
    """Full width at half maximum (s)."""
    above = np.flatnonzero(impact.force_n >= impact.force_n.max() / 2)
    return float(impact.time_s[above[-1]] - impact.time_s[above[0]])


@pytest.mark.parametrize(
    ("tip", "radius", "shortest", "longest"),
    [
        ("aluminum", 0.03, 50e-6, 300e-6),
        ("delrin", 0.03, 200e-6, 900e-6),
        ("polyurethane", 0.015, 1.5e-3, 6e-3),
    ],
)
def test_pulse_lasts_as_tips_do(tip: str, radius: float, shortest: float, longest: float) -> None:
    """Thesis section 4.1: about 1e-4 s for aluminium, fewer than ten samples at 51.2 kHz; more for
    polymers."""
    for impact in _strikes(hammer(tip, radius), [0.8, 1.8]):
        assert shortest < impact.contact_time_s < longest
        assert impact.contacts == 1


@pytest.mark.parametrize(("tip", "radius"), TIPS)
def test_contact_time_repeats_and_momentum_goes_through_cell_and_anvil_to_the_plate(
    tip: str, radius: float
) -> None:
    impacts = _strikes(hammer(tip, radius), [1.0] * 40, Effects.default(), tail_s=0.0)
    times = np.array([impact.contact_time_s for impact in impacts])
    assert 0.01 < times.std() / times.mean() < 0.05
    # The cell misses what stops the tip; the anvil hands on all, late and with its own ringing.
    impactor = hammer(tip, radius)
    (impact,) = _strikes(impactor, [1.0], tail_s=10e-3)
    change, contact, cell, plate = (
        np.trapezoid(signal, impact.time_s)
        for signal in (
            impact.impactor_acceleration_m_s2,
            impact.force_n,
            impact.cell_force_n,
            impact.plate_force_n,
        )
    )
    assert change == pytest.approx(1 + impact.restitution, rel=1e-3)
    if tip == "delrin":
        assert cell / contact == pytest.approx(1 - impactor.tip_mass_kg / impact.mass_kg, rel=1e-3)
    if tip == "aluminum":
        assert plate == pytest.approx(contact, rel=1e-3)
        assert np.argmax(impact.plate_force_n) > np.argmax(impact.force_n)


def test_hand_scatters_about_its_level_and_strikes_with_the_hand_alone() -> None:
    rng = np.random.default_rng(2)
    speeds = np.log([hand_speed("high", Effects.default(), rng) for _ in range(2000)])
    assert np.exp(speeds.mean()) == pytest.approx(HAND_SPEEDS_M_S["high"], rel=0.01)
    assert speeds.std() == pytest.approx(HAND_SPREAD, rel=0.06)
    assert hand_speed("low", Effects.none(), rng) == HAND_SPEEDS_M_S["low"]
    first, second = _strikes(hammer("delrin", 0.03), [1.0, 1.0])
    np.testing.assert_array_equal(first.force_n, second.force_n)
    first, second = (
        _strikes(hammer("delrin", 0.03), [1.0], Effects.default())[0] for _ in range(2)
    )
    np.testing.assert_array_equal(
        first.impactor_acceleration_m_s2, second.impactor_acceleration_m_s2
    )


def test_rear_rings_on_at_its_resonance() -> None:
    """Free decay at 7 kHz with 3 % of critical damping, by the exact oscillator."""
    (impact,) = _strikes(hammer("aluminum", 0.03), [1.0], tail_s=3e-3)
    after = impact.time_s > impact.contact_time_s + 100e-6
    time, ring = impact.time_s[after], impact.impactor_acceleration_m_s2[after]
    peaks = 1 + np.flatnonzero(
        (ring[1:-1] > ring[:-2]) & (ring[1:-1] >= ring[2:]) & (ring[1:-1] > 0)
    )
    damped = 7000 * np.sqrt(1 - 0.03**2)
    assert 1 / np.diff(time[peaks]).mean() == pytest.approx(damped, rel=2e-3)
    decrement = np.log(ring[peaks[:-1]] / ring[peaks[1:]]).mean()
    assert decrement == pytest.approx(2 * np.pi * 0.03 * 7000 / damped, rel=0.02)


def test_acceleration_lags_by_one_to_two_samples_of_a_uniform_fine_grid() -> None:
    (impact,) = _strikes(hammer("polyurethane", 0.015), [1.0])
    force, rear = (
        np.sum(impact.time_s * signal) / np.sum(signal)
        for signal in (impact.force_n, impact.impactor_acceleration_m_s2)
    )
    assert 1.0 < (rear - force) * 51200 < 2.0
    assert impact.time_s[0] == 0
    assert np.diff(impact.time_s).max() <= 1e-6
    assert impact.force_n.shape == impact.time_s.shape == impact.impactor_acceleration_m_s2.shape


@pytest.mark.parametrize("effects", [Effects.none(), STEADY.without("contact.plastic_yield")])
def test_width_against_peak_force_of_an_elastic_hammer(effects: Effects) -> None:
    """Log-log slope; Hertz -1/6, measured -0.157 and -0.159 on 44 published hits of two small
    hammers."""
    impacts = _strikes(
        hammer("aluminum", 0.03), list(np.geomspace(0.1, 2.0, 8)), effects, target("steel", 0.04)
    )
    width, peak = (
        [f(impact) for impact in impacts] for f in (_width, lambda impact: impact.peak_force_n)
    )
    assert np.polyfit(np.log(peak), np.log(width), 1)[0] == pytest.approx(-0.158, abs=0.012)


def test_harder_blows_bounce_less_polymers_are_softer_and_the_tail_goes_on() -> None:
    impacts = _strikes(hammer("aluminum", 0.03), [0.2, 0.8, 3.2])
    assert np.all(np.diff([impact.restitution for impact in impacts]) < 0)
    assert np.all(np.diff([impact.contact_time_s for impact in impacts]) < 0)
    hard, soft = (_strikes(projectile(0.5, tip, 0.045), [20.0])[0] for tip in ("steel", "PLA"))
    assert soft.peak_force_n < hard.peak_force_n
    assert soft.contact_time_s > 1.5 * hard.contact_time_s
    # The exact tail joins the integrated part: no jump in what still moves.
    insulated = target("aluminum", 0.02, anvil_material="aluminum", insulator="polymeric")
    (impact,) = _strikes(
        replace(hammer("aluminum", 0.03), wave_delay_s=0.0), [1.5], struck=insulated
    )
    for signal in (impact.impactor_acceleration_m_s2, impact.plate_force_n, impact.cell_force_n):
        assert np.abs(np.diff(signal, 3)).max() < 2e-3 * np.abs(signal).max()


@pytest.mark.parametrize("tip", ["aluminum", "steel"])
def test_projectile_of_metal_on_an_anvil(tip: str) -> None:
    """50 to 300 us, and forces from tens of kilonewtons to about a meganewton."""
    struck = target("steel", 0.01, anvil_material="steel")
    light, heavy = _strikes(projectile(0.2, tip, 0.03), [10.0], struck=struck) + _strikes(
        projectile(1.0, tip, 0.06), [80.0], struck=struck
    )
    assert 20e3 < light.peak_force_n < 100e3
    assert 0.6e6 < heavy.peak_force_n < 1.6e6
    assert 50e-6 < heavy.contact_time_s < light.contact_time_s * 2 < 600e-6
    assert heavy.restitution < light.restitution


def test_point_impedance_of_a_thin_plate() -> None:
    """8 sqrt(D rho h): 10 mm of aluminium, D = 6537 N m, 27 kg/m^2."""
    assert target("aluminum", 0.01).plate_impedance_n_s_m == pytest.approx(
        8 * np.sqrt(6536.9 * 27.0), rel=1e-4
    )
    twice, edge = target("aluminum", 0.02), target("aluminum", 0.01, edge_factor=0.5)
    assert twice.plate_impedance_n_s_m == pytest.approx(8 * edge.plate_impedance_n_s_m)


@pytest.mark.parametrize(
    ("refused", "words"),
    [
        *(
            (
                partial(strike, hammer("aluminum", 0.03), ON_STEEL, STEADY, speed, RNG),
                "velocities_m_s",
            )
            for speed in (0.0, -1.0, math.nan, math.inf)
        ),
        (
            partial(
                strike,
                hammer("delrin", 0.03),
                ON_STEEL,
                Effects.only("contact.effective_mass", -30.0),
                1.0,
                RNG,
            ),
            r"contact\.effective_mass",
        ),
        (
            partial(strike_many, [hammer("aluminum", 0.03)], [ON_STEEL] * 2, STEADY, [1.0], RNG),
            "1 impactors, 2 targets",
        ),
        (partial(contact_material, "titanium"), r"unknown contact material 'titanium'.*PLA"),
        (
            partial(target, "steel", 0.01, anvil_material="steel", insulator="rubber"),
            "insulator 'rubber'",
        ),
        (partial(target, "steel", 0.01, insulator="polymeric"), "insulator without an anvil"),
        (partial(target, "steel", 0.01, edge_factor=1.5), r"edge_factor = 1\.5"),
        (partial(Anvil, contact_material("steel"), volume_m3=0.0), r"volume_m3 = 0\.0"),
        (partial(hand_speed, "medium", STEADY, RNG), "hammer speed 'medium'"),
        *(
            (partial(replace, hammer("aluminum", 0.03), **{name: value}), name)
            for name, value in (
                ("mass_kg", 0.0),
                ("mass_kg", math.inf),
                ("tip_radius_m", -0.03),
                ("rear_fraction", 1.0),
                ("rear_resonance_hz", 0.0),
                ("tip_mass_kg", 0.3),
                ("rear_damping", 1.0),
            )
        ),
    ],
)
def test_impossible_strikes_hammers_and_targets_are_refused(refused: Any, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        refused()
