"""Hunt and Crossley's impact and the asymmetric von Hann pulse: they lose what they were told
to."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.twin.contact.bodies import MissingQuantityError
from pyroshock.twin.contact.hertz import hertz, low_loss_damping, matched_damping, restitution_of
from pyroshock.twin.contact.laws import hunt_crossley, von_hann
from pyroshock.twin.contact.restitution_laws import constant, zener
from scipy.integrate import cumulative_trapezoid, solve_ivp
from support.records.contact_bodies import impacts, impulse

MASS, VELOCITY = 0.32, 1.2


@pytest.mark.parametrize("restitution", [0.02, 0.1, 2 / 3, 0.95, 0.9999])
def test_motion_in_si_ends_with_the_restitution_and_balances_momentum_and_energy(
    restitution: float,
) -> None:
    """Eq. 1.21 integrated for the law's own contact time: indentation gone, velocity -e u."""
    bodies = impacts()
    stiffness = float(bodies.hertz_stiffness_n_m15[0])
    damping = float(matched_damping(np.array([restitution]))[0]) / VELOCITY
    pulse = hunt_crossley(bodies, constant(restitution))
    time, force = float(pulse.contact_time_s[0]), pulse.force_n(20_001)

    def rate(_, state):
        return [state[1], -stiffness / MASS * max(state[0], 0) ** 1.5 * (1 + damping * state[1])]

    run = solve_ivp(rate, (0, time), [0, VELOCITY], "LSODA", rtol=1e-11, atol=1e-15)
    assert run.y[0, -1] == pytest.approx(0.0, abs=1e-6 * run.y[0].max())
    assert run.y[1, -1] == pytest.approx(-restitution * VELOCITY, rel=1e-6)
    assert impulse(pulse.contact_time_s, force) == pytest.approx(pulse.impulse_n_s, rel=3e-5)
    assert pulse.impulse_n_s == pytest.approx((1 + restitution) * MASS * VELOCITY)
    if restitution < 0.99:  # what is lost has digits
        velocity = VELOCITY - cumulative_trapezoid(force[0], dx=time / 20_000, initial=0) / MASS
        spent = np.trapezoid(force[0] * velocity, dx=time / 20_000)
        assert spent == pytest.approx(MASS * VELOCITY**2 / 2 * (1 - restitution**2), rel=1e-4)
        turn = np.interp(pulse.compression_time_s, np.linspace(0, time, 20_001), velocity)
        assert turn == pytest.approx(0, abs=1e-4)


def test_without_loss_it_is_hertz_and_any_restitution_lies_between_those_solved() -> None:
    ours, his = hunt_crossley(impacts(), constant(1.0)), hertz(impacts())
    assert ours.contact_time_s == pytest.approx(his.contact_time_s, rel=1e-12)
    assert ours.force_n() == pytest.approx(his.force_n(), abs=1e-9 * his.peak_force_n[0])
    pulse = hunt_crossley(impacts(), constant(0.3))
    assert pulse.compression_time_s < 0.5 * pulse.contact_time_s
    assert np.argmax(pulse.force_n(1001)) < 1000 * pulse.compression_time_s / pulse.contact_time_s
    # 1,800 restitutions in one call; the impulse of each force is that of momentum.
    restitutions = np.linspace(0.02, 1, 1800)
    bodies = impacts(impact_velocity_m_s=np.full(1800, VELOCITY))
    pulse = hunt_crossley(bodies, lambda batch: type(constant(1)(batch)).bounded(restitutions))
    impulse_restitution = impulse(pulse.contact_time_s, pulse.force_n(2001)) / (MASS * VELOCITY) - 1
    assert impulse_restitution == pytest.approx(restitutions, abs=5e-4)


