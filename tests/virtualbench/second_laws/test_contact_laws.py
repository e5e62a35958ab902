"""The contact's second laws against limits and closed forms."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from pyroshock.virtualbench.impact.build import Layer, hammer, target
from pyroshock.virtualbench.second_laws import LAWS, SPLITS
from pyroshock.virtualbench.second_laws import contact as law
from pyroshock.virtualbench.second_laws.contact import (
    contact_forces,
    jackson_green,
    meyer,
    rounded_cone,
    worn_ball,
)

MODULUS, RADIUS = 1.1e11, 0.03
DEPTH = np.geomspace(1e-7, 1e-3, 50)
HERTZ = 4 / 3 * MODULUS * math.sqrt(RADIUS) * DEPTH**1.5
EFFECTS = sorted(
    effect for effect, split in LAWS if effect.startswith("contact.") and split == "sealed"
)


def force(
    strengths: dict[str, float], split: str, tip: str = "steel", speed: float = 1.0
) -> tuple[float, np.ndarray]:
    impactor = replace(
        hammer(tip, RADIUS), tip_height_m=math.inf, rear_fraction=0.0, rear_resonance_hz=0.0
    )
    struck = target("steel", 0.010, anvil_material="steel", insulator="polymeric")
    assert struck.insulator == Layer()
    return contact_forces([impactor], [struck], strengths, split, np.array([speed]))[0]


def impulse(strengths: dict[str, float], split: str, **other: object) -> float:
    step, values = force(strengths, split, **other)
    return float(values.sum() * step)


def restitution(strengths: dict[str, float], split: str, **other: object) -> float:
    """On a rigid face all of the impulse is the impactor's."""
    speed = float(other.get("speed", 1.0))
    return impulse(strengths, split, **other) / (0.32 * speed) - 1


def test_without_effects_the_contact_is_hertz() -> None:
    """Peak force of an elastic ball: Johnson, Contact Mechanics, eq. 11.23."""
    _, values = force({}, "sealed")
    modulus = 200e9 / (2 * 0.91)
    stiffness = 4 / 3 * modulus * math.sqrt(RADIUS)
    assert values.max() == pytest.approx(stiffness ** (2 / 5) * (1.25 * 0.32) ** (3 / 5), rel=1e-4)
    assert restitution({}, "sealed") == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("split", SPLITS)
@pytest.mark.parametrize("effect", EFFECTS)
def test_strength_next_to_zero_does_nothing_and_losses_lower_the_rebound(
    effect: str, split: str
) -> None:
    (_, nominal), (_, values) = force({}, split), force({effect: 1e-7}, split)
    assert values.max() == pytest.approx(nominal.max(), rel=1e-5)
    assert impulse({effect: 1e-7}, split) == pytest.approx(impulse({}, split), rel=1e-4)
    if effect in ("contact.viscous_loss", "contact.plastic_yield", "contact.plate_compliance"):
        assert restitution({effect: 1.0}, split) < 0.995


def test_layers_hands_tips_and_dampers_act_as_they_say() -> None:
    for split in SPLITS:
        (step, nominal), (other, values) = (
            force({}, split),
            force({"contact.layer_compliance": 1.0}, split),
        )
        assert values.max() < 0.9 * nominal.max()
        assert values.size * other > 1.05 * nominal.size * step
    light = impulse({}, "sealed")
    assert impulse({"contact.effective_mass": 30.0}, "sealed") > 1.01 * light
    heavier = 1 + 0.05 * 4 * law.TIP_MASS["steel"]
    assert impulse({"contact.effective_mass": 4.0}, "development") == pytest.approx(
        heavier * light, 1e-3
    )
    # 1 - s l of the tip, at any speed: that is what alpha is chosen for.
    for speed in (0.5, 2.0):
        e = restitution({"contact.viscous_loss": 3.0}, "sealed", tip="delrin", speed=speed)
        assert e == pytest.approx(1 - 3 * law.LOST_SPEED["delrin"], abs=0.02)
    # 1 - e ~ v^(1/5): Brilliantov et al., eq. 10.
    lost = [
        1 - restitution({"contact.viscous_loss": 5.0}, "development", speed=speed)
        for speed in (0.3, 3.0)
    ]
    assert lost[1] / lost[0] == pytest.approx(10**0.2, rel=0.1)


