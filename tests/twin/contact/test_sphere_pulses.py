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
def test_contact_time_is_hertz_for_the_sphere_and_compression_ends_at_the_peak(law) -> None:
    """The 4.53 of eq. 1.23 is 4.534, cut to three digits. Compression lasts as long as the restitution that follows it:
    nothing is lost. The impactor's own mass does not enter."""
    pulse = law(BALLS)
    assert pulse.contact_time_s == pytest.approx(hertz(BALLS).contact_time_s, rel=1.2e-3)
    phase = np.linspace(0, 1, 2001)
    peaks = phase[pulse.force_at(phase).argmax(axis=1)]
    assert pulse.compression_time_s / pulse.contact_time_s == pytest.approx(peaks, abs=1e-3)
    light, none = (law(impacts(impactor_mass_kg=mass)) for mass in (0.01, None))
    assert light.force_n() == pytest.approx(none.force_n())


def test_reeds_pulse_is_nearly_hertz_and_gives_more_than_a_sphere_has() -> None:
    pulse, his = reed(BALLS), hertz(BALLS)
    assert pulse.peak_force_n == pytest.approx(his.peak_force_n, rel=3e-4)
    shape, his_shape = (one.force_n(201) / one.peak_force_n[:, None] for one in (pulse, his))
    assert shape == pytest.approx(his_shape, abs=0.03)
    assert pulse.impulse_n_s / (2 * MOMENTUM) == pytest.approx(1.023, abs=1e-3)
    assert impulse(pulse.contact_time_s, pulse.force_n(2001)) == pytest.approx(pulse.impulse_n_s, rel=1e-6)


def test_hunters_pulse_is_half_a_sine_of_the_spheres_momentum() -> None:
    pulse = hunter(BALLS)
    assert pulse.impulse_n_s == pytest.approx(2 * MOMENTUM)
    assert impulse(pulse.contact_time_s, pulse.force_n(2001)) == pytest.approx(pulse.impulse_n_s, rel=1e-6)
    sixths = pulse.force_at(np.array([1 / 6, 1 / 2, 5 / 6])) / pulse.peak_force_n[:, None]
    assert sixths == pytest.approx(np.tile([0.5, 1.0, 0.5], (3, 1)))
