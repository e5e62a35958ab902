"""Impacts on an anvil, against limits in closed form and against another integration."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.twin.contact.anvil import anvil_pulses
from pyroshock.twin.contact.bodies import Bodies
from pyroshock.twin.contact.effects.plastic_yield import PlasticYield
from pyroshock.twin.contact.hertz import hertz
from pyroshock.twin.contact.impacts import Impacts
from pyroshock.twin.contact_interface import ForcePulses
from scipy.integrate import solve_ivp

BODIES = Bodies.of(
    impactor_radius_m=0.045, impactor_youngs_modulus_pa=200e9, impactor_poisson_ratio=0.3,
    impactor_density_kg_m3=7800.0, target_youngs_modulus_pa=200e9, target_poisson_ratio=0.3,
    target_density_kg_m3=7800.0, impact_velocity_m_s=5.0, impactor_mass_kg=0.5, impactor_yield_strength_pa=400e6,
    target_yield_strength_pa=400e6, plate_thickness_m=0.01,
)  # fmt: skip


def on_anvil(
    impacts: Impacts, mass_kg: float, stiffness_n_m: float, mobility_m_n_s: float, phases: int = 401
) -> ForcePulses:
    mass, stiffness, mobility = (np.array([value]) for value in (mass_kg, stiffness_n_m, mobility_m_n_s))
    return anvil_pulses(impacts, mass, stiffness, mobility, phases)


def test_anvils_are_hertz_where_they_are_light_and_shield_the_plate_where_heavy() -> None:
    pulse, law = on_anvil(Impacts.of(BODIES), 0.02, 1e11, 0.0), hertz(BODIES)
    assert pulse.peak_force_n[0] == pytest.approx(law.peak_force_n[0], rel=0.01)
    assert pulse.impulse_n_s[0] == pytest.approx(law.impulse_n_s[0], rel=0.01)
    assert pulse.contact_time_s[0] == pytest.approx(law.contact_time_s[0], rel=0.05)
    elastic = Impacts.of(BODIES)
    yielded = PlasticYield(1.6).prepare(elastic)
    soft, hard = (on_anvil(impacts, 0.3, 1e10, 0.0).peak_force_n[0] for impacts in (yielded, elastic))
    assert soft < 0.8 * hard
    # A joint that is softer by far than the contact rings at its own frequency with the anvil's momentum. That is 2 m u
    # M / (m + M) after an elastic impact of two free bodies; damping of 5 % takes a part.
    mass, stiffness = 4.0, 1e6
    pulse = on_anvil(Impacts.of(BODIES), mass, stiffness, 0.0)
    momentum = 2 * 0.5 * 5.0 * mass / (mass + 0.5)
    assert pulse.peak_force_n[0] == pytest.approx(
        momentum * np.sqrt(stiffness / mass) * np.exp(-0.05 * np.pi / 2), rel=0.02
    )
    assert pulse.contact_time_s[0] == pytest.approx(np.pi * np.sqrt(mass / stiffness), rel=0.05)


@pytest.mark.parametrize(("mass", "stiffness", "mobility"), [(1.2, 2e9, 1e-4), (0.4, 5e8, 3e-4), (2.0, 1e10, 3e-5)])
def test_pulse_is_that_of_another_integration(mass: float, stiffness: float, mobility: float) -> None:
    """Elastic contact; the force on the plate until it first falls to half a per cent of its peak."""
    impacts = Impacts.of(BODIES)
    hard, own = float(impacts.stiffness_n_mp[0]), 0.5
    damping = 2 * 0.05 * np.sqrt(stiffness * mass)

    def joint(state: np.ndarray) -> np.ndarray:
        return (stiffness * (state[2] - state[4]) + damping * state[3]) / (1 + damping * mobility)

    def rate(_: float, state: np.ndarray) -> list[float]:
        x, v, y, w, _plate = state
        contact, carried = hard * max(x - y, 0.0) ** 1.5, joint(state)
        return [v, -contact / own, w, (contact - carried) / mass, mobility * carried]

    run = solve_ivp(rate, (0, 2e-3), [0, 5.0, 0, 0, 0], rtol=1e-8, atol=1e-12, max_step=1e-6)
    force = joint(run.y)
    top = int(np.argmax(force))
    last = top + int(np.flatnonzero(force[top:] < 0.005 * force[top])[0])
    first = int(np.flatnonzero(force[:top] < 0.005 * force[top])[-1])
    pulse = on_anvil(impacts, mass, stiffness, mobility)
    assert pulse.peak_force_n[0] == pytest.approx(force[top], rel=0.005)
    assert pulse.contact_time_s[0] == pytest.approx(run.t[last] - run.t[first], rel=0.02)
    assert pulse.impulse_n_s[0] == pytest.approx(np.trapezoid(force[first:last], run.t[first:last]), rel=0.01)
