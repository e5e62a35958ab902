"""Hertz' impact against Johnson's closed forms and an integration in SI; Hunter's and Reed's of the
same sphere."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.doe.limits.contact_force import Elastic, hertz_contact
from pyroshock.twin.contact.hertz import contact_time, hertz, impactor_of_pulse
from pyroshock.twin.contact.laws import hunter, reed
from scipy.integrate import solve_ivp
from scipy.special import beta
from support.records.contact_bodies import ball, impacts, impulse

BODIES = impacts(
    impact_velocity_m_s=np.linspace(0.1, 20, 7), impactor_mass_kg=np.linspace(0.05, 3, 7)
)
MASS, VELOCITY = np.linspace(0.05, 3, 7), BODIES.impact_velocity_m_s


def test_contact_time_and_peak_force_of_johnson() -> None:
    """Eq. 11.24: 2.87 (m^2 / (R E*^2 u))^(1/5); the number is 2.94 (15/16)^(2/5). Quadrature and
    motion agree."""
    scale = (MASS**2 * BODIES.compliance_1_pa**2 / (BODIES.impactor_radius_m * VELOCITY)) ** 0.2
    exact = 0.8 * beta(0.4, 0.5) * (15 / 16) ** 0.4
    assert exact == pytest.approx(2.87, abs=0.005)
    assert hertz(BODIES).contact_time_s == pytest.approx(exact * scale, rel=1e-9)
    assert hertz(BODIES).contact_time_s == pytest.approx(contact_time(BODIES), rel=1e-9)
    # At the turn all energy is in the spring, m u^2 / 2 = (2/5) k delta^(5/2); there is the peak.
    deepest = (1.25 * MASS * VELOCITY**2 / BODIES.hertz_stiffness_n_m15) ** 0.4
    assert hertz(BODIES).peak_force_n == pytest.approx(
        BODIES.hertz_stiffness_n_m15 * deepest**1.5, rel=1e-9
    )


def test_impulse_turns_the_momentum_round_and_points_converge_to_it() -> None:
    pulse = hertz(BODIES)
    assert impulse(pulse.contact_time_s, pulse.force_n(4001)) == pytest.approx(
        2 * MASS * VELOCITY, rel=1e-7
    )
    mass, velocity = impactor_of_pulse(
        pulse.contact_time_s, 2 * MASS * VELOCITY, BODIES.hertz_stiffness_n_m15
    )
    assert mass == pytest.approx(MASS, rel=1e-9)
    assert velocity == pytest.approx(VELOCITY, rel=1e-9)
    force = hertz(BODIES).force_n(41)
    assert force == pytest.approx(force[:, ::-1], abs=1e-6 * force.max())
    assert hertz(BODIES).compression_time_s == pytest.approx(
        hertz(BODIES).contact_time_s / 2, rel=1e-9
    )
    # The trapezoid's error falls with the square of the step, or faster: the force starts as t^1.5.
    pulse = hertz(impacts())
    errors = [
        abs(impulse(pulse.contact_time_s, pulse.force_n(points)) / pulse.impulse_n_s - 1)[0]
        for points in (21, 81)
    ]
    assert errors[1] < errors[0] / 16
    # `doe` has its own, scalar: rooms on one floor do not know each other.
    delrin, aluminium = Elastic(3.2e9, 0.35), Elastic(69.9e9, 0.33)
    theirs = hertz_contact(
        delrin, aluminium, tip_radius_m=0.03, bullet_mass_kg=0.32, impact_velocity_m_s=1.2
    )
    ours = hertz(impacts())
    assert ours.contact_time_s == pytest.approx(theirs.contact_time_s, rel=1e-9)
    assert ours.peak_force_n == pytest.approx(theirs.peak_force_n, rel=1e-9)


def test_force_follows_the_motion_in_si() -> None:
    bodies = impacts()
    stiffness = float(bodies.hertz_stiffness_n_m15[0])
    pulse = hertz(bodies)
    time = np.linspace(0, float(pulse.contact_time_s[0]), 20)

    def rate(_, state):
        return [state[1], -stiffness / 0.32 * max(state[0], 0) ** 1.5]

    run = solve_ivp(rate, (0, time[-1]), [0, 1.2], "LSODA", time, rtol=1e-11, atol=1e-15)
    force = stiffness * np.maximum(run.y[0], 0) ** 1.5
    assert pulse.force_n()[0] == pytest.approx(force, abs=1e-6 * pulse.peak_force_n[0])


BALLS = ball(
    impact_velocity_m_s=np.array([0.3, 1.0, 10.0]),
    impactor_radius_m=np.array([0.0005, 0.015, 0.03]),
)
BALL_MOMENTUM = BALLS.sphere_mass_kg * BALLS.impact_velocity_m_s


@pytest.mark.parametrize("law", [hunter, reed])
def test_contact_time_is_hertz_for_the_sphere_and_compression_ends_at_the_peak(law) -> None:
    """The 4.53 of eq. 1.23 is 4.534, cut to three digits. Compression lasts as long as the
    restitution that follows it: nothing is lost. The impactor's own mass does not enter."""
    pulse = law(BALLS)
    assert pulse.contact_time_s == pytest.approx(hertz(BALLS).contact_time_s, rel=1.2e-3)
    phase = np.linspace(0, 1, 2001)
    peaks = phase[pulse.force_at(phase).argmax(axis=1)]
    assert pulse.compression_time_s / pulse.contact_time_s == pytest.approx(peaks, abs=1e-3)
    light, none = (law(impacts(impactor_mass_kg=mass)) for mass in (0.01, None))
    assert light.force_n() == pytest.approx(none.force_n())


def test_reeds_pulse_is_nearly_hertz_and_hunters_half_a_sine() -> None:
    pulse, his = reed(BALLS), hertz(BALLS)
    assert pulse.peak_force_n == pytest.approx(his.peak_force_n, rel=3e-4)
    shape, his_shape = (
        law_pulse.force_n(201) / law_pulse.peak_force_n[:, None] for law_pulse in (pulse, his)
    )
    assert shape == pytest.approx(his_shape, abs=0.03)
    assert pulse.impulse_n_s / (2 * BALL_MOMENTUM) == pytest.approx(1.023, abs=1e-3)
    assert impulse(pulse.contact_time_s, pulse.force_n(2001)) == pytest.approx(
        pulse.impulse_n_s, rel=1e-6
    )
    pulse = hunter(BALLS)
    assert pulse.impulse_n_s == pytest.approx(2 * BALL_MOMENTUM)
    assert impulse(pulse.contact_time_s, pulse.force_n(2001)) == pytest.approx(
        pulse.impulse_n_s, rel=1e-6
    )
    sixths = pulse.force_at(np.array([1 / 6, 1 / 2, 5 / 6])) / pulse.peak_force_n[:, None]
    assert sixths == pytest.approx(np.tile([0.5, 1.0, 0.5], (3, 1)))
