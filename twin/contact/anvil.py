"""Impacts on an anvil: a mass on the spring of its joint, between the tip and the plate.

The force on the plate is the joint's. A tip that is stiffer than the joint leaves the anvil moving before the plate has
felt much of it, and may strike it again.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from ...array_types import Floats
from ..contact_interface import ForcePulses
from .dimensionless import Numbers, scales
from .impacts import Impacts
from .integrate_contact import own_time

#: Share of critical damping of an anvil on its joint: bolted joints have a few hundredths.
_JOINT_DAMPING = 0.05
#: Most periods of the joint in a contact's own time: stiffer ones follow the contact, and would take very many steps.
_PERIODS = 40.0


def anvil_pulses(
    impacts: Impacts,
    anvil_mass_kg: Floats,
    joint_stiffness_n_m: Floats,
    plate_mobility_m_n_s: Floats,
    phases: int,
    *,
    at_tip: bool = False,
) -> ForcePulses:
    """Forces on the plate (n, phases) at equal phases of the pulse about the highest peak, which ends at 0.5 % of it.

    `at_tip`: forces between tip and anvil, as the load cell of a hammer feels them. `plate_mobility_m_n_s` (n,) is that
    of the plate below the joint; `impacts` have what the contact itself loses. A joint whose period is shorter than a
    fortieth of the contact is taken to have that period.
    """
    from .anvil_kernel import struck_anvils

    numbers = Numbers.of(impacts)
    length, force = scales(impacts)
    velocity = impacts.bodies.impact_velocity_m_s
    contact = own_time(numbers) * length / velocity
    lighter = np.minimum(anvil_mass_kg, impacts.mass_kg)
    joint_stiffness_n_m = np.minimum(joint_stiffness_n_m, lighter * (2 * np.pi * _PERIODS / contact) ** 2)
    damping = 2 * _JOINT_DAMPING * np.sqrt(joint_stiffness_n_m * anvil_mass_kg)
    figures = [
        *(getattr(numbers, item.name) for item in fields(numbers)),
        own_time(numbers),
        anvil_mass_kg / impacts.mass_kg,
        joint_stiffness_n_m * length / force,
        damping * velocity / force,
        plate_mobility_m_n_s * force / velocity,
    ]
    solved, course = struck_anvils(np.stack(figures, axis=1), at_tip, phases)
    time = solved[:, 0] * length / velocity
    turn = np.clip(solved[:, 1], 0.01 * solved[:, 0], 0.999 * solved[:, 0]) * length / velocity
    return ForcePulses(time, course * force[:, None], turn)
