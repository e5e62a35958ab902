"""Suspension or supports that hold: the low modes rise."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ...effects import parameter
from ..modal import ModalPlate, PlateEffect


@dataclass(frozen=True)
class Boundary(PlateEffect):
    """Springs spread over the plate as its mass is: exact for a plate on an elastic foundation,
    whatever its edges.

    A modal table knows no shapes at the supports, so they cannot be put where they are; a plate
    solved from its outline can be given them (`PointSpring`). A mode at f rises by f_s^2 / (2 f):
    the rigid ones by all of f_s, those far above by next to nothing. Shapes and damping ratios
    stay.
    """

    # Ropes and foam hang a plate at 1 to 20 Hz (Ewins, on free supports); four pads of 1e7 N/m hold
    # 10 kg at 300 Hz.
    support_frequency_hz: float = parameter(
        "frequency of the rigid plate on its supports",
        "Hz",
        default=10.0,
        low=0.0,
        high=5000.0,
        off=0.0,
        likely=(0.0, 300.0),
        owner="plate",
    )

    id = "plate.boundary"
    law = "f'^2 = f^2 + support_frequency_hz^2"
    source = (
        "Leissa, Vibration of Plates, NASA SP-160 (1969), ch. 1: foundation k "
        "per area adds k / (rho h) to omega^2"
    )

    def changed(self, plate: ModalPlate) -> ModalPlate:
        return replace(plate, frequency_hz=np.hypot(plate.frequency_hz, self.support_frequency_hz))
