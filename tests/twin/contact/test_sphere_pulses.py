"""Hunter's and Reed's pulses of a sphere, held against Hertz' of the same sphere."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.twin.contact.hertz import hertz
from pyroshock.twin.contact.laws import hunter, reed
from support.records.contact_bodies import ball, impacts, impulse

BALLS = ball(impact_velocity_m_s=np.array([0.3, 1.0, 10.0]), impactor_radius_m=np.array([0.0005, 0.015, 0.03]))
MOMENTUM = BALLS.sphere_mass_kg * BALLS.impact_velocity_m_s


@pytest.mark.parametrize("law", [hunter, reed])
def test_contact_time_is_hertz_for_the_sphere(law) -> None:
    """The 4.53 of eq. 1.23 is 4.534, cut to three digits."""
    assert law(BALLS).contact_time_s == pytest.approx(hertz(BALLS).contact_time_s, rel=1.2e-3)


@pytest.mark.parametrize("law", [hunter, reed])
def test_compression_ends_at_the_peak(law) -> None:
    """As long as the restitution that follows it: nothing is lost."""
    pulse = law(BALLS)
    phase = np.linspace(0, 1, 2001)
    peaks = phase[pulse.force_at(phase).argmax(axis=1)]
    assert pulse.compression_time_s / pulse.contact_time_s == pytest.approx(peaks, abs=1e-3)


def test_reeds_peak_is_hertz_for_the_sphere() -> None:
    assert reed(BALLS).peak_force_n == pytest.approx(hertz(BALLS).peak_force_n, rel=3e-4)


def test_reeds_shape_is_nearly_hertz() -> None:
    ours, his = (law(BALLS).force_n(201) / law(BALLS).peak_force_n[:, None] for law in (reed, hertz))
    assert ours == pytest.approx(his, abs=0.03)


def test_reed_gives_more_than_a_sphere_has() -> None:
    pulse = reed(BALLS)
    assert pulse.impulse_n_s / (2 * MOMENTUM) == pytest.approx(1.023, abs=1e-3)
    assert impulse(pulse.contact_time_s, pulse.force_n(2001)) == pytest.approx(pulse.impulse_n_s, rel=1e-6)


def test_hunter_returns_the_spheres_momentum() -> None:
    pulse = hunter(BALLS)
    assert pulse.impulse_n_s == pytest.approx(2 * MOMENTUM)
    assert impulse(pulse.contact_time_s, pulse.force_n(2001)) == pytest.approx(pulse.impulse_n_s, rel=1e-6)


def test_hunters_pulse_is_half_a_sine() -> None:
    pulse = hunter(BALLS)
    sixths = pulse.force_at(np.array([1 / 6, 1 / 2, 5 / 6])) / pulse.peak_force_n[:, None]
    assert sixths == pytest.approx(np.tile([0.5, 1.0, 0.5], (3, 1)))


@pytest.mark.parametrize("law", [hunter, reed])
def test_impactors_own_mass_does_not_enter(law) -> None:
    light, none = (law(impacts(impactor_mass_kg=mass)) for mass in (0.01, None))
    assert light.force_n() == pytest.approx(none.force_n())
