"""The asymmetric von Hann pulse."""

from __future__ import annotations

import numpy as np
import pytest
from pyroshock.twin.contact.bodies import MissingQuantityError
from pyroshock.twin.contact.hertz import hertz
from pyroshock.twin.contact.laws import von_hann
from pyroshock.twin.contact.restitution_laws import constant, zener
from support.records.contact_bodies import impacts, impulse

BODIES = impacts(impact_velocity_m_s=[0.4, 1.2, 8.0], impactor_mass_kg=[0.1, 0.32, 1.0])
MOMENTUM = np.array([0.1 * 0.4, 0.32 * 1.2, 8.0])


@pytest.mark.parametrize("restitution", [0.05, 2 / 3, 1.0])
def test_impulse_is_momentum_given_and_returned(restitution: float) -> None:
    pulse = von_hann(BODIES, constant(restitution))
    assert pulse.impulse_n_s == pytest.approx((1 + restitution) * MOMENTUM)
    assert impulse(pulse.contact_time_s, pulse.force_n(5001)) == pytest.approx(pulse.impulse_n_s, rel=1e-6)


def test_compression_takes_the_momentum_in_half_of_hertz_time() -> None:
    """Eq. 1.27: twice the momentum over the time. Zener's is the restitution unless told."""
    pulse = von_hann(BODIES, constant(2 / 3))
    assert pulse.compression_time_s == pytest.approx(hertz(BODIES).contact_time_s / 2, rel=1e-9)
    to_the_peak = pulse.force_at(np.linspace(0, 0.6, 3001))
    assert impulse(pulse.compression_time_s, to_the_peak) == pytest.approx(MOMENTUM, rel=1e-6)
    usual = von_hann(BODIES)
    assert usual.peak_force_n == pytest.approx(2 * MOMENTUM / usual.compression_time_s)
    assert usual.restitution.value == pytest.approx(zener(BODIES).value)


def test_shape_of_figure_1_7_and_without_loss_the_raised_cosine() -> None:
    """e = 2/3: peak at 3/5 of the contact, half of it at 3/10 and 4/5; the halves meet without a step."""
    pulse = von_hann(BODIES, constant(2 / 3))
    share = pulse.force_at(np.array([0.3, 0.6 - 1e-9, 0.6, 0.6 + 1e-9, 0.8])) / pulse.peak_force_n[:, None]
    assert share == pytest.approx(np.tile([0.5, 1, 1, 1, 0.5], (3, 1)), abs=1e-9)
    pulse = von_hann(BODIES, constant(1.0))
    expected = np.hanning(21) * pulse.peak_force_n[:, None]
    assert pulse.force_n(21) == pytest.approx(expected, abs=1e-9 * float(pulse.peak_force_n.max()))


@pytest.mark.parametrize("quantity", ["impactor_mass_kg", "plate_thickness_m"])
def test_what_it_needs_is_asked_for(quantity: str) -> None:
    with pytest.raises(MissingQuantityError, match=f"needs {quantity}"):
        von_hann(impacts(**{quantity: None}))