def test_damping_gives_its_restitution_or_more_by_eq_1_20() -> None:
    """a (1 + e) = ln((1 + a) / (1 - e a)), Gonthier et al. 2004; where it has no digits left, the
    first term of the series, 1 - e = 2 a / 3, eq. 1.20."""
    e = np.linspace(0.1, 0.99, 30)
    a = matched_damping(e)
    assert a * (1 + e) == pytest.approx(np.log((1 + a) / (1 - e * a)), rel=1e-9)
    e = np.r_[np.geomspace(0.01, 1, 40), 0.9999, 0.99991]
    assert restitution_of(matched_damping(e)) == pytest.approx(e, rel=1e-9)
    assert 1 - restitution_of(np.array([0.0, 3e-6, 6e-5])) == pytest.approx(
        [0.0, 2e-6, 4e-5], abs=4e-9
    )
    e = np.array([1.0, 1 - 1e-6, 1 - 5e-5])
    assert restitution_of(matched_damping(e)) == pytest.approx(e, rel=1e-12)
    e = np.array([0.1, 0.5, 2 / 3, 0.9])
    ends_with = restitution_of(low_loss_damping(e))
    assert np.all(ends_with > e)
    assert ends_with == pytest.approx([0.516, 0.663, 0.748, 0.909], abs=5e-4)
    nearly = 1 - 1e-3
    assert restitution_of(low_loss_damping(np.array([nearly]))) == pytest.approx(nearly, abs=1e-6)
    pulse = hunt_crossley(impacts(), constant(2 / 3), low_loss_damping)
    assert pulse.impulse_n_s == pytest.approx((1 + 0.7484349) * MASS * VELOCITY, rel=1e-6)
    assert impulse(pulse.contact_time_s, pulse.force_n(4001)) == pytest.approx(
        pulse.impulse_n_s, rel=1e-5
    )


BODIES = impacts(impact_velocity_m_s=[0.4, 1.2, 8.0], impactor_mass_kg=[0.1, 0.32, 1.0])
MOMENTUM = np.array([0.1 * 0.4, 0.32 * 1.2, 8.0])


@pytest.mark.parametrize("restitution", [0.05, 2 / 3, 1.0])
def test_impulse_is_momentum_given_and_returned(restitution: float) -> None:
    """The quantities that the law needs are asked for."""
    pulse = von_hann(BODIES, constant(restitution))
    assert pulse.impulse_n_s == pytest.approx((1 + restitution) * MOMENTUM)
    assert impulse(pulse.contact_time_s, pulse.force_n(5001)) == pytest.approx(
        pulse.impulse_n_s, rel=1e-6
    )
    for quantity in ("impactor_mass_kg", "plate_thickness_m"):
        with pytest.raises(MissingQuantityError, match=f"needs {quantity}"):
            von_hann(impacts(**{quantity: None}))


def test_compression_is_half_of_hertz_time_and_the_shape_that_of_figure_1_7() -> None:
    """Eq. 1.27: twice the momentum over the time. Zener's is the restitution unless told."""
    pulse = von_hann(BODIES, constant(2 / 3))
    assert pulse.compression_time_s == pytest.approx(hertz(BODIES).contact_time_s / 2, rel=1e-9)
    to_the_peak = pulse.force_at(np.linspace(0, 0.6, 3001))
    assert impulse(pulse.compression_time_s, to_the_peak) == pytest.approx(MOMENTUM, rel=1e-6)
    usual = von_hann(BODIES)
    assert usual.peak_force_n == pytest.approx(2 * MOMENTUM / usual.compression_time_s)
    assert usual.restitution.value == pytest.approx(zener(BODIES).value)
    # e = 2/3: peak at 3/5 of the contact, half of it at 3/10 and 4/5; the halves meet without a
    # step.
    share = (
        pulse.force_at(np.array([0.3, 0.6 - 1e-9, 0.6, 0.6 + 1e-9, 0.8]))
        / pulse.peak_force_n[:, None]
    )
    assert share == pytest.approx(np.tile([0.5, 1, 1, 1, 0.5], (3, 1)), abs=1e-9)
    pulse = von_hann(BODIES, constant(1.0))
    expected = np.hanning(21) * pulse.peak_force_n[:, None]
    assert pulse.force_n(21) == pytest.approx(expected, abs=1e-9 * float(pulse.peak_force_n.max()))
