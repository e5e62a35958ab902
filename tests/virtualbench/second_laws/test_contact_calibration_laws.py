"""The contact's second laws for calibration against limits and closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.virtualbench.impact.build import hammer, target
from pyroshock.virtualbench.second_laws import contact_calibration as law
from pyroshock.virtualbench.second_laws.contact import contact_forces
from scipy.signal import lfilter

MODULUS, RADIUS = 1.1e11, 0.03
DEPTH = np.geomspace(1e-7, 1e-3, 50)
HERTZ = 4 / 3 * MODULUS * math.sqrt(RADIUS) * DEPTH**1.5
SPLIT = "calibration"


def force(
    strengths: dict[str, float], tip: str = "steel", speed: float = 1.0, insulator: str = "none"
) -> tuple[float, np.ndarray]:
    impactor = replace(
        hammer(tip, RADIUS), tip_height_m=math.inf, rear_fraction=0.0, rear_resonance_hz=0.0
    )
    struck = target("steel", 0.010, anvil_material="steel", insulator=insulator)
    return contact_forces([impactor], [struck], strengths, SPLIT, np.array([speed]))[0]


def restitution(
    strengths: dict[str, float], tip: str = "steel", speed: float = 1.0, insulator: str = "none"
) -> float:
    step, values = force(strengths, tip, speed, insulator)
    return float(values.sum() * step) / (0.32 * speed) - 1


def test_split_without_laws_is_told() -> None:
    with pytest.raises(
        ValueError, match="'tuning': expected one of development, calibration, sealed"
    ):
        contact_forces(
            [hammer("steel", RADIUS)], [target("steel", 0.010)], {}, "tuning", np.ones(1)
        )


def test_damper_takes_less_of_fast_blows() -> None:
    """1 - e ~ v^(-1/5), as the contact's time; at 1 m/s it is about the stated share."""
    lost = [
        1 - restitution({"contact.viscous_loss": 1.0}, "delrin", speed)
        for speed in (0.1, 1.0, 10.0)
    ]
    np.testing.assert_allclose(np.divide(lost[1:], lost[:-1]), 10**-0.2, rtol=0.05)
    assert lost[1] == pytest.approx(law.LOST_AT_1_M_S["delrin"], rel=0.2)


def test_cavity_begins_with_hertz_and_ends_with_a_hardness() -> None:
    strength = 4e8
    values, residual = law.cavity(DEPTH, MODULUS, RADIUS, strength)
    onset = RADIUS * (3 * math.pi * 1.1 * strength / (4 * MODULUS)) ** 2
    assert np.all(values <= HERTZ * (1 + 1e-9))
    np.testing.assert_allclose(values[onset > DEPTH], HERTZ[onset > DEPTH])
    assert np.all(residual[onset > DEPTH] == 0)
    assert np.all(np.diff(residual[onset < DEPTH]) > 0)
    mean = values / (math.pi * RADIUS * DEPTH)
    assert mean[-1] == pytest.approx(3 * strength)
    beyond = (onset < DEPTH) & (mean < 2.99 * strength)
    slopes = np.diff(mean[beyond]) / np.diff(np.log(DEPTH[beyond]))
    np.testing.assert_allclose(slopes, strength / 3)  # 2/3 Y for each e-fold of a, and a ~ d^0.5


def test_strength_grows_with_rate_as_cowper_and_symonds_have_it() -> None:
    assert law.dynamic_yield_pa(4e8, 40.4, "steel") == pytest.approx(8e8)
    assert law.dynamic_yield_pa(4e8, 32 * 40.4, "steel") == pytest.approx(12e8)
    assert law.dynamic_yield_pa(4e8, 0.0, "aluminum") == 4e8
    assert law.strain_rate_1_s(1e-4, 0.04, 2e-4) == pytest.approx(100.0)