def test_balls_and_cones_are_hertz_and_sneddons() -> None:
    np.testing.assert_allclose(worn_ball(DEPTH, MODULUS, RADIUS, 0.0), HERTZ, rtol=1e-12)
    # F = 2 E* b d (Sneddon).
    flat = 0.05
    np.testing.assert_allclose(
        worn_ball(DEPTH[:10], MODULUS, RADIUS, flat), 2 * MODULUS * flat * DEPTH[:10], rtol=1e-4
    )
    # dF / dd = 2 E* a for any body of revolution.
    flat, depth, step = 1e-3, 5e-5, 1e-9
    slope = np.diff(worn_ball(np.array([depth - step, depth + step]), MODULUS, RADIUS, flat))[0] / (
        2 * step
    )
    a = math.sqrt((flat**2 + math.sqrt(flat**4 + 4 * (RADIUS * depth) ** 2)) / 2)
    assert slope == pytest.approx(2 * MODULUS * a, rel=1e-5)
    begins = 2e-3
    shallow = 0.5 * begins**2 / RADIUS > DEPTH
    np.testing.assert_allclose(
        rounded_cone(DEPTH, MODULUS, RADIUS, begins)[shallow], HERTZ[shallow], rtol=2e-3
    )
    # F = 2 E* d^2 / (pi t), t the slope of its side (Sneddon).
    begins, deep = 1e-5, np.geomspace(1e-4, 1e-3, 50)
    wanted = 2 * MODULUS * deep**2 / (math.pi * begins / RADIUS)
    np.testing.assert_allclose(
        rounded_cone(deep, MODULUS, RADIUS, begins)[-10:], wanted[-10:], rtol=0.03
    )


def test_plastic_curves_begin_with_hertz_and_end_with_a_hardness() -> None:
    """Beyond the onset force then grows with depth, as mean pressure stays."""
    values, left = meyer(DEPTH, MODULUS, RADIUS, 1e9, 2.0)
    onset = RADIUS * (math.pi * 1e9 / (2 * MODULUS)) ** 2
    beyond = onset < DEPTH
    np.testing.assert_allclose(values[beyond] / DEPTH[beyond], values[beyond][0] / DEPTH[beyond][0])
    np.testing.assert_allclose(values[~beyond], HERTZ[~beyond])
    assert np.all(left[~beyond] == 0)
    assert np.all(np.diff(left[beyond]) > 0)
    values, left = jackson_green(DEPTH, MODULUS, RADIUS, 4e8, 0.3)
    critical = (math.pi * 1.295 * math.exp(0.736 * 0.3) * 4e8 / (2 * MODULUS)) ** 2 * RADIUS
    elastic = 1.9 * critical > DEPTH
    np.testing.assert_allclose(values[elastic], HERTZ[elastic], rtol=1e-9)
    assert np.all(left[elastic] == 0)
    assert np.all(values <= HERTZ * (1 + 1e-9))
    mean = values[-1] / (math.pi * 2 * RADIUS * DEPTH[-1])
    assert 1.5 * 4e8 < mean < 3.5 * 4e8


def test_modes_of_the_finite_plate_carry_what_an_infinite_one_does() -> None:
    """Mean mobility: pi / 2 times modal density times mean square of the shapes is 1 / Z (Cremer
    and Heckl, 4.3)."""
    impedance = target("steel", 0.010).plate_impedance_n_s_m
    shapes, omega = law._plate_modes(impedance)
    assert math.pi / 2 * np.sum(shapes**2) / omega.max() == pytest.approx(1 / impedance, rel=0.1)
