"""10,000 impacts in one call."""

from __future__ import annotations

import time

import numpy as np
from pyroshock.twin.contact.effects.plastic_yield import PlasticYield
from pyroshock.twin.contact.effects.plate_compliance import PlateCompliance
from pyroshock.twin.contact.effects.viscous_loss import ViscousLoss
from pyroshock.twin.contact.impact import impact
from support.records.contact_bodies import impacts


def test_ten_thousand_in_one_call() -> None:
    """Within ten seconds of the processor, many times what it takes; each its own."""
    bodies = impacts(impact_velocity_m_s=np.linspace(0.1, 5, 10_000))
    started = time.process_time()
    pulse = impact(bodies, [ViscousLoss(0.05), PlasticYield(), PlateCompliance(0.3)])
    assert time.process_time() - started < 10
    assert np.all(np.diff(pulse.peak_force_n) > 0)
    assert np.all(np.diff(pulse.restitution.value) < 0)