def test_sheet_gives_by_the_root_of_force_and_nothing_is_lost_in_it() -> None:
    """Johnson, eq. 5.70: F = pi R E d^2 / t of a ball that is far stiffer than the layer."""
    values, residual = law.on_sheet(DEPTH, 1e4 * HERTZ, np.zeros_like(DEPTH), RADIUS, 1.0)
    bed = math.pi * RADIUS * law.SHEET_MODULUS_PA / law.SHEET_THICKNESS_M
    np.testing.assert_allclose(values[:30], bed * DEPTH[:30] ** 2, rtol=0.03)
    assert not residual.any()
    assert restitution({"contact.layer_compliance": 1.0}, insulator="polymeric") == pytest.approx(
        1.0, abs=2e-3
    )
    assert restitution({"contact.layer_compliance": 1.0}) == pytest.approx(1.0, abs=1e-3)
    hertz, soft = (
        force({}, insulator="none")[1].max(),
        force({"contact.layer_compliance": 4.0}, insulator="none"),
    )
    assert soft[1].max() == hertz


def test_edge_is_felt_most_by_long_pulses() -> None:
    """Zener: a soft plate takes the work of the force on its velocity, of the infinite plate and of
    the wave back; a pulse that is long sees 2.29 times the mobility."""
    impedance = target("steel", 0.010).plate_impedance_n_s_m
    share = 0.002
    gains = []
    for tip, speed in (("steel", 30.0), ("steel", 1.0), ("polyurethane", 0.02)):
        step, values = force({}, tip, speed)
        decay = math.exp(-step / law.EDGE_S)
        returned = lfilter([1 - decay], [1.0, -decay], values)
        gains.append(law.EDGE_GAIN * float(np.sum(values * returned) / np.sum(values**2)))
        lost = (
            share
            * (1 + gains[-1])
            / impedance
            * float(np.sum(values**2) * step)
            / (0.32 * speed**2)
        )
        e = restitution({"contact.plate_compliance": share}, tip, speed)
        assert 1 - e == pytest.approx(lost, rel=0.1, abs=2e-6)
    assert gains[0] < 0.6 * law.EDGE_GAIN
    assert gains[2] == pytest.approx(law.EDGE_GAIN, rel=0.02)


def test_slack_joint_pushes_with_its_friction_and_carries_all_of_its_mass_at_most() -> None:
    """Impulse: 2 m v + F T for a weak joint, 2 (m + m_j) v for a rigid one."""
    step, nominal = force({})
    _, pushed = force({"contact.effective_mass": 0.2})
    gained = float(pushed.sum() - nominal.sum()) * step
    assert gained == pytest.approx(0.2 * law.JOINT_N * nominal.size * step, rel=0.3)
    rigid = restitution({"contact.effective_mass": 60.0}, "polyurethane", 0.02)
    assert 1 + rigid == pytest.approx(2 * (0.32 + law.JOINT_KG) / 0.32, rel=0.03)


def test_worn_crown_goes_from_a_fourth_power_to_the_ball() -> None:
    np.testing.assert_allclose(law.worn_crown(DEPTH, MODULUS, RADIUS, 0.0), HERTZ, rtol=1e-4)
    np.testing.assert_allclose(law.worn_crown(DEPTH, MODULUS, RADIUS, 1e-6), HERTZ, rtol=1e-2)
    # z = r^4 / (2 R b^2): d = 4 a^4 / (3 R b^2), F = 32 E* a^5 / (15 R b^2) (Johnson, eq. 5.22 and
    # 5.23, n = 2).
    crown = 0.05
    a = (3 / 4 * RADIUS * crown**2 * DEPTH) ** 0.25
    wanted = 32 / 15 * MODULUS * a**5 / (RADIUS * crown**2)
    np.testing.assert_allclose(
        law.worn_crown(DEPTH, MODULUS, RADIUS, crown)[:20], wanted[:20], rtol=0.02
    )
    # d = a int z' / sqrt(a^2 - r^2) dr by quadrature, with r = a sin(angle)
    crown, contact = 1e-3, 2e-3
    angle = (np.arange(2000) + 0.5) / 2000 * math.pi / 2
    r = contact * np.sin(angle)
    slope = r / RADIUS * (1 - crown**4 / (r**2 + crown**2) ** 2)
    depth = contact * float(slope.mean()) * math.pi / 2
    assert law.crown_depth_m(np.array([contact]), RADIUS, crown)[0] == pytest.approx(
        depth, rel=1e-5
    )
    assert restitution({"contact.tip_geometry": 10.0}) == pytest.approx(1.0, abs=1e-3)
