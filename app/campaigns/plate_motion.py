"""The motion of a struck plate's surface, for an ingest that adds it to integrated velocities."""

from __future__ import annotations

import numpy as np

from ...array_types import Floats
from ...ingest.impact_speed import ImpactSpeed, StruckPlate
from ...twin.contact.impacts import plate_impedance
from ...twin.contact.target_motion import with_plate_motion


def add_plate_motion(speed: ImpactSpeed, force_n: Floats, plate: StruckPlate) -> ImpactSpeed:
    """A speed with its plate's motion, from the mobility of a plate without edges; its uncertainty grows by it."""
    figures = (plate.youngs_modulus_pa, plate.poisson_ratio, plate.density_kg_m3, plate.thickness_m)
    impedance = float(plate_impedance(*(np.array([value]) for value in figures))[0])
    velocity, uncertainty = with_plate_motion(speed.velocity_m_s, speed.velocity_u_m_s, force_n, impedance, plate.anvil)
    return ImpactSpeed(velocity, uncertainty, "integrated with target motion")
